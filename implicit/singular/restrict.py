"""A polynomial on a small box, from coefficients that are exact to twice double precision.

Coefficients are pairs high + low of doubles (Dekker, Numerische Mathematik 18, 1971, doi:10.1007/BF01397083), powers
of three variables that run over [-1, 1]. A box is given by its lower corner and widths, both exact doubles.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import INNER

Floats = NDArray[np.float64]

PAIR_UNIT = 2.0**-100  # bounds the relative error of each operation on pairs below, with room to spare


@njit(**INNER)
def _sum(a: float, b: float) -> tuple[float, float]:
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@njit(**INNER)
def add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """(ah + al) + (bh + bl) as a pair, accurate also where the high parts cancel."""
    s, e = _sum(ah, bh)
    t, f = _sum(al, bl)
    s, e = _sum(s, e + t)
    return _sum(s, e + f)


@njit(**INNER)
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


@njit(**INNER)
def restrict_line(high: Floats, low: Floats, first: int, stride: int, n: int, lower: float, width: float) -> None:
    """Power coefficients on [-1, 1] become Bernstein coefficients on [lower, lower + width], in place.

    They stand at first, first + stride, ..., first + n stride.
    """
    last = first + n * stride
    for i in range(first, last, stride):
        for j in range(last - stride, i - stride, -stride):
            h, t = multiply(high[j + stride], low[j + stride], lower)
            high[j], low[j] = add(high[j], low[j], h, t)
    scale, binomial = 1.0, 1.0
    for k in range(1, n + 1):
        j = first + k * stride
        scale *= width
        binomial = binomial * (n + 1 - k) / k
        h, t = multiply(high[j], low[j], scale)
        quotient = h / binomial
        ph, pl = multiply(-binomial, 0.0, quotient)
        rest, spare = add(h, t, ph, pl)
        high[j], low[j] = _sum(quotient, (rest + spare) / binomial)
    for i in range(first, last, stride):
        for j in range(last, i, -stride):
            high[j], low[j] = add(high[j], low[j], high[j - stride], low[j - stride])


@njit(**INNER)
def restrict(
    high: Floats, low: Floats, shape: NDArray[np.int64], lower: Floats, width: Floats, out: Floats, spare: Floats
) -> float:
    """Write the Bernstein coefficients on a box into out; return a bound of their absolute error.

    high, low, out and spare are flat, of size shape[0] shape[1] shape[2]. Every sum above has the same terms as the one
    for |coefficients| at |lower| + width, so the error is at most that value times the unit times the number of
    operations in a chain.
    """
    total = _majorant(high, shape, lower, width)
    for k in range(high.size):
        out[k] = high[k]
        spare[k] = low[k]
    block = high.size
    for a in range(3):
        stride = block // shape[a]
        for start in range(0, high.size, block):
            for first in range(start, start + stride):
                restrict_line(out, spare, first, stride, shape[a] - 1, lower[a], width[a])
        block = stride
    largest = 0.0
    for k in range(high.size):
        largest = abs(out[k]) if abs(out[k]) > largest else largest
    return 2.0**-52 * largest + 8 * (shape[0] + shape[1] + shape[2]) * PAIR_UNIT * total


@njit(**INNER)
def _majorant(high: Floats, shape: NDArray[np.int64], lower: Floats, width: Floats) -> float:
    """The sum of |coefficients| times powers of |lower| + width, by Horner's rule."""
    x, y, z = abs(lower[0]) + width[0], abs(lower[1]) + width[1], abs(lower[2]) + width[2]
    total, k = 0.0, high.size
    for _ in range(shape[0]):
        plane = 0.0
        for _ in range(shape[1]):
            line = 0.0
            for _ in range(shape[2]):
                k -= 1
                line = line * z + abs(high[k])
            plane = plane * y + line
        total = total * x + plane
    return total
