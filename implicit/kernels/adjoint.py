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
        operation = code[start + q, 0]
        a = code[start + q, 1]
        b = code[start + q, 2]
        g = adjoints[q, :n]
        value = registers[q, :n]
        if operation < CONST:
            total = gradients[operation, :n]
            for k in range(n):
                total[k] += g[k]
        elif operation == CONST:
            continue
        elif operation <= DIV and (code[start + a, 0] == CONST) != (code[start + b, 0] == CONST):
            first = code[start + a, 0] == CONST
            number = constants[code[start + (a if first else b), 1], 0]
            other = b if first else a
            _with_number(operation, g, value, registers[other], adjoints[other], number, first)
        elif operation <= DIV:
            _binary(operation, g, value, registers[a], registers[b], adjoints[a], adjoints[b])
        elif operation <= POW:
            exponent = constants[b, 0] if operation == POW else 0.0
            other = -1
            if SIN <= operation <= COS:  # the sine may be known where the cosine is wanted
                other = _find(code, start, count, COS + SIN - operation, a)
            known = registers[other if other >= 0 else q, :n]
            _unary(operation, g, known, other >= 0, registers[a], adjoints[a], exponent, scratch[2])
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
def _with_number(operation: int, g: Floats, value: Floats, a: Floats, to_a: Floats, number: float, first: bool) -> None:
    """An operation on an array and a number, the number first or second."""
    n = g.shape[0]
    if operation == DIV and first:
        for k in range(n):
            to_a[k] -= g[k] / a[k] * value[k] if g[k] != 0.0 else 0.0
        return
    factor = 1.0
    if operation == MUL:
        factor = number
    elif operation == SUB and first:
        factor = -1.0
    if operation == DIV:
        for k in range(n):
            to_a[k] += g[k] / number
    else:
        for k in range(n):
            to_a[k] += g[k] * factor


@njit(**INNER)
def _find(code: Rows, start: int, count: int, operation: int, a: int) -> int:
    """The register with this operation on register a, or -1."""
    for q in range(count):
        if code[start + q, 0] == operation and code[start + q, 1] == a:
            return q
    return -1


@njit(**INNER)
def _binary(operation: int, g: Floats, value: Floats, a: Floats, b: Floats, to_a: Floats, to_b: Floats) -> None:
    n = g.shape[0]
    if operation == MUL:
        for k in range(n):
            to_a[k] += g[k] * b[k]
        for k in range(n):
            to_b[k] += g[k] * a[k]
    elif operation == DIV:
        for k in range(n):
            to_a[k] += g[k] / b[k] if g[k] != 0.0 else 0.0
        for k in range(n):
            to_b[k] -= g[k] / b[k] * value[k] if g[k] != 0.0 else 0.0
    else:
        sign = -1.0 if operation == SUB else 1.0
        for k in range(n):
            to_a[k] += g[k]
        for k in range(n):
            to_b[k] += sign * g[k]


@njit(**INNER)
def _unary(
    operation: int,
    g: Floats,
    value: Floats,
    turned: bool,
    a: Floats,
    to_a: Floats,
    exponent: float,
    scratch: Floats,
) -> None:
    """An operation on one array; `value` is its result, or, where `turned`, the cosine for a sine and the reverse."""
    n = g.shape[0]
    factor, sign = (value if turned or operation == EXP else scratch)[:n], -1.0 if operation == COS else 1.0
    if turned or operation == EXP:
        pass
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
    elif SIN <= operation <= COS:
        sine(factor, a, 0.5 if operation == SIN else 0.0)
    elif operation == ATAN:
        for k in range(n):
            factor[k] = 1.0 / (1.0 + a[k] * a[k])
    else:
        for k in range(n):
            factor[k] = exponent * math.pow(a[k], exponent - 1.0)
    for k in range(n):
        to_a[k] += g[k] * (sign * factor[k]) if g[k] != 0.0 else 0.0
