"""Cones over blocks of lattice cells, each round one isolated singular point.

The triangles of the sweep inside a block are taken out, and the edges they leave behind are joined to the point.
Nothing is stitched: the sweep itself has made the rim, so there is no seam.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.points.blowup import Germ, are_cones, germs_at, regular_cones

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Put = tuple[NDArray[np.bool_], IntArray]
"""Which faces (n,) are gone, and those (m, 3) in their place."""

Ends = tuple[IntArray, IntArray]
"""The corners (3,) of a block, lower and upper."""

_FARTHEST = 4
"""Blocks reach at most so many cells beyond the point's own."""
_PER_SIZE = 3
"""So many blocks of each size are tried for a point."""
_SAMPLE = 60
"""So many blocks of each size are looked at."""
_TOGETHER = 5
"""The ribs of so many are looked at together."""
_BESIDE = 3.0
"""Places less than so many cells away are beside a block."""
_NEAREST = 0.6
"""The boundary of a block is at least so many cells away from its point."""
_CLEAR = 0.2
"""In a block worth trying the tangent cone stays so many cells away from corners and does not touch ribs."""
_ENDS = np.array([[np.insert((i, j), axis, end) for end in (0, 1)] for axis, i, j in product(range(3), (0, 1), (0, 1))])
"""The ribs (12, 2, 3) of a block, four along each axis: for both ends, which side of the block it lies on."""

_SHARES = np.linspace(0, 1, 9)
"""Where along a rib the tangent cone is looked at."""


@dataclass(frozen=True, eq=False)
class Block:
    """Cells from `lower` up to, not including, `upper`, round a point."""

    point: FloatArray
    lower: IntArray
    upper: IntArray

    def holds(self, cells: IntArray) -> NDArray[np.bool_]:
        """Which cells (n, 3) belong to the block."""
        return np.asarray(((cells >= self.lower) & (cells < self.upper)).all(axis=1))

    @property
    def cells(self) -> IntArray:
        """The cells (n, 3) themselves."""
        return np.argwhere(np.ones(self.upper - self.lower, bool)) + self.lower


def find_blocks(
    field: Field, grid: Grid, points: FloatArray, rows: IntArray, coarse: FloatArray
) -> tuple[list[Block], IntArray]:
    """The smallest blocks, proved to hold cones, for rows (m,) of isolated singular points (k, 3), with nothing coarse
    in or beside their boundary; they are disjoint. And the rows of points without one.

    coarse (n, 3), in lattice units: places where the sweep turns too far in one triangle, as near a thin cone.
    """
    if not isinstance(field, PolynomialField) or not len(rows):
        return [], rows
    units = grid.to_units(points)
    cells = np.floor(units).astype(np.int64)
    germs = germs_at(field, points[rows], grid.step)
    tries = {
        row: (germ, _candidates(germ, units[row], *_room(cells, row, grid.cells), coarse))
        for row, germ, smooth in zip(rows.tolist(), germs, regular_cones(germs), strict=True)
        if smooth
    }
    found = _first_held(points, units, tries)
    return [found[row] for row in sorted(found)], np.array([row for row in rows.tolist() if row not in found], np.int64)


def _first_held(
    points: FloatArray, units: FloatArray, tries: dict[int, tuple[Germ, Iterator[Ends]]]
) -> dict[int, Block]:
    """For each row of a point, among blocks that are to be tried, the first proved to hold a cone.

    A block of each point is tried at a time: few tests of many boxes cost less than many of few.
    """
    found: dict[int, Block] = {}
    while blocks := {row: ends for row, (_, more) in tries.items() if (ends := next(more, None)) is not None}:
        tries = {row: tries[row] for row in blocks}
        lower, upper = (np.array(side) - units[list(blocks)] for side in zip(*blocks.values(), strict=True))
        held = are_cones([germ for germ, _ in tries.values()], lower, upper)
        for (row, ends), holds in zip(blocks.items(), held, strict=True):
            if holds:
                found[row] = Block(points[row], *ends)
                del tries[row]
    return found


def _room(cells: IntArray, row: int, size: IntArray) -> tuple[IntArray, IntArray]:
    """The block (lower, upper) that belongs to a point: up to the middle towards each other, and within the grid."""
    cell = cells[row]
    lower, upper = np.maximum(cell - _FARTHEST, 0), np.minimum(cell + _FARTHEST + 1, size)
    offsets = np.delete(cells, row, axis=0) - cell
    axes = np.abs(offsets).argmax(axis=1) if len(offsets) else np.zeros(0, np.int64)
    for offset, axis in zip(offsets, axes, strict=True):
        middle = 2 * cell[axis] + offset[axis] + 1
        if offset[axis] > 0:
            upper[axis] = min(upper[axis], middle // 2)
        else:
            lower[axis] = max(lower[axis], -(-middle // 2))
    return lower, upper


def _candidates(germ: Germ, unit: FloatArray, least: IntArray, most: IntArray, coarse: FloatArray) -> Iterator[Ends]:
    """Blocks (lower, upper) whose ribs the tangent cone crosses clearly, small ones first."""
    cell = np.floor(unit).astype(np.int64)
    if (least > cell).any() or (most <= cell).any():
        return
    coarse = coarse[np.abs(coarse - unit).max(axis=1, initial=0) < _FARTHEST + 1 + _BESIDE]
    sides = [_Sides.of(float(unit[axis]), int(least[axis]), int(most[axis]), coarse[:, axis]) for axis in range(3)]
    sizes, blocks = _blocks_of(sides)
    for first, last in pairwise([0, *(np.flatnonzero(np.diff(sizes)) + 1), len(sizes)]):
        clear = 0
        for start in range(first, min(last, first + _SAMPLE), _TOGETHER):
            if clear < _PER_SIZE:
                part = blocks[start : min(start + _TOGETHER, first + _SAMPLE, last)]
                part = part[_clear_ribs(germ, part - unit)]
                yield from part[: _PER_SIZE - clear]
                clear += len(part)


@dataclass(frozen=True, eq=False)
class _Sides:
    """Ranges (n, 2) of cells that hold a place, their lengths (n,), and how near their ends are to it (n,).

    away and around (n, m): bits, 64 in each number, which of some other places are not beside the range, as they are
    well outside it, and which are inside.
    """

    ends: IntArray
    lengths: IntArray
    nearest: FloatArray
    away: NDArray[np.uint64]
    around: NDArray[np.uint64]

    @classmethod
    def of(cls, unit: float, least: int, most: int, others: FloatArray) -> "_Sides":
        """Those within (least, most) whose ends are not too near to the place."""
        cell = int(np.floor(unit))
        ends = np.array(list(product(range(least, cell + 1), range(cell + 1, most + 1))))
        nearest = np.abs(ends - unit).min(axis=1)
        ends, nearest = ends[nearest > _NEAREST], nearest[nearest > _NEAREST]
        low, high = ends.T
        gaps = np.maximum(low[:, None] - others, others - high[:, None])
        return cls(ends, high - low, nearest, _bits(gaps >= _BESIDE), _bits(gaps <= 0))


def _bits(flags: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Flags (n, k) in numbers (n, m) of 64 bits; the last ones are set."""
    padded = np.ones((len(flags), flags.shape[1] + -flags.shape[1] % 64), bool)
    padded[:, : flags.shape[1]] = flags
    return np.packbits(padded, axis=1).view(np.uint64)


def _blocks_of(sides: list[_Sides]) -> tuple[IntArray, IntArray]:
    """The cells (n,) along the longest side, and the blocks (n, 2, 3) themselves, with no side 2 cells shorter, and no
    other places beside them; small ones first, and then those whose boundary is far from the place.
    """
    longest = _outer(np.maximum, [side.lengths for side in sides])
    good = (longest > 1) & (_outer(np.minimum, [side.lengths for side in sides]) >= longest - 2)
    for word in range(sides[0].away.shape[1]):
        away = _outer(np.bitwise_or, [side.away[:, word] for side in sides])
        around = _outer(np.bitwise_and, [side.around[:, word] for side in sides])
        good &= ~(away | around) == 0
    rows = np.flatnonzero(good)
    nearest = _outer(np.minimum, [side.nearest for side in sides]).ravel()[rows]
    rows = rows[np.lexsort((-nearest, longest.ravel()[rows]))]
    chosen = zip(sides, np.unravel_index(rows, good.shape), strict=True)
    return longest.ravel()[rows], np.stack([side.ends[row] for side, row in chosen], axis=2)


def _outer(combine: np.ufunc, parts: list[NDArray[Any]]) -> NDArray[Any]:
    """What belongs to all triples of three arrays."""
    x, y, z = parts
    return np.asarray(combine(combine(x[:, None, None], y[:, None]), z))


def _clear_ribs(germ: Germ, corners: FloatArray) -> NDArray[np.bool_]:
    """Which blocks (n, 2, 3) have ribs that the tangent cone crosses transversally, if at all."""
    ends = corners[:, _ENDS, range(3)]
    w = ends[:, :, 0, None] + _SHARES[:, None] * (ends[:, :, 1] - ends[:, :, 0])[:, :, None]
    w = w.reshape(-1, 3, 4, len(_SHARES), 3)
    value, slope = germ.tangent_cone(w.reshape(-1, 3))
    value, slope = np.abs(value).reshape(w.shape[:-1]), slope.reshape(w.shape)
    steep = np.linalg.norm(slope, axis=-1)
    along = np.abs(np.einsum("nakpa->nakp", slope))
    touches = (value < _CLEAR * steep) & (along < 0.5 * steep)
    corner = value[..., (0, -1)] < _CLEAR * steep[..., (0, -1)]
    return ~touches.any(axis=(1, 2, 3)) & ~corner.any(axis=(1, 2, 3))


def put_cones(corners: FloatArray, faces: IntArray, grid: Grid, blocks: list[Block], first: int) -> Put:
    """Which faces, with corners (n, 3, 3), lie in blocks, and cones in their place; apexes are numbered on `first`."""
    cells = np.floor(grid.to_units(corners.mean(axis=1))).astype(np.int64)
    owner = np.full(len(faces), -1)
    for row, block in enumerate(blocks):
        owner[block.holds(cells)] = row
    gone = owner >= 0
    edges, owner = _rims(faces[gone], owner[gone])
    return gone, np.column_stack([edges, first + owner])


def _rims(faces: IntArray, owner: IntArray) -> tuple[IntArray, IntArray]:
    """The directed edges (n, 2) of faces whose opposite is none of the same owner's, and their owners, ascending."""
    edges, owner = np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]]), np.tile(owner, 3)
    size = int(edges.max(initial=0)) + 1
    (start, stop), shift = edges.T, owner * size**2
    single = np.flatnonzero(~np.isin(shift + start * size + stop, shift + stop * size + start))
    single = single[np.argsort(owner[single], kind="stable")]
    return edges[single], owner[single]
