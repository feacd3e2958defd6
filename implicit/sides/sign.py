"""Certified signs of f: floats with a proven bound on the error, and exact arithmetic where they cannot tell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import flint
import numpy as np
from numpy.typing import NDArray

from implicit.algebra.exact import Exact, ExactValues, to_fmpq
from implicit.algebra.expand import ring
from implicit.algebra.polynomial import Polynomial
from implicit.errors import SignAmbiguousError
from implicit.evaluate import PolynomialField
from implicit.kernels.filter import UNSURE, tape_signs
from implicit.language.trees import is_branching, x, y, z
from implicit.surface import Surface
from implicit.tape import Tape, make_tape

Floats: TypeAlias = NDArray[np.float64]
Signs: TypeAlias = NDArray[np.int8]

BLOCK = 512
FLOOR = 2.0**-47  # of surfaces that are no polynomials, times the largest coordinate where that exceeds 1
_LONG_TAPE = 2  # a tape this many times longer than the list of terms is not used
_UNIT = 1.2e-16  # above 2^-53
_TINY = 1e-300  # above all errors of underflow together


@dataclass(frozen=True, eq=False)
class Sign:
    """The sign of f for one surface."""

    surface: Surface

    @cached_property
    def _tape(self) -> Tape:
        return make_tape(self.surface.expression)

    @cached_property
    def _exact(self) -> ExactValues:
        return ExactValues(self.surface.expression)

    @cached_property
    def _terms(self) -> PolynomialField | None:
        """The multiplied-out polynomial, where that is quicker than the formula as it was written."""
        field = self.surface.field
        if not isinstance(field, PolynomialField) or len(field.coefficients) < 40:
            return None
        return field if len(self._tape) > _LONG_TAPE * len(field.coefficients) else None

    @property
    def provable(self) -> bool:
        """Whether boxes can be shown to keep one sign."""
        return True

    @property
    def floor(self) -> float:
        """The distance below which a point may count as on: 0 for rational formulas and polynomials, always exact."""
        return 0.0 if self._exact.rational or self.surface.polynomial is not None else FLOOR

    @cached_property
    def even_factors(self) -> tuple[Polynomial, ...]:
        """The factors of f of even multiplicity, across which it does not change its sign."""
        polynomial = self.surface.polynomial
        if polynomial is None or polynomial.degree < 2 or _is_square_free(polynomial):
            return ()
        return tuple(factor for factor, multiplicity in polynomial.factors() if multiplicity % 2 == 0)

    def check_multiplicity(self) -> None:
        """Raise SignAmbiguousError if there are such factors."""
        if self.even_factors:
            listed = ", ".join(str(factor.to_sympy()) for factor in self.even_factors)
            free = self.surface.polynomial.square_free if self.surface.polynomial is not None else None
            raise SignAmbiguousError(
                f"f has the factor {listed} with even multiplicity and does not change its sign there: inside and "
                f"outside are not told apart; take the square-free part, {free}"
            )

    def signs(self, points: Floats) -> Signs:
        """-1, 0 or 1 at points (n, 3); UNSURE where no proof was found, never for polynomials."""
        out = self.around(points)
        for i in np.flatnonzero(out == UNSURE):
            out[i] = self.exactly([to_fmpq(c) for c in points[i].tolist()])
        return out

    def exactly(self, point: Exact) -> int:
        """-1, 0, 1 or UNSURE at a rational point."""
        polynomial = self.surface.polynomial
        if polynomial is not None and polynomial.field is None and self._terms is not None:
            return _polynomial_sign(polynomial, point)
        sign = self._exact.sign(point)
        if sign is None and polynomial is not None and _is_zero(polynomial, point):
            return 0
        return UNSURE if sign is None else sign

    def around(self, points: Floats, radius: Floats | float = 0.0) -> Signs:
        """-1 or 1 where f has that sign at all points within a radius of a point (n, 3), by floats; else UNSURE.

        Within means no coordinate differs by more. Blocks of points share a bound, those left get their own.
        """
        radii = np.atleast_1d(np.asarray(radius, dtype=float))
        out = self._floats(points, radii, BLOCK)
        if len(left := np.flatnonzero(out == UNSURE)):
            own = radii[left] if len(radii) > 1 else radii
            out[left] = self._floats(np.ascontiguousarray(points[left]), own, 1)
        return out

    def _floats(self, points: Floats, radii: Floats, block: int) -> Signs:
        if self._terms is not None:
            return _compare(*_term_values(self._terms, points, radii, block))
        return _run(self._tape, points, radii, block, _NOTHING)

    @cached_property
    def _slopes(self) -> tuple[Tape, ...]:
        """The tapes of the three derivatives; none for formulas with min, max or abs."""
        expression = self.surface.expression
        if expression is None or is_branching(expression) or self._terms is not None:
            return ()
        return tuple(make_tape(expression.diff(s)) for s in (x, y, z))

    def clear(self, points: Floats, radius: Floats | float, ball: bool) -> Signs:
        """As `around`, sharper where f is smooth: |f(q) - f(p)| is at most |q - p| times the largest slope between.

        Within means in the ball of the radius round a point, or in the cube.
        """
        if not self._slopes:
            return np.full(len(points), UNSURE, dtype=np.int8)
        radii = np.broadcast_to(np.asarray(radius, dtype=float), len(points)).copy()
        value, error = _values(self._tape, points, np.zeros(1))
        slopes = np.stack([abs(g) + e for g, e in (_values(tape, points, radii) for tape in self._slopes)])
        with np.errstate(all="ignore"):
            reach = (
                radii * (np.sqrt((slopes * slopes).sum(axis=0)) if ball else slopes.sum(axis=0)) * (1 + 1e-14) + error
            )
            return np.where(value > reach, 1, np.where(value < -reach, -1, UNSURE)).astype(np.int8)


_NOTHING = np.empty((2, 0))


def _run(tape: Tape, points: Floats, radii: Floats, block: int, known: Floats) -> Signs:
    out = np.empty(len(points), dtype=np.int8)
    registers = np.empty((len(tape) + 6, block + 16))
    tape_signs(tape.code.copy(), tape.arguments.copy(), tape.constants, points, radii, block, registers, out, known)
    return out


def _values(tape: Tape, points: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Values (n,) at points, and bounds (n,) for their distance from all exact values within the radii."""
    known = np.empty((2, len(points)))
    _run(tape, points, radii, 1, known)
    return known[0], known[1]


@dataclass(frozen=True, eq=False)
class BlackBoxSign(Sign):
    """The sign of a function without a formula: of its computed values, which nothing can prove.

    Around a point the sign is certain where the function has guaranteed ranges, from a Lipschitz constant.
    """

    @property
    def provable(self) -> bool:
        """Whether the function has finite ranges."""
        return bool(np.isfinite(self.surface.field.ranges(np.zeros((1, 2, 3)))).all())

    @property
    def floor(self) -> float:
        """Infinite: no distance is certain."""
        return np.inf

    @property
    def even_factors(self) -> tuple[Polynomial, ...]:
        """None are known."""
        return ()

    def signs(self, points: Floats) -> Signs:
        """The signs of the computed values; UNSURE where they are no numbers."""
        values = self.surface.field.values(points)
        return np.where(np.isnan(values), UNSURE, np.sign(values)).astype(np.int8)

    def clear(self, points: Floats, radius: Floats | float, ball: bool) -> Signs:
        """UNSURE: nothing is known of the slopes."""
        return np.full(len(points), UNSURE, dtype=np.int8)

    def exactly(self, point: Exact) -> int:
        """UNSURE: there is no exact value."""
        return UNSURE

    def around(self, points: Floats, radius: Floats | float = 0.0) -> Signs:
        """-1 or 1 where the guaranteed ranges prove it within the radius of a point (n, 3), else UNSURE."""
        reach = np.broadcast_to(np.atleast_1d(np.asarray(radius, dtype=float))[:, None], points.shape)
        ranges = self.surface.field.ranges(np.stack([points - reach, points + reach], axis=1))
        return np.where(ranges[:, 0] > 0, 1, np.where(ranges[:, 1] < 0, -1, UNSURE)).astype(np.int8)


def sign_of(surface: Surface) -> Sign:
    """The signs of a surface, kept with it as its other derived properties are."""
    known = surface.__dict__.get("_sign")
    if known is None:
        known = Sign(surface) if surface.expression is not None else BlackBoxSign(surface)
        surface.__dict__["_sign"] = known
    return known


def _term_values(field: PolynomialField, points: Floats, radii: Floats, block: int) -> tuple[Floats, Floats]:
    """Values (n,) by Horner lines, and bounds (n,) for their distance from all exact values within the radii.

    The rounding error is at most gamma times the sum of the absolute values of all terms. That sum grows with |x|, |y|,
    |z|, and so does its change within the radius: both are computed once per block, where each coordinate is largest.
    """
    values = field.values(points)
    starts = np.arange(0, len(points), block)
    corners = np.maximum.reduceat(abs(points), starts, axis=0) if len(points) else np.empty((0, 3))
    reach = np.maximum.reduceat(radii, starts)[:, None] if len(radii) > 1 else radii
    degree, terms = int(field.exponents.sum(axis=1).max(initial=0)), len(field.coefficients)
    gamma = (degree + terms + 4) * _UNIT
    magnitude = PolynomialField(field.exponents, abs(field.coefficients) + field.errors, field.errors)
    off = PolynomialField(field.exponents, field.errors, field.errors)
    outer = magnitude.values(corners + reach)
    bounds = outer - magnitude.values(corners) + 4 * gamma * outer + off.values(corners + reach) * 2 + _TINY
    return values, np.repeat(bounds, block)[: len(points)]


def _compare(values: Floats, bounds: Floats) -> Signs:
    """1 or -1 where a value is farther from zero than its bound, else UNSURE."""
    with np.errstate(invalid="ignore"):
        return np.where(values > bounds, 1, np.where(values < -bounds, -1, UNSURE)).astype(np.int8)


def _polynomial_sign(polynomial: Polynomial, point: Exact) -> int:
    value = polynomial.flint(*point)
    return int(value > 0) - int(value < 0)


def _is_zero(polynomial: Polynomial, point: Exact) -> bool:
    """Whether a polynomial over a number field vanishes at a point: all its coordinates there do."""
    extra = 0 if polynomial.field is None else 1
    context = ring(extra)
    images = [context.constant(c) for c in point]
    value = polynomial.flint.compose(*images, *context.gens()[3:], ctx=context)
    return bool(value.is_zero())


def _is_square_free(polynomial: Polynomial) -> bool:
    """Whether f restricted to one line is square-free modulo one prime, at full degree, which proves it for f."""
    if polynomial.field is not None:
        return False
    p = (1 << 61) - 1
    random = np.random.default_rng(11)
    for _ in range(3):
        start, slope = (random.integers(1, p, 3).tolist() for _ in range(2))
        axes = [flint.nmod_poly([a, b], p) for a, b in zip(start, slope, strict=True)]
        try:
            restricted = _restrict(polynomial, axes, p)
        except ZeroDivisionError:
            return False
        if restricted.degree() == polynomial.degree:
            return bool(restricted.gcd(restricted.derivative()).degree() == 0)
    return False


def _restrict(polynomial: Polynomial, axes: list[flint.nmod_poly], p: int) -> flint.nmod_poly:
    powers = []
    for axis, degree in zip(axes, polynomial.degrees, strict=True):
        row = [flint.nmod_poly([1], p)]
        for _ in range(degree):
            row.append(row[-1] * axis)
        powers.append(row)
    total = flint.nmod_poly([0], p)
    for (i, j, k), c in polynomial.flint.to_dict().items():
        if int(c.q) % p == 0:
            raise ZeroDivisionError
        factor = int(c.p) * pow(int(c.q), -1, p) % p
        total += powers[0][int(i)] * powers[1][int(j)] * powers[2][int(k)] * factor
    return total
