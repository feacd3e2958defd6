"""Signs of a tape at points, where a bound on all rounding errors proves them.

The bound is one number for a block of points: largest values of the registers and their largest errors are carried
along beside the values. A block of one point gives the sharpest bound.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import INNER, MAKING, OPTIONS, Floats, Indices, Rows
from implicit.kernels.values import evaluate
from implicit.tape import ABS, ADD, ATAN, CONST, COS, DIV, EXP, LOG, MIN, MUL, NEG, SIN, SQR, SQRT, SUB

UNIT = 1.2e-16  # above 2^-53, so that the bounds may be computed with rounding themselves
TINY = 1e-323  # above the error of an underflow
LIBRARY = 1e-14  # sin, cos, exp, log, atan, pow: far above the errors measured in elementary.py and of C libraries
UNSURE = 2


@njit(**{**OPTIONS, **MAKING})
def tape_signs(
    code: Rows,
    arguments: Indices,
    constants: Floats,
    points: Floats,
    radii: Floats,
    block: int,
    registers: Floats,
    out: NDArray[np.int8],
    known: Floats,
) -> None:
    """Store -1 or 1 where the sign of the result is certain at all points within a radius of a point, else UNSURE.

    points (n, 3); distances are the largest difference of a coordinate; radii (n,), or (1,) for one radius for all.
    registers (rows of the tape + 6, >= block) is room to work in. known (2, n) takes values and bounds, unless empty.
    """
    size = code.shape[0]
    first, moved = np.int64(0), np.int64(15)
    scratch, axes = registers[size : size + 3], registers[size + 3 : size + 6]
    largest, errors = np.empty(size), np.empty(size)
    for base in range(0, points.shape[0], block):
        n = min(block, points.shape[0] - base)
        radius = radii[0]
        for k in range(n):
            for axis in range(3):
                axes[axis, k] = points[base + k, axis]
            if radii.shape[0] > 1:
                radius = radii[base + k] if k == 0 else max(radius, radii[base + k])
        evaluate(code, first, size, arguments, constants, axes, n, moved, registers, scratch)
        bound_errors(code, arguments, constants, n, radius, registers, largest, errors)
        bound, values = errors[size - 1], registers[size - 1]
        for k in range(n):
            v = values[k]
            out[base + k] = 1 if v > bound else (-1 if v < -bound else UNSURE)
        if known.shape[1] > 0:
            for k in range(n):
                known[0, base + k], known[1, base + k] = values[k], bound


@njit(**{**INNER, **MAKING})
def _size(row: Floats) -> float:
    """The largest absolute value. Floats without their sign are in the order of their bits, and a loop over whole
    numbers vectorises.
    """
    bits, most = row.view(np.int64), np.zeros(1, np.int64)
    worst = np.int64(0)
    for k in range(row.shape[0]):
        worst = max(worst, bits[k] & 0x7FFFFFFFFFFFFFFF)
    most[0] = worst
    return most.view(np.float64)[0]


@njit(**OPTIONS)
def bound_errors(
    code: Rows,
    arguments: Indices,
    constants: Floats,
    n: int,
    radius: float,
    registers: Floats,
    largest: Floats,
    errors: Floats,
) -> None:
    """Bounds for the absolute values of all registers, and for their distance from the exact values.

    The exact values are meant at any point whose coordinates differ by at most the radius.
    """
    for q in range(code.shape[0]):
        operation, a, b = code[q, 0], code[q, 1], code[q, 2]
        row = registers[q, :n]
        if operation < CONST:
            largest[q], errors[q] = _size(row), radius
            continue
        if operation == CONST:
            value = constants[a, 0]
            largest[q], errors[q] = abs(value), max(constants[a, 2] - value, value - constants[a, 1])
            continue
        if operation >= MIN:
            size = error = 0.0
            for t in range(b):
                size = max(size, largest[arguments[a + t]])
                error = max(error, errors[arguments[a + t]])
            largest[q], errors[q] = size, error
            continue
        divisor = b if operation == DIV else a
        size, error, rounding = _rule(
            operation, largest, errors, a, b, registers, n, constants, code[divisor, 0] == CONST
        )
        size *= 1 + 4 * UNIT
        largest[q] = size
        errors[q] = (error + rounding * size) * (1 + 4 * UNIT) + TINY


@njit(**OPTIONS)
def _rule(
    operation: int,
    largest: Floats,
    errors: Floats,
    a: int,
    b: int,
    registers: Floats,
    n: int,
    constants: Floats,
    by_number: bool,
) -> tuple[float, float, float]:
    """Largest value, error carried over from the operands, and relative rounding error of one operation.

    by_number: whether the operand that must not vanish is a number; registers of numbers may not be filled.
    """
    size, error = largest[a], errors[a]
    if operation in (ADD, SUB):
        return size + largest[b], error + errors[b], UNIT
    if operation == MUL:
        return size * largest[b], size * errors[b] + largest[b] * error + error * errors[b], UNIT
    if operation == SQR:
        return size * size, 2 * size * error + error * error, UNIT
    if operation in (NEG, ABS):
        return size, error, 0.0
    if operation in (SIN, COS):
        return 1.0, min(error, 2.0), LIBRARY * (1 + size)
    if operation == ATAN:
        return min(size, 1.6), error, LIBRARY
    divisor = b if operation == DIV else a
    least = largest[divisor] if by_number and operation == DIV else np.inf
    for k in range(0 if by_number and operation == DIV else n):
        value = registers[divisor, k]
        least = min(least, abs(value) if operation == DIV else value)
    if operation == EXP:
        largest_value = math.exp(size) if size < 709 else np.inf
        return largest_value, largest_value * math.expm1(min(error, 700.0)), LIBRARY
    gap = least - errors[divisor]
    if operation == DIV:
        if not gap > 0:
            return np.inf, np.inf, UNIT
        top = size / least
        return top, (error + top * errors[b]) / gap, UNIT
    if operation == SQRT:
        root = math.sqrt(size)
        return root, min(math.sqrt(error), error / math.sqrt(gap)) if gap > 0 else math.sqrt(error), UNIT
    if not gap > 0:
        return np.inf, np.inf, UNIT
    spread = max(abs(math.log(least)), abs(math.log(size)))
    if operation == LOG:
        return spread, error / gap, LIBRARY
    exponent = constants[b, 0]
    shift = abs(exponent) * error / gap + (constants[b, 2] - constants[b, 1]) * (spread + 1)
    top = max(math.pow(least, exponent), math.pow(size, exponent))
    return top, top * math.expm1(min(shift, 700.0)), LIBRARY * (1 + abs(exponent) * spread)
