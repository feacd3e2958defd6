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

from implicit.kernels.elementary import INNER, OPTIONS, copy
from implicit.polygonizers.guess import FOUND_ROWS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Gradients = Callable[[FloatArray, IntArray], tuple[FloatArray, FloatArray]]

STATE_ROWS = 5
"""Rows of a search: 0-1 the bracket, 2-3 f at its ends, 4 the length of the last step, 0 when settled."""

_CLOSE = 1e-6
"""A step settles a crossing when it is at most this share of the edge: the normal then belongs to the vertex."""

LANES = 64
"""Crossings at a time."""

TILE = 18 * LANES
"""Numbers in a tile, in rows of LANES each: see `_step`."""

_OPEN, _PINNED, _FLAT = np.uint8(1), np.uint8(2), np.uint8(4)
"""Marks of a crossing: it needs more steps; it lies at a lattice point; it has no normal."""

SNAP = 4.0
"""A root within this many tolerances of a lattice point is moved there."""


@njit(**OPTIONS)
def settle(
    found: Any, values: Any, gradients: Any, n: int, tolerance: float, vertices: Any, normals: Any, first: int,
    rows: Any, part: Any, state: Any, waiting: int, pinned: Any, tile: Any, marks: Any,
) -> Any:  # fmt: skip
    """One step for n crossings, written with their unit normals from row `first` of vertices and normals on.

    values (n,) and gradients (3, n) belong to the points found[:3]. A step s of Newton leaves an error of about
    s^2 f'' / 2 f', with f'' from the divided differences through the ends of the edge; it has to be small and is taken
    off. The gradient is that of a point s away, so s has to be small as well. Those that do not settle by that are
    listed in `rows`, and copied to `part` with their step done and the search begun in `state`, behind the `waiting`
    that are there already. Returns how many these are then; how many lie at a lattice point, listed in `pinned` with
    their row; and how many have no normal. To work in: tile (TILE,), marks (LANES,).
    """
    count, flat = 0, 0
    for base in range(0, n, LANES):
        m = LANES if n - base > LANES else n - base
        for row in range(FOUND_ROWS):
            copy(tile[LANES * row : LANES * row + m], found[row, base : base + m])
        copy(tile[LANES * 8 : LANES * 8 + m], values[base : base + m])
        for axis in range(3):
            copy(tile[LANES * (9 + axis) : LANES * (9 + axis) + m], gradients[axis, base : base + m])
        some = _step(tile, tolerance, marks)
        for q in range(m):
            row = first + base + q
            for axis in range(3):
                vertices[row, axis] = tile[LANES * (12 + axis) + q]
                normals[row, axis] = tile[LANES * (15 + axis) + q]
        if some == 0:
            continue
        for q in range(m):
            mark = marks[q]
            if mark & _OPEN:
                rows[waiting] = first + base + q
                _begin(found, values, gradients, base + q, tolerance, part, state, waiting)
                waiting += 1
            elif mark:
                pinned[count] = first + base + q
                count += (mark & _PINNED) != 0
                flat += (mark & _FLAT) != 0
    return waiting, count, flat


@njit(**INNER)
def _step(tile: Any, tolerance: float, marks: Any) -> Any:
    """Where one step leads and the unit normals, for all of a tile; what is to be said of each crossing in `marks`.

    The rows of the tile (18 of LANES each): 0-7 as in `found`, 8 f, 9-11 the gradient, then 12-14 the point and 15-17
    the normal. One array with places known beforehand is what lets the loop vectorise. Returns all marks together.
    """
    some, snap = np.uint8(0), SNAP * tolerance
    for k in range(LANES):
        x0, x1, x2, low = tile[k], tile[LANES + k], tile[2 * LANES + k], tile[3 * LANES + k]
        high, at_low, at_high = tile[4 * LANES + k], tile[5 * LANES + k], tile[6 * LANES + k]
        axis, f = tile[7 * LANES + k], tile[8 * LANES + k]
        a, b, c = tile[9 * LANES + k], tile[10 * LANES + k], tile[11 * LANES + k]
        first, second = axis == 0.0, axis == 1.0
        x = x0 if first else (x1 if second else x2)
        slope = a if first else (b if second else c)
        before, behind, whole = x - low, high - x, high - low
        # f'' / 2 is ((at_high - f) / (high - x) - (f - at_low) / (x - low)) / (high - low), multiplied out.
        bend = (at_high - f) * before - (f - at_low) * behind
        step = f / slope
        shift = step * step * bend / (slope * before * behind * whole)
        slight = abs(shift) <= tolerance  # at an end of the edge it is not even a number
        goal = x - step - (shift if slight else 0.0)
        step = abs(step)
        sure = slight & (low <= goal) & (goal <= high) & (step <= _CLOSE * whole)
        # A sample that is 0 is the root, and the guess is there already.
        zero = ((at_low == 0.0) & (before <= tolerance)) | ((at_high == 0.0) & (behind <= tolerance))
        goal = x if zero else goal
        goal = goal if goal > low else low
        goal = goal if goal < high else high
        near_low, near_high = goal - low <= snap, high - goal <= snap
        goal = low if near_low else (high if near_high else goal)
        length = np.sqrt(a * a + b * b + c * c)
        scale = 1.0 / length if length > 0.0 else 0.0
        tile[12 * LANES + k] = goal if first else x0
        tile[13 * LANES + k] = goal if second else x1
        tile[14 * LANES + k] = x2 if first | second else goal
        tile[15 * LANES + k], tile[16 * LANES + k], tile[17 * LANES + k] = a * scale, b * scale, c * scale
        mark = np.uint8(0) if sure | zero | (step <= tolerance) else _OPEN
        mark |= _PINNED if near_low | near_high else np.uint8(0)
        mark |= np.uint8(0) if length > 0.0 else _FLAT
        marks[k] = mark
        some |= mark
    return some


@njit(**INNER)
def _begin(
    found: Any, values: Any, gradients: Any, k: int, tolerance: float, part: Any, state: Any, place: int
) -> None:
    """Copy crossing k to a place in `part`, with its first step done and its bracket in `state`."""
    for row in range(FOUND_ROWS):
        part[row, place] = found[row, k]
    axis = np.int64(found[7, k])
    x, f = found[axis, k], values[k]
    low, high, at_low, at_high = found[3, k], found[4, k], found[5, k], found[6, k]
    target = x - f / gradients[axis, k]
    if at_low == 0.0 or at_high == 0.0:
        target = low if at_low == 0.0 else high
    if (f < 0.0) == (at_low < 0.0):
        low, at_low = x, f
    else:
        high, at_high = x, f
    if not (low <= target <= high):
        target = 0.5 * (low + high)
    state[0, place], state[1, place], state[2, place], state[3, place] = low, high, at_low, at_high
    step, least = abs(target - x), 2.0 * tolerance
    state[4, place] = least if least > step else step
    part[axis, place] = target


@njit(**OPTIONS)
def advance(found: Any, state: Any, values: Any, gradients: Any, n: int, tolerance: float, still: Any) -> int:
    """One more step for every crossing that is not settled; how many are left, and listed in `still`."""
    left = 0
    for k in range(n):
        last = state[4, k]
        if last == 0.0:
            continue
        axis = np.int64(found[7, k])
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
        still[left] = k
        left += step > 0.0
    return left


@njit(**OPTIONS)
def finish(
    found: Any, gradients: Any, rows: Any, tolerance: float, vertices: Any, normals: Any, pinned: Any
) -> tuple[int, int]:
    """Write points and unit normals to `rows` (n,); how many are listed in `pinned`, and how many have no normal."""
    count, flat = 0, 0
    for k in range(len(rows)):
        axis, row = np.int64(found[7, k]), rows[k]
        low, high, target = found[3, k], found[4, k], found[axis, k]
        at_low, at_high = target - low <= SNAP * tolerance, high - target <= SNAP * tolerance
        if at_low or at_high:
            target = low if at_low else high
            pinned[count] = row
            count += 1
        a, b, c = gradients[0, k], gradients[1, k], gradients[2, k]
        length = np.sqrt(a * a + b * b + c * c)
        scale = 1.0 / length if length > 0.0 else 0.0
        flat += not length > 0.0
        for i in range(3):
            vertices[row, i] = target if i == axis else found[i, k]
            normals[row, i] = gradients[i, k] * scale
    return count, flat


def search(
    found: FloatArray, state: FloatArray, rows: IntArray, gradients_at: Gradients, tolerance: float
) -> FloatArray:
    """Move the crossings of vertices `rows` (n,), whose search has begun, onto the surface; their gradients (3, n).

    `gradients_at` gives values (m,) and gradients (3, m) at points (3, m) of the given rows (m,), which ascend.
    """
    n = len(rows)
    still = np.empty(n + 1, np.int64)
    values, gradients = gradients_at(found[:3, :n], rows)
    while left := advance(found, state, values, gradients, n, tolerance, still):
        places = still[:left]
        values[places], gradients[:, places] = gradients_at(found[:3, places], rows[places])
    return gradients
