"""A mesh cut along a wall: a sphere, or another surface.

Each vertex is inside the wall, on it, or outside. Vertices nearer to the wall than a share of the cell are first moved
to the curve where surface and wall meet, so that few slivers are left; then the sides from inside to outside are cut at
a new vertex on that curve. A vertex is not moved where the cut mesh would touch itself there, or turn a triangle over.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Ball
from implicit.evaluate import Field
from implicit.polygonizers.weld import list_marked
from implicit.topology import find_edges, renumbered, split_vertices, with_others

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Trimesh = tuple[FloatArray, FloatArray, IntArray]

_NEAR = 0.2
"""Vertices within this share of a cell of the sphere are moved onto it."""
_ACROSS = 0.7
"""Of a side whose height changes by more than this share of its length only one end is moved."""
_APART = 1e-6
"""Vertices within this share of a cell of each other are at one place."""
_CHORDS = 6
_HIT = 1e-3
"""A place so near to the wall, as a share of a cell, is where to start for the curve."""
_ON = 1e-9
"""Vertices within this share of a cell of the wall are on it, and places so near to f = 0 are on that."""


class Rim(Protocol):
    """The curve where f = 0 meets a wall."""

    @property
    def field(self) -> Field:
        """The field of f."""

    @property
    def cell(self) -> float:
        """The length of the cells the mesh came from."""

    def heights(self, points: FloatArray) -> FloatArray:
        """Signed distances (n,) from the wall, negative inside."""

    def reach(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points moved to the curve, and unit normals there."""


@dataclass(frozen=True, eq=False)
class SphereRim:
    """The curve where f = 0 meets the sphere."""

    ball: Ball
    field: Field
    cell: float

    def heights(self, points: FloatArray) -> FloatArray:
        """Signed distances (n,) from the sphere, negative inside."""
        offset = points - self.ball.center
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset)) - self.ball.radius)

    def reach(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points moved to the curve, by Newton's steps of least length, and unit normals there."""
        center, radius = np.array(self.ball.center), self.ball.radius
        start = points
        for _ in range(8):
            f, g = self.field.gradients(points)
            out = points - center
            distance = np.linalg.norm(out, axis=1)
            n = out / distance[:, None]
            gg, gn = (g * g).sum(1), (g * n).sum(1)
            determinant = gg - gn * gn
            height = distance - radius
            with np.errstate(all="ignore"):
                along_g = np.where(determinant > 1e-12 * gg, (gn * height - f) / determinant, 0.0)
            along_n = -height - along_g * gn
            step = along_g[:, None] * g + along_n[:, None] * n
            length = np.linalg.norm(points + step - start, axis=1)
            points = np.where((length < 2 * self.cell)[:, None], points + step, points)
            if not np.any(np.linalg.norm(step, axis=1) > 1e-13 * radius):
                break
        out = points - center
        points = center + out * (radius / np.linalg.norm(out, axis=1))[:, None]
        return points, unit(self.field.gradients(points)[1])


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) of length 1, or 0 where there is no direction."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def clip(vertices: FloatArray, normals: FloatArray, faces: IntArray, ball: Ball, field: Field, cell: float) -> Trimesh:
    """The part of a mesh of f = 0 inside the ball; its boundary lies on the sphere, and on f = 0.

    cell: the length of the cells the mesh came from.
    """
    return cut_along(SphereRim(ball, field, cell), vertices, normals, faces)


def cut_along(
    rim: Rim, vertices: FloatArray, normals: FloatArray, faces: IntArray, fixed: NDArray[np.bool_] | None = None
) -> Trimesh:
    """The part of a mesh of f = 0 inside a wall. `fixed` vertices are not moved, and not cut off when on the wall.

    Vertices keep their numbers, new ones come behind.
    """
    height = rim.heights(vertices)
    if not (height > 0).any():
        return vertices, normals, faces
    shallow = list_marked(faces, height >= -_NEAR * rim.cell)
    deep = np.ones(len(faces), np.bool_)
    deep[shallow] = False
    near = faces[shallow]
    outside = (height > _NEAR * rim.cell)[near.T]
    names, near = renumbered(near[~(outside[0] & outside[1] & outside[2])], len(vertices))
    count = len(names)
    held = np.zeros(count, bool) if fixed is None else fixed[names]
    places, upright, kept = _cut_near(rim, (vertices[names], normals[names], near), height[names], held)
    names = np.append(names, len(vertices) + np.arange(len(places) - count))
    vertices, normals = np.concatenate([vertices, places[count:]]), np.concatenate([normals, upright[count:]])
    vertices[names[:count]], normals[names[:count]] = places[:count], upright[:count]
    return vertices, normals, with_others(faces, deep, names[kept])


def _cut_near(rim: Rim, mesh: Trimesh, height: FloatArray, fixed: NDArray[np.bool_]) -> Trimesh:
    """The part inside a wall of the faces that are near it."""
    vertices, normals, faces = mesh
    movable = (np.abs(height) < _NEAR * rim.cell) & ~fixed
    movable &= _crossing(height, faces)
    on = np.abs(height) < _ON * rim.cell
    movable[_behind(vertices, height, faces, movable, on)] = False
    old, ups, (vertices, normals) = vertices, normals, (vertices.copy(), normals.copy())
    vertices[movable], normals[movable] = rim.reach(vertices[movable])
    # A surface that touches an edge of a box does not meet both faces there near vertices beside.
    missed = np.flatnonzero(movable)
    missed = missed[~_on_surface(rim, vertices[missed])]
    movable[missed] = False
    missed = np.append(missed, _twins(vertices, height, _ends_of(faces, movable), _APART * rim.cell))
    movable[missed], vertices[missed], normals[missed] = False, old[missed], ups[missed]
    known = np.zeros(0, np.int64)
    fresh: tuple[FloatArray, ...] = (old[:0], ups[:0])
    while True:
        side = np.where(movable | on, 0, np.where(height < 0, -1, 1)).astype(np.int8)
        kept, cut = _cut(side, faces, height, _ON * rim.cell)
        keys = cut @ np.array([len(old), 1])
        more = ~np.isin(keys, known)
        (p, q), (low, high) = (part[cut[more].T] for part in (old, height))
        fresh = _merged(more, fresh, np.isin(known, keys), rim.reach(_on_wall(rim, p, q, low, high)))
        known = keys
        places, upright = (np.concatenate(pair) for pair in zip((vertices, normals), fresh, strict=True))
        moved = np.append(movable, np.zeros(len(places) - len(old), bool))
        beside = kept[list_marked(kept, moved)]
        split = split_vertices(beside, find_edges(beside, len(places)))
        bad = np.append(split, _turned(places, upright, beside))
        bad = bad[moved[bad]]
        if not len(bad):
            return places, upright, kept
        movable[bad] = False
        vertices[bad], normals[bad] = old[bad], ups[bad]


def _on_surface(rim: Rim, points: FloatArray) -> NDArray[np.bool_]:
    """Whether points (n, 3) have been moved to f = 0."""
    f, slope = rim.field.gradients(points)
    return np.asarray(np.abs(f) <= _ON * rim.cell * np.linalg.norm(slope, axis=1))


def _merged(
    more: NDArray[np.bool_], known: tuple[FloatArray, ...], stay: NDArray[np.bool_], fresh: tuple[FloatArray, ...]
) -> tuple[FloatArray, ...]:
    """Arrays (n, 3) with fresh rows where there are `more`, and in between, in order, those that stay of known ones."""
    result = tuple(np.empty((len(more), 3)) for _ in fresh)
    for target, old, new in zip(result, known, fresh, strict=True):
        target[more], target[~more] = new, old[stay]
    return result


def _on_wall(rim: Rim, p: FloatArray, q: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where the sides from p to q (n, 3), with heights low < 0 and high > 0 (n,), meet the wall, by a few chords."""
    points = (p * high[:, None] - q * low[:, None]) / (high - low)[:, None]
    left, ends, heights = np.arange(len(p)), np.stack([p, q]), np.stack([low, high])
    for _ in range(_CHORDS):
        found = rim.heights(points[left])
        side = (found >= 0).astype(np.int64)
        ends[side, left], heights[side, left] = points[left], found
        left = left[np.abs(found) > _HIT * rim.cell]
        if not len(left):
            break
        (p, q), (low, high) = ends[:, left], heights[:, left, None]
        points[left] = (p * high - q * low) / (high - low)
    return points


def _turned(vertices: FloatArray, normals: FloatArray, faces: IntArray) -> IntArray:
    """The vertices of faces that look away from the normals at their corners."""
    a, b, c = faces.T
    across = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
    return faces[np.einsum("ij,ij->i", across, normals[a] + normals[b] + normals[c]) < 0].ravel()


def _crossing(height: FloatArray, faces: IntArray) -> NDArray[np.bool_]:
    """The vertices of faces that are neither wholly inside nor wholly outside."""
    outside = height[faces] >= 0
    mixed = faces[outside.any(axis=1) & ~outside.all(axis=1)]
    found = np.zeros(len(height), bool)
    found[mixed.ravel()] = True
    return found


def _behind(
    vertices: FloatArray, height: FloatArray, faces: IntArray, movable: NDArray[np.bool_], on: NDArray[np.bool_]
) -> IntArray:
    """Of movable vertices those that would come to the place of others: the farther ends of sides across the wall, and
    the farthest corners of faces that have only such, or some that are on the wall.
    """
    a, b = _ends_of(faces, movable)
    across = np.abs(height[a] - height[b]) > _ACROSS * np.linalg.norm(vertices[a] - vertices[b], axis=1)
    behind = np.where(np.abs(height[a]) > np.abs(height[b]), a, b)[across]
    left = movable.copy()
    left[behind] = False
    flat = faces[(left | on)[faces].all(axis=1) & left[faces].any(axis=1)]
    farthest = np.where(left[flat], np.abs(height[flat]), -1).argmax(axis=1)
    return np.append(behind, np.take_along_axis(flat, farthest[:, None], axis=1))


def _ends_of(faces: IntArray, movable: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """Both ends (n,) of the sides of faces that have two movable ones."""
    faces = faces[movable[faces].sum(axis=1) > 1]
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    a, b = ends[movable[ends].all(axis=1)].T
    return a, b


def _twins(vertices: FloatArray, height: FloatArray, ends: tuple[IntArray, IntArray], apart: float) -> IntArray:
    """Of sides whose ends came to one place, as on an edge of a box, the ends that came from farther away."""
    a, b = ends
    same = np.linalg.norm(vertices[a] - vertices[b], axis=1) <= apart
    return np.asarray(np.where(np.abs(height[a]) > np.abs(height[b]), a, b)[same])


def _cut(side: NDArray[np.int8], faces: IntArray, height: FloatArray, slack: float) -> tuple[IntArray, IntArray]:
    """The faces inside, and the sides (n, 2) from inside to outside that get vertex len(side) + row."""
    corner = side[faces]
    inside = (corner < 0).any(axis=1) | (height[faces].sum(axis=1) < slack)  # or in the wall
    whole = faces[(corner <= 0).all(axis=1) & inside]
    split = (corner < 0).any(axis=1) & (corner > 0).any(axis=1)
    # Turn each split face so that its first corner is inside and its last is not.
    part, sign = faces[split], corner[split]
    turn = np.argmax((sign < 0) & (np.roll(sign, 1, axis=1) >= 0), axis=1)
    rows = np.arange(len(part))[:, None]
    order = (turn[:, None] + np.arange(3)) % 3
    part, sign = part[rows, order], sign[rows, order]
    a, b, c = part.T
    keys, names = _name_cuts(a, b, c, sign, len(side))
    ab, bc, ca = names
    pieces = [whole]
    for pattern, triangles in (
        ((-1, 0, 1), ((a, b, ca),)),
        ((-1, 1, 0), ((a, ab, c),)),
        ((-1, 1, 1), ((a, ab, ca),)),
        ((-1, -1, 1), ((a, b, bc), (a, bc, ca))),
    ):
        here = (sign == pattern).all(axis=1)
        pieces += [np.column_stack(triangle)[here] for triangle in triangles]
    return np.concatenate(pieces), keys


def _name_cuts(
    a: IntArray, b: IntArray, c: IntArray, sign: NDArray[np.int8], size: int
) -> tuple[IntArray, tuple[IntArray, ...]]:
    """The cut sides (n, 2), inside end first, and for the three sides of each face its new vertex, -1 if not cut."""
    names = []
    ends = []
    for (p, q), (i, j) in zip(((a, b), (b, c), (c, a)), ((0, 1), (1, 2), (2, 0)), strict=True):
        cut = sign[:, i] * sign[:, j] < 0
        names.append(np.where(cut, 0, -1))
        ends.append(np.where(sign[:, i] < 0, p * size + q, q * size + p)[cut])
    keys, inverse = np.unique(np.concatenate(ends), return_inverse=True)
    inverse += size
    first = 0
    for name in names:
        count = int(np.count_nonzero(name == 0))
        name[name == 0] = inverse[first : first + count]
        first += count
    return np.column_stack([keys // size, keys % size]), tuple(names)
