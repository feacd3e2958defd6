"""A proof that a triangle is near the surface: the control points of the surface over it are.

A Bezier patch of degree (p, q) restricted to a triangle of its domain is a triangular Bezier patch of degree p + q.
It lies in the convex hull of its control points, and the distance from a triangle of space is a convex function, so no
point of it is farther from the triangle than the farthest control point. The control points follow from the values at
the lattice of p + q + 1 points to a side; the rounding of that step is bounded and added.
"""

from functools import cache
from math import factorial

import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.splines.tensor import BSplineSurface
from parametric.surface import ParametricSurface
from parametric.tessellation.distance import farthest
from parametric.tessellation.triangulation import Triangulation

Ints = NDArray[np.int64]

_UNIT = 2.0**-53


@cache
def lattice(degree: int) -> tuple[Array, Array, float]:
    """Barycentric lattice (k, 3), the matrix (k, k) from values there to control points, and a bound of its rounding.

    The bound times the largest value bounds the error of every control point.
    """
    exponents = np.array([(i, j, degree - i - j) for i in range(degree + 1) for j in range(degree + 1 - i)])
    places = exponents / degree
    weight = np.array([factorial(degree) / np.prod([factorial(int(e)) for e in row]) for row in exponents])
    basis = weight * np.prod(places[:, None, :] ** exponents, axis=2)
    matrix = np.linalg.inv(basis)
    norm = float(np.abs(matrix).sum(axis=1).max())
    return places, matrix, 16 * (degree + 1) * len(places) * norm * _UNIT


def certified_deviations(net: Triangulation, which: Ints) -> Array:
    """Proved bounds of the distance of the surface over triangles (n,) from them."""
    bounds = np.zeros(which.size)
    home = net.triangles.home[which]
    for k in np.unique(home):
        here = np.flatnonzero(home == k)
        bounds[here] = _bound(net, net.shell.surfaces[k], which[here])
    return bounds


def _bound(net: Triangulation, surface: ParametricSurface, which: Ints) -> Array:
    if not isinstance(surface, BSplineSurface):
        raise ValueError(
            f"certified=True needs surfaces made of Bezier patches, got a {type(surface).__name__}; convert it first, "
            "for example with to_nurbs(), or interpolate it"
        )
    places, matrix, rounding = lattice(sum(surface.degrees))
    corners = net.vertices[net.triangles.corners[which]]
    scale = float(np.abs(surface.points).max())
    worst = np.zeros(which.size)
    for rows, region in _regions(net, which):
        u, v = (region[..., axis] @ places.T for axis in (0, 1))
        values = matrix @ _values(surface, u, v)
        worst[rows] = np.maximum(worst[rows], farthest(corners[rows], np.ascontiguousarray(values)))
    slack = rounding * scale
    if surface.weights is not None:
        slack *= 4 * float(surface.weights.max() / surface.weights.min()) ** 2
    return worst + slack


def _values(surface: BSplineSurface, u: Array, v: Array) -> Array:
    """Points (..., 3), or weighted points and weights (..., 4) of a rational surface."""
    if surface.weights is None:
        return surface(u, v)
    weights = surface.weights[..., None]
    weighted = BSplineSurface(surface.points * weights, surface.degrees, surface.knots)(u, v)
    alone = BSplineSurface(weights * (1.0, 0.0, 0.0), surface.degrees, surface.knots)(u, v)
    return np.concatenate([weighted, alone[..., :1]], axis=-1)


def _regions(net: Triangulation, which: Ints) -> list[tuple[Ints, Array]]:
    """Rows of `which` and triangles (n, 3, 2) of the domain that cover what they stand for: one, or two at a pole.

    At a pole a corner of the triangle is a side of the domain: the region is a quadrilateral.
    """
    t = net.triangles
    first, second = t.places[which].copy(), t.places[which].copy()
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        for axis in (0, 1):
            rows = t.free[which, k] == axis
            first[rows, k, axis] = first[rows, a, axis]
            second[rows, k, axis] = second[rows, b, axis]
            # The second triangle: both ends of the side that is a point, and the corner after it.
            corner = second[rows, a].copy()
            corner[:, :] = first[rows, k]
            second[rows, a] = corner
    at_poles = np.flatnonzero((t.free[which] >= 0).any(axis=1))
    every = (np.arange(which.size), first)
    return [every, (at_poles, second[at_poles])] if at_poles.size else [every]
