"""A patch of tetrahedra joined to the mesh of the sweep along the squares between them."""

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.block import Put
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.refine import Patch

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def join_patch(
    vertices: FloatArray, faces: IntArray, grid: Grid, patch: Patch, on: FloatArray, first: int
) -> tuple[Put, FloatArray, int]:
    """Which faces lie in the patch's cells, and its faces in their place; its vertices, those `on` (n, 3) the singular
    set first, numbered from `first` on; and how many vertices between the patch and the sweep did not match.
    """
    cells = np.floor(grid.to_units(vertices[faces].mean(axis=1))).astype(np.int64)
    inside = patch.region.holds(cells)
    number = first + len(on) + np.arange(len(patch.places))
    special = np.full(int(patch.names.max(initial=0)) + 1, -1)
    start = len(patch.region.places)
    special[start : start + len(on)] = first + np.arange(len(on))[: max(len(special) - start, 0)]
    same = patch.names[:, 0] == patch.names[:, 1]
    number[same] = special[patch.names[same, 0]]
    shared = np.flatnonzero(_on_rim(patch))
    places = _rim_places(grid, vertices, np.unique(faces[inside]))
    missing = 0
    for row in shared.tolist():
        key = _edge_key(patch.region.nodes[patch.names[row]])
        if key in places:
            number[row] = places[key]
        else:
            missing += 1
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


def _edge_key(ends: IntArray) -> tuple[int, int, int, int]:
    low = ends.min(axis=0)
    return int(low[0]), int(low[1]), int(low[2]), int(np.argmax(np.abs(ends[1] - ends[0])))


def _rim_places(grid: Grid, vertices: FloatArray, rows: IntArray) -> dict[tuple[int, int, int, int], int]:
    """The vertices of the sweep by the lattice edge they lie on."""
    units = grid.to_units(vertices[rows])
    nearest = np.rint(units)
    axis = np.argmax(np.abs(units - nearest), axis=1)
    low = nearest.astype(np.int64)
    k = np.arange(len(rows))
    low[k, axis] = np.floor(units[k, axis])
    return {(a, b, c, d): r for (a, b, c), d, r in zip(low.tolist(), axis.tolist(), rows.tolist(), strict=True)}
