"""Cones over blocks of lattice cells, each round one isolated singular point.

The triangles of the sweep inside a block are taken out, and the edges they leave behind are joined to the point. Nothing
is stitched: the sweep itself has made the rim, so there is no seam.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.conforming.blowup import Germ, is_cone
from implicit.polygonizers.conforming.grid import Grid

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_LARGEST = 4
"""Blocks reach at most so many cells beyond the point's own."""


@dataclass(frozen=True, eq=False)
class Block:
    """Cells from `lower` up to, not including, `upper`, round a point."""

    point: FloatArray
    lower: IntArray
    upper: IntArray

    def holds(self, cells: IntArray) -> NDArray[np.bool_]:
        """Which cells (n, 3) belong to the block."""
        return np.asarray(((cells >= self.lower) & (cells < self.upper)).all(axis=1))


def find_blocks(field: Field, grid: Grid, points: FloatArray) -> tuple[list[Block], IntArray]:
    """Disjoint blocks proved to hold cones, the smallest that will do, and the rows of points that have none."""
    units = grid.to_units(points)
    cells = np.floor(units).astype(np.int64)
    blocks: list[Block] = []
    rest = []
    for row, cell in enumerate(cells):
        gap = np.abs(np.delete(cells, row, axis=0) - cell).max(axis=1).min(initial=1 << 30)
        block = _smallest(field, grid, points[row], cell, min((int(gap) - 1) // 2, _LARGEST))
        if block is None:
            rest.append(row)
        else:
            blocks.append(block)
    return blocks, np.array(rest, np.int64)


def _smallest(field: Field, grid: Grid, point: FloatArray, cell: IntArray, largest: int) -> Block | None:
    if not isinstance(field, PolynomialField):
        return None
    germ = Germ.at(field, point, grid.step)
    unit = grid.to_units(point)
    for reach in range(1, largest + 1):
        lower, upper = cell - reach, cell + reach + 1
        if (lower >= 0).all() and (upper <= grid.cells).all() and is_cone(germ, lower - unit, upper - unit):
            return Block(point, lower, upper)
    return None


def put_cones(
    vertices: FloatArray, faces: IntArray, grid: Grid, blocks: list[Block]
) -> tuple[FloatArray, IntArray, IntArray]:
    """Vertices with the blocks' points behind them, faces with cones in the blocks, and the numbers of the points."""
    cells = np.floor(grid.to_units(vertices[faces].mean(axis=1))).astype(np.int64)
    apexes = len(vertices) + np.arange(len(blocks))
    stay = np.ones(len(faces), bool)
    cones = []
    for apex, block in zip(apexes, blocks, strict=True):
        inside = block.holds(cells)
        stay &= ~inside
        rim = boundary(faces[inside])
        cones.append(np.column_stack([rim, np.full(len(rim), apex)]))
    places = np.array([block.point for block in blocks]).reshape(-1, 3)
    return np.concatenate([vertices, places]), np.concatenate([faces[stay], *cones]), apexes


def boundary(faces: IntArray) -> IntArray:
    """The directed edges (n, 2) of the faces whose opposite is no edge of them."""
    edges = np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]])
    if not len(edges):
        return np.zeros((0, 2), np.int64)
    size = int(edges.max()) + 1
    single = ~np.isin(edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0])
    return np.asarray(edges[single])
