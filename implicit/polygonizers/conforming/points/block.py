"""Cones over blocks of lattice cells, each round one isolated singular point.

The triangles of the sweep inside a block are taken out, and the edges they leave behind are joined to the point.
Nothing is stitched: the sweep itself has made the rim, so there is no seam.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.points.blowup import Germ, has_regular_cone, is_cone

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Put = tuple[NDArray[np.bool_], IntArray]
"""Which faces (n,) are gone, and those (m, 3) in their place."""

_FARTHEST = 4
"""Blocks reach at most so many cells beyond the point's own."""
_PER_SIZE = 3
"""So many blocks of each size are tried for a point."""
_SAMPLE = 60
"""So many blocks of each size are looked at."""
_BESIDE = 3.0
"""Places less than so many cells away are beside a block."""
_NEAREST = 0.6
"""The boundary of a block is at least so many cells away from its point."""
_CLEAR = 0.2
"""In a block worth trying the tangent cone stays so many cells away from corners and does not touch ribs."""
_ENDS = np.array([[np.insert((i, j), axis, end) for end in (0, 1)] for axis, i, j in product(range(3), (0, 1), (0, 1))])
"""The ribs (12, 2, 3) of a block, four along each axis: for both ends, which side of the block it lies on."""


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
    cells = np.floor(grid.to_units(points)).astype(np.int64)
    blocks, rest = [], []
    for row in rows.tolist():
        block = _smallest(field, grid, points[row], *_room(cells, row, grid.cells), coarse)
        if block is None:
            rest.append(row)
        else:
            blocks.append(block)
    return blocks, np.array(rest, np.int64)


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


def _smallest(
    field: Field, grid: Grid, point: FloatArray, least: IntArray, most: IntArray, coarse: FloatArray
) -> Block | None:
    """The smallest block within (least, most), without a coarse place beside, in which f = 0 is proved to be a cone."""
    if not isinstance(field, PolynomialField):
        return None
    germ = Germ.at(field, point, grid.step)
    if not has_regular_cone(germ):
        return None
    unit = grid.to_units(point)
    for lower, upper in _candidates(germ, unit, least, most, coarse):
        if is_cone(germ, lower - unit, upper - unit):
            return Block(point, lower, upper)
    return None


def _candidates(
    germ: Germ, unit: FloatArray, least: IntArray, most: IntArray, coarse: FloatArray
) -> Iterator[tuple[IntArray, IntArray]]:
    """Blocks (lower, upper) whose ribs the tangent cone crosses clearly, small ones first."""
    cell = np.floor(unit).astype(np.int64)
    if (least > cell).any() or (most <= cell).any():
        return
    ranges = [_ranges(float(unit[axis]), int(least[axis]), int(most[axis])) for axis in range(3)]
    coarse = coarse[np.abs(coarse - unit).max(axis=1, initial=0) < _FARTHEST + 1 + _BESIDE]
    for size in range(2, 2 * _FARTHEST + 2):
        group = _of_size(ranges, size, unit)
        group = group[_clear_around(group, coarse)][:_SAMPLE]
        yield from group[_clear_ribs(germ, group - unit)][:_PER_SIZE]


def _ranges(unit: float, least: int, most: int) -> IntArray:
    """The ranges (n, 2) of cells within (least, most) that hold a place, and whose ends are not too near to it."""
    cell = int(np.floor(unit))
    ends = np.array(list(product(range(least, cell + 1), range(cell + 1, most + 1))))
    return np.asarray(ends[np.abs(ends - unit).min(axis=1) > _NEAREST])


def _of_size(ranges: list[IntArray], size: int, unit: FloatArray) -> IntArray:
    """The blocks (n, 2, 3) whose longest side has so many cells, none 2 cells shorter; those round a place come first
    whose boundary is far from it.
    """
    lengths = [part[:, 1] - part[:, 0] for part in ranges]
    usable = [part[(long <= size) & (long >= size - 2)] for part, long in zip(ranges, lengths, strict=True)]
    rows = np.indices([len(part) for part in usable]).reshape(3, -1)
    blocks = np.stack([part[row] for part, row in zip(usable, rows, strict=True)], axis=2)
    blocks = blocks[(blocks[:, 1] - blocks[:, 0]).max(axis=1, initial=0) == size]
    nearest = np.abs(blocks - unit).min(axis=(1, 2), initial=np.inf)
    return np.asarray(blocks[np.argsort(-nearest, kind="stable")])


def _clear_around(blocks: IntArray, coarse: FloatArray) -> NDArray[np.bool_]:
    """Which blocks (n, 2, 3) have none of some places beside them."""
    gaps = np.full((len(blocks), len(coarse)), -np.inf)
    for side, axis in product((0, 1), range(3)):
        ends, places = blocks[:, side, axis, None], coarse[:, axis]
        np.maximum(gaps, places - ends if side else ends - places, out=gaps)
    return np.asarray(((gaps <= 0) | (gaps >= _BESIDE)).all(axis=1))


def _clear_ribs(germ: Germ, corners: FloatArray) -> NDArray[np.bool_]:
    """Which blocks (n, 2, 3) have ribs that the tangent cone crosses transversally, if at all."""
    share = np.linspace(0, 1, 9)
    ends = corners[:, _ENDS, range(3)]
    w = ends[:, :, 0, None] + share[:, None] * (ends[:, :, 1] - ends[:, :, 0])[:, :, None]
    w = w.reshape(-1, 3, 4, len(share), 3)
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
    gone = np.zeros(len(faces), bool)
    cones = [np.zeros((0, 3), np.int64)]
    for apex, block in enumerate(blocks, first):
        inside = block.holds(cells)
        gone |= inside
        rim = boundary(faces[inside])
        cones.append(np.column_stack([rim, np.full(len(rim), apex)]))
    return gone, np.concatenate(cones)


def boundary(faces: IntArray) -> IntArray:
    """The directed edges (n, 2) of the faces whose opposite is no edge of them."""
    edges = np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]])
    if not len(edges):
        return np.zeros((0, 2), np.int64)
    size = int(edges.max()) + 1
    single = ~np.isin(edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0])
    return np.asarray(edges[single])
