"""sin, cos and exp of arrays, in loops that vectorise, and one loop per operation of a tape.

Measured errors against 50 digits: sin and cos 3e-16 absolute, exp 2e-15 relative; interval.py allows far more.
"""

import math
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.tape import ABS, ADD, ATAN, DIV, EXP, LOG, MIN, MUL, NEG, POW, SIN, SQR, SQRT, SUB

Floats: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int32]
Indices: TypeAlias = NDArray[np.int32]
Longs: TypeAlias = NDArray[np.int64]

# Kernels without _nrt may not make arrays; references to those that they are given need not be counted, which takes
# time, and more of it to compile. no_rewrites: there are no sums of whole arrays that loops could be made of.
OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "no_rewrites": True,
    "_nrt": False,
}
INNER = {**OPTIONS, "no_cpython_wrapper": True}  # called by other kernels only
MAKING = {"_nrt": True}  # added to the options of a kernel that makes arrays
# A kernel with one caller has inline="always" besides: it is compiled there alone, not at every level above as well.
FUSED = {**OPTIONS, "fastmath": {"contract"}}  # a product and a sum may be rounded once, which is more exact

EXP_LEAST, EXP_MOST = -708.0, 709.0  # exp is 0 below and infinite above
SIN_MOST = 1e5  # beyond, the library's sine
_POWERS = np.append(np.ldexp(1.0, np.arange(-1022, 1024)), [np.nan, np.nan])  # of two, 2048 of them
_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest whole number


@njit(**INNER)
def copy(out: Floats, a: Floats) -> None:
    """Store a; assigning slices of arrays would cost numba three seconds of compilation."""
    for k in range(len(out)):
        out[k] = a[k]


@njit(**INNER)
def fill(out: Floats, value: float) -> None:
    """Store one value everywhere."""
    for k in range(out.shape[0]):
        out[k] = value


@njit(**{**INNER, **FUSED})
def sine(out: Floats, a: Floats, shift: float) -> None:
    """Store sin(a + shift pi), shift 0 or 1/2: a = n pi + r with |r| <= pi/2, then a polynomial in r."""
    far = False
    for k in range(out.shape[0]):
        v = a[k]
        far |= abs(v) > SIN_MOST
        q = ((v * 0.3183098861837907 + shift) + _ROUND) - _ROUND
        n = q - shift
        r = ((v - n * 3.1415926218032837) - n * 3.178650942459171e-08) - n * 1.2246467864107189e-16
        s = r * r
        p = -8.220635246624329e-18 + s * 1.9572941063391263e-20
        p = 2.8114572543455206e-15 + s * p
        p = -7.647163731819816e-13 + s * p
        p = 1.6059043836821613e-10 + s * p
        p = -2.505210838544172e-08 + s * p
        p = 2.7557319223985893e-06 + s * p
        p = -0.0001984126984126984 + s * p
        p = 0.008333333333333333 + s * p
        p = r + r * s * (-0.16666666666666666 + s * p)
        half = q * 0.5
        odd = q - 2.0 * ((half + _ROUND) - _ROUND)
        out[k] = p * (1.0 - 2.0 * abs(odd))
    if far:
        for k in range(out.shape[0]):
            if abs(a[k]) > SIN_MOST:
                out[k] = math.sin(a[k]) if shift == 0.0 else math.cos(a[k])


@njit(**{**INNER, **FUSED})
def exponential(out: Floats, a: Floats) -> None:
    """Store exp(a): a = q log 2 + r, a polynomial in r, and 2^q from a table."""
    for k in range(out.shape[0]):
        v = a[k] if a[k] > EXP_LEAST else EXP_LEAST
        v = v if v < EXP_MOST else EXP_MOST
        q = (v * 1.4426950408889634 + _ROUND) - _ROUND
        r = (v - q * 0.6931471803691238) - q * 1.9082149292705877e-10
        p = 1.0 / 479001600.0 + r / 6227020800.0
        p = 1.0 / 39916800.0 + r * p
        p = 1.0 / 3628800.0 + r * p
        p = 1.0 / 362880.0 + r * p
        p = 1.0 / 40320.0 + r * p
        p = 1.0 / 5040.0 + r * p
        p = 1.0 / 720.0 + r * p
        p = 1.0 / 120.0 + r * p
        p = 1.0 / 24.0 + r * p
        p = 1.0 / 6.0 + r * p
        p = 0.5 + r * p
        v = (1.0 + r * (1.0 + r * p)) * _POWERS[np.int64(q + 1022.0) & 2047]
        v = 0.0 if a[k] < EXP_LEAST else v
        v = np.inf if a[k] > EXP_MOST else v
        out[k] = v if a[k] == a[k] else a[k]


@njit(**INNER)
def binary(operation: int, out: Floats, a: Floats, b: Floats) -> None:
    """One operation on two arrays; MIN and MAX keep a when both are equal, and a NaN in either."""
    n = out.shape[0]
    a, b = a[:n], b[:n]
    if operation <= SUB:
        sign = 1.0 if operation == ADD else -1.0  # one loop for both: each loop is a wait for its compilation
        for k in range(n):
            out[k] = a[k] + sign * b[k]
    elif operation == MUL:
        for k in range(n):
            out[k] = a[k] * b[k]
    elif operation == DIV:
        for k in range(n):
            out[k] = a[k] / b[k]
    else:
        sign = 1.0 if operation == MIN else -1.0
        for k in range(n):
            out[k] = b[k] if (sign * b[k] < sign * a[k]) or (b[k] != b[k]) else a[k]


@njit(**INNER)
def unary(operation: int, out: Floats, a: Floats, exponent: float) -> None:
    """One operation on one array, NaN where it is no real number; MIN and MAX of one operand are that operand."""
    n = out.shape[0]
    a = a[:n]
    if operation == NEG:
        for k in range(n):
            out[k] = -a[k]
    elif operation == ABS:
        for k in range(n):
            out[k] = abs(a[k])
    elif operation == SQR:
        for k in range(n):
            out[k] = a[k] * a[k]
    elif operation == SQRT:
        for k in range(n):
            out[k] = math.sqrt(a[k])
    elif operation == EXP:
        exponential(out, a)
    elif operation == LOG:
        for k in range(n):
            out[k] = math.log(a[k])
    elif operation == ATAN:
        for k in range(n):
            out[k] = math.atan(a[k])
    elif operation == POW:
        for k in range(n):
            out[k] = math.pow(a[k], exponent)
    elif operation < MIN:
        sine(out, a, 0.0 if operation == SIN else 0.5)
    else:
        copy(out, a)
