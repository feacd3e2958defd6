"""Where along its edge a crossing lies, from the samples in a row with it: good enough for one step of Newton's."""

from typing import Any

import numpy as np
from numba import njit

FOUND_ROWS = 8
"""Rows of a crossing: 0-2 the point, 3-4 the ends of its edge, 5-6 f at the ends, 7 the axis of the edge."""

_LANES = 64
"""Crossings at a time: their window stays in the processor's first cache."""


@njit(cache=True, nogil=True, error_model="numpy")
def guess(codes: Any, n: int, samples: Any, bricks: Any, axes: Any, cells: Any, found: Any) -> None:
    """Fill found (8, >= n) for the edges `codes` (see `extract`) of bricks (m, 3) with samples (m 512,).

    The point is where the polynomial of degree 5 through six samples in a row vanishes. axes (3, ...) padded planes,
    cells (3,) of the lattice.
    """
    window, line, first = np.empty((6, _LANES)), np.empty(_LANES), np.empty(_LANES)
    limits = np.empty(3, np.int64)  # a tuple indexed by a variable would cost a branch
    for axis in range(3):
        limits[axis] = cells[axis]
    for base in range(0, n, _LANES):
        count = min(_LANES, n - base)
        if _look(codes, base, count, samples, bricks, axes, limits, found, window, line, first):
            _straighten(codes, base, count, bricks, limits, found, window, line, first)
        _solve(window, line, first)
        for q in range(count):
            k = base + q
            share = first[q]
            low, high = found[3, k], found[4, k]
            found[(codes[k] >> 9) & 3, k] = low + (high - low) * share


@njit(cache=True, nogil=True, error_model="numpy")
def _look(
    codes: Any, base: int, count: int, samples: Any, bricks: Any, axes: Any, limits: Any, found: Any, window: Any,
    line: Any, first: Any,
) -> bool:  # fmt: skip
    """Read the edge of each crossing, six samples in a row, and where the straight line between its ends vanishes.

    `first` is where among the six the edge starts. Whether a brick has fewer than six samples along an axis of these.
    """
    short = False
    for q in range(count):
        k = base + q
        code = codes[k]
        index, axis, place = (code >> 11) & 0xFFFFF, (code >> 9) & 3, code & 511
        shift = 6 - 3 * axis
        at, step, here = (place >> shift) & 7, 1 << shift, (index << 9) + place
        for row in range(3):
            found[row, k] = axes[row, (7 * bricks[index, row] + ((place >> (6 - 3 * row)) & 7)) & 0xFFFFFFF]
        plane = (7 * bricks[index, axis] + at) & 0xFFFFFFF
        a, b = samples[here], samples[here + step]
        found[3, k], found[4, k] = axes[axis, plane], axes[axis, plane + 1]
        found[5, k], found[6, k], found[7, k] = a, b, axis
        own = limits[axis] - plane + at
        short |= own < 5
        start = max(min(at - 2, min(own, 7) - 5), 0)
        place = (here + (start - at) * step) & 0xFFFFFFFF
        for row in range(6):
            window[row, q] = samples[place + row * step]
        first[q] = float(at - start)
        line[q] = first[q] + a / (a - b)
    return short


@njit(cache=True, nogil=True, error_model="numpy")
def _straighten(
    codes: Any, base: int, count: int, bricks: Any, limits: Any, found: Any, window: Any, line: Any, first: Any
) -> None:
    """Where a brick has fewer than six samples along an axis, put six values on the straight line instead."""
    for q in range(count):
        k = base + q
        index, axis = (codes[k] >> 11) & 0xFFFFF, (codes[k] >> 9) & 3
        if limits[axis] - 7 * bricks[index, axis] < 5:
            a, b = found[5, k], found[6, k]
            for row in range(6):
                window[row, q] = a + row * (b - a)
            line[q], first[q] = a / (a - b), 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(window: Any, line: Any, first: Any) -> None:
    """Replace `first` by the share of the edge at which the polynomial through its six samples vanishes.

    Two of Newton's steps from the straight line, on the form d0 + t (d1 + (t - 1)/2 (d2 + ...)), in a loop that
    vectorises; where they do not end within the edge, the straight line.
    """
    w0, w1, w2, w3, w4, w5 = window[0], window[1], window[2], window[3], window[4], window[5]
    for k in range(_LANES):
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
