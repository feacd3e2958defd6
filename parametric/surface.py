"""ParametricSurface: everything that follows from one method, the derivatives of p(u, v)."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import wrong_kind
from parametric.parameters import Array, Interval, Value, check_orders, to_parameters

if TYPE_CHECKING:
    from implicit.surface import Curvature, Surface
    from parametric.curve import ParametricCurve
    from parametric.shell import Shell

Jet: TypeAlias = dict[tuple[int, int], Array]


class Frame(NamedTuple):
    """Points, first derivatives and unit normals, each (..., 3)."""

    point: Array
    along_u: Array
    along_v: Array
    normal: Array


class ParametricSurface(Value, ABC):
    """A map p(u, v) from a rectangle to space; immutable.

    A subclass gives `domain` and `derivative`; the rest follows. u and v broadcast against each other:
    two arrays of one shape are scattered points, `surface(u[:, None], v[None, :])` is a grid and is evaluated as one.
    The normal is p_u x p_v: exchanging u and v turns it round.
    """

    @property
    @abstractmethod
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1))."""

    @abstractmethod
    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3). (0, 0) is the point itself."""

    def __repr__(self) -> str:
        (u0, u1), (v0, v1) = self.domain
        return f"<{type(self).__name__} on [{u0:g}, {u1:g}] x [{v0:g}, {v1:g}]>"

    def __call__(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points p(u, v), shape (..., 3)."""
        return self.derivative(u, v, 0, 0)

    def grid(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points at every pair of u (m,) and v (n,): (m, n, 3)."""
        return self(np.asarray(u, dtype=float)[:, None], np.asarray(v, dtype=float)[None, :])

    def jet(self, u: ArrayLike, v: ArrayLike, order: int = 1) -> Jet:
        """All derivatives (i, j) with i + j <= order, each (..., 3)."""
        check_orders(order)
        return {(i, k - i): self.derivative(u, v, i, k - i) for k in range(order + 1) for i in range(k + 1)}

    def parameters(self, u: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """Both parameters as floats; a ValueError where one leaves the domain."""
        return to_parameters(u, self.domain[0], "u"), to_parameters(v, self.domain[1], "v")

    @property
    def breaks(self) -> tuple[Array, Array]:
        """Parameters in u and in v where the surface need not be smooth, both ends of the domain included."""
        return np.array(self.domain[0]), np.array(self.domain[1])

    @cached_property
    def scale(self) -> tuple[float, float]:
        """The largest |p_u| and |p_v| on a coarse grid: what counts as a zero derivative is measured by them."""
        u, v = (np.linspace(*interval, 9) for interval in self.domain)
        lengths = (np.linalg.norm(self.derivative(u[:, None], v, i, j), axis=-1).max() for i, j in ((1, 0), (0, 1)))
        a, b = (float(length) for length in lengths)
        return a, b

    def normal(self, u: ArrayLike, v: ArrayLike, *, undefined: str = "raise") -> Array:
        """Unit normals p_u x p_v / |p_u x p_v|, (..., 3).

        Where the cross product vanishes the limit is taken from higher derivatives: exact at the poles of a sphere
        or of a teapot's lid. Where no limit exists (the tip of a cone) the answer is a SingularPointError, or nan
        if `undefined` is "nan".

        Examples
        --------
        >>> from parametric.splines.tensor import BezierSurface
        >>> BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]]).normal(0.5, 0.5)
        array([0., 0., 1.])
        """
        if undefined not in ("raise", "nan"):
            raise ValueError(f'undefined must be "raise" or "nan", got {undefined!r}')
        from parametric.normals import unit_normals

        return unit_normals(self, u, v, undefined == "raise")

    def frame(self, u: ArrayLike, v: ArrayLike, *, undefined: str = "raise") -> "Frame":
        """Points, both first derivatives and unit normals in one evaluation, each (..., 3); normals as `normal`."""
        from parametric.normals import unit_normals

        jet = self.jet(u, v, 1)
        return Frame(jet[0, 0], jet[1, 0], jet[0, 1], unit_normals(self, u, v, undefined == "raise", jet))

    def true_normal(self, u: ArrayLike, v: ArrayLike) -> Array:
        """The vector N = p_u x p_v, whose length is the area of the surface over that of the domain: (..., 3)."""
        jet = self.jet(u, v, 1)
        return np.cross(jet[1, 0], jet[0, 1])

    def twist(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Twist vectors p_uv, (..., 3). They depend on the parametrization: a plane may have p_uv != 0."""
        return self.derivative(u, v, 1, 1)

    def iso_u(self, u: float) -> "ParametricCurve":
        """The curve v -> p(u, v) of constant u."""
        from parametric.curve import IsoCurve

        return IsoCurve(self, float(to_parameters(u, self.domain[0], "u")), 0)

    def iso_v(self, v: float) -> "ParametricCurve":
        """The curve u -> p(u, v) of constant v."""
        from parametric.curve import IsoCurve

        return IsoCurve(self, float(to_parameters(v, self.domain[1], "v")), 1)

    def curvature(self, u: ArrayLike, v: ArrayLike) -> "Curvature":
        """Gaussian, mean and principal curvatures (largest first) with their unit directions in space.

        A curvature is positive where the surface bends away from its normal, as on a sphere with the normal outside:
        the sign of an implicit surface with the same normal. A SingularPointError where p_u x p_v vanishes.
        """
        from parametric.analysis import curvature

        return curvature(self, u, v)

    def transform(self, matrix: ArrayLike) -> "ParametricSurface":
        """The surface moved by an affine map (4, 4) that acts on column vectors."""
        from parametric.place import MovedSurface

        return MovedSurface(self, matrix)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in the symbols u and v of `parametric`."""
        raise NotImplementedError(f"a {type(self).__name__} has no symbolic expression")

    def implicitize(self, **options: Any) -> "Surface":
        """The implicit surface f(x, y, z) = 0 that contains this one; options as in `implicit.implicitize`."""
        from implicit import implicitize
        from parametric.formula import u, v

        return implicitize(self.expressions(), (u, v), **options)

    @cached_property
    def _shell(self) -> "Shell":
        from parametric.shell import Shell

        return Shell([self])

    def classify_points(
        self, points: ArrayLike, tolerance: float | None = None, rule: str = "nonzero"
    ) -> NDArray[np.int8]:
        """-1 inside, 0 on, +1 outside, for points (..., 3) and a closed surface; see `implicit.classify`."""
        return self._shell.classify_points(points, tolerance, rule)

    def winding_numbers(self, points: ArrayLike) -> Array:
        """How often the surface winds round points (..., 3); see `implicit.winding_number`."""
        return self._shell.winding_numbers(points)

    @property
    def certified_floor(self) -> float:
        """The distance within which answers without a tolerance may be "on"; see `implicit.certified_floor`."""
        return self._shell.certified_floor


def check_surface(given: object) -> None:
    """Raise a TypeError unless it is a ParametricSurface."""
    if not isinstance(given, ParametricSurface):
        raise wrong_kind("a parametric surface", given)
