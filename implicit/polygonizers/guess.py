"""Where along its edge a crossing lies, from the samples in a row with it: good enough for one step of Newton's."""

from typing import Any

import numpy as np
from numba import njit

from implicit.kernels.elementary import INNER

FOUND_ROWS = 8
"""Rows of a crossing: 0-2 the point, 3-4 the ends of its edge, 5-6 f at the ends, 7 the axis of the edge."""

_LANES = 64
"""Crossings at a time: their window stays in the processor's first cache."""


@njit(cache=True, nogil=True, error_model="numpy")
def guess(
    codes: Any, starts: Any, begin: int, end: int, samples: Any, bricks: Any, axes: Any, cells: Any, found: Any
) -> None:
    """Fill found (8, n) for the edges `codes` (see `extract`) of the bricks `begin` to `end` of samples (m 512,).

    The point is where the polynomial of degree 5 through six samples in a row vanishes. starts: the place in `codes`
    where each brick begins; axes (3, ...) padded planes and cells (3,) of the lattice.
    """
    window, line, first = np.empty((6, _LANES)), np.empty(_LANES), np.empty(_LANES)
    home, own = np.empty(3, np.int64), np.empty(3, np.int64)
    for index in range(begin, end):
        for axis in range(3):
            home[axis] = 7 * bricks[index, axis]
            own[axis] = min(cells[axis] - home[axis], 7)
        for base in range(starts[index], starts[index + 1], _LANES):
            count = min(_LANES, starts[index + 1] - base)
            _look(codes, base, count, samples, index << 9, home, own, axes, found, window, line, first)
            if min(own[0], own[1], own[2]) < 5:
                _extend(codes, base, count, own, window)
            _solve(window, line, first, (count + 7) & ~7)
            for q in range(count):
                k = base + q
                low, high = found[3, k], found[4, k]
                found[(codes[k] >> 9) & 3, k] = low + (high - low) * first[q]


@njit(**INNER)
def _look(
    codes: Any, base: int, count: int, samples: Any, origin: int, home: Any, own: Any, axes: Any, found: Any,
    window: Any, line: Any, first: Any,
) -> None:  # fmt: skip
    """Read the edge of each crossing, six samples in a row, and where the straight line between its ends vanishes.

    `first` is where among the six the edge starts. Where a brick has fewer than six samples along an axis, what is
    read beyond them is without meaning.
    """
    x, y, z = axes[0, home[0] : home[0] + 8], axes[1, home[1] : home[1] + 8], axes[2, home[2] : home[2] + 8]
    brick = samples[origin : origin + 512]
    for q in range(count):
        k = base + q
        code = codes[k]
        axis, place = (code >> 9) & 3, code & 511
        shift = 6 - 3 * axis
        at, step = (place >> shift) & 7, 1 << shift
        found[0, k], found[1, k], found[2, k] = x[place >> 6], y[(place >> 3) & 7], z[place & 7]
        a, b = brick[place], brick[place + step]
        plane = (home[axis] + at) & 0xFFFFFFF
        found[3, k], found[4, k] = axes[axis, plane], axes[axis, plane + 1]
        found[5, k], found[6, k], found[7, k] = a, b, axis
        start = max(min(at - 2, own[axis] - 5), 0)
        place = (place + (start - at) * step) & 511
        for row in range(6):
            window[row, q] = brick[place + row * step]
        first[q] = float(at - start)
        line[q] = first[q] + a / (a - b)


@njit(**INNER)
def _extend(codes: Any, base: int, count: int, own: Any, window: Any) -> None:
    """Where a brick has fewer than six samples along an axis, continue the polynomial through those there are.

    With m + 1 samples its differences of order m + 1 vanish, which gives each sample from the m + 1 before it.
    """
    for q in range(count):
        degree = own[(codes[base + q] >> 9) & 3]
        for row in range(degree + 1, 6):
            total, factor = 0.0, 1.0
            for i in range(1, degree + 2):
                factor *= -(degree + 2 - i) / i
                total -= factor * window[row - i, q]
            window[row, q] = total


@njit(**INNER)
def _solve(window: Any, line: Any, first: Any, count: int) -> None:
    """Replace `first` by the share of the edge at which the polynomial through its six samples vanishes.

    Two of Newton's steps from the straight line, on the form d0 + t (d1 + (t - 1)/2 (d2 + ...)), in a loop that
    vectorises; where they do not end within the edge, the straight line.
    """
    w0, w1, w2, w3, w4, w5 = window[0], window[1], window[2], window[3], window[4], window[5]
    for k in range(count):
        g0, a1, a2, a3, a4, a5 = w0[k], w1[k] - w0[k], w2[k] - w1[k], w3[k] - w2[k], w4[k] - w3[k], w5[k] - w4[k]
        b2, b3, b4, b5 = a2 - a1, a3 - a2, a4 - a3, a5 - a4
        c3, c4, c5 = b3 - b2, b4 - b3, b5 - b4
        d4 = c4 - c3
        e5 = ((c5 - c4) - d4) * 0.2
        t = line[k]
        u4, u3, u2, u1 = t - 4.0, (t - 3.0) * 0.25, (t - 2.0) * (1.0 / 3.0), (t - 1.0) * 0.5
        p4 = d4 + u4 * e5
        p3, s3 = c3 + u3 * p4, 0.25 * p4 + u3 * e5
        p2, s2 = b2 + u2 * p3, (1.0 / 3.0) * p3 + u2 * s3
        p1, s1 = a1 + u1 * p2, 0.5 * p2 + u1 * s2
        t = t - (g0 + t * p1) / (p1 + t * s1)
        u4, u3, u2, u1 = t - 4.0, (t - 3.0) * 0.25, (t - 2.0) * (1.0 / 3.0), (t - 1.0) * 0.5
        p4 = d4 + u4 * e5
        p3, s3 = c3 + u3 * p4, 0.25 * p4 + u3 * e5
        p2, s2 = b2 + u2 * p3, (1.0 / 3.0) * p3 + u2 * s3
        p1, s1 = a1 + u1 * p2, 0.5 * p2 + u1 * s2
        share = t - (g0 + t * p1) / (p1 + t * s1) - first[k]
        first[k] = share if 0.0 < share < 1.0 else line[k] - first[k]
