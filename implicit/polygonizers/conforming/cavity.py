"""Delaunay tetrahedra with the skeleton's vertices in place of the lattice points near them.

Only the tetrahedra that a new vertex disturbs are replaced. The faces between them and the rest are marked; the
Delaunay tetrahedra of all vertices involved fall apart along the marked faces, and the parts that hold a new vertex
fill the hole exactly, which their volume confirms.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, cKDTree

from implicit.polygonizers.conforming.region import Region

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NEAR = 0.22
"""Lattice points nearer to a new vertex than this give way."""
_SLACK = 1e-7
_CLOSE = 0.8
"""No new vertex farther than this from the middle of a lattice tetrahedron lies in its sphere."""
_FACES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))


def dead_vertices(region: Region, cleared: FloatArray, new: FloatArray) -> NDArray[np.bool_]:
    """The region's vertices that give way to new ones (n, 3), or lie within the cleared places and radii (m, 4)."""
    tree = cKDTree(region.places)
    dead = np.zeros(len(region.places), bool)
    for rows in tree.query_ball_point(cleared[:, :3], cleared[:, 3]):
        dead[rows] = True
    return np.asarray(dead | (cKDTree(new).query(region.places, distance_upper_bound=_NEAR)[0] < _NEAR))


@dataclass(eq=False)
class Cavity:
    """Holes and what fills them; the Delaunay tetrahedra of a hole are kept for as long as its vertices stay."""

    known: dict[bytes, Any] = field(default_factory=dict)

    def fill(self, region: Region, dead: NDArray[np.bool_], new: FloatArray) -> tuple[IntArray, IntArray, bool]:
        """The region's tetrahedra that stay (n, 4), those that replace the others (m, 4), and whether they fit exactly.

        New vertices are numbered after those of the region.
        """
        places = np.concatenate([region.places, new])
        size, tets = len(region.places), region.tetrahedra
        touched, centers = _touched(region, dead, new)
        stay, gone = tets[~touched], tets[touched]
        faces = np.sort(np.concatenate([gone[:, face] for face in _FACES]), axis=1)
        keys, uses = np.unique(_face_keys(faces, len(places)), return_counts=True)
        rim = keys[uses == 1]
        hole = _components(gone, size)
        home = hole[cKDTree(centers).query(new)[1]]
        fresh = [np.zeros((0, 4), np.int64)]
        for number in np.unique(hole):
            used = np.unique(gone[hole == number])
            rows = np.concatenate([used[~dead[used]], size + np.flatnonzero(home == number)])
            fresh.append(self._fill_hole(places, rows, rim, size))
        filled = np.concatenate(fresh)
        volume = _volume(places[filled]).sum() / _volume(region.places[gone]).sum()
        return stay, filled, bool(abs(volume - 1) < _SLACK and not dead[region.pyramids].any())

    def _fill_hole(self, places: FloatArray, rows: IntArray, rim: IntArray, size: int) -> IntArray:
        """The Delaunay tetrahedra of vertices `rows` on the inner side of the faces `rim`."""
        key = places[rows].tobytes()
        if key not in self.known:
            delaunay = Delaunay(places[rows])
            self.known[key] = (delaunay.simplices, delaunay.neighbors)
        simplices, neighbors = self.known[key]
        tets = rows[simplices]
        starts, stops = [], []
        for number, face in enumerate(_FACES):
            cut = np.isin(_face_keys(np.sort(tets[:, face], axis=1), len(places)), rim)
            open_ = np.flatnonzero(~cut & (neighbors[:, number] >= 0))
            starts.append(open_)
            stops.append(neighbors[open_, number])
        start, stop = np.concatenate(starts), np.concatenate(stops)
        graph = coo_array((np.ones(len(start), bool), (start, stop)), shape=(len(tets),) * 2)
        label = connected_components(graph, directed=False)[1]
        return np.asarray(tets[np.isin(label, np.unique(label[(tets >= size).any(axis=1)]))])


def _touched(region: Region, dead: NDArray[np.bool_], new: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Which tetrahedra lose a corner or have a new vertex in their sphere, and the middles of those."""
    tets = region.tetrahedra
    tree = cKDTree(new)
    middle = region.places[tets].mean(axis=1)
    close = np.flatnonzero(np.isfinite(tree.query(middle, distance_upper_bound=_CLOSE)[0]))
    center, radius = circumspheres(region.places[tets[close]])
    touched: NDArray[np.bool_] = np.asarray(dead[tets].any(axis=1))
    touched[close] |= tree.query(center)[0] < radius * (1 - 1e-9)
    return touched, middle[touched]


def _components(simplices: IntArray, size: int) -> IntArray:
    """Numbers (n,) of simplices that are equal where they hang together by vertices."""
    first = np.repeat(simplices[:, 0], simplices.shape[1] - 1)
    graph = coo_array((np.ones(len(first), bool), (first, simplices[:, 1:].ravel())), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1][simplices[:, 0]])


def _face_keys(faces: IntArray, size: int) -> IntArray:
    return np.asarray((faces[:, 0] * size + faces[:, 1]) * size + faces[:, 2])


def _volume(corners: FloatArray) -> FloatArray:
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6)


def circumspheres(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and radii (n,) of the spheres through tetrahedra (n, 4, 3)."""
    first = corners[:, 0]
    ways = corners[:, 1:] - first[:, None]
    offset = np.linalg.solve(2 * ways, (ways * ways).sum(axis=2)[..., None])[..., 0]
    return first + offset, np.linalg.norm(offset, axis=1)
