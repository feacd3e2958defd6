"""A tape without what cannot matter in one box: branches of min and max that cannot win, abs of what has one sign,
and sums with what is 0 once such a branch is gone.

The shortened tape computes the same values, bit for bit, at every sample in the box. Equal ones are kept once.
"""

import numpy as np
from numba import njit

from implicit.kernels.elementary import INNER, OPTIONS, Floats, Indices, Rows
from implicit.kernels.ranges import PLACE
from implicit.tape import ABS, ADD, CONST, DIV, MIN, MUL, SQR, SUB

_MIX = np.uint64(0x9E3779B97F4A7C15)  # odd, with bits all over: 2^64 divided by the golden ratio


@njit(**OPTIONS)
def shorten(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    low: Floats,
    high: Floats,
    box: int,
    out: int,
    out_arguments: int,
    work: Rows,
) -> tuple[int, int]:
    """Write the tape for a box behind the pool: its rows from `out` on, its arguments from `out_arguments` on.

    low and high hold the bounds that `ranges.enclose` found with the rows start .. start+count-1, and box is the number
    of one in its mesh. Needs room for `count` rows and for as many arguments as the tape has; work (4, >= either).

    Returns the number of rows and the end of the arguments. The number is `count` when nothing was dropped, and then
    nothing is written that is needed: the old tape serves.
    """
    operands = _judge(code, start, count, arguments, constants, low, high, box, work)
    if _mark(code, start, count, arguments, low, box, operands, work) == 0:
        return count, out_arguments
    return _write(code, start, count, arguments, out, out_arguments, work)


@njit(**INNER, inline="always")
def _judge(
    code: Rows,
    start: int,
    count: int,
    arguments: Indices,
    constants: Floats,
    low: Floats,
    high: Floats,
    box: int,
    work: Rows,
) -> int:
    """Set work[2] to 1 where a register is 0 in the box: the number 0, products with it, its square, and a MIN or MAX
    that it wins; and work[3] to 1 for each operand of a MIN or MAX, in their order, that is beaten everywhere in the
    box. Returns the number of these operands.
    """
    zero, lost = work[2], work[3]
    operands = 0
    for q in range(count):
        operation, a, b = code[start + q, 0], code[start + q, 1], code[start + q, 2]
        zero[q] = 0
        if operation == CONST:
            zero[q] = constants[a, 1] == 0.0 and constants[a, 2] == 0.0
        elif operation == MUL:
            other = code[start + (b if zero[a] == 1 else a), 0]
            zero[q] = (zero[a] == 1 or zero[b] == 1) and other == CONST
        elif operation == SQR:
            zero[q] = zero[a]
        elif operation >= MIN:
            bar, won = np.inf, 1
            for t in range(b):
                r = arguments[a + t]
                place = PLACE[code[start + r, 3], 7, box]
                far = high[r, place] if operation == MIN else -low[r, place]
                bar = far if far < bar else bar
            for t in range(b):
                r = arguments[a + t]
                place = PLACE[code[start + r, 3], 7, box]
                near = low[r, place] if operation == MIN else -high[r, place]
                lost[operands + t] = near > bar
                won &= zero[r] | lost[operands + t]
            zero[q] = won
            operands += b
    return operands


@njit(**INNER, inline="always")
def _mark(
    code: Rows, start: int, count: int, arguments: Indices, low: Floats, box: int, operands: int, work: Rows
) -> int:
    """Set work[0] to which registers matter, 2 for a MIN or MAX that loses branches, and work[1] to the register that
    stands for one, or -1; how much can be dropped.
    """
    live, place, zero, lost = work[0], work[1], work[2], work[3]
    for q in range(count):
        live[q] = q == count - 1
    dropped = 0
    for q in range(count - 1, -1, -1):  # which registers matter; place >= 0: replaced by that register
        operation, a, b = code[start + q, 0], code[start + q, 1], code[start + q, 2]
        place[q] = -1
        if operation >= MIN:
            operands -= b
        if live[q] == 0:
            dropped += 1
        elif operation <= CONST:
            continue
        elif operation <= DIV:
            if zero[b] == 1 and operation <= SUB:
                place[q] = a
            elif zero[a] == 1 and operation == ADD:
                place[q] = b
            dropped += place[q] >= 0
            live[a] |= place[q] != b
            live[b] |= place[q] != a
        elif operation < MIN:
            live[a] = 1
            if operation == ABS and low[a, PLACE[code[start + a, 3], 7, box]] >= 0.0:
                place[q] = a
                dropped += 1
        else:
            kept, last = 0, 0
            for t in range(b):
                if lost[operands + t] == 0:
                    last = arguments[a + t]
                    live[last] = 1
                    kept += 1
            live[q] = 1 if kept == b else 2
            dropped += b - kept
            if kept == 1:
                place[q] = last
    return dropped


@njit(**INNER, inline="always")
def _write(
    code: Rows, start: int, count: int, arguments: Indices, out: int, out_arguments: int, work: Rows
) -> tuple[int, int]:
    """Write what matters behind the pool; the number of rows and the end of the arguments."""
    live, place, lost = work[0], work[1], work[3]
    rows, operands, end = 0, 0, out_arguments
    for q in range(count):
        operation = code[start + q, 0]
        a, b, mask = code[start + q, 1], code[start + q, 2], code[start + q, 3]
        first = operands
        if operation >= MIN:
            operands += b
        if live[q] == 0:
            continue
        if place[q] >= 0:
            place[q] = place[place[q]]
            continue
        if operation > CONST and operation <= DIV:
            a, b = place[a], place[b]
            mask = code[out + a, 3] | code[out + b, 3]
        elif operation > CONST and operation < MIN:
            a = place[a]
            mask = code[out + a, 3]
        elif operation >= MIN:
            begin, mask = end, np.int32(0)
            for t in range(b):
                if lost[first + t] == 0:
                    arguments[end] = place[arguments[a + t]]
                    mask |= code[out + arguments[end], 3]
                    end += 1
            a, b = np.int32(begin), np.int32(end - begin)
        code[out + rows, 0], code[out + rows, 1], code[out + rows, 2], code[out + rows, 3] = operation, a, b, mask
        place[q] = rows
        rows += 1
    return rows, end


@njit(**INNER)
def find_equal(code: Rows, arguments: Indices, start: int, count: int, known: Rows) -> int:
    """The first row of a tape equal to the one in rows start .. start+count-1, or `start`, which is then known too.

    known (2, a power of two) keeps the first row and the number of rows of a tape by its hash, -1 where there is none;
    a tape that finds its place taken by another takes it over.
    """
    mix = np.uint64(count)
    for q in range(start, start + count):
        a, b = code[q, 1], code[q, 2]
        if code[q, 0] >= MIN:
            for t in range(b):
                mix = (mix ^ np.uint64(arguments[a + t])) * _MIX
            a = b
        mix = (mix ^ np.uint64(code[q, 0])) * _MIX
        mix = (mix ^ np.uint64(a)) * _MIX
        mix = (mix ^ np.uint64(b)) * _MIX
    place = np.int64((mix >> np.uint64(32)) & np.uint64(known.shape[1] - 1))
    if known[1, place] == count and _equal(code, arguments, np.int64(known[0, place]), start, count):
        return int(known[0, place])
    known[0, place], known[1, place] = start, count
    return start


@njit(**INNER, inline="always")
def _equal(code: Rows, arguments: Indices, first: int, second: int, count: int) -> bool:
    """Whether two tapes of `count` rows are equal, whichever places the operands of their MIN and MAX are in."""
    for q in range(count):
        if code[first + q, 0] != code[second + q, 0] or code[first + q, 2] != code[second + q, 2]:
            return False
        a, b = code[first + q, 1], code[second + q, 1]
        if code[first + q, 0] < MIN:
            if a != b:
                return False
        else:
            for t in range(code[first + q, 2]):
                if arguments[a + t] != arguments[b + t]:
                    return False
    return True
