"""Surfaces given by any function of two parameters."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.differences import differentiate
from parametric.parameters import Array, Interval, check_orders, to_interval
from parametric.surface import ParametricSurface


class FunctionSurface(ParametricSurface):
    """A surface given by any function of u and v that returns three coordinates.

    Derivatives are differences of order eight over 1/64 of the domain: for a smooth function about 1e-10 of its size
    for the first and 500 times worse for each order more. Where derivatives matter, give a FormulaSurface.

    Examples
    --------
    >>> saddle = FunctionSurface(lambda u, v: (u, v, u * v), ((-1, 1), (-1, 1)))
    >>> saddle(0.5, 0.5), saddle.twist(0.0, 0.0).round(6) + 0.0
    (array([0.5 , 0.5 , 0.25]), array([0., 0., 1.]))
    """

    def __init__(self, function: Callable[..., Any], domain: ArrayLike = ((0.0, 1.0), (0.0, 1.0))) -> None:
        intervals = np.asarray(domain, dtype=float)
        if intervals.shape != (2, 2):
            raise ValueError(f"domain must be ((u0, u1), (v0, v1)), got {domain!r}")
        self.function = function
        self._domain = to_interval(intervals[0], "the domain of u"), to_interval(intervals[1], "the domain of v")
        self._one_by_one(*(np.linspace(*interval, 3) for interval in self._domain))

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1))."""
        return self._domain

    def _one_by_one(self, u: Array, v: Array) -> Array:
        values = [self.function(a, b) for a, b in zip(u.ravel().tolist(), v.ravel().tolist())]
        points = np.array([np.asarray(value, dtype=float) for value in values]).reshape(u.size, -1)
        if (u.size and points.shape[1] != 3) or not np.isfinite(points).all():
            raise ValueError(f"a surface's function must return three finite coordinates, got {values[0]!r}")
        return points.reshape(*u.shape, 3)

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3), by differences."""
        check_orders(i, j)
        a, b = np.broadcast_arrays(*self.parameters(u, v))

        def along_u(us: Array) -> Array:
            def along_v(vs: Array) -> Array:
                return self._one_by_one(np.broadcast_to(_widen(us, vs), vs.shape), vs)

            return differentiate(along_v, np.broadcast_to(_widen(b, us), us.shape), j, self._domain[1])

        return differentiate(along_u, a, i, self._domain[0])


def _widen(values: Array, other: Array) -> Array:
    """`values` with as many trailing axes of size one as `other` has axes more."""
    return values.reshape(values.shape + (1,) * (other.ndim - values.ndim))
