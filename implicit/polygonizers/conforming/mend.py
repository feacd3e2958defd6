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

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.facing import BEND, FACING, measure
from implicit.polygonizers.conforming.local import Local, among
from implicit.polygonizers.steps import step_onto
from implicit.polygonizers.weld import list_marked

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]
Mesh = tuple[FloatArray, FloatArray, IntArray]

_ALLOWED = 0.5
"""Triangles that face so much elsewhere, and sides that bend so much, are put up with when a side is halved."""
_TURNED = 0.5
"""Normals at the ends of a side that another is turned to do not turn by more; it may be halved next."""
_ROUNDS = 8
_ASIDE = 0.5
"""The surface is no farther from the middle of a side, as a share of its length."""
_TIE, _PRIME = 1e-9, 9973
_OFF = 1e-10
"""Vertices are so near to f = 0, in cells."""


@dataclass(frozen=True, eq=False)
class _Patch:
    """Faces (n, 3) over vertices and unit normals (v, 3), some `fixed` (v,), with what is measured of each once.

    bends (n, 3) and facing (n,): what `measure` says of each.
    """

    vertices: FloatArray
    normals: FloatArray
    fixed: Flags
    faces: IntArray
    bends: FloatArray
    facing: FloatArray

    @classmethod
    def of(cls, vertices: FloatArray, normals: FloatArray, fixed: Flags, faces: IntArray) -> "_Patch":
        """The faces measured."""
        return cls(vertices, normals, fixed, faces, *measure(vertices, normals, fixed, faces))

    def others(self, vertices: FloatArray, normals: FloatArray, faces: IntArray) -> "_Patch":
        """Other faces, between its vertices and more of them."""
        if not len(vertices):
            return _Patch.of(self.vertices, self.normals, self.fixed, faces)
        fixed = np.append(self.fixed, np.zeros(len(vertices), bool))
        more = np.concatenate([self.vertices, vertices]), np.concatenate([self.normals, normals])
        return _Patch.of(*more, fixed, faces)

    def rows(self, rows: IntArray | Flags) -> "_Patch":
        """Some of the faces."""
        return replace(self, faces=self.faces[rows], bends=self.bends[rows], facing=self.facing[rows])

    def put(self, rows: IntArray, other: "_Patch") -> "_Patch":
        """The faces with the first of another patch in some rows, and its others behind the last; over its vertices."""
        return replace(
            other,
            faces=_put(self.faces, rows, other.faces),
            bends=_put(self.bends, rows, other.bends),
            facing=_put(self.facing, rows, other.facing),
        )


def _put(old: NDArray[Any], rows: IntArray, new: NDArray[Any]) -> NDArray[Any]:
    """An array with the first of some new rows in old ones, and the others behind the last."""
    result = np.concatenate([old, new[len(rows) :]])
    result[rows] = new[: len(rows)]
    return result


def mend(local: Local, mesh: Mesh, fixed: Flags) -> Mesh:
    """The mesh with bent sides halved, at new vertices on f = 0, and triangles turned that face elsewhere.

    Sides between `fixed` vertices (v,) and those at the boundary stay; none with a fixed end is halved.
    """
    vertices, normals, faces = mesh
    whole = np.zeros(len(vertices), np.bool_)
    patch = _Patch.of(vertices, normals, fixed, faces)
    whole[faces[(patch.bends < BEND).any(axis=1) | (patch.facing < FACING)].ravel()] = True
    around = np.zeros(len(faces), bool)
    around[list_marked(faces, whole)] = True
    patch, failed = patch.rows(around), np.zeros(0, np.int64)
    for _ in range(_ROUNDS):
        before, tried = patch.faces, len(failed)
        patch, failed = _halve(local, patch, failed)
        whole = np.append(whole, np.ones(len(patch.vertices) - len(whole), bool))
        patch = _turn(patch, whole)
        if len(failed) == tried and np.array_equal(before, patch.faces):
            break
    return patch.vertices, patch.normals, np.concatenate([faces[~around], patch.faces])


def _halve(local: Local, patch: _Patch, failed: IntArray) -> tuple[_Patch, IntArray]:
    """Sides halved that bend most in both their triangles; and the keys of those where that has failed."""
    pairs, quads = _bent(patch, failed)
    if not len(pairs):
        return patch, failed
    p, q, r, s = quads.T
    size, count = len(patch.vertices), len(quads)
    m = size + np.arange(count)
    places, upright, good = _middles(local, patch.vertices, patch.normals, quads[:, :2])
    parts = patch.others(places, upright, _stacked((p, m, r), (q, m, s), (m, q, r), (m, p, s)))
    for before, after in (
        (patch.facing[pairs], parts.facing), (patch.bends[pairs].min(axis=2), parts.bends.min(axis=1)),
    ):  # fmt: skip
        good &= after.reshape(4, count).min(axis=0) >= np.minimum(before.min(axis=1), _ALLOWED)
    number = np.append(np.arange(size), np.where(good, size + np.cumsum(good) - 1, -1))
    parts = parts.rows(np.tile(good, 4))
    stay = np.append(np.ones(size, bool), good)
    parts = replace(
        parts, vertices=parts.vertices[stay], normals=parts.normals[stay], fixed=parts.fixed[stay],
        faces=number[parts.faces],
    )  # fmt: skip
    return patch.put(pairs[good].T.ravel(), parts), np.sort(np.append(failed, _keys(p, q)[~good]))


def _bent(patch: _Patch, failed: IntArray) -> tuple[IntArray, IntArray]:
    """Pairs (m, 2) of faces whose most bent side is that between them, and their corners p, q, r, s (m, 4)."""
    rows = np.flatnonzero((patch.bends < BEND).any(axis=1))
    part = patch.faces[rows]
    keys = _keys(part, np.roll(part, -1, axis=1))
    cosines = patch.bends[rows] + _TIE * (keys % _PRIME)  # of equal ones, both faces choose the same
    cosines[among(keys, failed)] = 1
    row = np.arange(len(part))
    quads, beyond = _across(part, 3 * row + cosines.argmin(axis=1), len(patch.vertices))
    own = np.flatnonzero((beyond > row) & (beyond[beyond] == row) & (cosines.min(axis=1, initial=1) < BEND))
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


def _turn(patch: _Patch, whole: Flags) -> _Patch:
    """Sides of faces that face elsewhere turned where both face better then, the best ones first; all faces at vertices
    that are `whole` (v,) are there.
    """
    vertices, fixed, faces = patch.vertices, patch.fixed, patch.faces
    bad = patch.facing < FACING
    marked = np.zeros(len(vertices), np.bool_)
    marked[faces[bad].ravel()] = True
    rows = list_marked(faces, marked)
    part, sides = faces[rows], np.flatnonzero(np.repeat(bad[rows], 3))
    quads, beyond = _across(part, sides, len(vertices))
    p, q, r, s = quads.T
    known = np.sort(_keys(part, np.roll(part, -1, axis=1)), axis=None)
    held = (fixed[p] & fixed[q]) | (fixed[r] & fixed[s])
    free = whole[r] & (beyond >= 0) & ~held & ~among(_keys(r, s), known)
    bend = (patch.normals[r] * patch.normals[s]).sum(axis=1)
    free &= fixed[r] | fixed[s] | (bend >= _TURNED)
    (p, q, r, s), pairs = quads[free].T, rows[np.stack([sides[free] // 3, beyond[free]])]
    new = patch.others(vertices[:0], vertices[:0], _stacked((p, s, r), (s, q, r)))
    gain = new.facing.reshape(2, -1).min(axis=0) - patch.facing[pairs].min(axis=0)
    wanted = np.flatnonzero(gain > 0)
    chosen = _disjoint(quads[free], wanted[np.argsort(-gain[wanted], kind="stable")])
    return patch.put(pairs[:, chosen].ravel(), new.rows(np.concatenate([chosen, len(gain) + chosen])))


def _stacked(*corners: tuple[IntArray, IntArray, IntArray]) -> IntArray:
    """Faces (k n, 3), by three corners (n,) of each kind."""
    return np.concatenate([np.column_stack(three) for three in corners])


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
