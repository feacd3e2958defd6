"""A mesh whose sheets cross or touch, taken apart into one that is manifold: for printers and for other programs.

Round an edge with several faces, each face is joined to the next one across the inside, so that every piece of the
solid round the edge gets an edge of its own. Round a vertex, the faces that hang together over joined edges get a
vertex of their own.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from implicit.mesh import Mesh, area_weighted_normals
from implicit.topology import Edges, components, find_edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def separate(mesh: Mesh) -> Mesh:
    """The same triangles with a vertex of their own for each sheet: no edge has more than two faces, no fans touch.

    Closed meshes stay closed. Where faces at an edge do not pair across the inside (sheets that bound nothing), they
    part and the edge becomes a boundary. Curves and special points are dropped.
    """
    faces = np.asarray(mesh.faces)
    edges = find_edges(faces, len(mesh.vertices))
    first, second = _pairs(mesh.vertices, faces, edges)
    links = np.concatenate([_same_corner(faces, first, second, end) for end in (0, 1)])
    label = components(links, faces.size)
    _, place, number = np.unique(label, return_index=True, return_inverse=True)
    source = faces.ravel()[place]
    corners = number.reshape(-1, 3)
    normals = np.array(mesh.normals)[source]
    several = np.bincount(source, minlength=len(mesh.vertices))[source] > 1
    vertices = np.array(mesh.vertices)[source]
    normals[several] = area_weighted_normals(vertices, corners)[several]
    return Mesh(vertices, corners, normals, unresolved=mesh.unresolved)


def _same_corner(faces: IntArray, first: IntArray, second: IntArray, end: int) -> IntArray:
    """For pairs of sides that run along an edge in opposite directions, the corners (n, 2) at one end of it."""
    after = (first - first % 3 + (first + 1) % 3, second - second % 3 + (second + 1) % 3)
    return np.column_stack([first, after[1]] if end == 0 else [after[0], second])


def _pairs(vertices: FloatArray, faces: IntArray, edges: Edges) -> tuple[IntArray, IntArray]:
    """Sides (n,) of faces and the sides opposite to them that they are joined to."""
    starts = np.cumsum(edges.uses) - edges.uses
    plain = starts[(edges.uses == 2) & (edges.balance == 0)]
    first, second = [edges.sides[plain]], [edges.sides[plain + 1]]
    for row in np.flatnonzero(edges.uses > 2):
        sides = edges.sides[starts[row] : starts[row] + edges.uses[row]]
        low, high = divmod(int(edges.keys[row]), edges.size)
        forward = faces.ravel()[sides] == low
        order = np.argsort(_angles(vertices, faces, sides, low, high), kind="stable")
        around = np.append(order, order[0])
        # Inside lies after a face that runs backward along the edge and before one that runs forward.
        joined = [(a, b) for a, b in pairwise(around) if forward[b] and not forward[a]]
        first.append(sides[[a for a, _ in joined]])
        second.append(sides[[b for _, b in joined]])
    return np.concatenate(first), np.concatenate(second)


def _angles(vertices: FloatArray, faces: IntArray, sides: IntArray, low: int, high: int) -> FloatArray:
    """The angles of faces round the edge from `low` to `high`, counter-clockwise about its direction."""
    along = vertices[high] - vertices[low]
    third = faces.ravel()[sides - sides % 3 + (sides + 2) % 3]
    ways = vertices[third] - vertices[low]
    ways = ways - np.outer(ways @ along, along) / (along @ along)
    u = ways[0] / np.linalg.norm(ways[0])
    v = np.cross(along, u) / np.linalg.norm(along)
    return np.asarray(np.arctan2(ways @ v, ways @ u) % (2 * np.pi))
