"""Samples and gradients of a tape, on the bricks where its range does not have one sign.

Space is divided into 4 x 4 x 4 blocks again and again, down to single bricks. The 64 children of a block are enclosed
together with the block's own tape; a child whose range has one sign is given up, the others go on with a tape from
which all branches of min and max that cannot win there have been dropped. Blocks with equal tapes share one.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.evaluate import TapeField
from implicit.kernels.adjoint import differentiate
from implicit.kernels.ranges import enclose
from implicit.kernels.shorten import find_equal, place_of, shorten
from implicit.kernels.values import EVERYTHING, SIDE, WIDTH, evaluate, spread
from implicit.polygonizers.lattice import Lattice
from implicit.tape import Tape

FloatArray = NDArray[np.float64]
BrickArray = NDArray[np.int32]

_SPLIT = 4


@njit(cache=True, nogil=True)
def _descend(
    code: Any, arguments: Any, rows: int, used: int, constants: Any, axes: Any, bricks: Any, levels: int, leaves: Any,
    stack: Any, state: Any,
) -> bool:  # fmt: skip
    """Write a leaf (x, y, z, first row, rows) for each brick that may be crossed, until all is done or room is short.

    The tape is in the first `rows` rows of `code`, its operands in the first `used` of `arguments`; shortened tapes are
    written behind them. state (4,): how many blocks are open, leaves written, rows and operands used; it says where to
    go on when there is more room.
    """
    low, high = np.empty((rows, 64)), np.empty((rows, 64))
    known = np.full((2, 1 << 13), -1, np.int32)
    scratch, work = np.empty((5, 64)), np.empty((3, rows), np.int32)
    lower, upper = np.empty((3, _SPLIT)), np.empty((3, _SPLIT))
    depth, count, end, most = state[0], state[1], state[2], state[3]
    points, side = np.int64(0), np.int64(_SPLIT)  # literals would compile `enclose` again
    if depth == 0:
        stack[0, 0], stack[0, 1], stack[0, 2] = 0, 0, 0
        stack[0, 3], stack[0, 4], stack[0, 5] = levels, 0, rows
        depth, end, most = 1, rows, used
    while depth > 0:
        length = np.int64(stack[depth - 1, 5])
        if end + 64 * length > len(code) or most + 64 * used > len(arguments) or count + 64 > len(leaves):
            break
        depth -= 1
        level, start = np.int64(stack[depth, 3]), np.int64(stack[depth, 4])
        width = _SPLIT ** (level - 1)
        x, y, z = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        for axis in range(3):
            for c in range(_SPLIT):
                block = stack[depth, axis] + c * width
                lower[axis, c] = axes[axis, 7 * min(block, bricks[axis])]
                upper[axis, c] = axes[axis, 7 * min(block + width, bricks[axis])]
        enclose(code, start, length, arguments, constants, lower, upper, points, side, low, high, scratch)
        mask = code[start + length - 1, 3]
        for i in range(min(_SPLIT, -(-(bricks[0] - x) // width))):
            for j in range(min(_SPLIT, -(-(bricks[1] - y) // width))):
                for k in range(min(_SPLIT, -(-(bricks[2] - z) // width))):
                    place = place_of(mask, i, j, k, side)
                    if low[length - 1, place] >= 0.0 or high[length - 1, place] < 0.0:
                        continue
                    kept, last = shorten(
                        code, start, length, arguments, constants, low, high, i, j, k, side, end, most, work
                    )  # fmt: skip
                    target = start
                    if kept < length:
                        target = find_equal(code, arguments, end, kept, known)
                        if target == end:
                            end, most = end + kept, last
                    corner = (x + i * width, y + j * width, z + k * width)
                    if level == 1:
                        leaves[count, 0], leaves[count, 1], leaves[count, 2] = corner
                        leaves[count, 3], leaves[count, 4] = target, kept
                        count += 1
                    else:
                        stack[depth, 0], stack[depth, 1], stack[depth, 2] = corner
                        stack[depth, 3], stack[depth, 4], stack[depth, 5] = level - 1, target, kept
                        depth += 1
    state[0], state[1], state[2], state[3] = depth, count, end, most
    return depth == 0


@njit(cache=True, nogil=True)
def _fill(code: Any, arguments: Any, constants: Any, axes: Any, leaves: Any, registers: Any, samples: Any) -> None:
    """Write the samples (n, 512) of leaves."""
    scratch, planes = np.empty((3, WIDTH)), np.empty((3, SIDE))
    points, side, full = (
        np.int64(0),
        np.int64(SIDE),
        np.int64(7),
    )  # literals would compile `evaluate` again
    for index in range(len(leaves)):
        moved = np.int64(0)
        for axis in range(3):
            for k in range(SIDE):
                planes[axis, k] = axes[axis, 7 * leaves[index, axis] + k]
            if index > 0 and leaves[index, axis] != leaves[index - 1, axis]:
                moved |= 4 >> axis
        start, count = np.int64(leaves[index, 3]), np.int64(leaves[index, 4])
        if index == 0 or start != leaves[index - 1, 3] or count != leaves[index - 1, 4]:
            moved = np.int64(EVERYTHING)
        evaluate(code, start, count, arguments, constants, planes, points, side, moved, registers, scratch)
        mask = code[start + count - 1, 3]
        spread(samples[index], registers[count - 1], np.int64(mask), full, side)


@njit(cache=True, nogil=True)
def _near(
    code: Any, arguments: Any, constants: Any, leaves: Any, order: Any, starts: Any, points: Any, registers: Any,
    adjoints: Any, values: Any, gradients: Any,
) -> None:  # fmt: skip
    """Values (n,) and gradients (3, n) at points (3, n), by the tape of the leaf that each belongs to.

    `order` has the leaves of one tape together: their points are taken together.
    """
    scratch, slopes, part = np.empty((3, WIDTH)), np.empty((3, WIDTH)), np.empty((3, WIDTH))
    index, side, every = 0, np.int64(SIDE), np.int64(EVERYTHING)
    members = np.empty(points.shape[1], np.int64)
    while index < len(order):
        start, count, many = np.int64(leaves[order[index], 3]), np.int64(leaves[order[index], 4]), 0
        while index < len(order) and leaves[order[index], 3] == start and leaves[order[index], 4] == count:
            for k in range(starts[order[index]], starts[order[index] + 1]):
                members[many] = k
                many += 1
            index += 1
        for base in range(0, many, SIDE**3):
            chosen = members[base : min(base + SIDE**3, many)]
            n = len(chosen)
            for axis in range(3):
                for k in range(n):
                    part[axis, k] = points[axis, chosen[k]]
            evaluate(code, start, count, arguments, constants, part, n, side, every, registers, scratch)
            differentiate(code, start, count, arguments, constants, n, registers, adjoints, slopes, scratch)
            for k in range(n):
                values[chosen[k]] = registers[count - 1, k]
            for axis in range(3):
                for k in range(n):
                    gradients[axis, chosen[k]] = slopes[axis, k]


def _find_leaves(tape: Tape, lattice: Lattice) -> tuple[BrickArray, BrickArray, BrickArray]:
    """The bricks that may be crossed as leaves, and the rows and operands of all their tapes."""
    levels = 1
    while _SPLIT**levels < max(lattice.bricks):
        levels += 1
    x, y, z = lattice.bricks
    room = 64 + 2 * (x * y + y * z + z * x)
    code, arguments, leaves = tape.code, tape.arguments, np.empty((0, 5), np.int32)
    stack, state, done = np.empty((64 * levels + 1, 6), np.int32), np.zeros(4, np.int64), False
    while not done:
        code = _longer(code, 64 * len(tape) + 8 * room)
        arguments = _longer(arguments, 64 * len(tape.arguments) + room)
        leaves = _longer(leaves, room)
        room *= 2
        done = _descend(
            code, arguments, len(tape), len(tape.arguments), tape.constants, lattice.padded, lattice.bricks, levels,
            leaves, stack, state,
        )  # fmt: skip
    return code, arguments, leaves[: state[1]]


def _longer(array: NDArray[np.int32], more: int) -> NDArray[np.int32]:
    """A copy with room for more rows."""
    return np.concatenate([array, np.empty((more, *array.shape[1:]), np.int32)])


def _whole(bricks: BrickArray, rows: int) -> BrickArray:
    """Leaves with the whole tape."""
    leaves = np.empty((len(bricks), 5), np.int32)
    leaves[:, :3], leaves[:, 3], leaves[:, 4] = bricks, 0, rows
    return leaves


@dataclass(frozen=True, eq=False)
class TapeSampler:
    """Samples a tape on the bricks that its ranges do not rule out.

    leaves (n, 5): a brick, and the first row and number of rows of its own tape in `code`.
    """

    field: TapeField
    lattice: Lattice
    code: NDArray[np.int32]
    arguments: NDArray[np.int32]
    leaves: NDArray[np.int32]

    @classmethod
    def over(cls, field: TapeField, lattice: Lattice, bricks: BrickArray | None = None) -> "TapeSampler":
        """The sampler of a tape over a lattice, of the given bricks or all that may be crossed."""
        tape = field.tape
        if bricks is not None:
            return cls(field, lattice, tape.code.copy(), tape.arguments.copy(), _whole(bricks, len(tape)))
        code, arguments, leaves = _find_leaves(tape, lattice)
        rank = np.full(lattice.bricks, -1, np.int32)  # the leaf of each brick: quicker to read in order than to sort
        rank[leaves[:, 0], leaves[:, 1], leaves[:, 2]] = np.arange(len(leaves))
        return cls(field, lattice, code, arguments, leaves[rank[rank >= 0][::-1]])

    @property
    def bricks(self) -> BrickArray:
        """The bricks (n, 3) in the order of the sweep."""
        return self.leaves[:, :3]

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""
        self._fill(self.leaves[first:last], samples)

    def sample(self, bricks: BrickArray, samples: FloatArray) -> None:
        """Write f at the sample points of any bricks (n, 3) into samples (n, 512)."""
        self._fill(_whole(bricks, len(self.field.tape)), samples)

    def _fill(self, leaves: BrickArray, samples: FloatArray) -> None:
        registers = np.empty((int(leaves[:, 4].max(initial=1)), WIDTH))
        _fill(self.code, self.arguments, self.field.tape.constants, self.lattice.padded, leaves, registers, samples)

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n); those from starts[i] on lie in brick first + i."""
        return self._differentiate(self.leaves[first:last], starts, points)

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        leaves = np.zeros((1, 5), np.int32)
        leaves[0, 4] = len(self.field.tape)
        return self._differentiate(leaves, np.array([0, points.shape[1]]), points)

    def _differentiate(self, leaves: BrickArray, starts: Any, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        registers, adjoints = (np.empty((int(leaves[:, 4].max()), WIDTH)) for _ in range(2))
        values, gradients = np.empty(points.shape[1]), np.empty(points.shape)
        points = np.ascontiguousarray(points)
        _near(
            self.code, self.arguments, self.field.tape.constants, leaves, np.argsort(leaves[:, 3]), starts, points,
            registers, adjoints, values, gradients,
        )  # fmt: skip
        return values, gradients
