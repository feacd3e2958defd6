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

from implicit.kernels.elementary import INNER
from implicit.polygonizers.guess import FOUND_ROWS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Gradients = Callable[[FloatArray, IntArray], tuple[FloatArray, FloatArray]]

STATE_ROWS = 5
"""Rows of a search: 0-1 the bracket, 2-3 f at its ends, 4 the length of the last step, 0 when settled."""

_CLOSE = 1e-4
"""A step settles a crossing when it is at most this share of the edge: the normal then belongs to the vertex."""

_BEND = 100.0
"""A step settles a crossing when the bend of f moves its end by so many tolerances at most; that is corrected."""

_LANES = 64
"""Crossings at a time."""

SNAP = 4.0
"""A root within this many tolerances of a lattice point is moved there."""


@njit(cache=True, nogil=True, error_model="numpy")
def settle(
    found: Any, values: Any, gradients: Any, n: int, tolerance: float, vertices: Any, normals: Any, first: int,
    rows: Any, part: Any, state: Any, waiting: int, pinned: Any,
) -> Any:  # fmt: skip
    """One step for n crossings, written with their unit normals from row `first` of vertices and normals on.

    values (n,) and gradients (3, n) belong to the points found[:3]. A step s of Newton leaves an error of about
    s^2 f'' / 2 f', with f'' from the divided differences through the ends of the edge; it has to be small and is taken
    off. The gradient is that of a point s away, so s has to be small as well. Those that do not settle by that are listed in `rows`, and copied to
    `part` with their step done and the search begun in `state`, behind the `waiting` that are there already. Returns
    how many these are then; how many lie at a lattice point, listed in `pinned` with their row; and how many have no
    normal.
    """
    target, length, good = np.empty(_LANES), np.empty(_LANES), np.empty(_LANES, np.bool_)
    count, flat = 0, 0
    snap = SNAP * tolerance
    for base in range(0, n, _LANES):
        m = min(_LANES, n - base)
        _try(found, values, gradients, base, m, tolerance, target, length, good)
        for q in range(m):
            k = base + q
            if not good[q]:
                rows[waiting] = first + k
                _begin(found, values, gradients, k, tolerance, part, state, waiting)
                waiting += 1
                continue
            count, flat = _write(
                found, gradients, k, target[q], length[q], snap, vertices, normals, first + k, pinned, count, flat
            )
    return waiting, count, flat


@njit(**INNER)
def _try(
    found: Any, values: Any, gradients: Any, base: int, n: int, tolerance: float, target: Any, length: Any, good: Any
) -> None:
    """Where one step leads, the length of the gradient, and whether the step settles; in a loop that vectorises."""
    part = slice(base, base + n)
    x0, x1, x2, lows, highs = found[0, part], found[1, part], found[2, part], found[3, part], found[4, part]
    at_lows, at_highs, axes, fs = found[5, part], found[6, part], found[7, part], values[part]
    a, b, c = gradients[0, part], gradients[1, part], gradients[2, part]
    for k in range(n):
        first, second = axes[k] == 0.0, axes[k] == 1.0
        x = x0[k] if first else (x1[k] if second else x2[k])
        slope = a[k] if first else (b[k] if second else c[k])
        f, low, high, at_low, at_high = fs[k], lows[k], highs[k], at_lows[k], at_highs[k]
        before, behind, whole = x - low, high - x, high - low
        step = f / slope
        # f'' / 2 is ((at_high - f) / (high - x) - (f - at_low) / (x - low)) / (high - low), multiplied out.
        bend = (at_high - f) * before - (f - at_low) * behind
        shift = step * step * bend / (slope * before * behind * whole)
        goal = x - step - shift
        step = abs(step)
        sure = (low <= goal) & (goal <= high) & (step <= _CLOSE * whole) & (abs(shift) <= _BEND * tolerance)
        # A sample that is 0 is the root, and the guess is there already.
        zero = ((at_low == 0.0) & (before <= tolerance)) | ((at_high == 0.0) & (behind <= tolerance))
        goal = goal if goal > low else low
        goal = goal if goal < high else high
        good[k] = sure | zero | (step <= tolerance)
        target[k] = x if zero else goal
        length[k] = np.sqrt(a[k] * a[k] + b[k] * b[k] + c[k] * c[k])


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _write(
    found: Any, gradients: Any, k: int, target: float, length: float, snap: float, vertices: Any, normals: Any,
    row: int, pinned: Any, count: int, flat: int,
) -> tuple[int, int]:  # fmt: skip
    """Write a point and its unit normal; one near an end of its edge is moved there and listed."""
    low, high, axis = found[3, k], found[4, k], found[7, k]
    at_low, at_high = target - low <= snap, high - target <= snap
    target = low if at_low else (high if at_high else target)
    pinned[count] = row  # always, but counted only where true: a conditional store would cost a third of the time
    count += at_low | at_high
    vertices[row, 0] = target if axis == 0.0 else found[0, k]
    vertices[row, 1] = target if axis == 1.0 else found[1, k]
    vertices[row, 2] = target if axis == 2.0 else found[2, k]
    scale = 1.0 / length if length > 0.0 else 0.0
    normals[row, 0] = gradients[0, k] * scale
    normals[row, 1] = gradients[1, k] * scale
    normals[row, 2] = gradients[2, k] * scale
    return count, flat + (not length > 0.0)


@njit(**INNER)
def _begin(
    found: Any, values: Any, gradients: Any, k: int, tolerance: float, part: Any, state: Any, place: int
) -> None:
    """Copy crossing k to a place in `part`, with its first step done and its bracket in `state`."""
    for row in range(FOUND_ROWS):
        part[row, place] = found[row, k]
    axis = int(found[7, k])
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
    state[4, place] = max(abs(target - x), 2.0 * tolerance)
    part[axis, place] = target


@njit(cache=True, nogil=True, error_model="numpy")
def advance(found: Any, state: Any, values: Any, gradients: Any, n: int, tolerance: float, still: Any) -> int:
    """One more step for every crossing that is not settled; how many are left, and listed in `still`."""
    left = 0
    for k in range(n):
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
        still[left] = k
        left += step > 0.0
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def finish(
    found: Any, gradients: Any, rows: Any, tolerance: float, vertices: Any, normals: Any, pinned: Any
) -> tuple[int, int]:
    """Write points and unit normals to `rows` (n,); how many are listed in `pinned`, and how many have no normal."""
    count, flat = 0, 0
    for k in range(len(rows)):
        target = found[int(found[7, k]), k]
        a, b, c = gradients[0, k], gradients[1, k], gradients[2, k]
        length = np.sqrt(a * a + b * b + c * c)
        count, flat = _write(
            found, gradients, k, target, length, SNAP * tolerance, vertices, normals, rows[k], pinned, count, flat
        )  # fmt: skip
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
