"""Implicit surfaces f(x, y, z) = 0: expression, value, gradient, Hessian, normal, curvature."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from implicit.errors import NotPolynomialError, SingularPointError
from implicit.formula import parse
from implicit.notation import write
from implicit.reading import to_expression, to_parameters
from implicit.trees import Packed, pack, unpack, x, y, z

if TYPE_CHECKING:
    from implicit.evaluate import Field
    from implicit.expand import Expansion
    from implicit.implicitize.certificate import Certificate
    from implicit.polynomial import Polynomial

__all__ = ["Curvature", "Surface", "x", "y", "z"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curvature:
    """Curvatures at points (...,), positive where the surface bends away from its normal, as on a sphere.

    `gaussian` and `mean` (...,), `principal` (..., 2) largest first, `directions` (..., 2, 3) unit vectors.
    """

    gaussian: Floats
    mean: Floats
    principal: Floats
    directions: Floats


@dataclass(frozen=True, init=False, repr=False)
class Surface:
    """The surface f(x, y, z) = 0; f < 0 is inside.

    Parameters
    ----------
    expression : str, sympy.Expr or sympy.Eq
        A formula such as "x^2 + y^2 = z" or "2x y - sin(z)", or sympy. An equation means left - right = 0.
    **parameters : real numbers
        Values for the further names in the formula. Floats count as the decimals that they are written as.

    At kinks of min, max and abs derivatives are one-sided: of equal operands the first counts, abs is differentiated
    as at a positive argument. Two surfaces are equal when their expressions are.

    Raises
    ------
    FormulaError
        When the text is no formula.
    ValueError
        For unknown names, numbers that are not real, functions without a rule, and formulas without x, y and z.

    Examples
    --------
    >>> sphere = Surface("x^2 + y^2 + z^2 = r^2", r=3)
    >>> float(sphere((0, 0, 0))), sphere.gradient((0, 0, 3)), sphere.degree
    (-9.0, array([0., 0., 6.]), 2)
    """

    expression: sympy.Expr
    certificate: Certificate | None = field(default=None, compare=False)  # of an implicitization, and what it proves

    def __init__(self, expression: str | sympy.Expr | sympy.Eq, **parameters: object) -> None:
        values = to_parameters(parameters)
        read = parse(expression, values) if isinstance(expression, str) else to_expression(expression, values)
        object.__setattr__(self, "expression", to_expression(read, {}, needs_variables=True))

    @classmethod
    def from_polynomial(cls, polynomial: Polynomial, certificate: Certificate | None = None) -> Surface:
        """The surface of an exact polynomial, not expanded again."""
        surface = object.__new__(cls)
        object.__setattr__(surface, "expression", polynomial.to_sympy())
        object.__setattr__(surface, "certificate", certificate)
        surface.__dict__["polynomial"] = polynomial
        if polynomial.field is None:
            from implicit.expand import Expansion

            surface.__dict__["_expansion"] = Expansion(polynomial.flint, ())
        return surface

    @cached_property
    def _expansion(self) -> Expansion | None:
        from implicit.expand import expand

        try:
            return expand(self.expression)
        except NotPolynomialError:
            return None

    @cached_property
    def polynomial(self) -> Polynomial | None:
        """The exact polynomial f; None when it is none, or has coefficients that are no algebraic numbers."""
        from implicit.polynomial import Polynomial

        try:
            return Polynomial.from_expansion(self._expansion) if self._expansion is not None else None
        except NotPolynomialError:
            return None

    @cached_property
    def degree(self) -> int | None:
        """The total degree of f in x, y, z; None when f is no polynomial."""
        if self._expansion is None:
            return None
        if self.polynomial is not None:
            return self.polynomial.degree
        return max(sum(exponents[:3]) for exponents in self._expansion.flint.to_dict())

    @cached_property
    def field(self) -> Field:
        """The numeric side: values, gradients, Hessians and guaranteed ranges of arrays of points (n, 3)."""
        from implicit.fields import make_field

        return make_field(self.expression, self._expansion, self.polynomial)

    def __call__(self, points: ArrayLike) -> Floats:
        """The values f (...,) at points (..., 3); negative inside."""
        flat, shape = _flat(points)
        return _scalar(self.field.values(flat).reshape(shape))

    def gradient(self, points: ArrayLike) -> Floats:
        """The gradients (..., 3) at points (..., 3)."""
        flat, shape = _flat(points)
        return self.field.gradients(flat)[1].reshape(*shape, 3)

    def hessian(self, points: ArrayLike) -> Floats:
        """The matrices of second derivatives (..., 3, 3) at points (..., 3)."""
        flat, shape = _flat(points)
        return self.field.hessians(flat).reshape(*shape, 3, 3)

    def normal(self, points: ArrayLike) -> Floats:
        """Unit normals grad f / |grad f| (..., 3) at points (..., 3), of the level set through each point.

        Raises SingularPointError where the gradient vanishes, to rounding.

        >>> Surface("z = x^2 - y^2").normal((0, 0, 0))
        array([0., 0., 1.])
        """
        flat, shape = _flat(points)
        return self._unit_gradients(flat)[0].reshape(*shape, 3)

    def _unit_gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """Unit normals (n, 3) and gradient lengths (n,)."""
        gradients = self.field.gradients(points)[1]
        lengths = np.linalg.norm(gradients, axis=1)
        small = ~(lengths > 1e-3)
        if small.any():
            bend = np.abs(self.field.hessians(points[small])).max(axis=(1, 2), initial=0.0)
            reach = np.maximum(1.0, np.abs(points[small]).max(axis=1))
            bad = ~(lengths[small] > 1e-14 * bend * reach) | ~np.isfinite(lengths[small])
            if bad.any():
                place = tuple(float(c) for c in points[small][bad][0])
                raise SingularPointError(f"a normal was asked for at {place}, where the gradient vanishes")
        return gradients / lengths[:, None], lengths

    def tangent_plane(self, point: ArrayLike) -> Surface:
        """The plane grad f (p) . (q - p) = 0 touching the level set through the point p (3,).

        >>> Surface("x^2 + y^2 + z^2 = 1").tangent_plane((0, 0, 1))
        Surface("2*z - 2")
        """
        flat, shape = _flat(point)
        if shape:
            raise ValueError(f"one point (3,) was wanted, got shape {(*shape, 3)}")
        self._unit_gradients(flat)
        gradient, place = (
            [sympy.Rational(repr(float(c))) for c in row] for row in (self.field.gradients(flat)[1][0], flat[0])
        )
        return Surface(sympy.expand(sum(g * (s - p) for g, s, p in zip(gradient, (x, y, z), place, strict=True))))

    def curvature(self, points: ArrayLike) -> Curvature:
        """Curvatures of the level sets through points (..., 3): eigenvalues of P H P / |grad f| in the tangent plane.

        H is the Hessian and P the projection onto the tangent plane (Goldman 2005, doi:10.1016/j.cagd.2005.06.005).
        The sphere of radius r has principal curvatures 1/r, 1/r. Raises SingularPointError where the gradient vanishes.
        """
        flat, shape = _flat(points)
        normals, lengths = self._unit_gradients(flat)
        tangents = _tangents(normals)
        forms = tangents @ self.field.hessians(flat) @ tangents.swapaxes(1, 2) / lengths[:, None, None]
        values, vectors = np.linalg.eigh((forms + forms.swapaxes(1, 2)) / 2)
        principal, vectors = values[:, ::-1], vectors[:, :, ::-1].swapaxes(1, 2)
        directions = vectors @ tangents
        return Curvature(
            gaussian=_scalar(principal.prod(axis=1).reshape(shape)),
            mean=_scalar(principal.mean(axis=1).reshape(shape)),
            principal=principal.reshape(*shape, 2),
            directions=directions.reshape(*shape, 2, 3),
        )

    def __repr__(self) -> str:
        return f'Surface("{write(self.expression)}")'

    def __reduce__(self) -> tuple[object, ...]:
        return _restore, (pack(self.expression), self.certificate)


def _restore(packed: Packed, certificate: Certificate | None) -> Surface:
    surface = object.__new__(Surface)
    object.__setattr__(surface, "certificate", certificate)
    object.__setattr__(surface, "expression", unpack(packed))
    return surface


def _flat(points: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
    """Points (..., 3) as (n, 3), and the leading shape."""
    array = np.asarray(points)
    if array.dtype.kind not in "fiub":
        raise ValueError(f"points must be real numbers, got an array of {array.dtype}")
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points must have shape (..., 3), got {array.shape}")
    return np.ascontiguousarray(array.reshape(-1, 3), dtype=float), array.shape[:-1]


def _scalar(values: Floats) -> Floats:
    return values if values.ndim else values[()]


def _tangents(normals: Floats) -> Floats:
    """Two unit vectors (n, 2, 3) across each unit normal (n, 3)."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)
