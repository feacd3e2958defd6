"""One vertex where several crossings meet at a lattice point.

When f vanishes at a lattice point, every crossed edge there has its root at that point, and the triangles between them
have no area. The crossings that such triangles join become one vertex, unless that would make the mesh touch itself:
where sheets meet at the point (the node of a cone), or a tube shrinks to it, they stay apart.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import OPTIONS
from implicit.mesh import area_weighted_normals
from implicit.topology import components, find_edges, renumbered, split_vertices
from implicit.work import trimmed

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


Arrays = tuple[FloatArray, FloatArray, IntArray]


def weld(vertices: FloatArray, normals: FloatArray, faces: IntArray, pinned: IntArray) -> Arrays:
    """Let one vertex of each group that meets at a lattice point stand for all; the arrays are used up.

    Faces that lose their area by that are dropped, and so are vertices without faces, and pieces that are all points.

    pinned: the vertices that lie at a lattice point, exactly, ascending.
    """
    meeting = _meeting(vertices, pinned)
    if not len(meeting):
        return vertices, normals, faces
    marked = _marks(meeting, len(vertices))
    marked[len(vertices) - len(meeting) :] = True  # these may take the places of vertices that are dropped
    near = list_marked(faces, marked)
    part = faces[near]
    members, leader = _groups(vertices, part, meeting)
    kept = part
    if not np.isin(leader, _solid(_renamed(part, members, leader))).all():
        points = _pieces_of_points(vertices, part, _marks(meeting, len(vertices)))
        kept = np.where(points[:, None], part[:, :1], part)
        stay = ~np.isin(members, part[points])
        members, leader = members[stay], leader[stay]
    while True:
        merged = _renamed(kept, members, leader)
        bad = _spoiled(_solid(merged), np.unique(leader), len(vertices))
        if not len(bad):
            faces[near] = merged
            dead = _without_faces(faces, part, merged, members[members != leader], len(vertices))
            return _compact(vertices, normals, faces, near, dead)
        stay = ~np.isin(leader, bad)
        members, leader = members[stay], leader[stay]


def _pieces_of_points(vertices: FloatArray, faces: IntArray, meeting: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which faces belong to pieces of which no triangle has three different corners: there f = 0 at lattice points
    alone. Such pieces have none but meeting vertices.
    """
    a, b, c = (vertices[corner] for corner in faces.T)
    flat = (a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1)
    names, near = renumbered(faces, len(vertices))
    label = components(np.concatenate([near[:, :2], near[:, 1:]]), len(names))
    alive = np.zeros(len(names), np.bool_)
    alive[label[near[~flat].ravel()]] = True
    alive[label[~meeting[names]]] = True
    return np.asarray(~alive[label[near[:, 0]]])


def _solid(faces: IntArray) -> IntArray:
    """The faces with three different vertices."""
    return faces[~_is_flat(faces)]


def _renamed(faces: IntArray, old: IntArray, new: IntArray) -> IntArray:
    """The faces with the vertices `old`, ascending, replaced by `new`: for few of them, without a list of all."""
    if not len(old):
        return faces
    place = np.minimum(np.searchsorted(old, faces), len(old) - 1)
    return np.asarray(np.where(old[place] == faces, new[place], faces))


def _is_flat(faces: IntArray) -> NDArray[np.bool_]:
    a, b, c = faces.T
    return np.asarray((a == b) | (b == c) | (c == a))


def _without_faces(faces: IntArray, before: IntArray, after: IntArray, members: IntArray, size: int) -> IntArray:
    """The vertices, ascending, that no face with area has any more, out of `size`; among them the members, which others
    stand for.
    """
    flat = _is_flat(after)
    lost = np.setdiff1d(before[flat], np.append(after[~flat], members))
    if len(lost):  # they may have faces that did not change
        rest = faces[list_marked(faces, _marks(lost, size))]
        lost = np.setdiff1d(lost, rest[~_is_flat(rest)])
    return np.union1d(members, lost)


def _compact(vertices: FloatArray, normals: FloatArray, faces: IntArray, near: IntArray, dead: IntArray) -> Arrays:
    """Drop vertices, and the faces among `near` without area, by moving the last ones into their places.

    near lists, ascending, at least the faces at the last len(dead) vertices.
    """
    size = len(vertices) - len(dead)
    holes = dead[dead < size]
    moved = np.setdiff1d(np.arange(size, len(vertices)), dead)
    vertices[holes], normals[holes] = vertices[moved], normals[moved]
    part = _renamed(faces[near], moved, holes)
    faces[near] = part
    gone = near[_is_flat(part)]
    count = len(faces) - len(gone)
    free = gone[gone < count]
    faces[free] = faces[np.setdiff1d(np.arange(count, len(faces)), gone)]
    return trimmed(vertices, size), trimmed(normals, size), trimmed(faces, count)


@njit(**OPTIONS)
def _squeeze(vertices: Any, normals: Any, faces: Any, number: Any) -> tuple[int, int]:
    """Move what stays to the front, how many vertices and faces that is; number (vertices,) starts as -1."""
    t = 0
    for row in range(len(faces)):
        a, b, c = faces[row, 0], faces[row, 1], faces[row, 2]
        if a != b and b != c and c != a:
            number[a], number[b], number[c] = 0, 0, 0
            faces[t, 0], faces[t, 1], faces[t, 2] = a, b, c
            t += 1
    n = 0
    for v in range(len(vertices)):
        if number[v] == 0:
            number[v] = n
            for axis in range(3):
                vertices[n, axis] = vertices[v, axis]
                normals[n, axis] = normals[v, axis]
            n += 1
    for row in range(t):
        for corner in range(3):
            faces[row, corner] = number[faces[row, corner]]
    return n, t


def squeeze(vertices: FloatArray, normals: FloatArray, faces: IntArray) -> Arrays:
    """Drop faces with repeated vertices and then vertices without faces; the arrays are used up."""
    return squeeze_keeping(vertices, normals, faces, np.zeros(0, np.int64))[0]


def squeeze_keeping(
    vertices: FloatArray, normals: FloatArray, faces: IntArray, kept: IntArray
) -> tuple[Arrays, IntArray]:
    """The same, but that some vertices are kept; and the number that each vertex has then, -1 if it is gone."""
    number = np.full(len(vertices), -1)
    number[kept] = 0
    n, t = _squeeze(vertices, normals, faces, number)
    return (trimmed(vertices, n), trimmed(normals, n), trimmed(faces, t)), number


def _meeting(vertices: FloatArray, pinned: IntArray) -> IntArray:
    """The pinned vertices at whose point there is another one, ascending."""
    if len(pinned) < 2:
        return pinned[:0]
    places = vertices[pinned]
    order = np.lexsort(places.T)
    same = (places[order[1:]] == places[order[:-1]]).all(axis=1)
    several = np.zeros(len(pinned), bool)
    several[order[1:][same]] = True
    several[order[:-1][same]] = True
    return pinned[several]


def _marks(members: IntArray, size: int) -> NDArray[np.bool_]:
    marked = np.zeros(size, np.bool_)
    marked[members] = True
    return marked


@njit(**OPTIONS)
def _list_marked(faces: Any, marked: Any, found: Any) -> int:
    count = 0
    for row in range(len(faces)):
        if marked[faces[row, 0]] or marked[faces[row, 1]] or marked[faces[row, 2]]:
            found[count] = row
            count += 1
    return count


def list_marked(faces: IntArray, marked: NDArray[np.bool_]) -> IntArray:
    """The rows of `faces` with a marked vertex."""
    found = np.empty(len(faces), np.int64)
    return found[: _list_marked(faces, marked, found)].copy()


def _groups(vertices: FloatArray, faces: IntArray, meeting: IntArray) -> tuple[IntArray, IntArray]:
    """The vertices joined by a mesh edge to another at the same point, and the lowest of each such group."""
    place = np.full(len(vertices), -1)
    place[meeting] = np.arange(len(meeting))
    corners = place[faces]
    sides = np.concatenate([corners[:, (0, 1)], corners[:, (1, 2)], corners[:, (2, 0)]])
    sides = sides[(sides >= 0).all(axis=1)]
    here = vertices[meeting]
    sides = sides[(here[sides[:, 0]] == here[sides[:, 1]]).all(axis=1)]
    label = components(sides, len(meeting))
    _, first, inverse, size = np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    several = size[inverse] > 1
    return meeting[several], meeting[first[inverse[several]]]


def _spoiled(merged: IntArray, leaders: IntArray, size: int) -> IntArray:
    """The leaders whose faces no longer form one fan, or that have an edge with more than two faces, or vanished."""
    edges = find_edges(merged, size)
    ends = np.concatenate([edges.keys[edges.uses > 2] // size, edges.keys[edges.uses > 2] % size])
    suspects = np.concatenate([ends, split_vertices(merged, edges), np.setdiff1d(leaders, merged)])
    return np.intersect1d(leaders, suspects)


def fill_normals(vertices: FloatArray, normals: FloatArray, faces: IntArray) -> None:
    """Give vertices where the gradient vanishes the mean normal of their faces, in `normals` itself."""
    flat: NDArray[np.bool_] = np.asarray(~normals.any(axis=1))
    used, near = renumbered(faces[list_marked(faces, flat)], len(vertices))
    mean = area_weighted_normals(vertices[used], near)
    wanted = flat[used]
    normals[used[wanted]] = mean[wanted]
