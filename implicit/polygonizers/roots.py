"""Where f vanishes along lattice edges: Newton steps that never leave the bracket.

Each crossing lies on an edge whose ends have different signs, so there is a root between them and bisection would find
it. The first step interpolates the inverse function through both ends and the first guess with its derivative; later
steps are Newton's; a step that leaves the bracket or does not shrink by half is replaced by a bisection.
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

SNAP = 4.0
"""A root within this many tolerances of a lattice point is moved there."""


@njit(cache=True, nogil=True, error_model="numpy")
def advance(found: Any, state: Any, values: Any, gradients: Any, tolerance: float, first: bool) -> int:
    """One step for every crossing that is not settled; how many are left.

    values (n,) and gradients (3, n) belong to the points as they come in.
    """
    left = 0
    for k in range(len(values)):
        axis = int(found[7, k])
        x, f, slope = found[axis, k], values[k], gradients[axis, k]
        if first:
            for row in range(4):
                state[row, k] = found[3 + row, k]
            state[4, k] = found[4, k] - found[3, k]
        low, high, at_low, at_high, last = state[0, k], state[1, k], state[2, k], state[3, k], state[4, k]
        if last == 0.0:
            continue
        if first and (at_low == 0.0 or at_high == 0.0):
            found[axis, k] = low if at_low == 0.0 else high
            state[4, k] = 0.0
            continue
        target = x - f / slope
        if first:
            # Newton's divided differences of the inverse function at f, f, at_low, at_high, evaluated at 0.
            to_low = ((x - low) / (f - at_low) - 1.0 / slope) / (at_low - f)
            to_high = ((x - high) / (f - at_high) - 1.0 / slope) / (at_high - f)
            better = target + f * f * (to_low - at_low * (to_high - to_low) / (at_high - at_low))
            if low < better < high:
                target = better
        if (f < 0.0) == (at_low < 0.0):
            low = x
            state[0, k], state[2, k] = x, f
        else:
            high = x
            state[1, k], state[3, k] = x, f
        if not (low <= target <= high) or abs(target - x) > 0.5 * last:
            target = 0.5 * (low + high)
        step = abs(target - x)
        if f == 0.0 or high - low <= tolerance:
            target, step = x, 0.0
        elif step <= tolerance or (not first and step * step <= tolerance * last):
            step = 0.0
        found[axis, k] = target
        state[4, k] = step
        left += step > 0.0
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def finish(
    found: Any, gradients: Any, snap: float, vertices: Any, normals: Any, first: int, n: int, pinned: Any
) -> int:
    """Write n points and unit normals from row `first` on; roots at a lattice point are moved there and listed."""
    count = 0
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
        for row in range(3):
            vertices[first + k, row] = found[row, k]
        normals[first + k, 0] = a * scale
        normals[first + k, 1] = b * scale
        normals[first + k, 2] = c * scale
    return count


def settle(
    found: FloatArray, state: FloatArray, n: int, near: Gradients, anywhere: Gradients, tolerance: float
) -> FloatArray:
    """Move n crossings onto the surface; their gradients (3, n).

    `near` and `anywhere` give values (m,) and gradients (3, m) at points (3, m): `near` for all the crossings in their
    order, twice, which is enough for nearly all; `anywhere` for those that are left.
    """
    values, gradients = near(found[:3, :n])
    advance(found, state, values, gradients, tolerance, True)
    values, gradients = near(found[:3, :n])
    left = advance(found, state, values, gradients, tolerance, False)
    if left:
        rows = np.flatnonzero(state[4, :n])
        part, searching = found[:, rows], state[:, rows]
        while left:
            values, slopes = anywhere(part[:3])
            left = advance(part, searching, values, slopes, tolerance, False)
        found[:, rows] = part
        gradients[:, rows] = slopes
    return gradients
