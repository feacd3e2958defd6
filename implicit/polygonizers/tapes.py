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
from implicit.interval import enclose_arrays
from implicit.kernels.elementary import INNER, OPTIONS
from implicit.kernels.ranges import PLACE, SPLIT, enclose
from implicit.kernels.shorten import find_equal, shorten
from implicit.kernels.sweep import Pool
from implicit.polygonizers.lattice import Lattice, to_bricks
from implicit.tape import ABS, MAX, MIN, Tape

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BrickArray = NDArray[np.int32]

_CHOICES = (ABS, MIN, MAX)
"""Without these nothing can be dropped from a tape, and arrays enclose it: the kernel takes long to compile."""

_FIRST, _BLOCKS = 12, 512
"""Blocks along an axis to begin with, and blocks whose children are enclosed together."""


@njit(**OPTIONS)
def _descend(
    code: Any, arguments: Any, rows: int, used: int, constants: Any, axes: Any, bricks: Any, levels: int, leaves: Any,
    stack: Any, state: Any, known: Any, low: Any, high: Any, room: Any, work: Any,
) -> bool:  # fmt: skip
    """Write a leaf (x, y, z, first row, rows) for each brick that may be crossed, until all is done or room is short.

    The tape is in the first `rows` rows of `code`, its operands in the first `used` of `arguments`; shortened tapes are
    written behind them. state (4,): how many blocks are open, leaves written, rows and operands used; it says where to
    go on when there is more room. To work in: low and high (rows, SPLIT^3), room (10, SPLIT^3), known as for
    `find_equal`, work as for `shorten`.
    """
    scratch, lower, upper = room[:4], room[4:7], room[7:]
    depth, count, end, most = state[0], state[1], state[2], state[3]
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
        x, y, z = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        width = 1 << 2 * (level - 1)
        _edges(axes, bricks, stack[depth], width, lower, upper)
        enclose(code, start, length, arguments, constants, lower, upper, low, high, scratch)
        mask = code[start + length - 1, 3]
        for box in range(SPLIT**3):
            i, j, k = x + (box >> 4) * width, y + (box >> 2 & 3) * width, z + (box & 3) * width
            place = PLACE[mask, 7, box]
            outside = i >= bricks[0] or j >= bricks[1] or k >= bricks[2]
            if outside or low[length - 1, place] >= 0.0 or high[length - 1, place] < 0.0:
                continue
            kept, last = shorten(code, start, length, arguments, constants, low, high, box, end, most, work)
            target = start
            if kept < length:
                target = find_equal(code, arguments, end, kept, known)
                if target == end:
                    end, most = end + kept, last
            if level == 1:
                leaves[count, 0], leaves[count, 1], leaves[count, 2] = i, j, k
                leaves[count, 3], leaves[count, 4] = target, kept
                count += 1
            else:
                stack[depth, 0], stack[depth, 1], stack[depth, 2] = i, j, k
                stack[depth, 3], stack[depth, 4], stack[depth, 5] = level - 1, target, kept
                depth += 1
    state[0], state[1], state[2], state[3] = depth, count, end, most
    return depth == 0


@njit(**INNER, inline="always")
def _edges(axes: Any, bricks: Any, block: Any, width: int, lower: Any, upper: Any) -> None:
    """Find the ends of the SPLIT children of a block along each axis."""
    for axis in range(3):
        for c in range(SPLIT):
            first, last = block[axis] + c * width, bricks[axis]
            lower[axis, c] = axes[axis, 7 * (first if first < last else last)]
            upper[axis, c] = axes[axis, 7 * (first + width if first + width < last else last)]


def _find_leaves(tape: Tape, lattice: Lattice) -> tuple[BrickArray, BrickArray, BrickArray]:
    """The bricks that may be crossed as leaves, and the rows and operands of all their tapes."""
    levels = 1
    while SPLIT**levels < max(lattice.bricks):
        levels += 1
    x, y, z = lattice.bricks
    room = 64 + 2 * (x * y + y * z + z * x)
    code, arguments, leaves = tape.code, tape.arguments, np.empty((0, 5), np.int32)
    low, high = np.empty((2, len(tape), SPLIT**3))
    known, work = np.full((2, 1 << 13), -1, np.int32), np.empty((4, max(len(tape), len(arguments))), np.int32)
    stack, state, done = np.empty((64 * levels + 1, 6), np.int32), np.zeros(4, np.int64), False
    while not done:
        code = _longer(code, 64 * len(tape) + 8 * room)
        arguments = _longer(arguments, 64 * len(tape.arguments) + room)
        leaves = _longer(leaves, room)
        room *= 2
        done = _descend(
            code, arguments, len(tape), len(tape.arguments), tape.constants, lattice.padded, lattice.bricks, levels,
            leaves, stack, state, known, low, high, np.empty((10, SPLIT**3)), work,
        )  # fmt: skip
    return code, arguments, leaves[: state[1]]


def _find_bricks(tape: Tape, lattice: Lattice) -> BrickArray:
    """The bricks that may be crossed, found as in `_descend` with the whole tape and many blocks at a time."""
    width = 1
    while width * _FIRST < max(lattice.bricks):
        width *= SPLIT
    blocks = _children(tape, lattice, np.zeros((1, 3), np.int64), width, -(-max(lattice.bricks) // width))
    while width > 1:
        width //= SPLIT
        parts = [blocks[first : first + _BLOCKS] for first in range(0, len(blocks), _BLOCKS)]
        blocks = np.concatenate([blocks[:0], *(_children(tape, lattice, part, width, SPLIT) for part in parts)])
    marked = np.zeros(lattice.bricks, np.bool_)
    marked[tuple(blocks.T)] = True
    return to_bricks(marked & lattice.met())


def _children(tape: Tape, lattice: Lattice, blocks: IntArray, width: int, split: int) -> IntArray:
    """The children of `width` bricks that may be crossed, of blocks (n, 3) with `split` of them along each axis."""
    lower, upper, inside = list[FloatArray](), list[FloatArray](), np.ones((len(blocks), 1, 1, 1), np.bool_)
    for axis in range(3):  # arrays of shape (n, split, 1, 1), (n, 1, split, 1), (n, 1, 1, split)
        shape = [len(blocks), 1, 1, 1]
        shape[1 + axis] = split
        first, last = (blocks[:, axis, None] + width * np.arange(split)).reshape(shape), lattice.bricks[axis]
        inside = inside & (first < last)
        lower.append(lattice.padded[axis, 7 * np.minimum(first, last)])
        upper.append(lattice.padded[axis, 7 * np.minimum(first + width, last)])
    low, high = enclose_arrays(tape, lower, upper)
    found = np.argwhere(inside & (low < 0.0) & (high >= 0.0))
    return np.asarray(blocks[found[:, 0]] + width * found[:, 1:])


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

    leaves (n, 5): a brick, and the first row and number of rows of its own tape in the pool.
    """

    field: TapeField
    lattice: Lattice
    pool: Pool
    leaves: NDArray[np.int32]

    @classmethod
    def over(cls, field: TapeField, lattice: Lattice, bricks: BrickArray | None = None) -> "TapeSampler":
        """The sampler of a tape over a lattice, of the given bricks or all that may be crossed."""
        tape = field.tape
        if bricks is not None:
            return cls(field, lattice, Pool.of(tape), _whole(bricks, len(tape)))
        if not np.isin(tape.code[:, 0], _CHOICES).any():
            return cls.over(field, lattice, _find_bricks(tape, lattice))
        code, arguments, leaves = _find_leaves(tape, lattice)
        rank = np.full(lattice.bricks, -1, np.int32)  # the leaf of each brick: quicker to read in order than to sort
        rank[leaves[:, 0], leaves[:, 1], leaves[:, 2]] = np.arange(len(leaves))
        rank[~lattice.met()] = -1
        return cls(field, lattice, Pool(code, arguments, tape.constants), leaves[rank[rank >= 0][::-1]])

    @property
    def bricks(self) -> BrickArray:
        """The bricks (n, 3) in the order of the sweep."""
        return self.leaves[:, :3]

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""
        self.pool.fill(self.leaves[first:last], self.lattice.padded, samples)

    def sample(self, bricks: BrickArray, samples: FloatArray) -> None:
        """Write f at the sample points of any bricks (n, 3) into samples (n, 512)."""
        self.pool.fill(_whole(bricks, len(self.field.tape)), self.lattice.padded, samples)

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n); those from starts[i] on lie in brick first + i."""
        return self.pool.gradients(self.leaves[first:last], starts, points)

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        whole = _whole(np.zeros((1, 3), np.int32), len(self.field.tape))
        return self.pool.gradients(whole, np.array([0, points.shape[1]]), points)
