"""Delaunay tetrahedra with the skeleton's vertices in place of the lattice points near them.

Only the tetrahedra that a new vertex disturbs are replaced. The faces between them and the rest are marked; the
Delaunay tetrahedra of all vertices involved fall apart along the marked faces, and the parts that hold a new vertex
fill the hole exactly, which their volume confirms.
"""

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
_FACES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))


def dead_vertices(region: Region, cleared: FloatArray, new: FloatArray) -> NDArray[np.bool_]:
    """The region's vertices that give way to new ones (n, 3), or lie within the cleared places and radii (m, 4)."""
    tree = cKDTree(region.places)
    dead = np.zeros(len(region.places), bool)
    for rows in tree.query_ball_point(cleared[:, :3], cleared[:, 3]):
        dead[rows] = True
    return np.asarray(dead | (cKDTree(new).query(region.places, distance_upper_bound=_NEAR)[0] < _NEAR))


def tetrahedralize(region: Region, dead: NDArray[np.bool_], new: FloatArray) -> tuple[IntArray, IntArray, bool]:
    """The region's tetrahedra that stay (n, 4), those that replace the others (m, 4), and whether they fit exactly.

    New vertices are numbered after those of the region.
    """
    places = np.concatenate([region.places, new])
    size = len(region.places)
    tets = region.tetrahedra
    center, radius = circumspheres(region.places[tets])
    touched = dead[tets].any(axis=1) | (cKDTree(new).query(center)[0] < radius * (1 - 1e-9))
    stay, gone = tets[~touched], tets[touched]
    used = np.unique(gone)
    rows = np.concatenate([used[~dead[used]], size + np.arange(len(new))])
    delaunay = Delaunay(places[rows])
    fresh = rows[delaunay.simplices]
    faces = np.sort(np.concatenate([gone[:, face] for face in _FACES]), axis=1)
    keys, uses = np.unique(_face_keys(faces, len(places)), return_counts=True)
    rim = keys[uses == 1]
    starts, stops = [], []
    for number, face in enumerate(_FACES):
        cut = np.isin(_face_keys(np.sort(fresh[:, face], axis=1), len(places)), rim)
        open_ = np.flatnonzero(~cut & (delaunay.neighbors[:, number] >= 0))
        starts.append(open_)
        stops.append(delaunay.neighbors[open_, number])
    start, stop = np.concatenate(starts), np.concatenate(stops)
    graph = coo_array((np.ones(len(start), bool), (start, stop)), shape=(len(fresh),) * 2)
    label = connected_components(graph, directed=False)[1]
    fresh = fresh[np.isin(label, np.unique(label[(fresh >= size).any(axis=1)]))]
    volume = _volume(places[fresh]).sum() / _volume(region.places[gone]).sum()
    return stay, fresh, bool(abs(volume - 1) < _SLACK and not dead[region.pyramids].any())


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
