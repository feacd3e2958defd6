"""Circles, ellipses, parabolas and hyperbolas, with the parameter of their textbook formulas."""

from math import ceil, pi
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array, Interval, check_orders, to_interval, to_vector
from parametric.splines.bspline import BSplineCurve, _divide, drop
from parametric.splines.knots import KnotVector

if TYPE_CHECKING:
    from parametric.formula import FormulaCurve


class Conic(ParametricCurve):
    """(a0 + a1 cos t + a2 sin t) / (w0 + w1 cos t + w2 sin t): rows of `matrix` (3, 4) are homogeneous points.

    `to_nurbs` gives the same conic as an exact rational quadratic, which agrees with it at the ends of its arcs (a
    quarter turn at most) and in shape, but not in parameter between.
    """

    def __init__(self, matrix: ArrayLike, domain: ArrayLike) -> None:
        self.matrix = np.array(matrix, dtype=float)
        self.matrix.flags.writeable = False
        self._domain = to_interval(domain)

    @property
    def domain(self) -> Interval:
        """The interval (t0, t1)."""
        return self._domain

    @property
    def _rational(self) -> bool:
        return self.matrix[:, 3].tolist() != [1.0, 0.0, 0.0]

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3)."""
        check_orders(order)
        t = self.parameters(t)
        cos, sin, one, none = np.cos(t).ravel(), np.sin(t).ravel(), np.ones(t.size), np.zeros(t.size)
        turns = ((cos, sin), (-sin, cos), (-cos, -sin), (sin, -cos))
        orders = range(order + 1) if self._rational else (order,)
        sums = [np.stack([none if k else one, *turns[k % 4]], axis=-1) @ self.matrix for k in orders]
        values = _divide(sums) if self._rational else sums[0][:, :3]
        return values.reshape(*t.shape, 3)

    def restrict(self, start: float, end: float) -> "Conic":
        """The arc on [start, end], with the same parameter."""
        return Conic(self.matrix, self.parameters((start, end)))

    def to_nurbs(self) -> BSplineCurve:
        """The conic as an exact rational quadratic B-spline curve with the ends of its arcs at their parameters."""
        knots, frame = circular_frame(*self.domain)
        points, weights = drop(frame @ self.matrix, True)
        return BSplineCurve(points, 2, knots, weights)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in t."""
        import sympy

        from parametric.formula import exact, t

        basis = (sympy.Integer(1), sympy.cos(t), sympy.sin(t))
        x, y, z, w = (sum(exact(c) * b for c, b in zip(column, basis)) for column in self.matrix.T.tolist())
        return x / w, y / w, z / w


def circular_frame(low: float, high: float) -> tuple[KnotVector, Array]:
    """Knots and Bezier weights (n, 3) of 1, cos t and sin t as rational quadratics in arcs of at most a quarter turn.

    On an arc of half angle h about m, (1, cos t, sin t) has the Bernstein coefficients of its two ends and
    (cos h, cos m, sin m) between, up to a common factor.
    """
    arcs = max(1, ceil((high - low) / (pi / 2) - 1e-12))
    ends = np.linspace(low, high, arcs + 1)
    middle, half = (ends[1:] + ends[:-1]) / 2, (high - low) / arcs / 2
    frame = np.empty((2 * arcs + 1, 3))
    frame[::2] = np.stack([np.ones(arcs + 1), np.cos(ends), np.sin(ends)], axis=-1)
    frame[1::2] = np.stack([np.full(arcs, np.cos(half)), np.cos(middle), np.sin(middle)], axis=-1)
    return KnotVector(np.concatenate([ends[:1], np.repeat(ends, 2), ends[-1:]]), 2), frame


def _conic(center: ArrayLike, rows: ArrayLike, domain: Interval) -> Conic:
    """The conic of homogeneous vectors for 1, cos t, sin t, moved so that its centre lies at `center`."""
    matrix = np.array(rows, dtype=float)
    matrix[:, :3] += matrix[:, 3:] * to_vector(center, "center")
    return Conic(matrix, domain)


def circle(radius: float = 1.0, center: ArrayLike = (0, 0, 0), angle: float = 2 * pi) -> Conic:
    """Circle, or an arc of it, in the xy-plane from +x: center + radius (cos t, sin t, 0), t in [0, angle] radians.

    Examples
    --------
    >>> circle(2, (0, 0, 1))(0.0)
    array([2., 0., 1.])
    """
    _positive(radius=radius)
    return ellipse(radius, radius, center, (0.0, angle))


def ellipse(a: float, b: float, center: ArrayLike = (0, 0, 0), domain: ArrayLike = (0.0, 2 * pi)) -> Conic:
    """Ellipse center + (a cos t, b sin t, 0).

    Examples
    --------
    >>> ellipse(3, 1).to_nurbs().degree
    2
    """
    _positive(a=a, b=b)
    interval = to_interval(domain, "the angles")
    return _conic(center, ((0, 0, 0, 1), (a, 0, 0, 0), (0, b, 0, 0)), interval)


def hyperbola(a: float, b: float, center: ArrayLike = (0, 0, 0), domain: ArrayLike = (0.0, 1.0)) -> Conic:
    """Branch x >= a of a hyperbola: center + (a sec t, b tan t, 0), with t inside (-pi/2, pi/2).

    Examples
    --------
    >>> x, y, _ = hyperbola(2, 1)(0.5)
    >>> round(float(x**2 / 4 - y**2), 12)
    1.0
    """
    _positive(a=a, b=b)
    interval = to_interval(domain, "the domain")
    if not -pi / 2 < interval[0] < interval[1] < pi / 2:
        raise ValueError(f"a branch of a hyperbola has t inside (-pi/2, pi/2), got {interval}")
    return _conic(center, ((a, 0, 0, 0), (0, 0, 0, 1), (0, b, 0, 0)), interval)


def parabola(a: float, center: ArrayLike = (0, 0, 0), domain: ArrayLike = (0.0, 1.0)) -> BSplineCurve:
    """Parabola center + (a t^2, 2 a t, 0), with its vertex at `center`: a quadratic B-spline of one piece.

    Examples
    --------
    >>> parabola(1)(0.5)
    array([0.25, 1.  , 0.  ])
    """
    _positive(a=a)
    low, high = to_interval(domain, "the domain")
    ends = np.array([(low, low), (low, high), (high, high)])  # the polar form of t^2 is s t, of t is (s + t) / 2
    points = np.stack([a * ends.prod(axis=1), a * ends.sum(axis=1), np.zeros(3)], axis=-1)
    return BSplineCurve(points + to_vector(center, "center"), 2, [low] * 3 + [high] * 3)


def helix(radius: float, pitch: float, turns: float = 1.0) -> "FormulaCurve":
    """Helix (radius cos t, radius sin t, pitch t / (2 pi)) about the z-axis, t in [0, 2 pi turns] radians.

    Examples
    --------
    >>> helix(1, 3, turns=2).domain[1] / pi
    4.0
    """
    _positive(radius=radius, turns=turns)
    import sympy

    from parametric.formula import FormulaCurve, exact, t

    r = exact(radius)
    return FormulaCurve((r * sympy.cos(t), r * sympy.sin(t), exact(pitch) * t / (2 * sympy.pi)), (0, 2 * pi * turns))


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")
