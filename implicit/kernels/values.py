"""A tape evaluated on a brick of samples, or at scattered points.

Registers lie in rows of one array. A register that depends on some of x, y, z only holds S values for each of them (x
slowest): in a brick with S = 8 samples per axis a register in x has 8 values, one in x and z 64, a full one 512. At
scattered points every register is full and holds one value per point.
"""

from numba import njit

from implicit.kernels.elementary import OPTIONS, Floats, Indices, Rows, binary, copy, fill, power, unary
from implicit.tape import CONST, DIV, MIN, POW

WIDTH = 528  # floats in a row of registers: 512 samples, and no two rows a multiple of 4096 bytes apart
SIDE = 8  # samples along a brick


@njit(**OPTIONS)
def count_of(mask: int, side: int) -> int:
    """The number of values of a register with this mask, on a brick with `side` samples along each axis."""
    n = 1
    for bit in range(3):
        if (mask >> bit) & 1:
            n *= side
    return n


@njit(**OPTIONS)
def spread(out: Floats, a: Floats, own: int, mask: int, side: int) -> None:
    """Store the register `a` of mask `own`, repeated to the layout of `mask`, which contains `own`."""
    full_x = side if mask & 4 else 1
    full_y = side if mask & 2 else 1
    full_z = side if mask & 1 else 1
    step_z = own & 1
    step_y = (side if own & 1 else 1) if own & 2 else 0
    step_x = (side if own & 1 else 1) * (side if own & 2 else 1) if own & 4 else 0
    place = 0
    for i in range(full_x):
        for j in range(full_y):
            start = i * step_x + j * step_y
            row = out[place : place + full_z]
            if step_z == 1:
                source = a[start : start + full_z]
                for k in range(full_z):
                    row[k] = source[k]
            else:
                value = a[start]
                for k in range(full_z):
                    row[k] = value
            place += full_z


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
    registers: Floats,
    scratch: Floats,
) -> None:
    """Registers 0 .. count-1 of the tape in rows start .. start+count-1 of `code`; the result is the last.

    points 0: a brick, axes (3, >= side) hold its lattice coordinates. points n > 0: n scattered points, axes (3, >= n)
    hold their coordinates. registers (>= count, >= values), scratch (3, >= values).
    """
    for q in range(count):
        operation = code[start + q, 0]
        a = code[start + q, 1]
        b = code[start + q, 2]
        mask = 7 if points else code[start + q, 3]
        n = points if points else count_of(mask, side)
        out = registers[q, :n]
        if operation < CONST:
            copy(out, axes[operation])
        elif operation == CONST:
            fill(out, constants[a, 0])
        elif operation >= MIN:
            first = arguments[a]
            operand(out, registers[first], code[start + first, 3], mask, points, side)
            for t in range(1, b):
                other = arguments[a + t]
                values = registers[other]
                if not points and code[start + other, 3] != mask:
                    spread(scratch[1], registers[other], code[start + other, 3], mask, side)
                    values = scratch[1]
                binary(operation, out, out, values)
        elif operation <= DIV:
            left, right = registers[a], registers[b]
            if not points and code[start + a, 3] != mask:
                spread(scratch[0], registers[a], code[start + a, 3], mask, side)
                left = scratch[0]
            if not points and code[start + b, 3] != mask:
                spread(scratch[1], registers[b], code[start + b, 3], mask, side)
                right = scratch[1]
            binary(operation, out, left, right)
        elif operation == POW:
            power(out, registers[a], constants[b, 0])
        else:
            unary(operation, out, registers[a], scratch[2])


@njit(**OPTIONS)
def operand(out: Floats, a: Floats, own: int, mask: int, points: int, side: int) -> None:
    """Copy a register into the layout of `mask`."""
    if points or own == mask:
        copy(out, a)
    else:
        spread(out, a, own, mask, side)
