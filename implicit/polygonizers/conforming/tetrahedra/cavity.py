"""Delaunay tetrahedra with the skeleton's vertices in place of the lattice points near them.

Only the tetrahedra that a new vertex disturbs are replaced. The faces between them and the rest are marked; the
Delaunay tetrahedra of all vertices involved fall apart along the marked faces, and the parts that hold a new vertex
fill the hole exactly, which their volume confirms.
"""

from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, cKDTree

from implicit.kernels.elementary import OPTIONS
from implicit.polygonizers.conforming.local import among, at_all, at_some
from implicit.polygonizers.conforming.tetrahedra.region import Region, cells_round
from implicit.topology import renumbered

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NEAR = 0.22
"""Lattice points nearer to a new vertex than this give way."""
_SLACK = 1e-7
_WIDER = 2
"""Where flat tetrahedra are in the way of an exact fit, those around are replaced too, so many times."""
_TOGETHER = 300
"""Holes of so few tetrahedra in all are filled together: to tell them apart takes longer."""
_SIMPLEST = 5
"""Fewer vertices have no Delaunay tetrahedra, for the library that finds them."""
_THIN, _INNER = 1e-12, 1 - 1e-9
"""Volumes (six-fold) below the first count as so large; points on a sphere are not in it."""
_WAY = np.array([0.8, 0.48, 0.36])
"""A unit vector along which vertices near different points and curves are mostly apart."""


def dead_vertices(region: Region, cleared: FloatArray, new: FloatArray) -> NDArray[np.bool_]:
    """The region's vertices that give way to new ones (n, 3), or lie within the cleared places and radii (m, 4)."""
    dead = np.zeros(len(region.places) + 1, bool)
    inside = region.tree.query_ball_point(cleared[:, :3], cleared[:, 3])
    dead[np.fromiter(chain.from_iterable(inside), np.int64)] = True
    dead[region.tree.query(new, distance_upper_bound=_NEAR)[1]] = True
    return dead[:-1]


@dataclass(frozen=True, eq=False)
class _Filling:
    """What a region was filled with: its tetrahedra that stay, and those that replace the others.

    dead: the region's places that were taken out; new: those that came in, numbered after the region's. The first
    `known` of the fresh ones were there before the last vertices came.
    """

    region: Region
    dead: NDArray[np.bool_]
    new: FloatArray
    stay: IntArray
    fresh: IntArray
    known: int = 0


@dataclass(eq=False)
class Cavity:
    """What a region is filled with. Where vertices or cells are added to those of the last filling, only what these
    disturb is replaced.
    """

    last: _Filling | None = None

    def fill(self, region: Region, dead: NDArray[np.bool_], new: FloatArray) -> tuple[IntArray, IntArray, int, bool]:
        """The region's tetrahedra that stay (n, 4); those that replace the others (m, 4), and how many of them did so
        at the last call; and whether they fit exactly. New vertices are numbered after those of the region.
        """
        places = np.concatenate([region.places, new])
        last = _grown(self.last, region) if self.last else None
        fits = False
        if last is not None and np.array_equal(last.new, new[: len(last.new)]) and not (last.dead & ~dead).any():
            filled, fits = _add(last, places, dead, new)
        if not fits:
            none = np.zeros((0, 4), np.int64)
            start = _Filling(region, np.zeros(len(dead), bool), new[:0], region.tetrahedra, none)
            filled, fits = _add(start, places, dead, new)
        self.last = filled if fits else None
        return filled.stay, filled.fresh, filled.known, bool(fits and not dead[region.pyramids].any())


def _add(last: _Filling, places: FloatArray, dead: NDArray[np.bool_], new: FloatArray) -> tuple[_Filling, bool]:
    """A filling with the vertices that came since, and whether they fit."""
    first = len(dead) + len(last.new)
    if first == len(places) and not (dead & ~last.dead).any():
        return replace(last, known=len(last.fresh)), True
    old, changed = _touched(last, places, dead, new[len(last.new) :])
    for _ in range(_WIDER + 1):
        gone = np.concatenate([last.stay[old], last.fresh[changed]])
        more, fits = _replace(places, gone, dead, first)
        if fits:
            break
        around = np.zeros(len(places), bool)
        around[gone] = True
        old, changed = at_some(around, last.stay), at_some(around, last.fresh)
    fresh = np.concatenate([last.fresh[~changed], more])
    known = len(last.fresh) - int(changed.sum())
    return _Filling(last.region, dead, new, last.stay[~old], fresh, known), fits


def _replace(places: FloatArray, gone: IntArray, dead: NDArray[np.bool_], first: int) -> tuple[IntArray, bool]:
    """Tetrahedra in place of those that are gone, with the vertices from `first` on; whether they fit exactly."""
    if not len(gone):
        return gone, first == len(places)
    used, gone = renumbered(gone, len(places))
    old, volume = used[gone], _volume(places[used[gone]]).sum()
    used = np.concatenate([used, np.arange(first, len(places))])
    count, alive = int(gone.max()) + 1, np.ones(len(used), bool)
    alive[:count] = ~np.append(dead, np.zeros(len(places) - len(dead), bool))[used[:count]]
    names = np.random.default_rng(0).integers(0, 2**62, len(used))
    keys = np.sort(_face_names(names, gone), axis=None)
    alone = np.append(True, keys[1:] != keys[:-1]) & np.append(keys[1:] != keys[:-1], True)
    hole = _components(gone, count) if len(gone) > _TOGETHER else np.zeros(len(gone), np.int64)
    home = np.full(len(used) - count, hole[0])
    if (hole != hole[0]).any():
        home = hole[cKDTree(places[old].mean(axis=1)).query(places[first:])[1]]
    parts = []
    for number in np.unique(hole):
        corners = np.unique(gone[hole == number])
        rows = np.concatenate([corners[alive[corners]], count + np.flatnonzero(home == number)])
        if len(rows) < _SIMPLEST:
            return old[:0], False
        delaunay = Delaunay(places[used[rows]])
        parts.append((rows, delaunay.simplices.astype(np.int64), delaunay.neighbors.astype(np.int64)))
    filled = used[_inside(parts, names, keys[alone], count)]
    return filled, bool(abs(_volume(places[filled]).sum() / volume - 1) < _SLACK)


def _inside(parts: list[tuple[IntArray, IntArray, IntArray]], names: IntArray, rim: IntArray, first: int) -> IntArray:
    """Of the Delaunay tetrahedra of some vertices (rows, simplices, neighbours) those on that side of the faces `rim`
    where vertices from `first` on are.
    """
    begins = np.cumsum([0, *(len(simplices) for _, simplices, _ in parts)])
    tets = np.concatenate([rows[simplices] for rows, simplices, _ in parts])
    beyond = np.concatenate([np.where(n >= 0, n + b, -1) for (_, _, n), b in zip(parts, begins[:-1], strict=True)])
    free = (beyond >= 0) & ~among(_face_names(names, tets), rim)
    chosen, count = np.logical_or.reduce([corner >= first for corner in tets.T]), 0
    while int(chosen.sum()) > count:  # most hold a new vertex: soon all are found
        count = int(chosen.sum())
        chosen |= np.logical_or.reduce([way & chosen[others] for way, others in zip(free.T, beyond.T, strict=True)])
    return np.asarray(tets[chosen])


def _face_names(names: IntArray, tets: IntArray) -> IntArray:
    """A number (n, 4) for the face opposite each corner: the sum of the random numbers of its vertices."""
    own = names[tets]
    return np.asarray(own.sum(axis=1, keepdims=True) - own)


def _grown(last: _Filling, region: Region) -> _Filling | None:
    """The filling of a region with more cells, if that has all cells of the last one."""
    if last.region is region:
        return last
    if not region.holds(last.region.cells).all():
        return None
    size = len(region.places)
    known = last.region.renumbered(region)
    number = np.concatenate([known, size + np.arange(len(last.new))])
    had, dead = np.zeros(size, bool), np.zeros(size, bool)
    had[known[len(last.region.nodes) :]] = True
    dead[known] = last.dead
    more = region.tetrahedra[~had[region.tetrahedra[:, :2]].all(axis=1)]
    stay, fresh = np.concatenate([number[last.stay], more]), number[last.fresh]
    return replace(last, region=region, dead=dead, stay=stay, fresh=fresh)


def _touched(
    last: _Filling, places: FloatArray, dead: NDArray[np.bool_], new: FloatArray
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which tetrahedra of a filling lose a corner or have a new vertex in their sphere: of the lattice, and others.

    A vertex in the sphere of a lattice tetrahedron lies in one of its two cells or beside both.
    """
    region = last.region
    near = np.zeros(len(places), bool)
    beside = region.numbers(cells_round(new, 1, region.size))
    near[beside[beside >= 0]] = True
    close = np.flatnonzero(at_all(near, last.stay[:, :2]))
    gone = np.zeros(len(places), bool)
    gone[: len(dead)] = dead & ~last.dead
    old, changed = at_some(gone, last.stay), at_some(gone, last.fresh)
    old[close] |= _holding(places, last.stay[close], new)
    return old, changed | _holding(places, last.fresh, new)


def _holding(places: FloatArray, tetrahedra: IntArray, points: FloatArray) -> NDArray[np.bool_]:
    """Which tetrahedra (n, 4) have one of the points (k, 3) in their sphere."""
    along = points @ _WAY
    order = np.argsort(along)
    found = np.zeros(len(tetrahedra), np.bool_)
    _mark_holding(np.ascontiguousarray(places), tetrahedra, points[order], along[order], _WAY, found)
    return found


@njit(**OPTIONS)
def _mark_holding(places: Any, tetrahedra: Any, points: Any, along: Any, way: Any, found: Any) -> None:
    """With corners 0, a, b, c the centre is (aa b x c + bb c x a + cc a x b) / (2 a . b x c), huge for flat ones."""
    for row in range(len(tetrahedra)):
        o, p, q, r = tetrahedra[row]
        ax, ay, az = places[p, 0] - places[o, 0], places[p, 1] - places[o, 1], places[p, 2] - places[o, 2]
        bx, by, bz = places[q, 0] - places[o, 0], places[q, 1] - places[o, 1], places[q, 2] - places[o, 2]
        cx, cy, cz = places[r, 0] - places[o, 0], places[r, 1] - places[o, 1], places[r, 2] - places[o, 2]
        aa, bb, cc = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        volume = ax * ux + ay * uy + az * uz
        size = 2 * max(abs(volume), _THIN)
        if volume < 0:
            size = -size
        x = (aa * ux + bb * (cy * az - cz * ay) + cc * (ay * bz - az * by)) / size
        y = (aa * uy + bb * (cz * ax - cx * az) + cc * (az * bx - ax * bz)) / size
        z = (aa * uz + bb * (cx * ay - cy * ax) + cc * (ax * by - ay * bx)) / size
        reach = (x * x + y * y + z * z) ** 0.5 * _INNER
        x, y, z = x + places[o, 0], y + places[o, 1], z + places[o, 2]
        middle = x * way[0] + y * way[1] + z * way[2]
        k = np.searchsorted(along, middle - reach)
        while k < len(points) and along[k] < middle + reach and not found[row]:
            dx, dy, dz = points[k, 0] - x, points[k, 1] - y, points[k, 2] - z
            found[row] = dx * dx + dy * dy + dz * dz < reach * reach
            k += 1


def _components(simplices: IntArray, size: int) -> IntArray:
    """Numbers (n,) of simplices that are equal where they hang together by vertices."""
    first = np.repeat(simplices[:, 0], simplices.shape[1] - 1)
    graph = coo_array((np.ones(len(first), bool), (first, simplices[:, 1:].ravel())), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1][simplices[:, 0]])


def _volume(corners: FloatArray) -> FloatArray:
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    return np.asarray(np.abs(np.einsum("ij,ij->i", a, np.cross(b, c))) / 6)
