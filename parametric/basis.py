"""Kernels: B-spline basis functions at many parameters, and control nets weighted by them.

A basis function of degree p restricted to a knot span is a polynomial. Its Bernstein coefficients on each span are
the table of `KnotVector.table`; the kernels evaluate Bernstein polynomials (stable for every degree, non-negative)
and multiply by the table. One table for each order of derivative, so one kernel serves them all.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array


@numba.njit(cache=True, inline="never")
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


@numba.njit(cache=True)
def weigh(t: Array, breaks: Array, table: Array) -> tuple[NDArray[np.int64], Array]:
    """Span indices (n,) and values (n, p+1) of the p+1 functions that live there."""
    spans = np.empty(t.size, np.int64)
    weights = np.empty((t.size, table.shape[2]))
    bernstein = np.empty(table.shape[1])
    for k in range(t.size):
        spans[k] = _weigh(t[k], breaks, table, bernstein, weights[k])
    return spans, weights


@numba.njit(cache=True)
def combine_grid(first_u: Array, weights_u: Array, first_v: Array, weights_v: Array, net: Array) -> Array:
    """Sum of weights_u[a, i] weights_v[b, j] net[first_u[a] + i, first_v[b] + j] for all a, b: (m, n, d)."""
    columns, d = net.shape[1], net.shape[2]
    out = np.empty((first_u.size, first_v.size, d))
    row = np.empty((columns, d))
    for a in range(first_u.size):
        row[:] = 0.0
        for i in range(weights_u.shape[1]):
            w = weights_u[a, i]
            source = net[first_u[a] + i]
            for j in range(columns):
                for c in range(d):
                    row[j, c] += w * source[j, c]
        for b in range(first_v.size):
            start = first_v[b]
            for c in range(d):
                total = 0.0
                for j in range(weights_v.shape[1]):
                    total += weights_v[b, j] * row[start + j, c]
                out[a, b, c] = total
    return out


@numba.njit(cache=True)
def combine_points(
    u: Array, v: Array, breaks_u: Array, table_u: Array, first_u: Array, breaks_v: Array, table_v: Array,
    first_v: Array, net: Array,
) -> Array:  # fmt: skip
    """The same sum at scattered parameters u, v (n,): (n, d)."""
    d = net.shape[2]
    out = np.empty((u.size, d))
    bernstein_u, bernstein_v = np.empty(table_u.shape[1]), np.empty(table_v.shape[1])
    wu, wv = np.empty(table_u.shape[2]), np.empty(table_v.shape[2])
    for k in range(u.size):
        i0 = first_u[_weigh(u[k], breaks_u, table_u, bernstein_u, wu)]
        j0 = first_v[_weigh(v[k], breaks_v, table_v, bernstein_v, wv)]
        for c in range(d):
            out[k, c] = 0.0
        for i in range(wu.size):
            for c in range(d):
                total = 0.0
                for j in range(wv.size):
                    total += wv[j] * net[i0 + i, j0 + j, c]
                out[k, c] += wu[i] * total
    return out
