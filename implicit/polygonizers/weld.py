"""One vertex where several crossings meet at a lattice point.

When f vanishes at a lattice point, every crossed edge there has its root at that point, and the triangles between them
have no area. The crossings that such triangles join become one vertex, unless that would make the mesh touch itself:
where sheets meet at the point (the node of a cone), or a tube shrinks to it, they stay apart.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from implicit.topology import find_edges, split_vertices

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def weld(vertices: FloatArray, faces: IntArray, pinned: IntArray) -> IntArray:
    """The faces without those that have no area, over one vertex of each group that meets at a lattice point.

    pinned: the vertices that lie at a lattice point, exactly.
    """
    target = np.arange(len(vertices))
    group = _groups(vertices, faces, pinned)
    if group is None:
        return faces
    members, leader = group
    touched = np.zeros(len(vertices), bool)
    touched[members] = True
    near = touched[faces].any(axis=1)
    part = faces[near]
    while len(members):
        target[members] = leader
        merged = _drop_flat(target[part])
        bad = _spoiled(merged, part, np.unique(leader), len(vertices))
        if not len(bad):
            break
        stay = ~np.isin(leader, bad)
        target[members[~stay]] = members[~stay]
        members, leader = members[stay], leader[stay]
    if not len(members):
        return faces
    return np.concatenate([faces[~near], _drop_flat(target[part])])


def _groups(vertices: FloatArray, faces: IntArray, pinned: IntArray) -> tuple[IntArray, IntArray] | None:
    """Pinned vertices joined by a mesh edge and at the same point, and the lowest of each group of several."""
    if len(pinned) < 2:
        return None
    place = np.full(len(vertices), -1)
    place[pinned] = np.arange(len(pinned))
    corners = place[faces]
    sides = np.concatenate([corners[:, (0, 1)], corners[:, (1, 2)]] + [corners[:, (2, 0)]])
    sides = sides[(sides >= 0).all(axis=1)]
    here = vertices[pinned]
    sides = sides[(here[sides[:, 0]] == here[sides[:, 1]]).all(axis=1)]
    if not len(sides):
        return None
    graph = coo_array((np.ones(len(sides), np.int8), (sides[:, 0], sides[:, 1])), shape=(len(pinned),) * 2)
    label = connected_components(graph, directed=False)[1]
    _, first, inverse, size = np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    several = size[inverse] > 1
    return pinned[several], pinned[first[inverse[several]]]


def _drop_flat(faces: IntArray) -> IntArray:
    a, b, c = faces.T
    return faces[(a != b) & (b != c) & (c != a)]


def _spoiled(merged: IntArray, part: IntArray, leaders: IntArray, size: int) -> IntArray:
    """The leaders whose faces no longer form one fan, or that have an edge with more than two faces, or vanished."""
    edges = find_edges(merged, size)
    ends = np.concatenate([edges.keys[edges.uses > 2] // size, edges.keys[edges.uses > 2] % size])
    suspects = np.concatenate([ends, split_vertices(merged, edges), np.setdiff1d(leaders, merged)])
    return np.intersect1d(leaders, suspects)
