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
    OPTIONS,
    SIN_MOST,
    Floats,
    Indices,
    Rows,
    copy,
    exponential,
    fill,
    sine,
)
from implicit.kernels.values import count_of, operand, spread
from implicit.tape import ABS, ADD, ATAN, CONST, DIV, EXP, LOG, MIN, NEG, POW, SIN, SQR, SQRT, SUB

_ULP = 2.0**-52
_TINY = 2.3e-308
_EXP_ERROR = 2.0**-46  # relative, 64 units; measured: 5
_SIN_ERROR = 1e-14  # times 1 + |x| / pi; measured: 3e-16
_LIBRARY_ERROR = 2.0**-49  # relative, 8 units, of log, atan and pow; measured: 1


@njit(**OPTIONS)
def _down(v: float) -> float:
    lower = v - (abs(v) * _ULP + _TINY)
    return lower if lower == lower else -np.inf


@njit(**OPTIONS)
def _up(v: float) -> float:
    upper = v + (abs(v) * _ULP + _TINY)
    return upper if upper == upper else np.inf


@njit(**OPTIONS)
def _binary(operation: int, low: Floats, high: Floats, al: Floats, ah: Floats, bl: Floats, bh: Floats) -> None:
    n = low.shape[0]
    al, ah, bl, bh = al[:n], ah[:n], bl[:n], bh[:n]
    if operation == ADD:
        for k in range(n):
            least = _down(al[k] + bl[k])
            low[k] = max(least, 0.0) if al[k] >= 0.0 and bl[k] >= 0.0 else least
            high[k] = _up(ah[k] + bh[k])
    elif operation == SUB:
        for k in range(n):
            least = _down(al[k] - bh[k])
            most = _up(ah[k] - bl[k])
            low[k] = max(least, 0.0) if al[k] >= bh[k] else least
            high[k] = min(most, 0.0) if ah[k] <= bl[k] else most
    elif operation == MIN:
        for k in range(n):
            low[k] = min(al[k], bl[k])
            high[k] = min(ah[k], bh[k])
    elif operation > MIN:
        for k in range(n):
            low[k] = max(al[k], bl[k])
            high[k] = max(ah[k], bh[k])
    else:
        quotient = operation == DIV
        for k in range(n):
            # a quotient is a product with the reciprocal only in its corners: each corner is rounded once
            p = al[k] / bl[k] if quotient else al[k] * bl[k]
            q = al[k] / bh[k] if quotient else al[k] * bh[k]
            r = ah[k] / bl[k] if quotient else ah[k] * bl[k]
            s = ah[k] / bh[k] if quotient else ah[k] * bh[k]
            least = min(min(p, q), min(r, s))
            most = max(max(p, q), max(r, s))
            wild = p != p or q != q or r != r or s != s or (quotient and bl[k] <= 0.0 and bh[k] >= 0.0)
            same = (al[k] >= 0.0 and bl[k] >= 0.0) or (ah[k] <= 0.0 and bh[k] <= 0.0)
            least = max(_down(least), 0.0) if same else _down(least)
            low[k] = -np.inf if wild else least
            high[k] = np.inf if wild else _up(most)


@njit(**OPTIONS)
def _even(low: Floats, high: Floats, al: Floats, ah: Floats, square: bool) -> None:
    for k in range(low.shape[0]):
        a, b = abs(al[k]), abs(ah[k])
        least = 0.0 if al[k] <= 0.0 and ah[k] >= 0.0 else min(a, b)
        most = max(a, b)
        low[k] = max(_down(least * least), 0.0) if square else least
        high[k] = _up(most * most) if square else most


@njit(**OPTIONS)
def _wave(low: Floats, high: Floats, al: Floats, ah: Floats, shift: float, scratch: Floats) -> None:
    """Range of sin(a + shift pi): the values at both ends, and 1 or -1 where an extremum lies between."""
    n = low.shape[0]
    at_low, at_high = scratch[:n], high
    sine(at_low, al[:n], shift)
    sine(at_high, ah[:n], shift)
    for k in range(n):
        a, b = al[k] * 0.3183098861837907, ah[k] * 0.3183098861837907
        error = _SIN_ERROR * (1.0 + max(abs(a), abs(b)))
        a = (a - error + shift - 0.5) * 0.5  # maxima at whole numbers, minima halfway
        b = (b + error + shift - 0.5) * 0.5
        peak = math.floor(b) >= math.ceil(a)
        dip = math.floor(b - 0.5) >= math.ceil(a - 0.5)
        calm = abs(al[k]) < SIN_MOST and abs(ah[k]) < SIN_MOST
        least = min(at_low[k], at_high[k]) - error
        most = max(at_low[k], at_high[k]) + error
        low[k] = least if calm and not dip else -1.0 - _SIN_ERROR
        high[k] = most if calm and not peak else 1.0 + _SIN_ERROR


@njit(**OPTIONS)
def _grow(low: float, high: float, error: float) -> tuple[float, float]:
    return _down(low - abs(low) * error), _up(high + abs(high) * error)


@njit(**OPTIONS)
def _unary(operation: int, low: Floats, high: Floats, al: Floats, ah: Floats, exponent: float, scratch: Floats) -> None:
    n = low.shape[0]
    if operation == NEG:
        for k in range(n):
            least = -ah[k]
            high[k] = -al[k]
            low[k] = least
    elif operation in (ABS, SQR):
        _even(low, high, al, ah, operation == SQR)
    elif operation == EXP:
        exponential(low, al[:n], scratch)
        exponential(high, ah[:n], scratch)
        for k in range(n):
            low[k] = low[k] * (1.0 - _EXP_ERROR) if al[k] > EXP_LEAST and al[k] <= EXP_MOST else 0.0
            high[k] = high[k] * (1.0 + _EXP_ERROR) if ah[k] >= EXP_LEAST and ah[k] < EXP_MOST else np.inf
            high[k] = 1e-300 if ah[k] < EXP_LEAST else high[k]
    elif operation >= SIN and operation < ATAN:
        _wave(low, high, al, ah, 0.0 if operation == SIN else 0.5, scratch)
    else:
        for k in range(n):
            a, b = al[k], ah[k]
            least, most, error = -np.inf, np.inf, _LIBRARY_ERROR
            if operation == SQRT and a >= 0.0:
                least, most, error = math.sqrt(a), math.sqrt(b), 0.0
            elif operation == LOG and a > 0.0:
                least, most = math.log(a), math.log(b)
            elif operation == ATAN:
                least, most = math.atan(a), math.atan(b)
            elif operation == POW and a >= 0.0 and exponent >= 0.0:
                least, most = math.pow(a, exponent), math.pow(b, exponent)
            elif operation == POW and a > 0.0:
                least, most = math.pow(b, exponent), math.pow(a, exponent)
            low[k], high[k] = _grow(least, most, error)
            if operation in (SQRT, POW):
                low[k] = max(low[k], 0.0) if a >= 0.0 else low[k]


@njit(**OPTIONS)
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
    `points` scattered boxes. low, high (>= count, >= values), scratch (5, >= values).
    """
    for q in range(count):
        operation = code[start + q, 0]
        a = code[start + q, 1]
        b = code[start + q, 2]
        mask = 7 if points else code[start + q, 3]
        n = points if points else count_of(mask, side)
        out_low, out_high = low[q, :n], high[q, :n]
        if operation < CONST:
            copy(out_low, lower[operation])
            copy(out_high, upper[operation])
        elif operation == CONST:
            fill(out_low, constants[a, 1])
            fill(out_high, constants[a, 2])
        elif operation >= MIN:
            first = arguments[a]
            operand(out_low, low[first], code[start + first, 3], mask, points, side)
            operand(out_high, high[first], code[start + first, 3], mask, points, side)
            for t in range(1, b):
                other = arguments[a + t]
                bl, bh = low[other], high[other]
                if not points and code[start + other, 3] != mask:
                    spread(scratch[2], bl, code[start + other, 3], mask, side)
                    spread(scratch[3], bh, code[start + other, 3], mask, side)
                    bl, bh = scratch[2], scratch[3]
                _binary(operation, out_low, out_high, out_low, out_high, bl, bh)
        elif operation <= DIV:
            al, ah, bl, bh = low[a], high[a], low[b], high[b]
            if not points and code[start + a, 3] != mask:
                spread(scratch[0], al, code[start + a, 3], mask, side)
                spread(scratch[1], ah, code[start + a, 3], mask, side)
                al, ah = scratch[0], scratch[1]
            if not points and code[start + b, 3] != mask:
                spread(scratch[2], bl, code[start + b, 3], mask, side)
                spread(scratch[3], bh, code[start + b, 3], mask, side)
                bl, bh = scratch[2], scratch[3]
            _binary(operation, out_low, out_high, al, ah, bl, bh)
        else:
            exponent = constants[b, 0] if operation == POW else 0.0
            _unary(operation, out_low, out_high, low[a], high[a], exponent, scratch[4])
