"""Surfaces that interpolate whole curves: sums of curves weighted by blending functions (transfinite interpolation).

Rows are curves c_b(u) and columns curves d_a(v); a Boolean sum takes both and subtracts what they share:

    p(u, v) = sum_b g_b(v) c_b(u) + sum_a f_a(u) d_a(v) - sum_ab f_a(u) g_b(v) T_ab

Rows alone give ruled and lofted surfaces; rows and columns give every Coons patch and Gordon's surfaces
(Coons 1967; Gordon 1969; Farin, Curves and Surfaces for CAGD, 2002, chapter 22).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import FunctionCurve, ParametricCurve
from parametric.parameters import Array, Interval, check_orders
from parametric.splines.knots import KnotVector, to_knots
from parametric.surface import ParametricSurface

if TYPE_CHECKING:
    from parametric.splines.bspline import BSplineCurve
    from parametric.splines.tensor import BSplineSurface


class Blend(ABC):
    """Blending functions f_1 ... f_n on an interval."""

    domain: Interval

    @abstractmethod
    def __call__(self, t: Array, order: int = 0) -> Array:
        """Values or derivatives (..., n) at t (...,)."""

    def expressions(self, symbol: Any) -> list[Any]:
        """The functions as sympy expressions."""
        raise ValueError("these blending functions have no single expression")


class SplineBlend(Blend):
    """Blending functions that are splines: combinations `matrix` (count, n) of the basis functions."""

    def __init__(self, knots: KnotVector, matrix: Array) -> None:
        self.knots, self.matrix, self.domain = knots, matrix, knots.domain

    def __call__(self, t: Array, order: int = 0) -> Array:
        """Values or derivatives (..., n) at t (...,)."""
        return (self.knots.design(t, order) @ self.matrix).reshape(*t.shape, -1)

    def expressions(self, symbol: Any) -> list[Any]:
        """The functions as sympy expressions; a ValueError where there are several pieces."""
        if self.knots.first.size > 1:
            return super().expressions(symbol)
        from parametric.formula import bezier_expressions

        nets = (self.knots.extraction[0] @ self.matrix).T[:, :, None]
        return [bezier_expressions(net, (symbol,), (self.domain,))[0] for net in nets]


class FunctionBlend(Blend):
    """f and 1 - f for any function with f(0) = 1 and f(1) = 0."""

    domain = (0.0, 1.0)

    def __init__(self, function: Callable[[Any], Any] | Any) -> None:
        self.function = function
        self.curve = self._curve(function)
        (start, _, _), (end, _, _) = self.curve([0.0, 1.0])
        if max(abs(start - 1), abs(end)) > 1e-12:
            raise ValueError(f"a blending function must be 1 at 0 and 0 at 1, got {start:g} and {end:g}")

    @staticmethod
    def _curve(function: Any) -> ParametricCurve:
        if callable(function):
            return FunctionCurve(lambda t: (function(t), 0.0, 0.0))
        from parametric.formula import FormulaCurve, t

        (symbol,) = function.free_symbols or {t}
        return FormulaCurve((function.subs(symbol, t), 0, 0), (0, 1))

    def __call__(self, t: Array, order: int = 0) -> Array:
        """Values or derivatives (..., 2) at t (...,)."""
        first = self.curve.derivative(t, order)[..., 0]
        return np.stack([first, (1.0 if order == 0 else 0.0) - first], axis=-1)

    def expressions(self, symbol: Any) -> list[Any]:
        """Both functions as sympy expressions."""
        from parametric.formula import t

        first = self.curve.expressions()[0].subs(t, symbol)
        return [first, 1 - first]


def linear_blend() -> SplineBlend:
    """1 - t and t."""
    return SplineBlend(KnotVector([0, 0, 1, 1], 1), np.eye(2))


def cubic_blend() -> SplineBlend:
    """h00 = 1 - 3 t^2 + 2 t^3 and h01 = 3 t^2 - 2 t^3: slope zero at both ends."""
    return SplineBlend(to_knots("clamped", 3, 4), np.array([[1.0, 0], [1, 0], [0, 1], [0, 1]]))


def hermite_blend() -> SplineBlend:
    """Cubic Hermite functions h00, h01, h10, h11: of the values at 0 and 1, then of the slopes at 0 and 1."""
    matrix = np.array([[1.0, 0, 0, 0], [1, 0, 1 / 3, 0], [0, 1, 0, -1 / 3], [0, 1, 0, 0]])
    return SplineBlend(to_knots("clamped", 3, 4), matrix)


def cardinal_blend(places: Array, degree: int = 3) -> SplineBlend:
    """Splines that are 1 at one of the places and 0 at the others; of that degree or one less than the places."""
    p = min(degree, places.size - 1)
    inner = np.array([places[k : k + p].mean() for k in range(1, places.size - p)])
    knots = KnotVector(np.concatenate([[places[0]] * (p + 1), inner, [places[-1]] * (p + 1)]), p)
    return SplineBlend(knots, np.asarray(np.linalg.inv(knots.design(places)), dtype=float))


class BlendedSurface(ParametricSurface):
    """Rows c_b(u) weighted by g(v), columns d_a(v) weighted by f(u), less the corners T: see the head of this file."""

    def __init__(
        self,
        rows: Sequence[ParametricCurve],
        g: Blend,
        columns: Sequence[ParametricCurve] = (),
        f: Blend | None = None,
        corners: Array | None = None,
    ) -> None:
        self.rows, self.g, self.columns, self.f, self.corners = tuple(rows), g, tuple(columns), f, corners

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1))."""
        return self.rows[0].domain, self.g.domain

    @property
    def breaks(self) -> tuple[Array, Array]:
        """Parameters where a curve or a blending function need not be smooth."""
        found: list[list[Array]] = [[curve.breaks for curve in self.rows], [curve.breaks for curve in self.columns]]
        for axis, blend in enumerate((self.f, self.g)):
            found[axis].append(blend.knots.breaks if isinstance(blend, SplineBlend) else np.array(self.domain[axis]))
        return np.unique(np.concatenate(found[0])), np.unique(np.concatenate(found[1]))

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3)."""
        check_orders(i, j)
        a, b = self.parameters(u, v)
        total = _weigh(self.g(b, j), [row.derivative(a, i) for row in self.rows])
        if self.f is not None and self.corners is not None:
            total = total + _weigh(self.f(a, i), [column.derivative(b, j) for column in self.columns])
            total = total - self._product(a, b, i, j)
        return total

    def _product(self, u: Array, v: Array, i: int, j: int) -> Array:
        """Derivative (i, j) of sum f_a(u) g_b(v) T_ab, (..., 3)."""
        assert self.f is not None and self.corners is not None
        g = self.g(v, j)
        return _weigh(self.f(u, i), [_weigh(g, line) for line in self.corners])

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in u and v, where every curve and blending function has one."""
        from parametric.formula import exact, t, u, v

        g = self.g.expressions(v)
        rows = [[e.subs(t, u) for e in row.expressions()] for row in self.rows]
        result = [sum(w * row[c] for w, row in zip(g, rows)) for c in range(3)]
        if self.f is not None and self.corners is not None:
            f = self.f.expressions(u)
            columns = [[e.subs(t, v) for e in column.expressions()] for column in self.columns]
            for c in range(3):
                shared = sum(p * q * exact(self.corners[a, b, c]) for a, p in enumerate(f) for b, q in enumerate(g))
                result[c] += sum(w * column[c] for w, column in zip(f, columns)) - shared
        x, y, z = (e.expand() for e in result)
        return x, y, z

    def to_nurbs(self) -> "BSplineSurface":
        """The same surface as a B-spline surface, where all curves are polynomial splines; a ValueError elsewhere."""
        from parametric.splines.tensor import BSplineSurface

        rows, columns = ([curve.to_nurbs() for curve in curves] for curves in (self.rows, self.columns))
        knots = tuple(merge_knots(self._vectors(k, curves)) for k, curves in enumerate((rows, columns)))
        degrees = knots[0].degree, knots[1].degree
        weights: Array | None = np.ones((knots[0].count, 1))
        if any(curve.weights is not None for curve in rows + columns):
            weights = common_weights(rows, knots[0]) if not columns else None
        if weights is None:
            raise ValueError("a blend of rational curves of different weights is no B-spline surface over their knots")
        places = [greville(k) for k in knots]
        inverse = [np.linalg.inv(k.design(p)) for k, p in zip(knots, places)]
        heights = self.grid(*places) * (knots[0].design(places[0]) @ weights)[:, None]
        net = np.einsum("ia,jb,abc->ijc", *inverse, heights) / weights[:, None]
        rational = np.broadcast_to(weights, net.shape[:2]) if np.ptp(weights) else None
        return BSplineSurface(net, degrees, knots, rational)

    def _vectors(self, axis: int, curves: "Sequence[BSplineCurve]") -> list[KnotVector]:
        """Knots of everything that runs along one axis."""
        blend = (self.f, self.g)[axis]
        vectors = [curve.knots for curve in curves]
        if isinstance(blend, SplineBlend):
            vectors.append(blend.knots)
        elif blend is not None:
            raise ValueError("a surface blended by arbitrary functions is no B-spline surface")
        return vectors


def common_weights(curves: "Sequence[BSplineCurve]", knots: KnotVector) -> Array | None:
    """Weights (count, 1) over `knots` of the denominator that all curves share, or None."""
    places = greville(knots)
    denominators = [np.ones(places.size) if c.weights is None else c.knots.design(places) @ c.weights for c in curves]
    if any(np.abs(d - denominators[0]).max() > 1e-14 * denominators[0].max() for d in denominators):
        return None
    return np.asarray(np.linalg.solve(knots.design(places), denominators[0])[:, None], dtype=float)


def _weigh(weights: Array, vectors: Sequence[Array] | Array) -> Array:
    """Sum of weights[..., k] vectors[k]."""
    terms = [weights[..., k, None] * vector for k, vector in enumerate(vectors)]
    return sum(terms[1:], terms[0])


def merge_knots(vectors: Sequence[KnotVector]) -> KnotVector:
    """Clamped knots of the highest degree over which all splines on one domain can be written."""
    degree = max(k.degree for k in vectors)
    low, high = vectors[0].domain
    needed: dict[float, int] = {}
    for k in vectors:
        for value in k.breaks[1:-1].tolist():
            times = int(np.count_nonzero(k.values == value)) + degree - k.degree
            needed[value] = max(needed.get(value, 0), times)
    inner = np.repeat(np.array(sorted(needed)), [needed[value] for value in sorted(needed)])
    return KnotVector(np.concatenate([[low] * (degree + 1), inner, [high] * (degree + 1)]), degree)


def greville(knots: KnotVector) -> Array:
    """One parameter for each basis function, the mean of its inner knots: good places to interpolate."""
    p = knots.degree
    means = np.array([knots.values[i + 1 : i + p + 1].mean() for i in range(knots.functions)])
    return np.clip(means, *knots.domain)
