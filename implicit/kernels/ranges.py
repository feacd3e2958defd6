"""A tape evaluated in interval arithmetic on a mesh of SPLIT^3 boxes; for what the bounds of all registers are needed.

Every rounded bound v moves outward to v -/+ (|v| 2^-52 + 2.3e-308), at least one unit in its last place. Rounding is
monotone, so the same interval also holds every value that `values.evaluate` computes in the closed box. Where an
operation is undefined somewhere (a root or logarithm of negative numbers, a quotient by an interval around 0) the
result is unbounded, and so is what is computed from it, on one side at least below min and max.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

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
    unary,
)
from implicit.tape import ABS, ATAN, CONST, COS, DIV, EXP, LOG, MIN, NEG, POW, SIN, SQR, SQRT, SUB

ULP = 2.0**-52
TINY = 2.3e-308
EXP_ERROR = 2.0**-46  # relative, 64 units; measured: 5
SIN_ERROR = 1e-14  # times 1 + |x| / pi; measured: 3e-16
LIBRARY_ERROR = 2.0**-49  # relative, 8 units, of log, atan and pow; measured: 1

SPLIT = 4  # boxes along each axis of a mesh


def _places() -> NDArray[np.uint8]:
    """Entry (own, mask, n): where a register of mask `own` keeps what is value n in the layout of `mask`."""
    table = np.zeros((8, 8, SPLIT**3), np.uint8)
    for mask in range(8):
        steps = np.indices([SPLIT if mask & bit else 1 for bit in (4, 2, 1)]).reshape(3, -1)
        for own in range(8):
            kept = [axis for axis, bit in enumerate((4, 2, 1)) if own & bit]
            weights = SPLIT ** np.arange(len(kept))[::-1]
            table[own, mask, : steps.shape[1]] = weights @ steps[kept]
    return table


PLACE = _places()
_COUNT = SPLIT ** np.array([mask.bit_count() for mask in range(8)])  # values of a register of each mask


@njit(**INNER)
def _down(v: float) -> float:
    lower = v - (abs(v) * ULP + TINY)
    return lower if lower == lower else -np.inf


@njit(**INNER)
def _up(v: float) -> float:
    upper = v + (abs(v) * ULP + TINY)
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
    """Bound sin(a + shift pi) by the values at both ends, given, and 1 or -1 where an extremum lies between."""
    for k in range(low.shape[0]):
        a, b = al[k] * 0.3183098861837907, ah[k] * 0.3183098861837907
        error = SIN_ERROR * (1.0 + abs(a) + abs(b))
        a = (a - error + shift - 0.5) * 0.5  # maxima at whole numbers, minima halfway
        b = (b + error + shift - 0.5) * 0.5
        peak = math.floor(b) >= math.ceil(a)
        dip = math.floor(b - 0.5) >= math.ceil(a - 0.5)
        calm = abs(al[k]) < SIN_MOST and abs(ah[k]) < SIN_MOST
        least, most = (low[k], high[k]) if low[k] < high[k] else (high[k], low[k])
        low[k] = least - error if calm and not dip else -1.0 - SIN_ERROR
        high[k] = most + error if calm and not peak else 1.0 + SIN_ERROR


@njit(**INNER)
def _rising(operation: int, low: Floats, high: Floats, al: Floats, ah: Floats, exponent: float) -> None:
    """Move outward the values at both ends, given, of a root, exponential, logarithm, arc tangent or power."""
    error = EXP_ERROR if operation == EXP else 0.0 if operation == SQRT else LIBRARY_ERROR
    never_negative = operation == POW or SQRT <= operation <= EXP
    partial = operation != EXP and operation != ATAN
    falls = operation == POW and exponent < 0.0
    for k in range(low.shape[0]):
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


@njit(**INNER, inline="always")
def _aligned(bounds: Floats, r: int, own: int, mask: int, scratch: Floats) -> Floats:
    """Register r in the layout of `mask`: itself, or spread into scratch."""
    row = bounds[r]
    if own == mask:
        return row
    for k in range(_COUNT[mask]):
        scratch[k] = row[PLACE[own, mask, k]]
    return scratch


@njit(**OPTIONS, inline="always")
def enclose(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    lower: Floats,
    upper: Floats,
    low: Floats,
    high: Floats,
    scratch: Floats,
) -> None:
    """Bounds of registers 0 .. count-1 of the tape in rows start .. start+count-1; see `values.evaluate`.

    lower and upper (3, SPLIT) bound x, y, z along each axis of the mesh. low, high (>= count, SPLIT^3),
    scratch (4, SPLIT^3).
    """
    for q in range(count):
        row = code[start + q]
        operation, a, b, mask = row[0], row[1], row[2], row[3]
        least, most = low[q, : _COUNT[mask]], high[q, : _COUNT[mask]]
        if operation < CONST:
            copy(least, lower[operation])
            copy(most, upper[operation])
            continue
        if operation == CONST:
            fill(least, constants[a, 1])
            fill(most, constants[a, 2])
            continue
        terms, al, ah = (b if operation >= MIN else (2 if operation <= DIV else 1)), least, most
        for t in range(terms):
            r = arguments[a + t] if operation >= MIN else (a if t == 0 else b)
            own, free = code[start + r, 3], (2 if t else 0)
            bl = _aligned(low, r, own, mask, scratch[free])
            bh = _aligned(high, r, own, mask, scratch[free + 1])
            if t:
                _combine(operation, least, most, al, ah, bl, bh)
            al, ah = (least, most) if t else (bl, bh)
        if terms > 1:
            continue
        if ABS <= operation <= SQR:
            _even(least, most, al, ah, operation == SQR)
            continue
        exponent = constants[b if operation == POW else 0, 0]
        for end in range(2):  # one call for both: each is a copy to compile
            unary(operation, most if end else least, al if (end == 1) == (operation == NEG) else ah, exponent)
        if SIN <= operation <= COS:
            _wave(least, most, al, ah, 0.0 if operation == SIN else 0.5)
        elif NEG < operation < MIN:
            _rising(operation, least, most, al, ah, exponent)


@njit(**INNER, inline="always")
def _combine(operation: int, low: Floats, high: Floats, al: Floats, ah: Floats, bl: Floats, bh: Floats) -> None:
    """Store one operation on two operands."""
    if operation >= MIN:
        binary(operation, low, al, bl)
        binary(operation, high, ah, bh)
    elif operation <= SUB:
        _add(low, high, al, ah, bl, bh, operation == SUB)
    else:
        _multiply(low, high, al, ah, bl, bh, operation == DIV)
