"""The cells near the singular set as tetrahedra, and pyramids towards the cells of the sweep.

Two neighbouring cells of the region share a square; it and the two centres make four tetrahedra round the line of the
centres. A square between the region and the sweep is the base of a pyramid with the centre of the region's cell: on it
the surface is joined by the sweep's own rule, so the two fit without a seam.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.cell import CORNERS, FACES
from implicit.polygonizers.conforming.local import distinct

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_JITTER = 2e-3
"""Vertices inside are moved by so much of a cell: that five lie on one sphere makes Delaunay's tetrahedra expensive."""
_FACE_OF = {(axis, side): FACES[2 * axis + side] for axis in range(3) for side in (0, 1)}

_REACH = 1
"""The region reaches so many cells beyond the cells with new vertices."""


@dataclass(frozen=True, eq=False)
class Region:
    """Places (n, 3) in lattice units: `nodes` lattice points (m, 3) first, then the centres of the cells.

    tetrahedra (t, 4): two centres, then two nodes; pyramids (p, 5): apex, then the base counter-clockwise seen from
    outside. cells (c, 3), sorted.
    """

    places: FloatArray
    nodes: IntArray
    tetrahedra: IntArray
    pyramids: IntArray
    cells: IntArray
    size: IntArray

    @cached_property
    def tree(self) -> cKDTree:
        """All places, to look for those near a point."""
        return cKDTree(self.places, balanced_tree=False, compact_nodes=False)

    @cached_property
    def _keys(self) -> IntArray:
        return np.ravel_multi_index(tuple(self.cells.T), tuple(self.size))

    def numbers(self, cells: IntArray) -> IntArray:
        """The places of the centres of cells (n, 3), -1 for cells that do not belong to the region."""
        inside: NDArray[np.bool_] = np.asarray(((cells >= 0) & (cells < self.size)).all(axis=1))
        asked = np.ravel_multi_index(tuple(np.where(inside[:, None], cells, 0).T), tuple(self.size))
        row = np.minimum(np.searchsorted(self._keys, asked), len(self._keys) - 1)
        return np.where(inside & (self._keys[row] == asked), len(self.nodes) + row, -1)

    def holds(self, cells: IntArray) -> NDArray[np.bool_]:
        """Which cells (n, 3) belong to the region."""
        return np.asarray(self.numbers(cells) >= 0)

    def renumbered(self, larger: "Region") -> IntArray:
        """The number that each place has in a region with all the cells of this one, and more."""
        nodes, known = (
            np.ravel_multi_index(tuple(region.nodes.T), tuple(region.size + 1)) for region in (self, larger)
        )
        return np.concatenate([np.searchsorted(known, nodes), larger.numbers(self.cells)])


def _noise(places: FloatArray) -> FloatArray:
    """Numbers between -1 and 1 (n, 3) that depend on the place alone."""
    mixed = places @ np.array([[12.9898, 39.3467, 73.1562], [78.233, 11.1351, 52.2354], [37.719, 83.1557, 9.1513]])
    return np.asarray(2 * np.modf(np.abs(np.sin(mixed)) * 43758.5453)[0] - 1)


def cells_round(places: FloatArray, reach: int, size: IntArray) -> IntArray:
    """The cells (n, 3), sorted, of a lattice of `size` cells within `reach` cells of the cells that hold the places."""
    wide = tuple((size + 2 * reach).tolist())
    cells = np.floor(places).astype(np.int64)
    cells = cells[((cells >= 0) & (cells < size)).all(axis=1)]
    keys = distinct(np.ravel_multi_index(tuple((cells + reach).T), wide))
    for stride in (wide[1] * wide[2], wide[2], 1):
        keys = distinct(keys[:, None] + stride * np.arange(-reach, reach + 1))
    cells = np.column_stack(np.unravel_index(keys, wide)) - reach
    return cells[((cells >= 0) & (cells < size)).all(axis=1)]


def build_region(cells: IntArray, size: IntArray, last: Region | None = None) -> Region:
    """The region of cells (n, 3), sorted, of a lattice of `size` cells; no vertex of the last one has moved."""
    flat = np.ravel_multi_index(tuple(cells.T), tuple(size))
    corners = cells[:, None] + np.array(CORNERS)
    named = np.ravel_multi_index(tuple(corners.reshape(-1, 3).T), tuple(size + 1))
    keys, numbers = np.unique(named, return_inverse=True)
    numbers = numbers.reshape(-1, 8)
    nodes = np.column_stack(np.unravel_index(keys, tuple(size + 1)))
    centers = len(nodes) + np.arange(len(cells))
    tetrahedra, pyramids = [], []
    for (axis, side), face in _FACE_OF.items():
        beside = cells + (2 * side - 1) * np.eye(3, dtype=np.int64)[axis]
        inside = (beside[:, axis] >= 0) & (beside[:, axis] < size[axis])
        other = np.ravel_multi_index(tuple(np.where(inside[:, None], beside, 0).T), tuple(size))
        place = np.minimum(np.searchsorted(flat, other), len(flat) - 1)
        shared = inside & (flat[place] == other)
        base = numbers[:, face]
        pyramids.append(np.column_stack([centers, base])[~shared])
        if side:
            ends = np.column_stack([centers, centers[place]])[shared]
            tetrahedra += [np.column_stack([ends, base[shared][:, [k, (k + 1) % 4]]]) for k in range(4)]
    outer = np.concatenate(pyramids)
    places = np.concatenate([nodes.astype(float), cells + 0.5])
    free = np.ones(len(places), bool)
    free[outer[:, 1:].ravel()] = False
    if last is not None:
        known = np.searchsorted(keys, np.ravel_multi_index(tuple(last.nodes.T), tuple(size + 1)))
        free[known] &= (last.places[: len(known)] != last.nodes).any(axis=1)
    places[free] += _JITTER * _noise(places[free])
    return Region(places, nodes, np.concatenate(tetrahedra), outer, cells, size)


def reaching(last: Region | None, touched: FloatArray, size: IntArray) -> Region:
    """The last region where it reaches far enough, else one with more cells, and a cell to spare around these."""
    needed = cells_round(touched, _REACH, size)
    if last is None:
        return build_region(needed, size)
    lacking = needed[~last.holds(needed)]
    if not len(lacking):
        return last
    extra = cells_round(lacking.astype(float), 1, size)
    cells = np.concatenate([last.cells, extra[~last.holds(extra)]])
    return build_region(cells[np.lexsort(cells.T[::-1])], size, last)


def inner_places(cleared: FloatArray, new: FloatArray) -> FloatArray:
    """Places in or beside all cells that the region must hold: those of new vertices, and of what is cleared."""
    parts = [new]
    radii = np.ceil(cleared[:, 3])
    for radius in np.unique(radii):  # in each cell of a ball, and the few beside it, there is such a place
        steps = np.arange(-radius, radius + 1)
        offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        offsets = offsets[np.linalg.norm(offsets, axis=1) < radius + 0.5]
        parts.append((cleared[radii == radius, None, :3] + offsets).reshape(-1, 3))
    return np.concatenate(parts)
