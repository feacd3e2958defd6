"""Triangles near the singular set mended: sides along which the surface bends are halved, and others turned.

Along folds, as they run from pinch points, cells that are small enough for the topology are too large for a picture;
and slivers of vertices in one line, as tetrahedra leave them, may face anywhere. Neither a new vertex in the middle of
a side nor the other diagonal of two triangles changes the topology.
"""

#     r           r           r
#    / \         /|\         /|\
#   p---q  to   p-m-q  or   p | q
#    \ /         \|/         \|/
#     s           s           s

from functools import partial

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.local import Local, among, unit_rows
from implicit.polygonizers.steps import step_onto
from implicit.polygonizers.weld import list_marked

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]
Mesh = tuple[FloatArray, FloatArray, IntArray]

_FACING, _ALLOWED = 0.8, 0.5
"""Triangles should not turn by more than this cosine from a normal at a corner; the second is put up with."""
_BEND = 0.7
"""Nor should normals at the ends of a side."""
_TURNED = 0.5
"""Nor do they at those of a side that another is turned to; it may be halved next."""
_ROUNDS = 8
_ASIDE = 0.5
"""The surface is no farther from the middle of a side, as a share of its length."""
_TIE, _PRIME = 1e-9, 9973
_OFF = 1e-10
"""Vertices are so near to f = 0, in cells."""


def mend(local: Local, mesh: Mesh, fixed: Flags) -> Mesh:
    """The mesh with bent sides halved, at new vertices on f = 0, and triangles turned that face elsewhere.

    Sides between `fixed` vertices (v,) and those at the boundary stay; none with a fixed end is halved.
    """
    vertices, normals, faces = mesh
    bad = (_bends(normals, fixed, faces) < _BEND).any(axis=1) | (_facing(vertices, normals, fixed, faces) < _FACING)
    whole = np.zeros(len(vertices), np.bool_)
    whole[faces[bad].ravel()] = True
    around = np.zeros(len(faces), bool)
    around[list_marked(faces, whole)] = True
    mesh, failed = (vertices, normals, faces[around]), np.zeros(0, np.int64)
    for _ in range(_ROUNDS):
        before, tried = mesh, len(failed)
        (vertices, normals, part), failed = _halve(local, mesh, fixed, failed)
        more = len(vertices) - len(fixed)
        fixed, whole = np.append(fixed, np.zeros(more, bool)), np.append(whole, np.ones(more, bool))
        mesh = vertices, normals, _turn(vertices, normals, fixed, part, whole)
        if len(failed) == tried and np.array_equal(before[2], mesh[2]):
            break
    return vertices, normals, np.concatenate([faces[~around], mesh[2]])


def _halve(local: Local, mesh: Mesh, fixed: Flags, failed: IntArray) -> tuple[Mesh, IntArray]:
    """Sides halved that bend most in both their triangles; and the keys of those where that has failed."""
    vertices, normals, faces = mesh
    size = len(vertices)
    pairs, quads = _bent(normals, fixed, faces, failed)
    p, q, r, s = quads.T
    m = size + np.arange(len(quads))
    places, upright, good = _middles(local, vertices, normals, quads[:, :2])
    parts = np.array([np.column_stack(corners) for corners in ((p, m, r), (q, m, s), (m, q, r), (m, p, s))])
    more = np.concatenate([vertices, places]), np.concatenate([normals, upright])
    loose = np.append(fixed, np.zeros(len(quads), bool))
    old = [faces[rows] for rows in pairs.T]
    for measure in (partial(_facing, *more, loose), partial(_least_bend, more[1], loose)):
        before, after = (np.min([measure(part) for part in some], axis=0) for some in (old, parts))
        good &= after >= np.minimum(before, _ALLOWED)
    number = np.append(np.arange(size), np.where(good, size + np.cumsum(good) - 1, -1))
    first, second, third, fourth = number[parts[:, good]]
    faces = np.concatenate([faces, third, fourth])
    faces[pairs[good, 0]], faces[pairs[good, 1]] = first, second
    mesh = np.concatenate([vertices, places[good]]), np.concatenate([normals, upright[good]]), faces
    return mesh, np.sort(np.append(failed, _keys(p, q)[~good]))


def _bent(normals: FloatArray, fixed: Flags, faces: IntArray, failed: IntArray) -> tuple[IntArray, IntArray]:
    """Pairs (m, 2) of faces whose most bent side is that between them, and their corners p, q, r, s (m, 4)."""
    cosines = _bends(normals, fixed, faces)
    rows = np.flatnonzero((cosines < _BEND).any(axis=1))
    part, after = faces[rows], np.roll(faces[rows], -1, axis=1)
    keys = _keys(part, after)
    cosines = cosines[rows] + _TIE * (keys % _PRIME)  # of equal ones, both faces choose the same
    cosines[among(keys, failed)] = 1
    row = np.arange(len(part))
    quads, beyond = _across(part, 3 * row + cosines.argmin(axis=1), len(normals))
    own = np.flatnonzero((beyond > row) & (beyond[beyond] == row) & (cosines.min(axis=1, initial=1) < _BEND))
    return np.column_stack([rows[own], rows[beyond[own]]]), quads[own]


def _middles(
    local: Local, vertices: FloatArray, normals: FloatArray, sides: IntArray
) -> tuple[FloatArray, FloatArray, Flags]:
    """Points of f = 0 (m, 3) near the middles of sides (m, 2), and their normals; and where both lie in between."""
    ends, ways = vertices[sides], normals[sides]
    middle = ends.mean(axis=1)
    reach = _ASIDE * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    places = step_onto(local.field, middle, local.grid.step)
    values, slopes = local.field.gradients(places)
    upright = unit(slopes)
    cosines = np.einsum("ij,ikj->ik", upright, ways).min(axis=1, initial=1)
    good = np.linalg.norm(places - middle, axis=1) < reach
    good &= np.abs(values) <= _OFF * local.grid.step * np.linalg.norm(slopes, axis=1)
    return places, upright, good & (cosines > np.einsum("ij,ij->i", ways[:, 0], ways[:, 1]))


def _turn(vertices: FloatArray, normals: FloatArray, fixed: Flags, faces: IntArray, whole: Flags) -> IntArray:
    """The faces, with sides of those that face elsewhere turned where both face better then, the best ones first; all
    faces at vertices that are `whole` (v,) are there.
    """
    facing = _facing(vertices, normals, fixed, faces)
    bad = facing < _FACING
    marked = np.zeros(len(vertices), np.bool_)
    marked[faces[bad].ravel()] = True
    rows = list_marked(faces, marked)
    part, sides = faces[rows], np.flatnonzero(np.repeat(bad[rows], 3))
    quads, beyond = _across(part, sides, len(vertices))
    p, q, r, s = quads.T
    known = np.sort(_keys(part, np.roll(part, -1, axis=1)), axis=None)
    held = (fixed[p] & fixed[q]) | (fixed[r] & fixed[s])
    held |= _least_bend(normals, fixed, np.column_stack([r, s])) < _TURNED
    free = whole[r] & (beyond >= 0) & ~held & ~among(_keys(r, s), known)
    pairs = rows[np.column_stack([sides // 3, beyond])]
    new = np.column_stack([p, s, r]), np.column_stack([s, q, r])
    after = np.minimum(*(_facing(vertices, normals, fixed, corners) for corners in new))
    gain = after - facing[pairs].min(axis=1, initial=1)
    wanted = np.flatnonzero(free & (gain > 0))
    chosen = _disjoint(quads, wanted[np.argsort(-gain[wanted], kind="stable")])
    faces = faces.copy()
    faces[pairs[chosen, 0]], faces[pairs[chosen, 1]] = new[0][chosen], new[1][chosen]
    return faces


def _bends(normals: FloatArray, fixed: Flags, faces: IntArray) -> FloatArray:
    """The cosines (n, k) between the normals at the ends of the side that begins at each corner; 1 at fixed ends."""
    after = np.roll(faces, -1, axis=1)
    cosines = [(normals[a] * normals[b]).sum(axis=1) for a, b in zip(faces.T, after.T, strict=True)]
    return np.asarray(np.where(fixed[faces] | fixed[after], 1.0, np.stack(cosines, axis=1)))


def _least_bend(normals: FloatArray, fixed: Flags, faces: IntArray) -> FloatArray:
    return np.asarray(_bends(normals, fixed, faces).min(axis=1, initial=1))


def _facing(vertices: FloatArray, normals: FloatArray, fixed: Flags, faces: IntArray) -> FloatArray:
    """The least cosine (n,) between a face and the normals at its corners that are not fixed; 1 if there are none."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    cosines = np.einsum("ij,ikj->ik", unit_rows(np.cross(b - a, c - a)), normals[faces])
    return np.asarray(np.where(fixed[faces], 1.0, cosines).min(axis=1, initial=1))


def _keys(a: IntArray, b: IntArray) -> IntArray:
    """Numbers of the edges between vertices."""
    return np.minimum(a, b) << 32 | np.maximum(a, b)


def _across(faces: IntArray, sides: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """The corners p, q, r, s (n, 4), drawn above, round sides (n,), and the row (n,) of the face beyond; -1 where there
    is none. Side 3 row + corner begins at that corner.
    """
    row, corner = sides // 3, sides % 3
    p, q, r = (faces[row, (corner + k) % 3] for k in range(3))
    keys = (faces * size + np.roll(faces, -1, axis=1)).ravel()  # one after the other those of each face
    order = np.argsort(keys)
    wanted = q * size + p
    place = order[np.searchsorted(keys, wanted, sorter=order) % max(len(keys), 1)]
    s = faces.ravel()[place - place % 3 + (place + 2) % 3]
    return np.column_stack([p, q, r, s]), np.where(keys[place] == wanted, place // 3, -1)


def _disjoint(quads: IntArray, wanted: IntArray) -> IntArray:
    """Of the rows wanted, best first, those that share no vertex with one before."""
    taken: set[int] = set()
    chosen = []
    for row in wanted.tolist():
        corners = set(quads[row].tolist())
        if taken.isdisjoint(corners):
            taken |= corners
            chosen.append(row)
    return np.array(chosen, np.int64)
