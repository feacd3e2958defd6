"""Guaranteed ranges of tapes on boxes, by interval arithmetic on arrays: it needs no kernel.

The rules are those of `kernels.ranges`, which makes shorter tapes of the bounds of all registers besides. Every rounded
bound moves outward, so an interval holds f and also every value that the tape computes in the closed box. Where an
operation is undefined somewhere the result is unbounded.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.kernels.elementary import EXP_LEAST, EXP_MOST, SIN_MOST
from implicit.kernels.ranges import EXP_ERROR, LIBRARY_ERROR, SIN_ERROR, TINY, ULP
from implicit.tape import ABS, ATAN, CONST, COS, DIV, EXP, LOG, MIN, NEG, POW, SIN, SQR, SQRT, SUB, Tape

Floats: TypeAlias = NDArray[np.float64]
Range: TypeAlias = tuple[Floats, Floats]

_CHUNK = 4096
"""Boxes at a time: their registers stay in the cache."""

_FUNCTIONS = {SQRT: np.sqrt, EXP: np.exp, LOG: np.log, ATAN: np.arctan, SIN: np.sin, COS: np.cos}


def tape_ranges(tape: Tape, boxes: Floats) -> Floats:
    """Bounds (K, 2) on closed boxes (K, 2, 3), rounded outward, infinite where unknown.

    They hold for f and for every value that the tape computes in the box.
    """
    result = np.empty((len(boxes), 2))
    for start in range(0, len(boxes), _CHUNK):
        corners = np.ascontiguousarray(boxes[start : start + _CHUNK].transpose(1, 2, 0))
        result[start : start + _CHUNK, 0], result[start : start + _CHUNK, 1] = enclose_arrays(
            tape, corners[0], corners[1]
        )
    return result


def enclose_arrays(tape: Tape, lower: Sequence[Floats], upper: Sequence[Floats]) -> Range:
    """Bounds of the result where x, y, z lie between lower and upper, three arrays each whose shapes broadcast."""
    known: list[Range] = []
    with np.errstate(all="ignore"):
        for operation, a, b, _ in tape.code.tolist():
            if operation < CONST:
                known.append((lower[operation], upper[operation]))
            elif operation == CONST:
                known.append((tape.constants[a, 1:2], tape.constants[a, 2:3]))
            elif operation <= SUB:
                known.append(_add(known[a], known[b], operation == SUB))
            elif operation <= DIV:
                known.append(_multiply(known[a], known[b], operation == DIV))
            elif operation < MIN:
                known.append(_unary(operation, known[a], float(tape.constants[b, 0])))
            else:
                extreme = np.minimum if operation == MIN else np.maximum
                lows, highs = zip(*(known[r] for r in tape.arguments[a : a + b]), strict=True)
                known.append((_fold(extreme, lows), _fold(extreme, highs)))
    return known[-1]


def _fold(extreme: np.ufunc, parts: tuple[Floats, ...]) -> Floats:
    """The least or the largest of several arrays."""
    result = parts[0]
    for part in parts[1:]:
        result = extreme(result, part)
    return result


def _outward(low: Floats, high: Floats) -> Range:
    """Both bounds moved outward, what is not a number to infinity; `low` and `high` are used up."""
    for bound, step, end, clean in ((low, np.subtract, -np.inf, np.fmax), (high, np.add, np.inf, np.fmin)):
        error = np.abs(bound)
        error *= ULP
        error += TINY
        step(bound, error, out=bound)
        clean(bound, end, out=bound)
    return low, high


def _add(first: Range, second: Range, minus: bool) -> Range:
    """The range of a + b, or a - b. Where both parts are of one sign the result is of that sign, without rounding."""
    (al, ah), (bl, bh) = first, second
    low, high = (al - bh, ah - bl) if minus else (al + bl, ah + bh)
    at_0 = [bound == 0.0 for bound in (low, high)]
    for bound, here in zip(_outward(low, high), at_0, strict=True):
        if here.any():
            bound[here] = 0.0
    return low, high


def _multiply(first: Range, second: Range, over: bool) -> Range:
    """The range of a b, or a / b: the least and the largest of the four corners, each rounded once."""
    (al, ah), (bl, bh) = first, second
    apply = np.divide if over else np.multiply
    p, q, r, s = apply(al, bl), apply(al, bh), apply(ah, bl), apply(ah, bh)
    least, most = np.minimum(p, q), np.maximum(p, q, out=q)
    np.minimum(least, np.minimum(r, s, out=p), out=least)
    np.maximum(most, np.maximum(r, s, out=s), out=most)
    at_0 = least == 0.0
    low, high = _outward(least, most)
    if at_0.any():  # 0 is no result of rounding where both are of one sign
        low[at_0 & (((al >= 0.0) & (bl >= 0.0)) | ((ah <= 0.0) & (bh <= 0.0)))] = 0.0
    if over:
        wild = (bl <= 0.0) & (bh >= 0.0)
        low, high = np.where(wild, -np.inf, low), np.where(wild, np.inf, high)
    return low, high


def _unary(operation: int, own: Range, exponent: float) -> Range:
    """One operation on one range."""
    al, ah = own
    if operation == NEG:
        return -ah, -al
    if ABS <= operation <= SQR:
        return _even(own, operation == SQR)
    ends = [np.power(v, exponent) if operation == POW else _FUNCTIONS[operation](v) for v in own]
    if SIN <= operation <= COS:
        return _wave(own, (ends[0], ends[1]), 0.0 if operation == SIN else 0.5)
    return _rising(operation, own, (ends[0], ends[1]), exponent)


def _even(own: Range, square: bool) -> Range:
    """The range of |a|, or a^2."""
    least = np.maximum(np.maximum(own[0], -own[1]), 0.0)
    most = np.maximum(np.abs(own[0]), np.abs(own[1]))
    if not square:
        return least, most
    low, high = _outward(least * least, most * most)
    return np.maximum(low, 0.0, out=low), high


def _wave(own: Range, ends: Range, shift: float) -> Range:
    """The range of sin(a + shift pi): the values at both ends, and 1 or -1 where an extremum lies between."""
    al, ah = own
    a, b = al * 0.3183098861837907, ah * 0.3183098861837907
    error = SIN_ERROR * (1.0 + np.abs(a) + np.abs(b))
    a, b = (a - error + shift - 0.5) * 0.5, (b + error + shift - 0.5) * 0.5  # maxima at whole numbers, minima halfway
    peak, dip = np.floor(b) >= np.ceil(a), np.floor(b - 0.5) >= np.ceil(a - 0.5)
    wild = ~((np.abs(al) < SIN_MOST) & (np.abs(ah) < SIN_MOST))
    low = np.where(wild | dip, -1.0 - SIN_ERROR, np.minimum(*ends) - error)
    return low, np.where(wild | peak, 1.0 + SIN_ERROR, np.maximum(*ends) + error)


def _rising(operation: int, own: Range, ends: Range, exponent: float) -> Range:
    """A root, exponential, logarithm, arc tangent or power: the values at both ends, moved outward."""
    al, ah = own
    falls = operation == POW and exponent < 0.0
    error = EXP_ERROR if operation == EXP else 0.0 if operation == SQRT else 2.0 * LIBRARY_ERROR  # numpy's besides
    a, b = ends[::-1] if falls else ends
    a, b = _outward(a - np.abs(a) * error, b + np.abs(b) * error)
    if operation == POW or SQRT <= operation <= EXP:
        a = np.maximum(a, 0.0)
    if operation == EXP:
        a = np.where((al > EXP_MOST - 1.0) | (al < EXP_LEAST + 1.0), 0.0, a)
        b = np.where(ah > EXP_MOST - 1.0, np.inf, np.where(ah < EXP_LEAST + 1.0, 1e-300, b))
    if operation in (EXP, ATAN):
        return a, b
    wild = ~((al > 0.0) | ((al == 0.0) & (operation != LOG and not falls)))
    return np.where(wild, -np.inf, a), np.where(wild, np.inf, b)
