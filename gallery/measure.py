"""How far a mesh is from the surface it stands for, measured and not promised."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from implicit.mesh import Mesh

Points = NDArray[np.float64]


def implicit_distance(mesh: Mesh, surface: Any) -> float:
    """The largest distance of the triangles' middles and sides' middles from the surface f = 0.

    Each point is moved onto the surface by Newton steps along the gradient; how far it went bounds its distance.
    """
    corners = mesh.vertices[mesh.faces]
    if not len(corners):
        return 0.0
    start = np.concatenate([corners.mean(axis=1), *((corners[:, i] + corners[:, i - 1]) / 2 for i in range(3))])
    points = start.copy()
    for _ in range(4):
        values, gradients = surface(points), surface.gradient(points)
        square = np.sum(gradients**2, axis=1)
        points -= np.divide(values, square, out=np.zeros_like(values), where=square > 0)[:, None] * gradients
    return float(np.max(np.linalg.norm(points - start, axis=1)))


def parametric_distance(mesh: Mesh, surfaces: tuple[Any, ...], count: int = 40) -> float:
    """The largest distance from the mesh, over `count` by `count` points of each surface."""
    from scipy.spatial import cKDTree

    triangles = mesh.vertices[mesh.faces]
    middles = triangles.mean(axis=1)
    reach = float(np.max(np.linalg.norm(triangles - middles[:, None], axis=2)))
    tree = cKDTree(middles)
    worst = 0.0
    for surface in surfaces:
        points = sample(surface, count).reshape(-1, 3)
        near = tree.query(points, k=[*range(1, min(12, len(triangles)) + 1)])[1]
        bounds = np.min([distance_to_triangles(points, triangles[column]) for column in near.T], axis=0)
        for index in np.argsort(bounds)[::-1]:
            if bounds[index] <= worst:
                break
            nearby = triangles[tree.query_ball_point(points[index], bounds[index] + reach)]
            exact = distance_to_triangles(np.broadcast_to(points[index], (len(nearby), 3)), nearby)
            worst = max(worst, float(exact.min()))
    return worst


def sample(surface: Any, count: int) -> Points:
    """Points (count, count, 3) of a parametric surface at the middles of `count` by `count` cells of its domain."""
    share = (np.arange(count) + 0.5) / count
    (u0, u1), (v0, v1) = surface.domain
    u, v = np.meshgrid(u0 + (u1 - u0) * share, v0 + (v1 - v0) * share)
    return np.asarray(surface(u, v))


def distance_to_triangles(points: Points, triangles: Points) -> Points:
    """The distance (n,) of each point (n, 3) from its triangle (n, 3, 3).

    >>> distance_to_triangles(np.array([[0.2, 0.2, 3.0]]), np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float))
    array([3.])
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    square = np.maximum(_dot(normal, normal), 1e-300)
    inside = np.ones(len(points), dtype=bool)
    best = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _dot(np.cross(end - start, points - start), normal) >= 0
        side = end - start
        share = np.clip(_dot(points - start, side) / np.maximum(_dot(side, side), 1e-300), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - start - share[:, None] * side, axis=1))
    height = np.abs(_dot(points - a, normal)) / np.sqrt(square)
    return np.where(inside, height, best)


def _dot(a: Points, b: Points) -> Points:
    return np.asarray(np.sum(a * b, axis=1))
