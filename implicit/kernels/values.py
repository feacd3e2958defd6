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
    binary_number,
    copy,
    fill,
    power,
    unary,
)
from implicit.tape import CONST, DIV, MIN, POW

WIDTH = 528  # floats in a row of registers: 512 samples, and no two rows a multiple of 4096 bytes apart
SIDE = 8  # samples along a brick
_U = np.uint64
EVERYTHING = 15  # no register is known yet


@njit(**INNER)
def count_of(mask: int, side: int) -> int:
    """The number of values of a register with this mask, on a brick with `side` samples along each axis."""
    n = side if mask & 1 else 1
    n = n * side if mask & 2 else n
    return n * side if mask & 4 else n


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


@njit(**OPTIONS)
def spread(out: Floats, a: Floats, own: int, mask: int, side: int) -> None:
    """Store the register `a` of mask `own`, repeated to the layout of `mask`, which contains `own`."""
    inner = mask & -mask
    middle = (mask ^ inner) & -(mask ^ inner)
    outer = mask ^ inner ^ middle
    size = side if own & inner else 1
    step_middle = size if own & middle else 0
    size = size * side if own & middle else size
    step_outer = size if own & outer else 0
    place = np.uint64(0)
    for i in range(side if outer else 1):
        for j in range(side if middle else 1):
            source = np.uint64(i * step_outer + j * step_middle)
            if side != SIDE:
                for k in range(side):
                    out[place + np.uint64(k)] = a[source + np.uint64(k if own & inner else 0)]
            elif own & inner:
                _copy_row(out, place, a, source)
            else:
                _fill_row(out, place, a[source])
            place += np.uint64(side)


@njit(**INNER)
def aligned(registers: Floats, r: int, own: int, mask: int, side: int, scratch: Floats) -> Floats:
    """Register r in the layout of `mask`: itself, or spread into scratch."""
    if own == mask:
        return registers[r]
    spread(scratch, registers[r], own, mask, side)
    return scratch


@njit(**INNER)
def _fill_number(code: Rows, start: int, r: int, constants: Floats, points: int, registers: Floats) -> None:
    """Fill register r if it is a number and there are scattered points: on a brick it has one value already."""
    if points and code[start + r, 0] == CONST:
        fill(registers[r, :points], constants[code[start + r, 1], 0])


@njit(**OPTIONS)
def evaluate(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    axes: Floats,
    points: int,
    side: int,
    moved: int,
    registers: Floats,
    scratch: Floats,
) -> None:
    """Registers 0 .. count-1 of the tape in rows start .. start+count-1 of `code`; the result is the last.

    Registers of numbers are filled only where an operation needs an array.

    points 0: a brick, axes (3, >= side) hold its lattice coordinates. points n > 0: n scattered points, axes (3, >= n)
    hold their coordinates. registers (>= count, >= values), scratch (2, >= values).
    moved: EVERYTHING, or the axes (in the bits of a mask) along which a brick differs from the one that the registers
    were found for; those that depend on no such axis are kept.
    """
    for q in range(count):
        operation = code[start + q, 0]
        a = code[start + q, 1]
        b = code[start + q, 2]
        mask = 7 if points else code[start + q, 3]
        if not (moved == EVERYTHING or mask & moved):
            continue
        out = registers[q, : points if points else count_of(mask, side)]
        if operation < CONST:
            copy(out, axes[operation])
        elif operation == CONST:
            if not points or q == count - 1:
                fill(out, constants[a, 0])
        elif operation == POW:
            _fill_number(code, start, a, constants, points, registers)
            power(out, registers[a], constants[b, 0])
        elif operation > DIV and operation < MIN:
            _fill_number(code, start, a, constants, points, registers)
            unary(operation, out, registers[a])
        elif operation <= DIV and (code[start + a, 0] == CONST) != (code[start + b, 0] == CONST):
            first = code[start + a, 0] == CONST
            number = constants[code[start + (a if first else b), 1], 0]
            binary_number(operation, out, registers[b if first else a], number, first)
        else:  # two operands, or the several of MIN and MAX one after the other
            chain = operation >= MIN
            for t in range(b if chain else 2):
                _fill_number(
                    code, start, arguments[a + t] if chain else (a if t == 0 else b), constants, points, registers
                )
            first = arguments[a] if chain else a
            left = aligned(registers, first, 7 if points else code[start + first, 3], mask, side, scratch[0])
            if chain and b == 1:
                copy(out, left)
            for t in range(1, b if chain else 2):
                other = arguments[a + t] if chain else b
                right = aligned(registers, other, 7 if points else code[start + other, 3], mask, side, scratch[1])
                binary(operation, out, left, right)
                left = out
