"""Gradients of a tape at scattered points, by running it backwards."""

import math

from numba import njit

from implicit.kernels.elementary import INNER, OPTIONS, Floats, Indices, Rows, copy, fill, sine
from implicit.tape import ABS, ATAN, CONST, COS, DIV, EXP, LOG, MUL, NEG, POW, SIN, SQR, SQRT, SUB


@njit(**OPTIONS, inline="always")
def differentiate(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    points: int,
    registers: Floats,
    adjoints: Floats,
    gradients: Floats,
    scratch: Floats,
) -> None:
    """Find the gradients (3, points) of the tape whose `registers` hold its values at the points.

    One-sided where f has a kink: of equal operands of min and max the first counts, abs is differentiated as at a
    positive argument, sqrt at 0 has derivative 0. adjoints (>= count, >= points), scratch (3, >= points).
    """
    n = points
    for q in range(count - 1):
        if code[start + q, 0] != CONST:
            fill(adjoints[q, :n], 0.0)
    fill(adjoints[count - 1, :n], 1.0)
    for axis in range(3):
        fill(gradients[axis, :n], 0.0)
    for q in range(count - 1, -1, -1):
        row = code[start + q]
        operation, a, b = row[0], row[1], row[2]
        g = adjoints[q, :n]
        value = registers[q, :n]
        if operation < CONST:
            total = gradients[operation, :n]
            for k in range(n):
                total[k] += g[k]
        elif operation == CONST:
            continue
        elif operation <= DIV:
            for turn in range(2):
                own, other = (b, a) if turn else (a, b)
                if code[start + own, 0] != CONST:
                    _binary(operation, turn == 0, g, value, registers[other], registers[own], adjoints[own])
        elif operation <= POW:
            exponent, known = constants[b if operation == POW else 0, 0], value
            if SIN <= operation <= COS:
                # the derivative of one is the other, which the tape may have
                other = _find(code, start, count, COS + SIN - operation, a)
                known = registers[other, :n] if other >= 0 else scratch[2, :n]
                if other < 0:
                    sine(known, registers[a], 0.5 if operation == SIN else 0.0)
            _unary(operation, g, known, registers[a], adjoints[a], exponent, scratch[2])
        else:
            free = scratch[0, :n]
            copy(free, g)
            for t in range(b):
                branch = registers[arguments[a + t], :n]
                target = adjoints[arguments[a + t], :n]
                for k in range(n):
                    taken = branch[k] == value[k]
                    target[k] += free[k] if taken else 0.0
                    free[k] = 0.0 if taken else free[k]


@njit(**INNER)
def _find(code: Rows, start: int, count: int, operation: int, a: int) -> int:
    """The register with this operation on register a, or -1."""
    for q in range(count):
        if code[start + q, 0] == operation and code[start + q, 1] == a:
            return q
    return -1


@njit(**INNER)
def _binary(operation: int, first: bool, g: Floats, value: Floats, other: Floats, own: Floats, to: Floats) -> None:
    """What an operation on two arrays gives to one of them, `own`, the first or the second."""
    n = g.shape[0]
    if operation == MUL:
        for k in range(n):
            to[k] += g[k] * other[k]
    elif operation == DIV and first:
        for k in range(n):
            to[k] += g[k] / other[k] if g[k] != 0.0 else 0.0
    elif operation == DIV:
        for k in range(n):
            to[k] -= g[k] / own[k] * value[k] if g[k] != 0.0 else 0.0
    else:
        sign = -1.0 if operation == SUB and not first else 1.0
        for k in range(n):
            to[k] += sign * g[k]


@njit(**INNER)
def _unary(operation: int, g: Floats, value: Floats, a: Floats, to_a: Floats, exponent: float, scratch: Floats) -> None:
    """What an operation on one array gives to it; `value` is its result, or the cosine for a sine and the reverse."""
    n = g.shape[0]
    factor, sign = scratch[:n], -1.0 if operation == COS else 1.0
    if operation == EXP or SIN <= operation <= COS:
        factor = value
    elif operation == NEG:
        fill(factor, -1.0)
    elif operation == ABS:
        for k in range(n):
            factor[k] = 1.0 if a[k] >= 0.0 else -1.0
    elif operation == SQR:
        for k in range(n):
            factor[k] = 2.0 * a[k]
    elif operation == SQRT:
        for k in range(n):
            factor[k] = 0.5 / value[k] if value[k] != 0.0 else 0.0
    elif operation == LOG:
        for k in range(n):
            factor[k] = 1.0 / a[k]
    elif operation == ATAN:
        for k in range(n):
            factor[k] = 1.0 / (1.0 + a[k] * a[k])
    else:
        for k in range(n):
            factor[k] = exponent * math.pow(a[k], exponent - 1.0)
    for k in range(n):
        to_a[k] += g[k] * (sign * factor[k]) if g[k] != 0.0 else 0.0
