"""A tape evaluated in interval arithmetic, on a mesh of side^3 boxes or on scattered boxes.

Every rounded bound v moves outward to v -/+ (|v| 2^-52 + 2.3e-308), at least one unit in its last place. Rounding is
monotone, so the same interval also holds every value that `values.evaluate` computes in the closed box. Where an
operation is undefined somewhere (a root or logarithm of negative numbers, a quotient by an interval around 0) the
result is unbounded, and so is what is computed from it, on one side at least below min and max.
"""

import math

import numpy as np
from numba import njit

from implicit.kernels.elementary import (
    EXP_LEAST,
    EXP_MOST,
    INNER,
    OPTIONS,
    SIN_MOST,
    Floats,
    Indices,
    Rows,
    binary,
    copy,
    fill,
    power,
    sine,
    unary,
)
from implicit.kernels.values import aligned, count_of
from implicit.tape import ABS, ADD, CONST, COS, DIV, EXP, LOG, MIN, NEG, POW, SIN, SQR, SQRT, SUB

_ULP = 2.0**-52
_TINY = 2.3e-308
_EXP_ERROR = 2.0**-46  # relative, 64 units; measured: 5
_SIN_ERROR = 1e-14  # times 1 + |x| / pi; measured: 3e-16
_LIBRARY_ERROR = 2.0**-49  # relative, 8 units, of log, atan and pow; measured: 1


@njit(**INNER)
def _down(v: float) -> float:
    lower = v - (abs(v) * _ULP + _TINY)
    return lower if lower == lower else -np.inf


@njit(**INNER)
def _up(v: float) -> float:
    upper = v + (abs(v) * _ULP + _TINY)
    return upper if upper == upper else np.inf


@njit(**INNER)
def _add(low: Floats, high: Floats, al: Floats, ah: Floats, bl: Floats, bh: Floats, minus: bool) -> None:
    """Store a + b, or a - b. Where both parts are of one sign the result is of that sign, without rounding."""
    for k in range(low.shape[0]):
        cl = -bh[k] if minus else bl[k]
        ch = -bl[k] if minus else bh[k]
        least, most = _down(al[k] + cl), _up(ah[k] + ch)
        low[k] = 0.0 if al[k] + cl >= 0.0 and least < 0.0 else least
        high[k] = 0.0 if ah[k] + ch <= 0.0 and most > 0.0 else most


@njit(**INNER)
def _multiply(low: Floats, high: Floats, al: Floats, ah: Floats, bl: Floats, bh: Floats, over: bool) -> None:
    """Store a b, or a / b: the least and the largest of the four corners, each rounded once."""
    for k in range(low.shape[0]):
        p = al[k] / bl[k] if over else al[k] * bl[k]
        q = al[k] / bh[k] if over else al[k] * bh[k]
        r = ah[k] / bl[k] if over else ah[k] * bl[k]
        s = ah[k] / bh[k] if over else ah[k] * bh[k]
        total = p + q + r + s
        p, q = (p, q) if p < q else (q, p)
        r, s = (r, s) if r < s else (s, r)
        least = _down(p if p < r else r)
        most = _up(q if q > s else s)
        wild = total != total or (over and bl[k] <= 0.0 and bh[k] >= 0.0)
        same = (al[k] >= 0.0 and bl[k] >= 0.0) or (ah[k] <= 0.0 and bh[k] <= 0.0)
        least = 0.0 if same and least < 0.0 else least
        low[k] = -np.inf if wild else least
        high[k] = np.inf if wild else most


@njit(**INNER)
def _even(low: Floats, high: Floats, al: Floats, ah: Floats, square: bool) -> None:
    """Store |a|, or a^2."""
    for k in range(low.shape[0]):
        a, b = abs(al[k]), abs(ah[k])
        least, most = (a, b) if a < b else (b, a)
        least = 0.0 if al[k] <= 0.0 and ah[k] >= 0.0 else least
        below = _down(least * least)
        low[k] = (below if below > 0.0 else 0.0) if square else least
        high[k] = _up(most * most) if square else most


@njit(**INNER)
def _wave(low: Floats, high: Floats, al: Floats, ah: Floats, shift: float) -> None:
    """Store sin(a + shift pi): the values at both ends, and 1 or -1 where an extremum lies between."""
    sine(low, al, shift)
    sine(high, ah, shift)
    for k in range(low.shape[0]):
        a, b = al[k] * 0.3183098861837907, ah[k] * 0.3183098861837907
        error = _SIN_ERROR * (1.0 + abs(a) + abs(b))
        a = (a - error + shift - 0.5) * 0.5  # maxima at whole numbers, minima halfway
        b = (b + error + shift - 0.5) * 0.5
        peak = math.floor(b) >= math.ceil(a)
        dip = math.floor(b - 0.5) >= math.ceil(a - 0.5)
        calm = abs(al[k]) < SIN_MOST and abs(ah[k]) < SIN_MOST
        least, most = (low[k], high[k]) if low[k] < high[k] else (high[k], low[k])
        low[k] = least - error if calm and not dip else -1.0 - _SIN_ERROR
        high[k] = most + error if calm and not peak else 1.0 + _SIN_ERROR


@njit(**INNER)
def _rising(operation: int, low: Floats, high: Floats, al: Floats, ah: Floats, exponent: float) -> None:
    """Store a root, exponential, logarithm, arc tangent or power: the values at both ends, moved outward."""
    if operation == POW:
        power(low, al, exponent)
        power(high, ah, exponent)
    else:
        unary(operation, low, al)
        unary(operation, high, ah)
    error = _EXP_ERROR if operation == EXP else 0.0 if operation == SQRT else _LIBRARY_ERROR
    partial = operation in (SQRT, LOG, POW)
    never_negative = operation in (SQRT, EXP, POW)
    for k in range(low.shape[0]):
        falls = operation == POW and exponent < 0.0
        a, b = (high[k], low[k]) if falls else (low[k], high[k])
        a = _down(a - abs(a) * error)
        b = _up(b + abs(b) * error)
        a = 0.0 if never_negative and a < 0.0 else a
        wild = partial and not (al[k] > 0.0 or (al[k] == 0.0 and operation != LOG and not falls))
        if operation == EXP:
            a = 0.0 if al[k] > EXP_MOST - 1.0 or al[k] < EXP_LEAST + 1.0 else a
            b = np.inf if ah[k] > EXP_MOST - 1.0 else b
            b = 1e-300 if ah[k] < EXP_LEAST + 1.0 else b
        low[k] = -np.inf if wild else a
        high[k] = np.inf if wild else b


@njit(**OPTIONS, inline="always")
def enclose(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    lower: Floats,
    upper: Floats,
    points: int,
    side: int,
    low: Floats,
    high: Floats,
    scratch: Floats,
) -> None:
    """Bounds of registers 0 .. count-1 of the tape in rows start .. start+count-1; see `values.evaluate`.

    lower and upper (3, n) bound x, y, z: along each axis of a mesh of side^3 boxes (points 0), or for each of
    `points` scattered boxes. low, high (>= count, >= values), scratch (4, >= values).
    """
    for q in range(count):
        operation = code[start + q, 0]
        a = code[start + q, 1]
        b = code[start + q, 2]
        mask = 7 if points else code[start + q, 3]
        n = points if points else count_of(mask, side)
        least, most = low[q, :n], high[q, :n]
        if operation < CONST:
            copy(least, lower[operation])
            copy(most, upper[operation])
        elif operation == CONST:
            fill(least, constants[a, 1])
            fill(most, constants[a, 2])
        elif operation == NEG:
            unary(operation, least, high[a])
            unary(operation, most, low[a])
        elif operation in (ABS, SQR):
            _even(least, most, low[a], high[a], operation == SQR)
        elif operation in (SIN, COS):
            _wave(least, most, low[a], high[a], 0.0 if operation == SIN else 0.5)
        elif operation > DIV and operation < MIN:
            _rising(operation, least, most, low[a], high[a], constants[b, 0] if operation == POW else 0.0)
        else:
            chain = operation >= MIN
            first = arguments[a] if chain else a
            own = 7 if points else code[start + first, 3]
            al = aligned(low, first, own, mask, side, scratch[0])
            ah = aligned(high, first, own, mask, side, scratch[1])
            if chain and b == 1:
                copy(least, al)
                copy(most, ah)
            for t in range(1, b if chain else 2):
                other = arguments[a + t] if chain else b
                own = 7 if points else code[start + other, 3]
                bl = aligned(low, other, own, mask, side, scratch[2])
                bh = aligned(high, other, own, mask, side, scratch[3])
                if chain:
                    binary(operation, least, al, bl)
                    binary(operation, most, ah, bh)
                    al, ah = least, most
                elif operation in (ADD, SUB):
                    _add(least, most, al, ah, bl, bh, operation == SUB)
                else:
                    _multiply(least, most, al, ah, bl, bh, operation == DIV)
