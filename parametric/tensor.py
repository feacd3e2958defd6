"""Tensor product surfaces: Bezier, B-spline and NURBS of any degree."""

from collections.abc import Sequence
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from parametric.basis import combine_grid, combine_points
from parametric.knots import Knots, KnotVector, to_knots
from parametric.parameters import Array, Interval, from_grid, split_axes, to_points, to_weights
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
        vectors = tuple(
            to_knots(kind, degree, count, f"{name} knots")
            for kind, degree, count, name in zip(kinds, pair, net.shape, "uv")
        )
        self._set(points=net, weights=to_weights(weights, net.shape[:2]), knots=vectors)

    def _set(self, **attributes: object) -> None:
        for name, value in attributes.items():
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a {type(self).__name__} cannot be changed")

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1)) on which the basis functions sum to one."""
        return self.knots[0].domain, self.knots[1].domain

    @property
    def degrees(self) -> tuple[int, int]:
        """Degrees (p, q) in u and v."""
        return self.knots[0].degree, self.knots[1].degree

    @cached_property
    def _net(self) -> Array:
        """One row and column for each basis function; weighted points and weights where rational."""
        net = self.points
        if self.weights is not None:
            net = np.concatenate([net * self.weights[..., None], self.weights[..., None]], axis=-1)
        return np.ascontiguousarray(self.knots[1].unwrap(self.knots[0].unwrap(net, 0), 1))

    def _combine(self, u: Array, v: Array, i: int, j: int) -> Array:
        """Derivative (i, j) of the sum of weighted points, before any division: (..., 3 or 4)."""
        along_u, along_v = self.knots
        grid = split_axes(u, v)
        if grid is not None:
            values = combine_grid(*along_u.weights(u.ravel(), i), *along_v.weights(v.ravel(), j), self._net)
            return from_grid(values, *grid)
        u, v = np.broadcast_arrays(u, v)
        tables = (along_u.breaks, along_u.table(i), along_u.first, along_v.breaks, along_v.table(j), along_v.first)
        return combine_points(u.ravel(), v.ravel(), *tables, self._net).reshape(*u.shape, -1)

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3)."""
        a, b = self.parameters(u, v)
        if self.weights is None:
            return self._combine(a, b, i, j)
        return self._divide({(k, m): self._combine(a, b, k, m) for k in range(i + 1) for m in range(j + 1)})[i, j]

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
