"""A patch of tetrahedra joined to the mesh of the sweep along the squares between them."""

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import among
from implicit.polygonizers.conforming.points.block import Put
from implicit.polygonizers.conforming.tetrahedra.patch import Patch

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def join_patch(
    vertices: FloatArray, faces: IntArray, grid: Grid, patch: Patch, on: FloatArray, first: int
) -> tuple[Put, FloatArray, int]:
    """Which faces lie in the patch's cells, and its faces in their place; its vertices, those `on` (n, 3) the singular
    set first, numbered from `first` on; and how many vertices between the patch and the sweep did not match.
    """
    a, b, c = (vertices[corner] for corner in faces.T)
    cells = np.floor(grid.to_units((a + b + c) / 3)).astype(np.int64)
    inside = patch.region.holds(cells)
    number = first + len(on) + np.arange(len(patch.places))
    special = np.full(int(patch.names.max(initial=0)) + 1, -1)
    start = len(patch.region.places)
    special[start : start + len(on)] = first + np.arange(len(on))[: max(len(special) - start, 0)]
    same = patch.names[:, 0] == patch.names[:, 1]
    number[same] = special[patch.names[same, 0]]
    shared = np.flatnonzero(_on_rim(patch))
    rows = np.unique(faces[inside])
    keys = _edge_keys(grid, *_lattice_edges(grid.to_units(vertices[rows])))
    order = np.argsort(keys)
    ends = patch.region.nodes[patch.names[shared]]
    wanted = _edge_keys(grid, ends.min(axis=1), np.argmax(np.abs(ends[:, 1] - ends[:, 0]), axis=1))
    known = among(wanted, keys[order])
    number[shared[known]] = rows[order[np.searchsorted(keys[order], wanted[known])]]
    missing = int((~known).sum())
    return (inside, number[patch.faces]), grid.to_points(np.concatenate([on, patch.places])), missing


def _on_rim(patch: Patch) -> NDArray[np.bool_]:
    """The vertices of a patch on lattice edges of its boundary."""
    outer = np.zeros(int(patch.names.max(initial=0)) + 1, bool)
    bases = patch.region.pyramids[:, 1:]
    outer[np.unique(bases)[np.unique(bases) < len(outer)]] = True
    both = outer[patch.names].all(axis=1) & (patch.names[:, 0] != patch.names[:, 1])
    rows = np.flatnonzero(both)
    nodes = patch.region.nodes[patch.names[rows]]
    result = np.zeros(len(patch.names), bool)
    result[rows] = np.abs(nodes[:, 0] - nodes[:, 1]).sum(axis=1) == 1
    return result


def _edge_keys(grid: Grid, low: IntArray, axis: IntArray) -> IntArray:
    """Numbers for lattice edges that begin at nodes `low` (n, 3) along axes (n,)."""
    return np.asarray(3 * np.ravel_multi_index(tuple(low.T), tuple(grid.cells + 1)) + axis)


def _lattice_edges(units: FloatArray) -> tuple[IntArray, IntArray]:
    """The lattice edges on which places (n, 3) lie: where they begin, and their axes."""
    nearest = np.rint(units)
    axis = np.argmax(np.abs(units - nearest), axis=1)
    low = nearest.astype(np.int64)
    k = np.arange(len(units))
    low[k, axis] = np.floor(units[k, axis])
    return low, axis
