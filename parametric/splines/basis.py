"""Kernels: B-spline basis functions at many parameters, and control nets weighted by them.

Everything is evaluated by Bernstein polynomials, which are stable for every degree. A basis function restricted to a
knot span has the Bernstein coefficients of `KnotVector.table`, one table for each order of derivative: that serves
grids. Scattered points of a surface are taken from its Bezier patches, those of a curve from patches of one column.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array


@numba.njit(cache=True, error_model="numpy")
def _weigh(t: float, breaks: Array, table: Array, bernstein: Array, out: Array) -> int:
    """Fill `out` (p+1,) with the functions that live on the span of t; the span's index.

    The last span contains its right end; every other span contains only its left end.
    """
    low, high = 0, breaks.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if t < breaks[middle]:
            high = middle
        else:
            low = middle
    s = (t - breaks[low]) / (breaks[high] - breaks[low])
    degree = table.shape[1] - 1
    bernstein[0] = 1.0
    for k in range(1, degree + 1):
        carried = 0.0
        for a in range(k):
            part = bernstein[a]
            bernstein[a] = carried + (1.0 - s) * part
            carried = s * part
        bernstein[k] = carried
    for j in range(out.size):
        total = 0.0
        for a in range(degree + 1):
            total += bernstein[a] * table[low, a, j]
        out[j] = total
    return low


@numba.njit(cache=True, error_model="numpy")
def weigh(t: Array, breaks: Array, table: Array) -> tuple[NDArray[np.int64], Array]:
    """Span indices (n,) and values (n, p+1) of the p+1 functions that live there."""
    spans = np.empty(t.size, np.int64)
    weights = np.empty((t.size, table.shape[2]))
    bernstein = np.empty(table.shape[1])
    for k in range(t.size):
        spans[k] = _weigh(t[k], breaks, table, bernstein, weights[k])
    return spans, weights


@numba.njit(cache=True, error_model="numpy")
def combine_grid(
    first_u: NDArray[np.int64], weights_u: Array, first_v: NDArray[np.int64], weights_v: Array, net: Array, d: int
) -> Array:
    """Sum of weights_u[a, i] weights_v[b, j] net[first_u[a] + i, first_v[b] + j] for all a, b: (m, n, d).

    The net has four coordinates, the last of them idle where d is 3, so that one vector register takes them all.
    """
    count = first_u.size
    out = np.empty((count, first_v.size, d))
    row, below = np.empty(4 * net.shape[1]), np.empty(4 * net.shape[1])
    for a in range(0, count, 2):  # two lines at a time share their weights; an odd last one is computed twice
        other = min(a + 1, count - 1)
        for k in range(row.size):
            row[k] = below[k] = 0.0
        for i in range(weights_u.shape[1]):
            weight, source = weights_u[a, i], net[first_u[a] + i].reshape(-1)
            for k in range(row.size):
                row[k] += weight * source[k]
            weight, source = weights_u[other, i], net[first_u[other] + i].reshape(-1)
            for k in range(row.size):
                below[k] += weight * source[k]
        line, next_line = out[a], out[other]
        for b in range(first_v.size):
            k = 4 * first_v[b]
            x0, y0, z0, w0 = 0.0, 0.0, 0.0, 0.0
            x1, y1, z1, w1 = 0.0, 0.0, 0.0, 0.0
            for j in range(weights_v.shape[1]):
                weight = weights_v[b, j]
                x0 += weight * row[k]
                y0 += weight * row[k + 1]
                z0 += weight * row[k + 2]
                w0 += weight * row[k + 3]
                x1 += weight * below[k]
                y1 += weight * below[k + 1]
                z1 += weight * below[k + 2]
                w1 += weight * below[k + 3]
                k += 4
            line[b, 0], line[b, 1], line[b, 2] = x0, y0, z0
            next_line[b, 0], next_line[b, 1], next_line[b, 2] = x1, y1, z1
            if d == 4:
                line[b, 3], next_line[b, 3] = w0, w1
    return out


@numba.njit(cache=True, error_model="numpy")
def _bernstein(t: Array, breaks: Array, spans: NDArray[np.int64], values: Array, slopes: Array, order: int) -> None:
    """Spans (n,) of t (n,), Bernstein polynomials there (p+1, n) and, if order is 1, their derivatives by t.

    Every inner loop runs over the parameters, without a branch: the compiler makes vector code of it.
    """
    count, degree = t.size, values.shape[0] - 1
    for k in range(count):
        spans[k] = 0
    left = breaks.size - 1
    while left > 1:
        half = left // 2
        for k in range(count):
            middle = spans[k] + half
            spans[k] = middle if t[k] >= breaks[middle] else spans[k]
        left -= half
    s, rate = np.empty(count), np.empty(count)
    for k in range(count):
        start = breaks[spans[k]]
        rate[k] = 1.0 / (breaks[spans[k] + 1] - start)
        s[k] = (t[k] - start) * rate[k]
        values[0, k] = 1.0
    for r in range(1, degree + 1):
        if order == 1 and r == degree:
            for k in range(count):
                slopes[0, k] = -degree * rate[k] * values[0, k]
                slopes[degree, k] = degree * rate[k] * values[degree - 1, k]
            for a in range(1, degree):
                for k in range(count):
                    slopes[a, k] = degree * rate[k] * (values[a - 1, k] - values[a, k])
        for k in range(count):
            values[r, k] = s[k] * values[r - 1, k]
        for a in range(r - 1, 0, -1):
            for k in range(count):
                values[a, k] = s[k] * values[a - 1, k] + (1.0 - s[k]) * values[a, k]
        for k in range(count):
            values[0, k] *= 1.0 - s[k]


@numba.njit(cache=True, error_model="numpy")
def combine_points(u: Array, v: Array, breaks_u: Array, breaks_v: Array, nets: Array, order: int) -> Array:
    """Points of Bezier patches at scattered parameters: (1, n, d), or (3, n, d) with both derivatives if order is 1.

    `nets` (spans in u, spans in v, p+1, q+1, d) holds the patches. Parameters are taken in blocks that fit the
    fastest cache; each coefficient is fetched once.
    """
    block = 128
    patches_v, rows, columns, d = nets.shape[1], nets.shape[2], nets.shape[3], nets.shape[4]
    flat, single = nets.reshape(-1), nets.shape[0] * nets.shape[1] == 1
    out = np.empty((1 + 2 * order, u.size, d))
    span_u, span_v, base = np.empty(block, np.int64), np.empty(block, np.int64), np.empty(block, np.int64)
    bu, du = np.empty((rows, block)), np.empty((rows, block))
    bv, dv = np.empty((columns, block)), np.empty((columns, block))
    row, slope, total = np.empty((d, block)), np.empty((d, block)), np.empty((3, d, block))
    for start in range(0, u.size, block):
        n = min(block, u.size - start)
        _bernstein(u[start : start + n], breaks_u, span_u, bu, du, order)
        _bernstein(v[start : start + n], breaks_v, span_v, bv, dv, order)
        for k in range(n):
            base[k] = (span_u[k] * patches_v + span_v[k]) * (rows * columns * d)
        for c in range(d):
            for k in range(n):
                total[0, c, k] = total[1, c, k] = total[2, c, k] = 0.0
        for i in range(rows):
            for c in range(d):
                for k in range(n):
                    row[c, k] = slope[c, k] = 0.0
            for j in range(columns):
                for c in range(d):
                    at = (i * columns + j) * d + c
                    if single:
                        x = flat[at]
                        for k in range(n):
                            row[c, k] += bv[j, k] * x
                        if order == 1:
                            for k in range(n):
                                slope[c, k] += dv[j, k] * x
                    elif order == 0:
                        for k in range(n):
                            row[c, k] += bv[j, k] * flat[base[k] + at]
                    else:
                        for k in range(n):
                            x = flat[base[k] + at]
                            row[c, k] += bv[j, k] * x
                            slope[c, k] += dv[j, k] * x
            for c in range(d):
                for k in range(n):
                    total[0, c, k] += bu[i, k] * row[c, k]
                if order == 1:
                    for k in range(n):
                        total[1, c, k] += du[i, k] * row[c, k]
                        total[2, c, k] += bu[i, k] * slope[c, k]
        for r in range(1 + 2 * order):
            for c in range(d):
                for k in range(n):
                    out[r, start + k, c] = total[r, c, k]
    return out


@numba.njit(cache=True, error_model="numpy")
def cross(a: Array, b: Array) -> tuple[Array, Array]:
    """Unit vectors (n, 3) along a x b, zero where it vanishes, and its lengths (n,)."""
    units, lengths = np.zeros(a.shape), np.empty(a.shape[0])
    for k in range(a.shape[0]):
        x = a[k, 1] * b[k, 2] - a[k, 2] * b[k, 1]
        y = a[k, 2] * b[k, 0] - a[k, 0] * b[k, 2]
        z = a[k, 0] * b[k, 1] - a[k, 1] * b[k, 0]
        length = np.sqrt(x * x + y * y + z * z)
        lengths[k] = length
        if length > 0.0:
            units[k, 0] = x / length
            units[k, 1] = y / length
            units[k, 2] = z / length
    return units, lengths
