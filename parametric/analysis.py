"""Lengths, angles, areas and curvatures: what the first and second fundamental forms measure."""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import SingularPointError, wrong_kind
from parametric.curve import ParametricCurve
from parametric.parameters import Array, check_orders
from parametric.shell import Shell
from parametric.surface import ParametricSurface, check_surface

if TYPE_CHECKING:
    from implicit.surface import Curvature

HALVINGS = 40


@dataclass(frozen=True)
class FundamentalForms:
    """First form E, F, G = p_u.p_u, p_u.p_v, p_v.p_v; second form L, M, N = n.p_uu, n.p_uv, n.p_vv; each (...,)."""

    E: Array
    F: Array
    G: Array
    L: Array
    M: Array
    N: Array


def fundamental_forms(surface: ParametricSurface, u: ArrayLike, v: ArrayLike) -> FundamentalForms:
    """Both fundamental forms, with the unit normal n = p_u x p_v / |p_u x p_v|.

    A SingularPointError where p_u x p_v has no direction.

    Examples
    --------
    >>> from parametric.formula import FormulaSurface, u, v
    >>> forms = fundamental_forms(FormulaSurface((u, v, u * v), ((-1, 1), (-1, 1))), 0.0, 0.0)
    >>> float(forms.E), float(forms.M)
    (1.0, 1.0)
    """
    check_surface(surface)
    jet = surface.jet(u, v, 2)
    n = surface.normal(u, v)
    a, b = jet[1, 0], jet[0, 1]
    return FundamentalForms(
        _dot(a, a), _dot(a, b), _dot(b, b), _dot(n, jet[2, 0]), _dot(n, jet[1, 1]), _dot(n, jet[0, 2])
    )


def curvature(surface: ParametricSurface, u: ArrayLike, v: ArrayLike) -> "Curvature":
    """Principal, Gaussian and mean curvature; see `ParametricSurface.curvature`.

    In an orthonormal basis of the tangent plane the differential of the normal is a symmetric 2 x 2 matrix; its
    eigenvalues are the principal curvatures, its eigenvectors their directions.
    """
    from implicit.surface import Curvature

    jet = surface.jet(u, v, 2)
    a, b = jet[1, 0], jet[0, 1]
    cross = np.cross(a, b)
    size, area = np.sqrt(_dot(a, a)), np.sqrt(_dot(cross, cross))
    if not (area > 1e-9 * surface.scale[0] * surface.scale[1]).all():
        raise SingularPointError("curvature was asked for where p_u x p_v vanishes")
    n = cross / area[..., None]
    e1 = a / size[..., None]
    e2 = np.cross(n, e1)
    along, across = _dot(b, e1), area / size  # p_v in the basis; p_u is (size, 0)
    second = -np.stack([_dot(n, jet[2, 0]), _dot(n, jet[1, 1]), _dot(n, jet[0, 2])], axis=-1)
    m11 = second[..., 0] / size**2
    m12 = (second[..., 1] / size - along * m11) / across
    m22 = (second[..., 2] - 2 * along * across * m12 - along**2 * m11) / across**2
    matrix = np.stack([np.stack([m11, m12], axis=-1), np.stack([m12, m22], axis=-1)], axis=-2)
    values, vectors = np.linalg.eigh(matrix)
    values, vectors = values[..., ::-1], vectors[..., ::-1]
    basis = np.stack([e1, e2], axis=-2)
    directions = np.einsum("...kp,...kc->...pc", vectors, basis)
    return Curvature(gaussian=m11 * m22 - m12**2, mean=(m11 + m22) / 2, principal=values, directions=directions)


def angle(surface: ParametricSurface, u: ArrayLike, v: ArrayLike) -> Array:
    """Angle between the curves of constant v and constant u, in radians, (...,)."""
    jet = surface.jet(u, v, 1)
    cross = np.cross(jet[1, 0], jet[0, 1])
    return np.arctan2(np.sqrt(_dot(cross, cross)), _dot(jet[1, 0], jet[0, 1]))


def is_singular(
    surface: ParametricSurface, u: ArrayLike, v: ArrayLike, *, tolerance: float = 1e-9
) -> NDArray[np.bool_]:
    """Whether the parametrization is singular: p_u x p_v vanishes against the largest |p_u| |p_v|; (...,)."""
    check_surface(surface)
    vectors = surface.true_normal(u, v)
    return np.sqrt(_dot(vectors, vectors)) <= tolerance * surface.scale[0] * surface.scale[1]


def arc_length(
    curve: ParametricCurve, start: float | None = None, end: float | None = None, tolerance: float = 1e-12
) -> float:
    """Arc length of a curve; see `ParametricCurve.length`."""
    low, high = curve.domain
    first, last = (low if start is None else float(start)), (high if end is None else float(end))
    curve.parameters((first, last))
    inner = curve.breaks[(curve.breaks > min(first, last)) & (curve.breaks < max(first, last))]
    ends = np.sort(np.array([first, *inner, last]))
    speed = _Speed(curve)
    pieces = [(a, b, speed.integrate(a, b)) for a, b in pairwise(ends.tolist())]
    rough = sum(value for _, _, value in pieces)
    total = sum(_refine(speed, a, b, value, tolerance * rough, HALVINGS) for a, b, value in pieces)
    return total if last >= first else -total


class _Speed:
    """Gauss-Legendre quadrature of |c'|."""

    def __init__(self, curve: ParametricCurve) -> None:
        self.curve = curve
        self.nodes, self.weights = np.polynomial.legendre.leggauss(16)

    def integrate(self, a: float, b: float) -> float:
        t = np.clip((a + b) / 2 + (b - a) / 2 * self.nodes, *self.curve.domain)
        velocity = self.curve.derivative(t, 1)
        return float((b - a) / 2 * (self.weights @ np.sqrt(_dot(velocity, velocity))))


def _refine(speed: _Speed, a: float, b: float, whole: float, tolerance: float, halvings: int) -> float:
    middle = (a + b) / 2
    left, right = speed.integrate(a, middle), speed.integrate(middle, b)
    if abs(left + right - whole) <= max(tolerance, 1e-15 * whole):
        return left + right
    if halvings == 0:
        raise ValueError(f"the arc length near {middle:g} does not settle to {tolerance:.3g}")
    return _refine(speed, a, middle, left, tolerance / 2, halvings - 1) + _refine(
        speed, middle, b, right, tolerance / 2, halvings - 1
    )


def curve_on(surface: ParametricSurface, path: ParametricCurve) -> "CurveOnSurface":
    """The curve t -> p(u(t), v(t)) of a path (u, v) in the domain; its length is measured on the surface.

    Examples
    --------
    >>> from parametric.splines.bspline import line
    >>> from parametric.formula import FormulaSurface, u, v
    >>> round(curve_on(FormulaSurface((u, v, u), ((0, 1), (0, 1))), line((0, 0), (1, 0))).length(), 12)
    1.414213562373
    """
    check_surface(surface)
    if not isinstance(path, ParametricCurve):
        raise wrong_kind("a curve (u, v) in the domain", path)
    return CurveOnSurface(surface, path)


class CurveOnSurface(ParametricCurve):
    """A curve given by a path in the domain of a surface; derivatives up to the second."""

    def __init__(self, surface: ParametricSurface, path: ParametricCurve) -> None:
        self.surface, self.path = surface, path

    @property
    def domain(self) -> tuple[float, float]:
        """The interval of the path."""
        return self.path.domain

    @property
    def breaks(self) -> Array:
        """The breaks of the path."""
        return self.path.breaks

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3), by the chain rule; a ValueError beyond the second."""
        check_orders(order)
        t = self.parameters(t)
        u, v = np.moveaxis(self.path(t)[..., :2], -1, 0)
        if order == 0:
            return self.surface(u, v)
        du, dv = np.moveaxis(self.path.derivative(t, 1)[..., :2, None], -2, 0)
        jet = self.surface.jet(u, v, order)
        if order == 1:
            return jet[1, 0] * du + jet[0, 1] * dv
        if order == 2:
            ddu, ddv = np.moveaxis(self.path.derivative(t, 2)[..., :2, None], -2, 0)
            bent = jet[2, 0] * du**2 + 2 * jet[1, 1] * du * dv + jet[0, 2] * dv**2
            return bent + jet[1, 0] * ddu + jet[0, 1] * ddv
        raise ValueError(f"a curve on a surface has derivatives up to the second here, not the {order}th")


def area(surface: ParametricSurface | Shell, *, tolerance: float = 1e-9) -> float:
    """Area of the surface, the integral of |p_u x p_v|, to the relative tolerance; of a shell, of all its surfaces.

    Gauss-Legendre quadrature on the smooth pieces, with cells quartered until the sum settles; a ValueError if ten
    quarterings do not settle it, a TypeError for what is no parametric surface or Shell.

    Examples
    --------
    >>> from parametric.splines.tensor import BezierSurface
    >>> round(area(BezierSurface([[(0, 0, 0), (0, 2, 0)], [(3, 0, 0), (3, 2, 0)]])), 12)
    6.0
    """
    if isinstance(surface, Shell):
        return sum(area(part, tolerance=tolerance) for part in surface.surfaces)
    if not isinstance(surface, ParametricSurface):
        raise wrong_kind("a parametric surface or Shell", surface)
    nodes, weights = np.polynomial.legendre.leggauss(10)
    cells = [np.array(axis) for axis in surface.breaks]
    previous = np.inf
    for _ in range(10):
        (u, du), (v, dv) = (_rule(ends, nodes, weights) for ends in cells)
        vectors = surface.true_normal(u[:, None], v[None, :])
        total = float(du @ np.sqrt(_dot(vectors, vectors)) @ dv)
        if abs(total - previous) <= tolerance * total:
            return total
        previous = total
        cells = [np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2])) for ends in cells]
    raise ValueError(f"the area does not settle to the relative tolerance {tolerance:g}")


def _rule(ends: Array, nodes: Array, weights: Array) -> tuple[Array, Array]:
    half = np.diff(ends)[:, None] / 2
    points = (ends[1:, None] + ends[:-1, None]) / 2 + half * nodes
    return points.ravel(), (half * weights).ravel()


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...c,...c->...", a, b))
