"""Polynomials at scattered points, from coefficients as data.

The terms are sorted by (i, j); a row collects those with the same x^i y^j, a polynomial in z.
"""

import numpy as np
from numba import njit

from implicit.kernels.elementary import OPTIONS, Floats, Longs

LANES = 64  # points handled together


@njit(**OPTIONS)
def evaluate_terms(
    rows: Longs, starts: Longs, powers: Longs, coefficients: Floats, points: Floats, values: Floats, gradients: Floats
) -> None:
    """Find the values (n,) and, unless it is empty, gradients (n, 3) of a polynomial at points (n, 3).

    rows (R, 2): exponents of x and y; the terms of row r are starts[r] .. starts[r + 1] of powers (of z) and
    coefficients.
    """
    largest = 0
    for t in range(powers.shape[0]):
        largest = max(largest, powers[t])
    for r in range(rows.shape[0]):
        largest = max(largest, max(rows[r, 0], rows[r, 1]))
    table = np.ones((3, largest + 1, LANES))
    inner = np.empty((2, LANES))
    total = np.empty((4, LANES))
    slopes = gradients.shape[0] > 0
    for base in range(0, points.shape[0], LANES):
        n = min(LANES, points.shape[0] - base)
        for axis in range(3):
            for k in range(n):
                for e in range(1, largest + 1):
                    table[axis, e, k] = points[base + k, axis]
            for e in range(2, largest + 1):
                for k in range(LANES):
                    table[axis, e, k] *= table[axis, e - 1, k]
        for axis in range(4):
            for k in range(LANES):
                total[axis, k] = 0.0
        for r in range(rows.shape[0]):
            for k in range(LANES):
                inner[0, k] = 0.0
                inner[1, k] = 0.0
            for t in range(starts[r], starts[r + 1]):
                c, e = coefficients[t], powers[t]
                for k in range(LANES):
                    inner[0, k] += c * table[2, e, k]
                if slopes and e > 0:
                    for k in range(LANES):
                        inner[1, k] += c * e * table[2, e - 1, k]
            i, j = rows[r, 0], rows[r, 1]
            for k in range(LANES):
                outer = table[0, i, k] * table[1, j, k]
                total[0, k] += outer * inner[0, k]
                total[3, k] += outer * inner[1, k]
            if slopes and i > 0:
                for k in range(LANES):
                    total[1, k] += i * table[0, i - 1, k] * table[1, j, k] * inner[0, k]
            if slopes and j > 0:
                for k in range(LANES):
                    total[2, k] += j * table[0, i, k] * table[1, j - 1, k] * inner[0, k]
        for k in range(n):
            values[base + k] = total[0, k]
            if slopes:
                for axis in range(3):
                    gradients[base + k, axis] = total[1 + axis, k]
