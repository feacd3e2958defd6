"""Implicit surfaces f(x, y, z) = 0: expression, value, gradient, Hessian, normal, curvature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import field as kept
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from implicit import differential
from implicit.differential import Curvature
from implicit.errors import NotPolynomialError, wrong_kind
from implicit.formula import parse
from implicit.language.notation import write
from implicit.language.reading import to_expression, to_parameters
from implicit.language.trees import Packed, pack, unpack, x, y, z

if TYPE_CHECKING:
    from implicit.algebra.expand import Expansion
    from implicit.algebra.polynomial import Polynomial
    from implicit.domain import Bounds
    from implicit.evaluate import Field
    from implicit.implicitize.certificate import Certificate
    from implicit.solids.distance import Distance

__all__ = ["Curvature", "Surface", "x", "y", "z"]

Floats = NDArray[np.float64]


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

    expression: sympy.Expr | None  # None for a function without a formula
    black_box: Field | None = None  # such a function
    distance: Distance | None = kept(default=None, compare=False)  # the signed distance, where it is known
    certificate: Certificate | None = kept(default=None, compare=False)  # of an implicitization, and what it proves

    def __init__(self, expression: str | sympy.Expr | sympy.Eq, **parameters: object) -> None:
        values = to_parameters(parameters)
        read = parse(expression, values) if isinstance(expression, str) else to_expression(expression, values)
        self.__dict__["expression"] = to_expression(read, {}, needs_variables=True)

    @classmethod
    def _make(cls, **values: object) -> Surface:
        surface = object.__new__(cls)
        surface.__dict__.update(values)
        return surface

    @classmethod
    def from_expression(cls, expression: sympy.Expr, distance: Distance | None = None) -> Surface:
        """From an expression in this module's x, y, z, taken as it is, and the signed distance where known."""
        return cls._make(expression=expression, distance=distance)

    @classmethod
    def from_field(cls, field: Field) -> Surface:
        """From the numeric side alone."""
        return cls._make(expression=None, black_box=field)

    @classmethod
    def from_function(
        cls,
        function: Callable[[Floats], Floats],
        gradient: Callable[[Floats], Floats] | None = None,
        bounds: Bounds | float | None = None,
        lipschitz: float | None = None,
    ) -> Surface:
        """From a vectorised function of points (n, 3) that returns (n,), and perhaps its gradient (n, 3).

        The function is called only inside `bounds`. Space is skipped only with a Lipschitz constant: a number L with
        |f(p) - f(q)| <= L |p - q| everywhere. Nothing else is known of such a surface: its expression is None.

        >>> ball = Surface.from_function(lambda p: (p**2).sum(axis=1) - 1)
        >>> ball.gradient((0, 0, 1)).round(6)
        array([0., 0., 2.])
        """
        from implicit.blackbox import CallableField
        from implicit.domain import to_bounds

        if not callable(function):
            raise ValueError(f"a function of points (n, 3) was wanted, got {function!r}")
        if lipschitz is not None and not (np.isfinite(lipschitz) and lipschitz > 0):
            raise ValueError(f"a Lipschitz constant is positive and finite, got {lipschitz!r}")
        domain = None if bounds is None else to_bounds(bounds)
        return cls.from_field(CallableField(function, gradient, domain, lipschitz))

    @classmethod
    def from_polynomial(cls, polynomial: Polynomial, certificate: Certificate | None = None) -> Surface:
        """The surface of an exact polynomial, not expanded again."""
        surface = cls._make(expression=polynomial.to_sympy(), certificate=certificate, polynomial=polynomial)
        if polynomial.field is None:
            from implicit.algebra.expand import Expansion

            surface.__dict__["_expansion"] = Expansion(polynomial.flint, ())
        return surface

    @cached_property
    def _expansion(self) -> Expansion | None:
        from implicit.algebra.expand import expand

        try:
            return expand(self.expression) if self.expression is not None else None
        except NotPolynomialError:
            return None

    @cached_property
    def polynomial(self) -> Polynomial | None:
        """The exact polynomial f; None when it is none, or has coefficients that are no algebraic numbers."""
        from implicit.algebra.polynomial import Polynomial

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

        if self.black_box is not None:
            return self.black_box
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
        return differential.unit_gradients(self.field, flat)[0].reshape(*shape, 3)

    def tangent_plane(self, point: ArrayLike) -> Surface:
        """The plane grad f (p) . (q - p) = 0 touching the level set through the point p (3,).

        >>> Surface("x^2 + y^2 + z^2 = 1").tangent_plane((0, 0, 1))
        Surface("2*z - 2")
        """
        flat, shape = _flat(point)
        if shape:
            raise ValueError(f"one point (3,) was wanted, got shape {(*shape, 3)}")
        differential.unit_gradients(self.field, flat)
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
        found = differential.curvature(self.field, flat)
        return Curvature(
            _scalar(found.gaussian.reshape(shape)),
            _scalar(found.mean.reshape(shape)),
            found.principal.reshape(*shape, 2),
            found.directions.reshape(*shape, 2, 3),
        )

    def __or__(self, other: Surface) -> Surface:
        """Union: where either solid is."""
        return _combine("union", self, other)

    def __and__(self, other: Surface) -> Surface:
        """Intersection: where both solids are."""
        return _combine("intersection", self, other)

    def __sub__(self, other: Surface) -> Surface:
        """Difference: where this solid is and the other is not."""
        return _combine("difference", self, other)

    def __invert__(self) -> Surface:
        """Complement: inside and outside exchanged."""
        return _combine("complement", self)

    def transform(self, matrix: ArrayLike) -> Surface:
        """The surface moved by p -> M p + t, a matrix (3, 3), or (4, 4) with last row (0, 0, 0, 1), acting on columns.

        >>> Surface("x^2 + y^2 + z^2 = 1").transform([[2, 0, 0], [0, 1, 0], [0, 0, 1]])
        Surface("x^2/4 + y^2 + z^2 - 1")
        """
        from implicit.solids.motion import transform

        return transform(self, matrix)

    def translate(self, vector: ArrayLike) -> Surface:
        """The surface moved by a vector (3,)."""
        from implicit.solids.motion import translate

        return translate(self, vector)

    def rotate(self, angle: object, axis: ArrayLike = (0, 0, 1), center: ArrayLike = (0, 0, 0)) -> Surface:
        """The surface turned by an angle in radians about an axis through `center`, counter-clockwise seen from ahead.

        sympy angles such as pi/6 stay exact, and so do quarter turns.
        """
        from implicit.solids.motion import rotate

        return rotate(self, angle, axis, center)

    def scale(self, factor: object, center: ArrayLike = (0, 0, 0)) -> Surface:
        """The surface scaled from `center` by one factor, or by three along x, y and z."""
        from implicit.solids.motion import scale

        return scale(self, factor, center)

    def __repr__(self) -> str:
        if self.expression is None:
            return f"Surface.from_field({self.black_box!r})"
        return f'Surface("{write(self.expression)}")'

    def __reduce__(self) -> tuple[object, ...]:
        if self.expression is None:
            return Surface.from_field, (self.black_box,)
        known = self.distance
        packed = None if known is None else (pack(known.expression), known.outside, known.inside)
        return _restore, (pack(self.expression), packed)


def check_surface(given: object) -> None:
    """Raise a TypeError unless it is a Surface."""
    if not isinstance(given, Surface):
        raise wrong_kind("an implicit Surface", given)


def _combine(verb: str, *surfaces: Surface) -> Surface:
    from implicit.solids import combine

    for surface in surfaces:
        if not isinstance(surface, Surface):
            raise TypeError(f"surfaces combine with surfaces, got {surface!r}")
    result: Surface = getattr(combine, verb)(*surfaces)
    return result


def _restore(packed: Packed, known: tuple[Packed, bool, bool] | None) -> Surface:
    from implicit.solids.distance import Distance

    distance = None if known is None else Distance(unpack(known[0]), known[1], known[2])
    return Surface.from_expression(unpack(packed), distance)


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
