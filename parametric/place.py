"""Curves and surfaces moved by affine maps, and the maps: matrices (4, 4) that act on column vectors."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array, Interval, to_vector
from parametric.surface import ParametricSurface

if TYPE_CHECKING:
    from parametric.splines.bspline import BSplineCurve


def translation(vector: ArrayLike) -> Array:
    """The map x -> x + vector."""
    matrix = np.eye(4)
    matrix[:3, 3] = to_vector(vector, "vector")
    return matrix


def rotation(direction: ArrayLike, angle: float, point: ArrayLike = (0, 0, 0)) -> Array:
    """Rotation by `angle` about the line through `point` along `direction`, by Rodrigues' formula.

    Examples
    --------
    >>> (rotation((0, 0, 1), np.pi / 2) @ [1, 0, 0, 1]).round(12).tolist()
    [0.0, 1.0, 0.0, 1.0]
    """
    k, centre = to_direction(direction), to_vector(point, "point")
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(k, k)
    matrix[:3, 3] = centre - matrix[:3, :3] @ centre
    return matrix


def scaling(factor: float) -> Array:
    """Scaling about the origin."""
    return np.diag([factor, factor, factor, 1.0])


def to_direction(values: ArrayLike) -> Array:
    """Unit vector; a ValueError for the zero vector."""
    vector = to_vector(values, "direction")
    size = float(np.linalg.norm(vector))
    if size == 0:
        raise ValueError("a direction must not be the zero vector")
    return vector / size


def check_affine(matrix: ArrayLike) -> Array:
    """An affine map; a ValueError for anything else."""
    m = np.array(matrix, dtype=float)
    if m.shape != (4, 4) or not np.isfinite(m).all() or m[3].tolist() != [0, 0, 0, 1]:
        raise ValueError(f"an affine map is a finite matrix (4, 4) with last row 0 0 0 1, got {m.tolist()}")
    m.flags.writeable = False
    return m


def move(points: Array, matrix: Array) -> Array:
    """Points moved by an affine map."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def move_derivative(vectors: Array, matrix: Array, order: int) -> Array:
    """Points or, from the first order on, derivatives moved by an affine map."""
    return move(vectors, matrix) if order == 0 else vectors @ matrix[:3, :3].T


def _symbolic(coordinates: tuple[Any, Any, Any], matrix: Array) -> tuple[Any, Any, Any]:
    from parametric.formula import exact

    x, y, z = (sum(exact(a) * e for a, e in zip(row, coordinates)) + exact(row[3]) for row in matrix[:3].tolist())
    return x, y, z


class MovedCurve(ParametricCurve):
    """A curve moved by an affine map."""

    def __init__(self, curve: ParametricCurve, matrix: ArrayLike) -> None:
        self.curve, self.matrix = curve, check_affine(matrix)

    @property
    def domain(self) -> Interval:
        """The domain of the curve that is moved."""
        return self.curve.domain

    @property
    def breaks(self) -> Array:
        """The breaks of the curve that is moved."""
        return self.curve.breaks

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3)."""
        return move_derivative(self.curve.derivative(t, order), self.matrix, order)

    def restrict(self, start: float, end: float) -> "MovedCurve":
        """The part on [start, end], with the same parameter."""
        return MovedCurve(self.curve.restrict(start, end), self.matrix)

    def to_nurbs(self) -> "BSplineCurve":
        """The curve as a B-spline."""
        return self.curve.to_nurbs().transform(self.matrix)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in t."""
        return _symbolic(self.curve.expressions(), self.matrix)


class MovedSurface(ParametricSurface):
    """A surface moved by an affine map."""

    def __init__(self, surface: ParametricSurface, matrix: ArrayLike) -> None:
        self.surface, self.matrix = surface, check_affine(matrix)

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The domain of the surface that is moved."""
        return self.surface.domain

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The breaks of the surface that is moved."""
        return self.surface.breaks

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3)."""
        return move_derivative(self.surface.derivative(u, v, i, j), self.matrix, i + j)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in u and v."""
        return _symbolic(self.surface.expressions(), self.matrix)
