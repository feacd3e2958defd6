"""B-spline and Bezier curves, rational or not, and the curves that are such in disguise."""

from collections.abc import Sequence
from functools import cached_property
from math import comb
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array, Interval, check_orders, flatten, to_interval, to_points, to_vector, to_weights
from parametric.place import check_affine, move
from parametric.splines import refine
from parametric.splines.basis import combine_points
from parametric.splines.knots import Knots, KnotVector, to_knots

UNIT = np.array([0.0, 1.0])


class BSplineCurve(ParametricCurve):
    """B-spline curve c(t) = sum N_i,p(t) P_i, rational where weights are given; immutable.

    Parameters
    ----------
    points : (n+1, 3)
        Control points.
    degree : p
    knots : "clamped", "closed", "open", an array or a KnotVector
        The three kinds are uniform on the domain [0, 1]; an array is taken as it stands.
    weights : (n+1,), optional
        Positive; c = sum N w P / sum N w.

    Examples
    --------
    >>> BSplineCurve([(0, 0, 0), (1, 2, 0), (2, 0, 0), (3, 2, 0)], 3)(0.5)
    array([1.5, 1. , 0. ])
    """

    points: Array
    weights: Array | None
    knots: KnotVector

    def __init__(
        self, points: ArrayLike, degree: int, knots: Knots = "clamped", weights: ArrayLike | None = None
    ) -> None:
        net = to_points(points, "control points", 1)
        self.points, self.weights = net, to_weights(weights, net.shape[:1])
        self.knots = to_knots(knots, degree, len(net))

    def __repr__(self) -> str:
        rational = "" if self.weights is None else "rational, "
        return f"<{type(self).__name__} of degree {self.degree}, {rational}{len(self.points)} points on {self.domain}>"

    @property
    def degree(self) -> int:
        """The polynomial degree p."""
        return self.knots.degree

    @property
    def domain(self) -> Interval:
        """Where the basis functions sum to one."""
        return self.knots.domain

    @property
    def breaks(self) -> Array:
        """The distinct knots of the domain."""
        return self.knots.breaks

    @cached_property
    def _net(self) -> Array:
        """Points, weighted and with their weights where rational: (n+1, 3 or 4)."""
        return self.points if self.weights is None else lift(self.points, self.weights)

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3). Order 0 is the point itself."""
        check_orders(order)
        t = self.parameters(t)
        orders = range(order + 1) if self.weights is not None else (order,)
        sums = [self._combine(flatten(t), k) for k in orders]
        values = sums[0] if self.weights is None else _divide(sums)
        return values.reshape(*t.shape, 3)

    def _combine(self, t: Array, order: int) -> Array:
        """The derivative of the sum of weighted points at t (n,), before any division: (n, 3 or 4)."""
        if order not in self._nets:
            patches = refine.derive_patches(self._pieces, self.knots, order, 0, 1)
            self._nets[order] = patches[:, None, :, None]
        return combine_points(t, np.zeros(t.size), self.knots.ends, UNIT, self._nets[order], 0)[0]

    @cached_property
    def _nets(self) -> dict[int, Array]:
        return {}

    @cached_property
    def _pieces(self) -> Array:
        """Bezier points of all spans, (spans, p+1, 3 or 4)."""
        windows = self.knots.first[:, None] + np.arange(self.degree + 1)
        return np.einsum("sai,sic->sac", self.knots.extraction, self.knots.unwrap(self._net)[windows])

    def _with(self, knots: KnotVector, matrix: Array) -> "BSplineCurve":
        """The curve over other knots, with control points `matrix` times the old."""
        points, weights = drop(matrix @ self._net, self.weights is not None)
        return self._like(points, knots, weights)

    def _like(self, points: Array, knots: KnotVector, weights: Array | None) -> "BSplineCurve":
        return BSplineCurve(points, knots.degree, knots, weights)

    def insert_knot(self, t: float, times: int = 1) -> "BSplineCurve":
        """The same curve with the knot t inserted; a ValueError where its multiplicity would pass the degree."""
        return self._with(*refine.insert(self.knots, t, times))

    def remove_knot(self, t: float, *, tolerance: float = 1e-12) -> "BSplineCurve":
        """The same curve with the knot t once less, or a ValueError if control points would move by more."""
        knots, matrix, back = refine.remove(self.knots, t)
        moved = float(np.abs(back @ (matrix @ self._net) - self._net).max())
        if moved > tolerance:
            raise ValueError(f"knot {t:g} cannot be removed: control points are off by {moved:.3g}, not {tolerance:g}")
        return self._with(knots, matrix)

    def elevate(self, by: int = 1) -> "BSplineCurve":
        """The same curve with its degree raised."""
        if by < 0:
            raise ValueError(f"a degree is raised by zero or more, got {by}")
        curve = self
        for _ in range(by):
            curve = curve._with(*refine.elevate(curve.knots))
        return curve

    def restrict(self, start: float, end: float) -> "BSplineCurve":
        """The part on [start, end], clamped, with the same parameter."""
        low, high = to_interval(self.parameters((start, end)), "the part")
        return self._with(*refine.restrict(self.knots, low, high))

    def split(self, t: float) -> "tuple[BSplineCurve, BSplineCurve]":
        """The parts before and after an inner parameter, clamped, each with the same parameter as the whole."""
        low, high = self.domain
        if not low < t < high:
            raise ValueError(f"a curve on [{low:g}, {high:g}] splits at a parameter inside, got {t:g}")
        return self.restrict(low, t), self.restrict(t, high)

    def bezier_pieces(self) -> "tuple[BezierCurve, ...]":
        """One Bezier curve on [0, 1] for each span of the domain."""
        return tuple(BezierCurve(*drop(net, self.weights is not None)) for net in self._pieces)

    def derivative_curve(self) -> "BSplineCurve":
        """The derivative as a B-spline curve of one degree less, for clamped, closed and open knots alike.

        Its points are p (P_(i+1) - P_i) / (u_(i+p+1) - u_(i+1)). A ValueError for rational curves and polylines.
        """
        if self.weights is not None:
            raise ValueError("the derivative of a rational B-spline is no B-spline over the same knots")
        knots, matrix = refine.derive(self.knots)
        return BSplineCurve(matrix @ self.points, knots.degree, knots)

    def reversed(self) -> "BSplineCurve":
        """The same curve run through the other way, on the same domain."""
        low, high = self.domain
        values = low + (high - self.knots.values[::-1])
        values[self.knots.values[::-1] == low] = high
        knots = KnotVector(values, self.degree, self.knots.closed)
        order = np.arange(self.knots.functions)[::-1][: len(self.points)] % len(self.points)
        return self._like(self.points[order], knots, None if self.weights is None else self.weights[order])

    def over(self, domain: ArrayLike) -> "BSplineCurve":
        """The same curve with its parameter running linearly over another domain."""
        (low, high), (a, b) = self.domain, to_interval(domain)
        if (low, high) == (a, b):
            return self
        values = a + (self.knots.values - low) * ((b - a) / (high - low))
        values[self.knots.values == high] = b
        knots = KnotVector(values, self.degree, self.knots.closed)
        return BSplineCurve(self.points, self.degree, knots, self.weights)

    def transform(self, matrix: ArrayLike) -> Self:
        """The curve moved by an affine map (4, 4) that acts on column vectors: its control points moved."""
        result = object.__new__(type(self))
        result.points = to_points(move(self.points, check_affine(matrix)), "points", 1)
        result.weights, result.knots = self.weights, self.knots
        return result

    def to_nurbs(self) -> "BSplineCurve":
        """The curve itself."""
        return self

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as exact sympy expressions in t; a ValueError where there are several pieces."""
        if self.knots.first.size > 1:
            pieces = self.knots.first.size
            raise ValueError(f"the curve has {pieces} pieces: take expressions of one of bezier_pieces()")
        from parametric.formula import bezier_expressions, t

        x, y, z = bezier_expressions(self.bezier_pieces()[0]._net, (t,), (self.domain,))
        return x, y, z


class BezierCurve(BSplineCurve):
    """Bezier curve c(t) = sum B_n,i(t) P_i on [0, 1], rational where weights are given; immutable.

    Examples
    --------
    >>> curve = BezierCurve([(-1, 0), (0, 1), (2, 0)])
    >>> curve(0.25)
    array([-0.4375,  0.375 ,  0.    ])
    >>> curve.elevate().points[1:3].round(6).tolist()
    [[-0.333333, 0.666667, 0.0], [0.666667, 0.666667, 0.0]]
    """

    def __init__(self, points: ArrayLike, weights: ArrayLike | None = None) -> None:
        net = to_points(points, "control points", 1)
        if len(net) < 2:
            raise ValueError("a Bezier curve needs at least two control points, got one")
        super().__init__(net, len(net) - 1, "clamped", weights)

    def _like(self, points: Array, knots: KnotVector, weights: Array | None) -> BSplineCurve:
        if knots.values.size == 2 * len(points) and knots.domain == (0.0, 1.0):
            return BezierCurve(points, weights)
        return super()._like(points, knots, weights)

    def split(self, t: float) -> "tuple[BezierCurve, BezierCurve]":
        """The parts before and after an inner parameter, as Bezier curves that run over [0, 1] each."""
        left, right = super().split(t)
        return BezierCurve(left.points, left.weights), BezierCurve(right.points, right.weights)

    def differences(self, order: int = 1) -> Array:
        """Difference points D_i^k = sum (-1)^(k-j) C(k, j) P_(i+j), (n+1-k, 3)."""
        return np.diff(self.points, n=order, axis=0)

    def monomial(self) -> Array:
        """Coefficients a_k of c(t) = sum a_k t^k, (n+1, 3); unstable for high degree, here to be read.

        A ValueError for rational curves.
        """
        if self.weights is not None:
            raise ValueError("a rational curve is no polynomial")
        n = self.degree
        return np.array([comb(n, k) * np.diff(self.points, n=k, axis=0)[0] for k in range(n + 1)])


def line(a: ArrayLike, b: ArrayLike) -> BezierCurve:
    """The segment from a to b on [0, 1].

    Examples
    --------
    >>> line((1, 1, 0), (6, 2, 0))(0.5)
    array([3.5, 1.5, 0. ])
    """
    return BezierCurve([to_vector(a, "a"), to_vector(b, "b")])


def polyline(points: ArrayLike) -> BSplineCurve:
    """The polyline through the points on [0, 1], the same share of the domain for each segment."""
    return BSplineCurve(to_points(points, "vertices", 1), 1)


def lift(points: Array, weights: Array) -> Array:
    """Homogeneous points (w x, w y, w z, w)."""
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def drop(net: Array, rational: bool) -> tuple[Array, Array | None]:
    """Points and weights of homogeneous points; the points themselves where not rational."""
    return (net[..., :3] / net[..., 3:], net[..., 3]) if rational else (net, None)


def _divide(sums: Sequence[Array]) -> Array:
    """The last derivative of the quotient, by Leibniz' rule: (w c)_k = sum C(k, a) w_a c_(k-a)."""
    quotients: list[Array] = []
    for k, total in enumerate(sums):
        rest = total[:, :3] - sum(comb(k, a) * sums[a][:, 3:] * quotients[k - a] for a in range(1, k + 1))
        quotients.append(rest / sums[0][:, 3:])
    return quotients[-1]
