"""Tensor product surfaces: Bezier, B-spline and NURBS of any degree."""

from collections.abc import Sequence
from functools import cached_property
from math import comb
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import (
    Array,
    Interval,
    check_orders,
    flatten,
    from_grid,
    split_axes,
    to_interval,
    to_parameters,
    to_points,
    to_vector,
    to_weights,
)
from parametric.place import check_affine, move
from parametric.splines import refine
from parametric.splines.basis import combine_grid, combine_points
from parametric.splines.bspline import BSplineCurve, drop, lift
from parametric.splines.knots import Knots, KnotVector, to_knots
from parametric.surface import Jet, ParametricSurface


class BSplineSurface(ParametricSurface):
    """B-spline surface p(u, v) = sum N_i,p(u) N_j,q(v) P_ij, rational where weights are given; immutable.

    Parameters
    ----------
    points : (m+1, n+1, 3)
        Control net; i runs with u and j with v.
    degrees : (p, q) or one integer
    knots : pair of "clamped", "closed", "open", an array or a KnotVector
        The three kinds are uniform on the domain [0, 1]; an array is taken as it stands.
    weights : (m+1, n+1), optional
        Positive; p = sum N N w P / sum N N w.

    Examples
    --------
    >>> net = np.stack(np.meshgrid([0, 1, 2, 3], [0, 1, 2], [0], indexing="ij"), axis=-1)[:, :, 0]
    >>> BSplineSurface(net, (3, 2))(0.5, 0.5)
    array([1.5, 1. , 0. ])
    """

    points: Array
    weights: Array | None
    knots: tuple[KnotVector, KnotVector]

    def __init__(
        self,
        points: ArrayLike,
        degrees: int | Sequence[int],
        knots: Sequence[Knots] | str = ("clamped", "clamped"),
        weights: ArrayLike | None = None,
    ) -> None:
        net = to_points(points, "control points", 2)
        pair = (degrees, degrees) if isinstance(degrees, int | np.integer) else tuple(degrees)
        kinds = (knots, knots) if isinstance(knots, str) else tuple(knots)
        if len(pair) != 2 or len(kinds) != 2:
            raise ValueError(f"degrees and knots must be pairs, for u and v, got {degrees!r} and {len(kinds)} knots")
        vectors = [
            to_knots(kind, degree, count, f"{name} knots")
            for kind, degree, count, name in zip(kinds, pair, net.shape, "uv")
        ]
        self.points, self.weights = net, to_weights(weights, net.shape[:2])
        self.knots = vectors[0], vectors[1]

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1)) on which the basis functions sum to one."""
        return self.knots[0].domain, self.knots[1].domain

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The distinct knots of the domain, in u and in v."""
        return self.knots[0].breaks, self.knots[1].breaks

    @property
    def degrees(self) -> tuple[int, int]:
        """Degrees (p, q) in u and v."""
        return self.knots[0].degree, self.knots[1].degree

    @cached_property
    def _net(self) -> Array:
        """One row and column for each basis function, (., ., 4): weighted points and weights, or points and zero."""
        ones = np.zeros(self.points.shape[:2]) if self.weights is None else self.weights
        scale = 1.0 if self.weights is None else self.weights[..., None]
        net = np.concatenate([self.points * scale, ones[..., None]], axis=-1)
        return np.ascontiguousarray(self.knots[1].unwrap(self.knots[0].unwrap(net, 0), 1))

    @cached_property
    def _nets(self) -> dict[tuple[int, int], Array]:
        return {}

    def _combine(self, u: Array, v: Array, i: int, j: int) -> Array:
        """Derivative (i, j) of the sum of weighted points, before any division: (..., 3 or 4)."""
        grid = split_axes(u, v)
        if grid is None:
            return self._scatter(u, v, self._derived_nets(i, j), 0)[0]
        along_u, along_v = self.knots
        d = 3 if self.weights is None else 4
        values = combine_grid(*along_u.weights(u.ravel(), i), *along_v.weights(v.ravel(), j), self._net, d)
        return from_grid(values, *grid)

    def _scatter(self, u: Array, v: Array, nets: Array, order: int) -> Array:
        """Sums (1, ..., d), or with both derivatives (3, ..., d), from patches of the same spans."""
        shape = np.broadcast_shapes(u.shape, v.shape)
        ends = self.knots[0].ends, self.knots[1].ends
        return combine_points(flatten(u, shape), flatten(v, shape), *ends, nets, order).reshape(
            1 + 2 * order, *shape, -1
        )

    def _derived_nets(self, i: int, j: int) -> Array:
        """Bezier nets of the derivative (i, j) on all spans; kept."""
        if (i, j) not in self._nets:
            along_u = refine.derive_patches(self._bezier_nets, self.knots[0], i, 0, 2)
            self._nets[i, j] = refine.derive_patches(along_u, self.knots[1], j, 1, 3)
        return self._nets[i, j]

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3)."""
        check_orders(i, j)
        a, b = self.parameters(u, v)
        if self.weights is None:
            return self._combine(a, b, i, j)
        return self._divide({(k, m): self._combine(a, b, k, m) for k in range(i + 1) for m in range(j + 1)})[i, j]

    def jet(self, u: ArrayLike, v: ArrayLike, order: int = 1) -> Jet:
        """All derivatives (i, j) with i + j <= order, each (..., 3)."""
        check_orders(order)
        a, b = self.parameters(u, v)
        orders = [(i, k - i) for k in range(order + 1) for i in range(k + 1)]
        sums: Jet = {}
        if order and split_axes(a, b) is None:
            sums[0, 0], sums[1, 0], sums[0, 1] = self._scatter(a, b, self._derived_nets(0, 0), 1)
        sums.update({pair: self._combine(a, b, *pair) for pair in orders if pair not in sums})
        return sums if self.weights is None else self._divide(sums)

    @staticmethod
    def _divide(sums: Jet) -> Jet:
        """Derivatives of the quotient by Leibniz' rule: (w p)_kl = sum C(k,a) C(l,b) w_ab p_(k-a)(l-b)."""
        result: Jet = {}
        for k, m in sorted(sums):
            rest = sums[k, m][..., :3].copy()
            for a in range(k + 1):
                for b in range(m + 1):
                    if a or b:
                        rest -= comb(k, a) * comb(m, b) * sums[a, b][..., 3:] * result[k - a, m - b]
            result[k, m] = rest / sums[0, 0][..., 3:]
        return result

    def _with(self, axis: int, knots: KnotVector, matrix: Array) -> "BSplineSurface":
        """The surface over other knots along one axis, with control points `matrix` times the old."""
        net = self.points if self.weights is None else lift(self.points, self.weights)
        points, weights = drop(np.moveaxis(np.tensordot(matrix, net, (1, axis)), 0, axis), self.weights is not None)
        return self._like(points, (knots, self.knots[1]) if axis == 0 else (self.knots[0], knots), weights)

    def _like(self, points: Array, knots: tuple[KnotVector, KnotVector], weights: Array | None) -> "BSplineSurface":
        return BSplineSurface(points, (knots[0].degree, knots[1].degree), knots, weights)

    def insert_knot(self, u: float | None = None, v: float | None = None, times: int = 1) -> "BSplineSurface":
        """The same surface with a knot inserted in u, in v or in both."""
        surface = self
        for axis, value in enumerate((u, v)):
            if value is not None:
                surface = surface._with(axis, *refine.insert(surface.knots[axis], value, times))
        return surface

    def elevate(self, by: int | Sequence[int] = 1) -> "BSplineSurface":
        """The same surface with its degrees raised, by one number or a pair for u and v."""
        pair = (by, by) if isinstance(by, int | np.integer) else tuple(by)
        if len(pair) != 2 or min(pair) < 0:
            raise ValueError(f"degrees are raised by zero or more, in u and v, got {by!r}")
        surface = self
        for axis, times in enumerate(pair):
            for _ in range(times):
                surface = surface._with(axis, *refine.elevate(surface.knots[axis]))
        return surface

    def restrict(self, u: ArrayLike | None = None, v: ArrayLike | None = None) -> "BSplineSurface":
        """The part over an interval of u, of v or of both, clamped, with the same parameters."""
        surface = self
        for axis, part in enumerate((u, v)):
            if part is not None:
                low, high = to_interval(to_parameters(part, self.domain[axis], "uv"[axis]), "the part")
                surface = surface._with(axis, *refine.restrict(surface.knots[axis], low, high))
        return surface

    def split(self, u: float | None = None, v: float | None = None) -> "tuple[BSplineSurface, ...]":
        """The two parts on either side of u or of v, or the four of both (u first), with the same parameters."""
        parts: list[BSplineSurface] = [self]
        for axis, value in enumerate((u, v)):
            low, high = self.domain[axis]
            if value is None:
                continue
            if not low < value < high:
                raise ValueError(f"the surface splits at {'uv'[axis]} inside [{low:g}, {high:g}], got {value:g}")
            halves = ((low, value), (value, high))
            parts = [p.restrict(h, None) if axis == 0 else p.restrict(None, h) for p in parts for h in halves]
        return tuple(parts)

    @cached_property
    def _bezier_nets(self) -> Array:
        """Bezier nets of all spans, (spans in u, spans in v, p+1, q+1, 3 or 4)."""
        a, b = self.knots
        rows = a.first[:, None] + np.arange(a.degree + 1)
        columns = b.first[:, None] + np.arange(b.degree + 1)
        net = self._net if self.weights is not None else self._net[..., :3]
        local = net[rows[:, None, :, None], columns[None, :, None, :]]
        return np.einsum("sai,tbj,stijc->stabc", a.extraction, b.extraction, local, optimize=True)

    @cached_property
    def _patches(self) -> "tuple[BezierSurface, ...]":
        nets = self._bezier_nets.reshape(-1, *self._bezier_nets.shape[2:])
        return tuple(BezierSurface(*drop(net, self.weights is not None)) for net in nets)

    def bezier_patches(self) -> "tuple[BezierSurface, ...]":
        """One Bezier surface on [0, 1] x [0, 1] for each pair of spans, those of v running fastest; kept."""
        return self._patches

    def iso_u(self, u: float) -> BSplineCurve:
        """The curve v -> p(u, v) of constant u, a B-spline curve."""
        return self._iso(0, u)

    def iso_v(self, v: float) -> BSplineCurve:
        """The curve u -> p(u, v) of constant v, a B-spline curve."""
        return self._iso(1, v)

    def _iso(self, axis: int, value: float) -> BSplineCurve:
        knots, other = self.knots[axis], self.knots[1 - axis]
        design = knots.design(to_parameters([value], knots.domain, "uv"[axis]))
        net = self.points if self.weights is None else lift(self.points, self.weights)
        points, weights = drop(np.tensordot(design, net, (1, axis))[0], self.weights is not None)
        return BSplineCurve(points, other.degree, other, weights)

    def transform(self, matrix: ArrayLike) -> Self:
        """The surface moved by an affine map (4, 4) that acts on column vectors: its control points moved."""
        return self.with_points(move(self.points, check_affine(matrix)))

    def replace_point(self, i: int, j: int, point: ArrayLike) -> Self:
        """The surface with control point (i, j) elsewhere; it changes on [u_i, u_(i+p+1)) x [v_j, v_(j+q+1)) only."""
        points = self.points.copy()
        points[i, j] = to_vector(point, "point")
        return self.with_points(points)

    def with_points(self, points: ArrayLike) -> Self:
        """The surface of the same knots and weights with other control points of the same shape."""
        if np.shape(points) != self.points.shape:
            raise ValueError(f"the net has shape {self.points.shape}, got {np.shape(points)}")
        result = object.__new__(type(self))
        result.points = to_points(points, "points", 2)
        result.weights, result.knots = self.weights, self.knots
        return result

    def to_nurbs(self) -> "BSplineSurface":
        """The surface itself."""
        return self

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as exact sympy expressions in u and v; a ValueError where there are several pieces.

        The floats are taken at their word. The weight sqrt(1/2) of a circular arc is no float: to implicitize a surface
        of revolution, ask it and not its `to_nurbs`.
        """
        patches = self.bezier_patches()
        if len(patches) > 1:
            raise ValueError(f"the surface has {len(patches)} pieces: take expressions of one of bezier_patches()")
        from parametric.formula import bezier_expressions, u, v

        x, y, z = bezier_expressions(self._bezier_nets[0, 0], (u, v), self.domain)
        return x, y, z


class BezierSurface(BSplineSurface):
    """Bezier surface p(u, v) = sum B_m,i(u) B_n,j(v) P_ij on [0, 1] x [0, 1], rational where weights are given.

    Parameters
    ----------
    points : (m+1, n+1, 3)
        Control net of a surface of degree (m, n); i runs with u and j with v.
    weights : (m+1, n+1), optional
        Positive.

    Examples
    --------
    >>> BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]])(0.5, 0.5)
    array([0.5 , 0.5 , 0.25])
    """

    def __init__(self, points: ArrayLike, weights: ArrayLike | None = None) -> None:
        net = to_points(points, "control points", 2)
        if min(net.shape[:2]) < 2:
            raise ValueError(f"a Bezier surface needs at least 2 x 2 points, got {net.shape[0]} x {net.shape[1]}")
        super().__init__(net, (net.shape[0] - 1, net.shape[1] - 1), ("clamped", "clamped"), weights)

    def _like(self, points: Array, knots: tuple[KnotVector, KnotVector], weights: Array | None) -> BSplineSurface:
        single = all(k.values.size == 2 * k.degree + 2 and k.domain == (0.0, 1.0) for k in knots)
        return BezierSurface(points, weights) if single else super()._like(points, knots, weights)

    def split(self, u: float | None = None, v: float | None = None) -> "tuple[BezierSurface, ...]":
        """The parts on either side of u, of v or of both (u first), as Bezier surfaces on [0, 1] x [0, 1] each."""
        return tuple(BezierSurface(part.points, part.weights) for part in super().split(u, v))
