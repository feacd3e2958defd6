"""Where f vanishes along lattice edges: Newton steps that never leave the bracket.

Each crossing lies on an edge whose ends have different signs, so there is a root between them and bisection would find
it. The first guess interpolates the samples; then come Newton's steps along the edge, and a step that leaves the
bracket or does not shrink by half is replaced by a bisection. On a resolved surface one evaluation is enough.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Gradients = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

FOUND_ROWS = 8
"""Rows of a crossing: 0-2 the point, 3-4 the ends of its edge, 5-6 f at the ends, 7 the axis of the edge."""

STATE_ROWS = 5
"""Rows of a search: 0-1 the bracket, 2-3 f at its ends, 4 the length of the last step, 0 when settled."""

_CLOSE = 1e-6
"""A step settles a crossing when it is at most this share of the edge: the normal then belongs to the vertex."""

_MANY = 0.1
"""The share of crossings from which on all are evaluated again, rather than those that are left."""

SNAP = 4.0
"""A root within this many tolerances of a lattice point is moved there."""


@njit(cache=True, nogil=True, error_model="numpy")
def begin(found: Any, state: Any, values: Any, gradients: Any, tolerance: float) -> int:
    """The first step for every crossing; how many are not settled yet.

    values (n,) and gradients (3, n) belong to the points as they come in. A step s of Newton leaves an error of about
    s^2 |f'' / 2 f'|, with f'' from the divided differences through the ends of the edge; the gradient is that of a
    point s away, so s has to be tiny as well.
    """
    left = 0
    for k in range(len(values)):
        axis = int(found[7, k])
        x, f, slope = found[axis, k], values[k], gradients[axis, k]
        low, high, at_low, at_high = found[3, k], found[4, k], found[5, k], found[6, k]
        target = x - f / slope
        step = abs(target - x)
        bend = ((at_high - f) / (high - x) - (f - at_low) / (x - low)) / (high - low)
        if (
            low <= target <= high
            and step <= _CLOSE * (high - low)
            and step * step * abs(bend) <= tolerance * abs(slope)
        ):
            found[axis, k] = target
            state[4, k] = 0.0
            continue
        if at_low == 0.0 or at_high == 0.0:
            target = low if at_low == 0.0 else high
        if (f < 0.0) == (at_low < 0.0):
            low, at_low = x, f
        else:
            high, at_high = x, f
        if not (low <= target <= high):
            target = 0.5 * (low + high)
        state[0, k], state[1, k], state[2, k], state[3, k] = low, high, at_low, at_high
        state[4, k] = max(abs(target - x), 2.0 * tolerance)
        found[axis, k] = target
        left += 1
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def advance(found: Any, state: Any, values: Any, gradients: Any, tolerance: float) -> int:
    """One more step for every crossing that is not settled; how many are left."""
    left = 0
    for k in range(len(values)):
        last = state[4, k]
        if last == 0.0:
            continue
        axis = int(found[7, k])
        x, f, slope = found[axis, k], values[k], gradients[axis, k]
        if found[5, k] == 0.0 or found[6, k] == 0.0:
            state[4, k] = 0.0
            continue
        target = x - f / slope
        if (f < 0.0) == (state[2, k] < 0.0):
            state[0, k], state[2, k] = x, f
        else:
            state[1, k], state[3, k] = x, f
        low, high = state[0, k], state[1, k]
        if not (low <= target <= high) or abs(target - x) > 0.5 * last:
            target = 0.5 * (low + high)
        step = abs(target - x)
        if f == 0.0 or high - low <= tolerance:
            target, step = x, 0.0
        elif step <= tolerance or (step <= _CLOSE * (found[4, k] - found[3, k]) and step * step <= tolerance * last):
            step = 0.0
        found[axis, k] = target
        state[4, k] = step
        left += step > 0.0
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def finish(
    found: Any, gradients: Any, snap: float, vertices: Any, normals: Any, first: int, n: int, pinned: Any
) -> tuple[int, int]:
    """Write n points and unit normals from row `first` on; roots at a lattice point are moved there and listed.

    Returns how many are listed, and how many have no normal because the gradient vanishes.
    """
    count, flat = 0, 0
    for k in range(n):
        axis = int(found[7, k])
        for end in range(2):
            if abs(found[axis, k] - found[3 + end, k]) <= snap:
                found[axis, k] = found[3 + end, k]
                pinned[count] = first + k
                count += 1
        a, b, c = gradients[0, k], gradients[1, k], gradients[2, k]
        length = np.sqrt(a * a + b * b + c * c)
        scale = 1.0 / length if length > 0.0 else 0.0
        flat += not length > 0.0
        for row in range(3):
            vertices[first + k, row] = found[row, k]
        normals[first + k, 0] = a * scale
        normals[first + k, 1] = b * scale
        normals[first + k, 2] = c * scale
    return count, flat


def settle(
    found: FloatArray, state: FloatArray, n: int, near: Gradients, anywhere: Gradients, tolerance: float
) -> FloatArray:
    """Move n crossings onto the surface; their gradients (3, n).

    `near` and `anywhere` give values (m,) and gradients (3, m) at points (3, m): `near` for all the crossings in their
    order, while many are left, `anywhere` for the others.
    """
    values, gradients = near(found[:3, :n])
    left = begin(found, state, values, gradients, tolerance)
    if left > _MANY * n:
        values, gradients = near(found[:3, :n])
        left = advance(found, state, values, gradients, tolerance)
    if left:
        rows = np.flatnonzero(state[4, :n])
        part, searching = found.take(rows, axis=1), state.take(rows, axis=1)
        values, slopes = anywhere(part[:3])
        while advance(part, searching, values, slopes, tolerance):
            still = np.flatnonzero(searching[4])
            values[still], slopes[:, still] = anywhere(part[:3, still])
        found[:, rows], gradients[:, rows] = part, slopes
    return gradients
