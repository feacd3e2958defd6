"""Determinants of many small matrices x A + y B + z C + D at once."""

import numpy as np
from numba import njit

from implicit.kernels.elementary import MAKING, OPTIONS, Floats

LANES = 32  # matrices handled together, one per lane of the innermost loops
_SMALL = 1e-4  # a pivot below this share of the largest entry sends its matrix to elimination with row exchanges


@njit(**{**OPTIONS, **MAKING})
def pencil_determinants(planes: Floats, points: Floats, out: Floats) -> None:
    """Store det(x A + y B + z C + D) for points (n, 3); planes (4, r, r) hold A, B, C, D, mixed at random.

    Elimination without row exchanges, all lanes alike; the few matrices where a pivot is small are done again.
    """
    r = planes.shape[1]
    rows = np.empty((r, r * LANES))
    factor, inverse, least, total = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    axes, one = np.ones((3, LANES)), np.empty((r, r))
    for base in range(0, points.shape[0], LANES):
        n = min(LANES, points.shape[0] - base)
        for k in range(n):
            for axis in range(3):
                axes[axis, k] = points[base + k, axis]
        for i in range(r):
            for j in range(r):
                a, b, c, d = planes[0, i, j], planes[1, i, j], planes[2, i, j], planes[3, i, j]
                cell = rows[i, j * LANES : (j + 1) * LANES]
                for k in range(LANES):
                    cell[k] = a * axes[0, k] + b * axes[1, k] + c * axes[2, k] + d
        largest = np.abs(rows).max()
        total[:] = 1.0
        least[:] = np.inf
        for j in range(r):
            pivot = rows[j, j * LANES : (j + 1) * LANES]
            for k in range(LANES):
                total[k] *= pivot[k]
                inverse[k] = 1.0 / pivot[k]
                if j < r - 1:
                    least[k] = min(least[k], abs(pivot[k]))
            for i in range(j + 1, r):
                for k in range(LANES):
                    factor[k] = rows[i, j * LANES + k] * inverse[k]
                for c in range(j + 1, r):
                    above, below = rows[j, c * LANES : (c + 1) * LANES], rows[i, c * LANES : (c + 1) * LANES]
                    for k in range(LANES):
                        below[k] -= factor[k] * above[k]
        for k in range(n):
            if least[k] > _SMALL * largest:
                out[base + k] = total[k]
            else:
                out[base + k] = _with_exchanges(planes, points[base + k], one)


@njit(**OPTIONS)
def _with_exchanges(planes: Floats, point: Floats, rows: Floats) -> float:
    """One determinant by elimination with row exchanges."""
    r, total = planes.shape[1], 1.0
    for i in range(r):
        for j in range(r):
            rows[i, j] = planes[0, i, j] * point[0] + planes[1, i, j] * point[1]
            rows[i, j] += planes[2, i, j] * point[2] + planes[3, i, j]
    for j in range(r):
        best = j
        for i in range(j + 1, r):
            if abs(rows[i, j]) > abs(rows[best, j]):
                best = i
        if best != j:
            total = -total
            for c in range(j, r):
                rows[j, c], rows[best, c] = rows[best, c], rows[j, c]
        total *= rows[j, j]
        if total == 0.0:
            return 0.0
        for i in range(j + 1, r):
            factor = rows[i, j] / rows[j, j]
            for c in range(j + 1, r):
                rows[i, c] -= factor * rows[j, c]
    return total
