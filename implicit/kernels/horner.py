"""Polynomials at scattered points, from coefficients as data.

The terms are sorted by (i, j); a row collects those with the same x^i y^j, a polynomial in z.
"""

from numba import njit

from implicit.kernels.elementary import OPTIONS, Floats, Longs

LANES = 64  # points handled together


@njit(**OPTIONS)
def evaluate_terms(
    rows: Longs,
    starts: Longs,
    powers: Longs,
    coefficients: Floats,
    points: Floats,
    values: Floats,
    gradients: Floats,
    power: Floats,
    slope: Floats,
    total: Floats,
) -> None:
    """Find the values (n,) and, unless it is empty, gradients (n, 3) of a polynomial at points (n, 3).

    rows (R, 2): exponents of x and y; the terms of row r are starts[r] .. starts[r + 1] of powers (of z) and
    coefficients. Room to work: power, ones, and slope, zeros, (3, largest exponent + 1, LANES), total (6, LANES).
    """
    for base in range(0, points.shape[0], LANES):
        n = points.shape[0] - base
        n = n if n < LANES else LANES
        for axis in range(3):
            for e in range(1, power.shape[1]):
                for k in range(n):
                    power[axis, e, k] = power[axis, e - 1, k] * points[base + k, axis]
                    slope[axis, e, k] = e * power[axis, e - 1, k]
        for axis in range(4):
            for k in range(LANES):
                total[axis, k] = 0.0
        for r in range(rows.shape[0]):
            i, j = rows[r, 0], rows[r, 1]
            for k in range(LANES):
                total[4, k] = 0.0
                total[5, k] = 0.0
            for t in range(starts[r], starts[r + 1]):
                c, e = coefficients[t], powers[t]
                for k in range(LANES):
                    total[4, k] += c * power[2, e, k]
                for k in range(LANES if gradients.shape[1] else 0):
                    total[5, k] += c * slope[2, e, k]
            for k in range(LANES):
                x, y, f = power[0, i, k], power[1, j, k], total[4, k]
                total[0, k] += x * y * f
                total[1, k] += slope[0, i, k] * y * f
                total[2, k] += x * slope[1, j, k] * f
                total[3, k] += x * y * total[5, k]
        for k in range(n):
            values[base + k] = total[0, k]
        for axis in range(gradients.shape[1]):
            for k in range(n):
                gradients[base + k, axis] = total[1 + axis, k]
