"""A polynomial on a small box, from coefficients that are exact to twice double precision.

Coefficients are pairs high + low of doubles (Dekker, Numerische Mathematik 18, 1971, doi:10.1007/BF01397083), powers
of three variables that run over [-1, 1]. A box is given by its lower corner and widths, both exact doubles.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

PAIR_UNIT = 2.0**-100  # bounds the relative error of each operation on pairs below, with room to spare


@njit(cache=True, inline="always")
def _sum(a: float, b: float) -> tuple[float, float]:
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@njit(cache=True)
def add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """(ah + al) + (bh + bl) as a pair, accurate also where the high parts cancel."""
    s, e = _sum(ah, bh)
    t, f = _sum(al, bl)
    s, e = _sum(s, e + t)
    return _sum(s, e + f)


@njit(cache=True)
def multiply(ah: float, al: float, b: float) -> tuple[float, float]:
    """(ah + al) * b as a pair."""
    p = ah * b
    t = 134217729.0 * ah
    a1 = t - (t - ah)
    a2 = ah - a1
    t = 134217729.0 * b
    b1 = t - (t - b)
    b2 = b - b1
    e = ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2
    return _sum(p, e + al * b)


@njit(cache=True)
def restrict_line(high: NDArray[np.float64], low: NDArray[np.float64], lower: float, width: float) -> None:
    """Replace power coefficients on [-1, 1] by Bernstein coefficients on [lower, lower + width], in place."""
    n = high.size - 1
    for i in range(n):
        for j in range(n - 1, i - 1, -1):
            h, t = multiply(high[j + 1], low[j + 1], lower)
            high[j], low[j] = add(high[j], low[j], h, t)
    scale, binomial = 1.0, 1.0
    for j in range(1, n + 1):
        scale *= width
        binomial = binomial * (n + 1 - j) / j
        h, t = multiply(high[j], low[j], scale)
        quotient = h / binomial
        ph, pl = multiply(-binomial, 0.0, quotient)
        rest, spare = add(h, t, ph, pl)
        high[j], low[j] = _sum(quotient, (rest + spare) / binomial)
    for i in range(n):
        for j in range(n, i, -1):
            high[j], low[j] = add(high[j], low[j], high[j - 1], low[j - 1])


@njit(cache=True)
def restrict(
    high: NDArray[np.float64],
    low: NDArray[np.float64],
    lower: NDArray[np.float64],
    width: NDArray[np.float64],
    out: NDArray[np.float64],
) -> float:
    """Write the Bernstein coefficients on a box into out (flat); return a bound of their absolute error.

    high, low (n0 + 1, n1 + 1, n2 + 1). Every sum above has the same terms as the one for |coefficients| at
    |lower| + width, so the error is at most that value times the unit times the number of operations in a chain.
    """
    a, b = high.copy(), low.copy()
    n0, n1, n2 = a.shape
    size = 0.0
    for i in range(n0):
        for j in range(n1):
            for k in range(n2):
                size += (
                    abs(a[i, j, k])
                    * (abs(lower[0]) + width[0]) ** i
                    * (abs(lower[1]) + width[1]) ** j
                    * (abs(lower[2]) + width[2]) ** k
                )
    for j in range(n1):
        for k in range(n2):
            restrict_line(a[:, j, k], b[:, j, k], lower[0], width[0])
    for i in range(n0):
        for k in range(n2):
            restrict_line(a[i, :, k], b[i, :, k], lower[1], width[1])
    for i in range(n0):
        for j in range(n1):
            restrict_line(a[i, j, :], b[i, j, :], lower[2], width[2])
    largest = 0.0
    flat = a.reshape(-1)
    for i in range(flat.size):
        out[i] = flat[i]
        largest = max(largest, abs(flat[i]))
    return 2.0**-52 * largest + 8 * (n0 + n1 + n2) * PAIR_UNIT * size
