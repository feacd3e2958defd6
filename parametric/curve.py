"""ParametricCurve: everything that follows from one method, the derivatives of c(t)."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from parametric.differences import differentiate
from parametric.parameters import Array, Interval, Value, check_orders, to_interval, to_parameters

if TYPE_CHECKING:
    from parametric.splines.bspline import BezierCurve, BSplineCurve
    from parametric.surface import ParametricSurface

CurveLike: TypeAlias = "ParametricCurve | Callable[..., Any] | ArrayLike"


class ParametricCurve(Value, ABC):
    """A map c(t) from an interval to space; immutable. A subclass gives `domain` and `derivative`."""

    @property
    @abstractmethod
    def domain(self) -> Interval:
        """The interval (t0, t1)."""

    @abstractmethod
    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3). Order 0 is the point itself."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on [{self.domain[0]:g}, {self.domain[1]:g}]>"

    def __call__(self, t: ArrayLike) -> Array:
        """Points c(t), shape (..., 3)."""
        return self.derivative(t, 0)

    def parameters(self, t: ArrayLike) -> Array:
        """The parameters as floats; a ValueError where one leaves the domain."""
        return to_parameters(t, self.domain, "t")

    @property
    def breaks(self) -> Array:
        """Parameters where the curve need not be smooth, both ends of the domain included."""
        return np.array(self.domain)

    @property
    def closed(self) -> bool:
        """Whether both ends meet, to 1e-12 of the curve's size."""
        points = self(np.linspace(*self.domain, 17))
        return bool(np.abs(points[0] - points[-1]).max() <= 1e-12 * np.abs(points).max())

    def tangent(self, t: ArrayLike) -> Array:
        """Unit tangents c'/|c'|, (..., 3); nan where c' vanishes."""
        velocity = self.derivative(t, 1)
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        return np.divide(velocity, speed, out=np.full_like(velocity, np.nan), where=speed > 0)

    def length(self, start: float | None = None, end: float | None = None, *, tolerance: float = 1e-12) -> float:
        """Arc length from `start` to `end` (default: the whole curve), to the relative tolerance.

        Gauss-Legendre quadrature of |c'|, halving each smooth piece until both halves agree with the whole.
        A ValueError if 40 halvings do not reach the tolerance.

        Examples
        --------
        >>> from parametric.splines.bspline import line
        >>> line((0, 0, 0), (3, 4, 0)).length()
        5.0
        """
        from parametric.analysis import arc_length

        return arc_length(self, start, end, tolerance)

    def reversed(self) -> "ParametricCurve":
        """The same curve run through the other way, on the same domain."""
        low, high = self.domain
        return AffineCurve(self, (low, high), low + high, -1.0)

    def over(self, domain: ArrayLike) -> "ParametricCurve":
        """The same curve with its parameter running linearly over another domain."""
        new, (low, high) = to_interval(domain), self.domain
        if new == self.domain:
            return self
        rate = (high - low) / (new[1] - new[0])
        return AffineCurve(self, new, low - rate * new[0], rate)

    def restrict(self, start: float, end: float) -> "ParametricCurve":
        """The part on [start, end], with the same parameter."""
        return AffineCurve(self, to_interval(self.parameters((start, end)), "the part"), 0.0, 1.0)

    def split(self, t: float) -> "tuple[ParametricCurve, ParametricCurve]":
        """The parts before and after an inner parameter, each with the same parameter as the whole."""
        low, high = self.domain
        if not low < t < high:
            raise ValueError(f"a curve on [{low:g}, {high:g}] splits at a parameter inside, got {t:g}")
        return self.restrict(low, t), self.restrict(t, high)

    def elevate(self, by: int = 1) -> "BSplineCurve":
        """The curve as a B-spline with its degree raised; a ValueError where there is none."""
        return self.to_nurbs().elevate(by)

    def insert_knot(self, t: float, times: int = 1) -> "BSplineCurve":
        """The curve as a B-spline with a knot inserted; a ValueError where there is none."""
        return self.to_nurbs().insert_knot(t, times)

    def bezier_pieces(self) -> "tuple[BezierCurve, ...]":
        """The curve as Bezier curves; a ValueError where there are none."""
        return self.to_nurbs().bezier_pieces()

    def to_nurbs(self) -> "BSplineCurve":
        """The curve as a B-spline, rational where it has to be. A ValueError where there is none."""
        raise ValueError(f"a {type(self).__name__} is no rational curve")

    def transform(self, matrix: ArrayLike) -> "ParametricCurve":
        """The curve moved by an affine map (4, 4) that acts on column vectors."""
        from parametric.place import MovedCurve

        return MovedCurve(self, matrix)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in the symbol t of `parametric`."""
        raise NotImplementedError(f"a {type(self).__name__} has no symbolic expression")


class AffineCurve(ParametricCurve):
    """c(shift + rate t): a curve run through at another rate or backwards."""

    def __init__(self, curve: ParametricCurve, domain: Interval, shift: float, rate: float) -> None:
        self.curve, self._domain, self.shift, self.rate = curve, domain, shift, rate

    @property
    def domain(self) -> Interval:
        """The interval (t0, t1)."""
        return self._domain

    @property
    def breaks(self) -> Array:
        """Parameters where the curve need not be smooth."""
        inner = np.sort((self.curve.breaks[1:-1] - self.shift) / self.rate)
        low, high = self._domain
        return np.array([low, *inner[(inner > low) & (inner < high)], high])

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3)."""
        check_orders(order)
        inner = np.clip(self.shift + self.rate * self.parameters(t), *self.curve.domain)
        return self.rate**order * self.curve.derivative(inner, order)

    def restrict(self, start: float, end: float) -> "AffineCurve":
        """The part on [start, end], with the same parameter."""
        return AffineCurve(self.curve, to_interval(self.parameters((start, end)), "the part"), self.shift, self.rate)

    def to_nurbs(self) -> "BSplineCurve":
        """The curve as a B-spline."""
        ends = sorted(self.shift + self.rate * t for t in self._domain)
        low, high = np.clip(ends, *self.curve.domain)
        whole = (float(low), float(high)) == self.curve.domain
        part = self.curve if whole else self.curve.restrict(float(low), float(high))
        if isinstance(part, AffineCurve):
            raise ValueError(f"a part of a {type(self.curve).__name__} is no rational curve")
        spline = part.to_nurbs()
        if self.rate < 0:
            spline = spline.reversed()
        return spline.over(self._domain)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in t."""
        from parametric.formula import exact, t

        inner = exact(self.shift) + exact(self.rate) * t
        x, y, z = (e.subs(t, inner) for e in self.curve.expressions())
        return x, y, z


class IsoCurve(ParametricCurve):
    """A curve of constant u (axis 0) or constant v (axis 1) on a surface."""

    def __init__(self, surface: "ParametricSurface", value: float, axis: int) -> None:
        self.surface, self.value, self.axis = surface, value, axis

    @property
    def domain(self) -> Interval:
        """The domain of the parameter that runs."""
        return self.surface.domain[1 - self.axis]

    @property
    def breaks(self) -> Array:
        """Parameters where the curve need not be smooth."""
        return self.surface.breaks[1 - self.axis]

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3)."""
        t = self.parameters(t)
        if self.axis == 0:
            return self.surface.derivative(self.value, t, 0, order)
        return self.surface.derivative(t, self.value, order, 0)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in t."""
        from parametric.formula import exact, t, u, v

        fixed, running = (u, v) if self.axis == 0 else (v, u)
        values = {fixed: exact(self.value), running: t}
        x, y, z = (e.subs(values, simultaneous=True) for e in self.surface.expressions())
        return x, y, z


class FunctionCurve(ParametricCurve):
    """A curve given by any function of t that returns three coordinates.

    Derivatives are differences of order eight over 1/64 of the domain: for a smooth function about 1e-10 of its size
    for the first derivative and 500 times worse for each order more. Where derivatives matter, give a FormulaCurve.

    Examples
    --------
    >>> curve = FunctionCurve(lambda t: (t, t**2, 0), (0, 2))
    >>> curve(1.5), curve.derivative(1.5).round(9)
    (array([1.5 , 2.25, 0.  ]), array([1., 3., 0.]))
    """

    def __init__(self, function: Callable[..., Any], domain: ArrayLike = (0.0, 1.0)) -> None:
        self.function, self._domain = function, to_interval(domain)
        self._rows = self._vectorized()

    @property
    def domain(self) -> Interval:
        """The interval (t0, t1)."""
        return self._domain

    def _vectorized(self) -> bool:
        """Whether the function maps an array of parameters to one row for each, found by trying."""
        t = np.linspace(*self._domain, 5)
        single = self._one_by_one(t)
        try:
            many = np.asarray(self.function(t), dtype=float)
        except Exception:  # any failure on arrays means: one by one
            return False
        return many.shape == single.shape and bool(np.allclose(many, single, rtol=1e-12, atol=0))

    def _one_by_one(self, t: Array) -> Array:
        points = np.array([np.asarray(self.function(float(s)), dtype=float) for s in t])
        if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
            got = self.function(float(t[0]))
            raise ValueError(f"a curve's function must return three finite coordinates, got {got!r}")
        return points

    def _points(self, t: Array) -> Array:
        flat = t.ravel()
        points = np.asarray(self.function(flat), dtype=float) if self._rows else self._one_by_one(flat)
        if points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(flat.size)])
        return points.reshape(*t.shape, 3)

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3), by differences; order 0 is the point itself."""
        check_orders(order)
        t = self.parameters(t)
        return differentiate(self._points, t, order, self._domain)


def to_curve(curve: CurveLike, name: str = "curve") -> ParametricCurve:
    """A curve from a curve object, a callable on [0, 1] or the vertices (n, 3) of a polyline."""
    if isinstance(curve, ParametricCurve):
        return curve
    if callable(curve):
        return FunctionCurve(curve)
    from parametric.splines.bspline import polyline

    try:
        return polyline(curve)
    except ValueError as error:
        raise ValueError(f"{name} must be a curve, a callable or the vertices of a polyline: {error}") from error


def share_domain(*curves: ParametricCurve) -> tuple[ParametricCurve, ...]:
    """The curves over their common domain if they have one, otherwise each over [0, 1]."""
    if all(curve.domain == curves[0].domain for curve in curves):
        return curves
    return tuple(curve.over((0.0, 1.0)) for curve in curves)
