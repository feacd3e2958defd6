"""A tape evaluated on a brick of samples, or at scattered points.

Registers lie in rows of one array. A register that depends on some of x, y, z only holds S values for each of them (x
slowest): in a brick with S = 8 samples per axis a register in x has 8 values, one in x and z 64, a full one 512. At
scattered points every register is full and holds one value per point.
"""

import numpy as np
from numba import njit

from implicit.kernels.elementary import (
    INNER,
    OPTIONS,
    Floats,
    Indices,
    Rows,
    binary,
    copy,
    fill,
    unary,
)
from implicit.tape import CONST, DIV, MIN, POW

WIDTH = 528  # floats in a row of registers: 512 samples, and no two rows a multiple of 4096 bytes apart
SIDE = 8  # samples along a brick
_U = np.uint64
EVERYTHING = 15  # no register is known yet
_COUNT = SIDE ** np.array([mask.bit_count() for mask in range(8)])  # values of a register of each mask


@njit(**INNER, inline="always")
def _copy_row(out: Floats, place: int, a: Floats, source: int) -> None:
    """Copy SIDE values; all are read before one is stored, so that it takes one instruction each, not a call."""
    v0, v1, v2, v3 = a[source], a[source + _U(1)], a[source + _U(2)], a[source + _U(3)]
    v4, v5, v6, v7 = a[source + _U(4)], a[source + _U(5)], a[source + _U(6)], a[source + _U(7)]
    out[place], out[place + _U(1)], out[place + _U(2)], out[place + _U(3)] = v0, v1, v2, v3
    out[place + _U(4)], out[place + _U(5)], out[place + _U(6)], out[place + _U(7)] = v4, v5, v6, v7


@njit(**INNER, inline="always")
def _fill_row(out: Floats, place: int, value: float) -> None:
    """Store one value SIDE times."""
    out[place] = out[place + _U(1)] = out[place + _U(2)] = out[place + _U(3)] = value
    out[place + _U(4)] = out[place + _U(5)] = out[place + _U(6)] = out[place + _U(7)] = value


@njit(**INNER)
def spread(out: Floats, a: Floats, own: int, mask: int) -> None:
    """Store the register `a` of mask `own`, repeated to the layout of `mask`, which contains `own`."""
    inner = mask & -mask
    middle = (mask ^ inner) & -(mask ^ inner)
    outer = mask ^ inner ^ middle
    size = SIDE if own & inner else 1
    step_middle = size if own & middle else 0
    step_outer = (size * SIDE if own & middle else size) if own & outer else 0
    for row in range(_COUNT[mask] // SIDE):  # one loop for both axes: LLVM makes copies of each for what is constant
        place, source = _U(SIDE * row), _U((row >> 3) * step_outer + (row & 7) * step_middle)
        if own & inner:
            _copy_row(out, place, a, source)
        else:
            _fill_row(out, place, a[source])


@njit(**INNER, inline="always")
def _aligned(registers: Floats, r: int, own: int, mask: int, scratch: Floats) -> Floats:
    """Register r in the layout of `mask`: itself, or spread into scratch."""
    if own == mask:
        return registers[r]
    spread(scratch, registers[r], own, mask)
    return scratch


@njit(**OPTIONS, inline="always")
def evaluate(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    axes: Floats,
    points: int,
    moved: int,
    registers: Floats,
    scratch: Floats,
) -> None:
    """Registers 0 .. count-1 of the tape in rows start .. start+count-1 of `code`; the result is the last.

    Registers of numbers are filled at scattered points only where an operation needs them.

    points 0: a brick, axes (3, SIDE) hold its lattice coordinates. points n > 0: n scattered points, axes (3, >= n)
    hold their coordinates. registers (>= count, >= values), scratch (2, >= values).
    moved: EVERYTHING, or the axes (in the bits of a mask) along which a brick differs from the one that the registers
    were found for; those that depend on no such axis are kept.
    """
    for q in range(count):
        row = code[start + q]
        operation, a, b, mask = row[0], row[1], row[2], (7 if points else row[3])
        if not (moved == EVERYTHING or mask & moved):
            continue
        out = registers[q, : points if points else _COUNT[mask]]
        if operation < CONST:
            copy(out, axes[operation])
            continue
        if operation == CONST:
            if not points or q == count - 1:
                fill(out, constants[a, 0])
            continue
        # one operand, two, or the several of MIN and MAX one after the other
        terms, left = (b if operation >= MIN else (2 if operation <= DIV else 1)), out
        for t in range(terms):
            r = arguments[a + t] if operation >= MIN else (a if t == 0 else b)
            if points and code[start + r, 0] == CONST:
                fill(registers[r, :points], constants[code[start + r, 1], 0])
            right = _aligned(registers, r, 7 if points else code[start + r, 3], mask, scratch[1 if t else 0])
            if t:
                binary(operation, out, left, right)
            left = out if t else right
        if terms == 1:
            unary(operation, out, left, constants[b if operation == POW else 0, 0])
