"""Cones over blocks of lattice cells, each round one isolated singular point.

The triangles of the sweep inside a block are taken out, and the edges they leave behind are joined to the point.
Nothing is stitched: the sweep itself has made the rim, so there is no seam.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.conforming.blowup import Germ, is_cone
from implicit.polygonizers.conforming.grid import Grid

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
_NEAREST = 0.6
"""The boundary of a block is at least so many cells away from its point."""
_CLEAR = 0.2
"""In a block worth trying the tangent cone stays so many cells away from corners and does not touch ribs."""


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


def find_blocks(field: Field, grid: Grid, points: FloatArray) -> tuple[list[Block], IntArray]:
    """Disjoint blocks proved to hold cones, the smallest that will do, and the rows of points that have none."""
    cells = np.floor(grid.to_units(points)).astype(np.int64)
    blocks: list[Block] = []
    rest = []
    for row in range(len(points)):
        block = _smallest(field, grid, points[row], *_room(cells, row, grid.cells))
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


def _smallest(field: Field, grid: Grid, point: FloatArray, least: IntArray, most: IntArray) -> Block | None:
    """The smallest block round a point, within (least, most), in which f = 0 is proved to be a cone."""
    if not isinstance(field, PolynomialField):
        return None
    germ = Germ.at(field, point, grid.step)
    unit = grid.to_units(point)
    for lower, upper in _candidates(germ, unit, least, most):
        if is_cone(germ, lower - unit, upper - unit):
            return Block(point, lower, upper)
    return None


def _candidates(germ: Germ, unit: FloatArray, least: IntArray, most: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Blocks (lower, upper) whose ribs the tangent cone crosses clearly, small ones first."""
    cell = np.floor(unit).astype(np.int64)
    ranges = [range(least[a], cell[a] + 1) for a in range(3)] + [range(cell[a] + 1, most[a] + 1) for a in range(3)]
    blocks = np.array(list(product(*ranges)), np.int64).reshape(-1, 2, 3)
    away = np.abs(blocks - unit)
    blocks = blocks[away.min(axis=(1, 2), initial=np.inf) > _NEAREST]
    sizes = blocks[:, 1] - blocks[:, 0]
    blocks = blocks[np.ptp(sizes, axis=1) <= 2]
    sizes = (blocks[:, 1] - blocks[:, 0]).max(axis=1)
    chosen = []
    for size in np.unique(sizes[sizes > 1]):
        group = blocks[sizes == size]
        nearest = np.abs(group - unit).min(axis=(1, 2))
        group = group[np.argsort(-nearest, kind="stable")][:_SAMPLE]
        good = np.ones(len(group), bool)
        for axis in range(3):
            good[good] = _clear_ribs(germ, (group - unit)[good], axis)
        chosen += [(lower, upper) for lower, upper in group[good][:_PER_SIZE]]
    return chosen


def _clear_ribs(germ: Germ, corners: FloatArray, axis: int) -> NDArray[np.bool_]:
    """Which blocks (n, 2, 3) have ribs along an axis that the tangent cone crosses transversally, if at all."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    share = np.linspace(0, 1, 9)
    good = np.ones(len(corners), bool)
    for i, j in product((0, 1), repeat=2):
        w = np.empty((len(corners), len(share), 3))
        w[..., axis] = corners[:, :1, axis] + share * (corners[:, 1:, axis] - corners[:, :1, axis])
        w[..., u], w[..., v] = corners[:, i, u, None], corners[:, j, v, None]
        value, slope = germ.tangent_cone(w.reshape(-1, 3))
        value, slope = value.reshape(w.shape[:2]), slope.reshape(w.shape)
        steep = np.linalg.norm(slope, axis=2)
        along = np.abs(slope[..., axis])
        touches = (np.abs(value) < _CLEAR * steep) & (along < 0.5 * steep)
        corner = np.abs(value[:, (0, -1)]) < _CLEAR * steep[:, (0, -1)]
        good &= ~touches.any(axis=1) & ~corner.any(axis=1)
    return good


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
