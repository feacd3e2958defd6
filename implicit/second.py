"""Second derivatives of a tape at scattered points, carried forward with numpy as (value, gradient, Hessian)."""

import numpy as np
from numpy.typing import NDArray

from implicit.tape import (
    ABS,
    ADD,
    ATAN,
    CONST,
    COS,
    DIV,
    EXP,
    LOG,
    MIN,
    MUL,
    NEG,
    POW,
    SIN,
    SQR,
    SQRT,
    SUB,
    Tape,
)

Floats = NDArray[np.float64]
Jet = tuple[Floats, Floats, Floats]  # values (n,), gradients (n, 3), Hessians (n, 3, 3)


def hessians_of(tape: Tape, points: Floats) -> Floats:
    """The Hessians (n, 3, 3); at kinks those of the branch that the gradient takes."""
    parts = [_jet(tape, block)[2] for block in np.array_split(points, max(1, len(points) // 4096))]
    return np.concatenate(parts)


def _jet(tape: Tape, points: Floats) -> Jet:
    jets: list[Jet] = []
    last_use = _last_use(tape)
    n = len(points)
    with np.errstate(all="ignore"):
        for q, (operation, a, b, _) in enumerate(tape.code.tolist()):
            if operation < CONST:
                slope = np.zeros((n, 3))
                slope[:, operation] = 1
                jet = points[:, operation].copy(), slope, np.zeros((n, 3, 3))
            elif operation == CONST:
                jet = np.full(n, tape.constants[a, 0]), np.zeros((n, 3)), np.zeros((n, 3, 3))
            elif operation >= MIN:
                jet = _branch([jets[r] for r in tape.arguments[a : a + b]], operation == MIN)
            elif operation <= DIV:
                jet = _binary(operation, jets[a], jets[b])
            else:
                jet = _unary(jets[a], *_function(operation, jets[a][0], tape.constants[b, 0]))
            jets.append(jet)
            for r in last_use.get(q, ()):
                jets[r] = jet  # frees the memory of a register that is not read again
    return jets[-1]


def _last_use(tape: Tape) -> dict[int, list[int]]:
    last: dict[int, int] = {}
    for q, (operation, a, b, _) in enumerate(tape.code.tolist()):
        read = tape.arguments[a : a + b].tolist() if operation >= MIN else [a, b] if operation <= DIV else [a]
        if operation > CONST:
            last.update(dict.fromkeys(read, q))
    freed: dict[int, list[int]] = {}
    for register, q in last.items():
        freed.setdefault(q, []).append(register)
    return freed


def _outer(a: Floats, b: Floats) -> Floats:
    product = a[:, :, None] * b[:, None, :]
    return np.asarray(product + product.swapaxes(1, 2))


def _binary(operation: int, left: Jet, right: Jet) -> Jet:
    (a, da, dda), (b, db, ddb) = left, right
    if operation == ADD:
        return a + b, da + db, dda + ddb
    if operation == SUB:
        return a - b, da - db, dda - ddb
    if operation == MUL:
        return (
            a * b,
            da * b[:, None] + a[:, None] * db,
            dda * b[:, None, None] + a[:, None, None] * ddb + _outer(da, db),
        )
    value = a / b
    slope = (da - value[:, None] * db) / b[:, None]
    return value, slope, (dda - value[:, None, None] * ddb - _outer(slope, db)) / b[:, None, None]


def _unary(jet: Jet, value: Floats, first: Floats, second: Floats) -> Jet:
    _, slope, bend = jet
    bend = first[:, None, None] * bend + second[:, None, None] * _outer(slope, slope) / 2
    return value, first[:, None] * slope, bend


def _function(operation: int, a: Floats, exponent: float) -> tuple[Floats, Floats, Floats]:
    """The value, first and second derivative of a function of one variable."""
    zero, one = np.zeros_like(a), np.ones_like(a)
    if operation == NEG:
        return -a, -one, zero
    if operation == ABS:
        return np.abs(a), np.where(a >= 0, 1.0, -1.0), zero
    if operation == SQR:
        return a * a, 2 * a, 2 * one
    if operation == SQRT:
        root = np.sqrt(a)
        return root, np.where(root != 0, 0.5 / root, 0.0), np.where(root != 0, -0.25 / (a * root), 0.0)
    if operation == EXP:
        grown = np.exp(a)
        return grown, grown, grown
    if operation == LOG:
        return np.log(a), 1 / a, -1 / (a * a)
    if operation == SIN:
        return np.sin(a), np.cos(a), -np.sin(a)
    if operation == COS:
        return np.cos(a), -np.sin(a), -np.cos(a)
    if operation == ATAN:
        return np.arctan(a), 1 / (1 + a * a), -2 * a / (1 + a * a) ** 2
    assert operation == POW
    p = exponent
    return np.power(a, p), p * np.power(a, p - 1), p * (p - 1) * np.power(a, p - 2)


def _branch(jets: list[Jet], least: bool) -> Jet:
    value, slope, bend = jets[0]
    for other, other_slope, other_bend in jets[1:]:
        better = other < value if least else other > value
        value = np.where(better, other, value)
        slope = np.where(better[:, None], other_slope, slope)
        bend = np.where(better[:, None, None], other_bend, bend)
    return value, slope, bend
