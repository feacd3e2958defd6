"""Where along its edge a crossing lies, from the samples in a row with it: good enough for one step of Newton's."""

from typing import Any

from numba import njit

from implicit.kernels.elementary import INNER, OPTIONS, copy

FOUND_ROWS = 8
"""Rows of a crossing: 0-2 the point, 3-4 the ends of its edge, 5-6 f at the ends, 7 the axis of the edge."""

_LANES = 64
"""Crossings at a time: their tile stays in the processor's first cache."""

TILE = 16 * _LANES
"""Numbers in a tile, in rows of _LANES each: 0-7 the samples in a row with a crossing, then those of `found`, or what
they are made from: 8-10 the lower end of the edge, 11 the place of the edge in the row, 12 the upper end, 13-15 as in
`found`.
"""


@njit(**OPTIONS)
def guess(
    codes: Any, starts: Any, begin: int, end: int, samples: Any, bricks: Any, axes: Any, cells: Any, found: Any,
    tile: Any, counts: Any,
) -> None:  # fmt: skip
    """Fill found (8, n) for the edges `codes` (see `extract`) of the bricks `begin` to `end` of samples (m 512,).

    The point is where the polynomial of degree 7 through the eight samples in a row vanishes. starts: the place in
    `codes` where each brick begins; axes (3, ...) padded planes and cells (3,) of the lattice. To work in:
    tile (>= TILE,), counts (2, 3).
    """
    home, own = counts[0], counts[1]
    for index in range(begin, end):
        for axis in range(3):
            home[axis] = 7 * bricks[index, axis]
            left = cells[axis] - home[axis]
            own[axis] = left if left < 7 else 7
        brick = samples[512 * index : 512 * index + 512]
        for base in range(starts[index], starts[index + 1], _LANES):
            last = base + _LANES if base + _LANES < starts[index + 1] else starts[index + 1]
            part = codes[base:last]
            _look(part, brick, home, axes, tile)
            if own[0] < 7 or own[1] < 7 or own[2] < 7:
                _extend(part, own, tile)
            _solve(tile, (len(part) + 7) & ~7)
            for row in range(FOUND_ROWS):
                copy(found[row, base : base + len(part)], tile[_LANES * (8 + row) : _LANES * (9 + row)])


@njit(**INNER)
def _look(codes: Any, brick: Any, home: Any, axes: Any, tile: Any) -> None:
    """Read the eight samples in a row with each crossing, and its edge.

    Where a brick has fewer than eight samples along an axis, what is read beyond them is without meaning.
    """
    x, y, z = axes[0, home[0] : home[0] + 8], axes[1, home[1] : home[1] + 8], axes[2, home[2] : home[2] + 8]
    for q in range(len(codes)):
        code = codes[q]
        axis, place = (code >> 9) & 3, code & 511
        shift = 6 - 3 * axis
        at, step = (place >> shift) & 7, 1 << shift
        first = place - (at << shift)
        for i in range(8):
            tile[_LANES * i + q] = brick[first + i * step]
        tile[8 * _LANES + q], tile[9 * _LANES + q] = x[place >> 6], y[(place >> 3) & 7]
        tile[10 * _LANES + q], tile[11 * _LANES + q] = z[place & 7], float(at)
        tile[12 * _LANES + q] = axes[axis, (home[axis] + at + 1) & 0xFFFFFFF]
        tile[13 * _LANES + q], tile[14 * _LANES + q] = brick[place], brick[place + step]
        tile[15 * _LANES + q] = axis


@njit(**INNER)
def _extend(codes: Any, own: Any, tile: Any) -> None:
    """Where a brick has fewer than eight samples along an axis, continue the polynomial through those there are.

    With m + 1 samples its differences of order m + 1 vanish, which gives each sample from the m + 1 before it.
    """
    for q in range(len(codes)):
        degree = own[(codes[q] >> 9) & 3]
        for row in range(degree + 1, 8):
            total, factor = 0.0, 1.0
            for i in range(1, degree + 2):
                factor *= -(degree + 2 - i) / i
                total -= factor * tile[_LANES * (row - i) + q]
            tile[_LANES * row + q] = total


@njit(**INNER)
def _solve(tile: Any, count: int) -> None:
    """Set rows 8-15 of the tile to those of `found`: the edge, and the point where the polynomial vanishes.

    Two of Newton's steps from the straight line, on the form d0 + t (d1 + (t - 1)/2 (d2 + ...)), in a loop that
    vectorises since its places are known; where they do not end within the edge, the straight line.
    """
    for k in range(count):
        d0, w1, w2, w3 = tile[k], tile[_LANES + k], tile[2 * _LANES + k], tile[3 * _LANES + k]
        w4, w5, w6, w7 = tile[4 * _LANES + k], tile[5 * _LANES + k], tile[6 * _LANES + k], tile[7 * _LANES + k]
        x, y, z, first = tile[8 * _LANES + k], tile[9 * _LANES + k], tile[10 * _LANES + k], tile[11 * _LANES + k]
        high, a, b, axis = tile[12 * _LANES + k], tile[13 * _LANES + k], tile[14 * _LANES + k], tile[15 * _LANES + k]
        d1, w2, w3, w4, w5, w6, w7 = w1 - d0, w2 - w1, w3 - w2, w4 - w3, w5 - w4, w6 - w5, w7 - w6
        d2, w3, w4, w5, w6, w7 = w2 - d1, w3 - w2, w4 - w3, w5 - w4, w6 - w5, w7 - w6
        d3, w4, w5, w6, w7 = w3 - d2, w4 - w3, w5 - w4, w6 - w5, w7 - w6
        d4, w5, w6, w7 = w4 - d3, w5 - w4, w6 - w5, w7 - w6
        d5, w6, w7 = w5 - d4, w6 - w5, w7 - w6
        d6, w7 = w6 - d5, w7 - w6
        d7 = w7 - d6
        line = a / (a - b)
        t = first + line
        for _ in range(2):
            p, s = d7, 0.0
            s, p = p * (1.0 / 7.0) + (t - 6.0) * (1.0 / 7.0) * s, d6 + (t - 6.0) * (1.0 / 7.0) * p
            s, p = p * (1.0 / 6.0) + (t - 5.0) * (1.0 / 6.0) * s, d5 + (t - 5.0) * (1.0 / 6.0) * p
            s, p = p * 0.2 + (t - 4.0) * 0.2 * s, d4 + (t - 4.0) * 0.2 * p
            s, p = p * 0.25 + (t - 3.0) * 0.25 * s, d3 + (t - 3.0) * 0.25 * p
            s, p = p * (1.0 / 3.0) + (t - 2.0) * (1.0 / 3.0) * s, d2 + (t - 2.0) * (1.0 / 3.0) * p
            s, p = p * 0.5 + (t - 1.0) * 0.5 * s, d1 + (t - 1.0) * 0.5 * p
            t = t - (d0 + t * p) / (p + t * s)
        share = t - first
        share = share if 0.0 < share < 1.0 else line
        on_x, on_y = axis == 0.0, axis == 1.0
        low = x if on_x else (y if on_y else z)
        target = low + (high - low) * share
        tile[8 * _LANES + k] = target if on_x else x
        tile[9 * _LANES + k] = target if on_y else y
        tile[10 * _LANES + k] = z if on_x | on_y else target
        tile[11 * _LANES + k] = low
