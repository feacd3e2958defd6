"""Surfaces of revolution."""

from math import pi
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from parametric.conic import Conic, circular_frame
from parametric.curve import CurveLike, ParametricCurve, to_curve
from parametric.parameters import Array, Interval, check_orders, to_parameters, to_vector
from parametric.place import rotation, to_direction
from parametric.splines.bspline import drop
from parametric.surface import ParametricSurface

if TYPE_CHECKING:
    from parametric.shell import Shell
    from parametric.splines.tensor import BSplineSurface

X_AXIS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


@overload
def revolve(curve: CurveLike, axis: ArrayLike = ..., angle: float = ...) -> "RevolvedSurface": ...
@overload
def revolve(
    curve: CurveLike, axis: ArrayLike = ..., angle: float = ..., *, caps: Literal[False]
) -> "RevolvedSurface": ...
@overload
def revolve(curve: CurveLike, axis: ArrayLike = ..., angle: float = ..., *, caps: Literal[True]) -> "Shell": ...
def revolve(
    curve: CurveLike, axis: ArrayLike = X_AXIS, angle: float = 2 * pi, *, caps: bool = False
) -> "RevolvedSurface | Shell":
    """Surface of revolution: p(u, phi) is curve(u) turned by phi about the axis, right-handed; 0 <= phi <= angle.

    The second parameter is the true angle in radians. About the x-axis p = (x, y cos phi - z sin phi,
    y sin phi + z cos phi). The normal p_u x p_phi is on the left of the profile's direction of travel, seen with the
    axis to the right and the profile above it: towards the axis where the profile runs along +axis, away where it
    runs back. So a profile run through against the axis has its normals outside.

    Parameters
    ----------
    curve : curve object, callable on [0, 1] or vertices of a polyline
    axis : (point, direction), default the x-axis
    angle : in (0, 2 pi]
    caps : whether to close both ends of a partial turn of a closed plane profile; the result is then a Shell

    Examples
    --------
    >>> from parametric.splines.bspline import line
    >>> cone = revolve(line((1, 1, 0), (6, 2, 0)))
    >>> cone(0.5, pi / 3).round(6)
    array([3.5     , 0.75    , 1.299038])
    """
    side = RevolvedSurface(to_curve(curve), axis, angle)
    if not caps:
        return side
    if side.angle == 2 * pi:
        raise ValueError("a full turn has no ends to cap")
    from parametric.shell import Shell
    from parametric.sweeps.caps import cap

    ends = (cap(side.iso_v(0.0)), cap(side.iso_v(side.angle), reverse=True))
    return Shell([side, *(end for end in ends if end is not None)])


class RevolvedSurface(ParametricSurface):
    """A surface of revolution; see `revolve`. `to_nurbs` gives the exact rational surface."""

    def __init__(self, curve: ParametricCurve, axis: ArrayLike, angle: float) -> None:
        pair = list(axis)  # type: ignore[arg-type]
        if len(pair) != 2:
            raise ValueError(f"an axis is a pair (point, direction), got {axis!r}")
        if not 0 < angle <= 2 * pi * (1 + 1e-15):
            raise ValueError(f"the angle of revolution must be in (0, 2 pi], got {angle!r}")
        self.curve, self.angle = curve, float(angle)
        self.point, self._direction = to_vector(pair[0], "point"), to_vector(pair[1], "direction")
        self.direction = to_direction(self._direction)

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The domain of the profile, and (0, angle)."""
        return self.curve.domain, (0.0, self.angle)

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The breaks of the profile, and the ends of the angle."""
        return self.curve.breaks, np.array([0.0, self.angle])

    def iso_u(self, u: float) -> Conic:
        """The circle of constant u, by its true angle."""
        radius = self.curve(to_parameters(u, self.domain[0], "u")) - self.point
        along = (radius @ self.direction) * self.direction
        rows = np.stack([self.point + along, radius - along, np.cross(self.direction, radius)])
        return Conic(np.column_stack([rows, [1.0, 0.0, 0.0]]), (0.0, self.angle))

    def iso_v(self, v: float) -> ParametricCurve:
        """The profile turned by the angle v."""
        turn = rotation(self.direction, float(to_parameters(v, self.domain[1], "v")), self.point)
        return self.curve.transform(turn)

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3)."""
        check_orders(i, j)
        a, phi = self.parameters(u, v)
        vectors = self.curve.derivative(a, i) - (self.point if i == 0 else 0.0)
        along = (vectors @ self.direction)[..., None] * self.direction
        out, side = vectors - along, np.cross(self.direction, vectors)
        cos, sin = np.cos(phi)[..., None], np.sin(phi)[..., None]
        for _ in range(j):
            cos, sin = -sin, cos
        turned = cos * out + sin * side
        if j == 0:
            turned = turned + along
            if i == 0:
                turned += self.point
        return turned

    def to_nurbs(self) -> "BSplineSurface":
        """The exact rational surface; its second parameter is the angle only at the ends of arcs of a quarter turn."""
        from parametric.splines.tensor import BSplineSurface

        profile = self.curve.to_nurbs()
        knots, frame = circular_frame(0.0, self.angle)
        vectors = profile.points - self.point
        along = (vectors @ self.direction)[:, None] * self.direction
        parts = (along + self.point, vectors - along, np.cross(self.direction, vectors))
        moved = np.einsum("jk,kic->ijc", frame, np.stack(parts))
        weights = np.broadcast_to(frame[None, :, :1], (*moved.shape[:2], 1))
        net = np.concatenate([moved, weights], axis=-1)
        if profile.weights is not None:
            net = net * profile.weights[:, None, None]
        points, w = drop(net, True)
        return BSplineSurface(points, (profile.degree, 2), (profile.knots, knots), w)

    def expressions(self) -> tuple[Any, Any, Any]:
        """The coordinates as sympy expressions in u and v, with cos v and sin v."""
        import sympy

        from parametric.formula import exact, t, u, v

        k, o = (sympy.Matrix([exact(c) for c in vector.tolist()]) for vector in (self._direction, self.point))
        size = k.dot(k)
        vector = sympy.Matrix([e.subs(t, u) for e in self.curve.expressions()]) - o
        along = k * (k.dot(vector) / size)
        turned = o + along + sympy.cos(v) * (vector - along) + sympy.sin(v) * k.cross(vector) / sympy.sqrt(size)
        x, y, z = (sympy.expand(e) for e in turned)
        return x, y, z
