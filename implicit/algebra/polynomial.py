"""Exact polynomials in x, y, z over Q or over a real number field Q(w)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from math import isfinite

import flint
import numpy as np
import sympy
from numpy.typing import NDArray

from implicit.algebra.constants import BITS, enclose
from implicit.algebra.expand import Expansion, expand, ring
from implicit.algebra.numberfield import NumberField, make_field
from implicit.errors import NotPolynomialError
from implicit.language.trees import x, y, z


@dataclass(frozen=True, eq=False)
class Polynomial:
    """An exact polynomial.

    `flint` is a python-flint `fmpq_mpoly` in x, y, z or, with a `field`, in x, y, z, w with powers of w below the
    degree of the field.

    Examples
    --------
    >>> from implicit.formula import parse
    >>> p = Polynomial.from_sympy(parse("(x^2 - 2y)^2 (x + 1/2)"))
    >>> p.degree, p.square_free.degree
    (5, 3)
    """

    flint: flint.fmpq_mpoly
    field: NumberField | None = None

    @classmethod
    def from_sympy(cls, expression: sympy.Expr) -> Polynomial:
        """The expression multiplied out; algebraic coefficients stay exact, floats count as decimals.

        Raises
        ------
        NotPolynomialError
            When it is no polynomial in x, y, z, or has a transcendental coefficient such as pi.
        """
        expansion = expand(sympy.sympify(expression))
        return cls.from_expansion(expansion)

    @classmethod
    def from_expansion(cls, expansion: Expansion) -> Polynomial:
        """Replace the irrational constants by numbers of one field."""
        if not expansion.constants:
            return cls(expansion.flint)
        for constant in expansion.constants:
            if not constant.is_algebraic:
                raise NotPolynomialError(f"exact coefficients must be algebraic numbers, but {constant} occurs")
        field, forms = make_field(expansion.constants)
        gens = ring(1).gens()
        numbers = [sum((gens[3] ** n * _q(c) for n, c in enumerate(form)), start=gens[3] * 0) for form in forms]
        return cls(_reduce(expansion.flint.compose(*gens[:3], *numbers, ctx=ring(1)), field), field)._lowered()

    @classmethod
    def from_terms(
        cls, terms: Mapping[tuple[int, int, int], Fraction | int | Sequence[Fraction]], field: NumberField | None = None
    ) -> Polynomial:
        """From exponents (i, j, k) to coefficients; with a field each coefficient is a sequence of powers of w."""
        if field is None:
            return cls(ring().from_dict({e: _q(Fraction(c)) for e, c in terms.items()}))  # type: ignore[arg-type]
        long = {(*e, n): _q(q) for e, c in terms.items() for n, q in enumerate(c)}  # type: ignore[arg-type]
        return cls(_reduce(ring(1).from_dict(long), field), field)

    @classmethod
    def over(cls, value: flint.fmpq_mpoly, field: NumberField | None) -> Polynomial:
        """From a flint polynomial in which powers of w may be as high as they like."""
        return cls(_reduce(value, field), field)

    def _lowered(self) -> Polynomial:
        """Over Q when w does not occur."""
        if self.field is None or self.flint.degrees()[3] > 0:
            return self
        return Polynomial(ring().from_dict({tuple(e[:3]): c for e, c in self.flint.to_dict().items()}))

    @cached_property
    def terms(self) -> dict[tuple[int, int, int], tuple[Fraction, ...]]:
        """Exponents to coefficients, each given by its rational coordinates 1, w, w^2, ...; sorted, no zeros."""
        size = self.field.degree if self.field else 1
        found: dict[tuple[int, int, int], list[Fraction]] = {}
        for exponents, c in self.flint.to_dict().items():
            i, j, k, *power = (int(e) for e in exponents)
            found.setdefault((i, j, k), [Fraction(0)] * size)[power[0] if power else 0] = Fraction(int(c.p), int(c.q))
        return {e: tuple(found[e]) for e in sorted(found)}

    @cached_property
    def _floats(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        w = self.field.enclosure(BITS) if self.field else 0
        return float_terms({e: (c, (w,)) for e, c in _by_monomial(self.flint).items()})

    @property
    def exponents(self) -> NDArray[np.int64]:
        """Exponents (T, 3), sorted."""
        return self._floats[0]

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Coefficients (T,) as the nearest floats."""
        return self._floats[1]

    @property
    def coefficient_errors(self) -> NDArray[np.float64]:
        """Proven bounds (T,) for |coefficient - its float|; 0 where the float is exact."""
        return self._floats[2]

    @property
    def is_zero(self) -> bool:
        """Whether it vanishes everywhere."""
        return bool(self.flint == 0)

    @cached_property
    def degrees(self) -> tuple[int, int, int]:
        """The degree in each of x, y, z; 0 for the zero polynomial."""
        i, j, k = (max(0, int(d)) for d in self.flint.degrees()[:3])
        return i, j, k

    @cached_property
    def degree(self) -> int:
        """The total degree in x, y, z; 0 for the zero polynomial."""
        return max((sum(e) for e in self.terms), default=0)

    def derivative(self, axis: int) -> Polynomial:
        """The partial derivative by x, y or z (axis 0, 1, 2)."""
        return Polynomial(self.flint.derivative(axis), self.field)

    def gradient(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """The three partial derivatives."""
        return self.derivative(0), self.derivative(1), self.derivative(2)

    def compose(self, a: Polynomial, b: Polynomial, c: Polynomial) -> Polynomial:
        """The polynomial p(a, b, c)."""
        field = _shared_field(self, a, b, c)
        parts = [_lift(p, field) for p in (a, b, c)]
        extra = ring(1).gens()[3:] if field else ()
        whole = _lift(self, field).compose(*parts, *extra, ctx=ring(1) if field else ring())
        return Polynomial.over(whole, field)

    def shifted(self, center: Sequence[Fraction | float]) -> Polynomial:
        """The polynomial p(x + a, y + b, z + c), exactly, for rational a, b, c."""
        moved = [Polynomial(g + _q(Fraction(c))) for g, c in zip(ring().gens(), center, strict=True)]
        return self.compose(*moved)

    def to_sympy(self) -> sympy.Expr:
        """The polynomial as an expression in x, y, z, multiplied out."""
        w = self.field.generator if self.field else sympy.Integer(1)
        total = []
        for (i, j, k), coordinates in self.terms.items():
            number = sympy.Add(*(sympy.Rational(c.numerator, c.denominator) * w**n for n, c in enumerate(coordinates)))
            total.append(sympy.expand(number) * x**i * y**j * z**k)
        return sympy.Add(*total)

    @property
    def square_free(self) -> Polynomial:
        """The product of the distinct irreducible factors, up to a constant: the surface without multiplicities."""
        from implicit.algebra.factor import square_free

        return square_free(self)

    def factors(self) -> list[tuple[Polynomial, int]]:
        """The irreducible factors over the field of the coefficients, with multiplicities; constants left out."""
        from implicit.algebra.factor import factors

        return factors(self)

    def _with(
        self, other: Polynomial | int | Fraction
    ) -> tuple[flint.fmpq_mpoly, flint.fmpq_mpoly, NumberField | None]:
        if not isinstance(other, Polynomial):
            other = Polynomial(ring().constant(_q(Fraction(other))))
        field = _shared_field(self, other)
        return _lift(self, field), _lift(other, field), field

    def __add__(self, other: Polynomial | int | Fraction) -> Polynomial:
        a, b, field = self._with(other)
        return Polynomial(a + b, field)

    def __sub__(self, other: Polynomial | int | Fraction) -> Polynomial:
        a, b, field = self._with(other)
        return Polynomial(a - b, field)

    def __mul__(self, other: Polynomial | int | Fraction) -> Polynomial:
        a, b, field = self._with(other)
        return Polynomial.over(a * b, field)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Polynomial:
        return Polynomial(-self.flint, self.field)

    def __pow__(self, power: int) -> Polynomial:
        if power == 0:
            return Polynomial(ring().constant(1))
        return reduce(Polynomial.__mul__, [self] * power) if self.field else Polynomial(self.flint**power)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polynomial):
            return NotImplemented
        a, b = self._lowered(), other._lowered()
        return a.field == b.field and bool(a.flint == b.flint)

    def __hash__(self) -> int:
        lowered = self._lowered()
        return hash((tuple(lowered.terms.items()), lowered.field))

    def __repr__(self) -> str:
        return f"Polynomial({self.to_sympy()})"

    def __reduce__(self) -> tuple[object, ...]:
        return _restore, (self.terms, self.field)


def float_terms(
    terms: Mapping[tuple[int, int, int], tuple[list[tuple[tuple[int, ...], flint.fmpq]], tuple[flint.arb, ...]]],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Exponents, nearest floats and error bounds of coefficients given as rational sums of powers of balls."""
    exponents, values, errors = [], [], []
    with flint.ctx.workprec(BITS):
        for monomial in sorted(terms):
            parts, balls = terms[monomial]
            total = flint.arb(0)
            for powers, c in parts:
                product = flint.arb(c)
                for ball, power in zip(balls, powers, strict=False):
                    product = product * ball**power if power else product
                total += product
            value = float(total.mid())
            if not isfinite(value):
                raise ValueError(
                    f"the coefficient of x^{monomial[0]} y^{monomial[1]} z^{monomial[2]} is beyond all floats"
                )
            exponents.append(monomial)
            values.append(value)
            errors.append(_upper(abs(total - flint.arb(value))))
    table = (
        np.array(exponents, dtype=np.int64).reshape(-1, 3),
        np.array(values, dtype=float),
        np.array(errors, dtype=float),
    )
    for array in table:
        array.flags.writeable = False
    return table


def expansion_terms(expansion: Expansion) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Exponents, nearest floats and error bounds of an expansion with any real constants, pi among them."""
    balls = tuple(enclose(constant) for constant in expansion.constants)
    return float_terms({e: (c, balls) for e, c in _by_monomial(expansion.flint).items()})


def _upper(ball: flint.arb) -> float:
    value = float(ball.abs_upper())
    return 0.0 if ball == 0 else float(np.nextafter(value, np.inf))


def _by_monomial(p: flint.fmpq_mpoly) -> dict[tuple[int, int, int], list[tuple[tuple[int, ...], flint.fmpq]]]:
    found: dict[tuple[int, int, int], list[tuple[tuple[int, ...], flint.fmpq]]] = {}
    for exponents, c in p.to_dict().items():
        i, j, k, *powers = (int(e) for e in exponents)
        found.setdefault((i, j, k), []).append((tuple(powers), c))
    return found


def _q(number: Fraction | int | float) -> flint.fmpq:
    exact = Fraction(number)
    return flint.fmpq(exact.numerator, exact.denominator)


def _reduce(p: flint.fmpq_mpoly, field: NumberField | None) -> flint.fmpq_mpoly:
    if field is None or p.degrees()[3] < field.degree:
        return p
    w = ring(1).gens()[3]
    return divmod(p, sum((w**n * c for n, c in enumerate(field.minimal)), start=w * 0))[1]


def _shared_field(*polynomials: Polynomial) -> NumberField | None:
    fields = {p.field for p in polynomials if p.field is not None}
    if len(fields) > 1:
        raise ValueError(f"coefficients from one number field were wanted, got {[f.generator for f in fields]}")
    return fields.pop() if fields else None


def _lift(p: Polynomial, field: NumberField | None) -> flint.fmpq_mpoly:
    if field is None or p.field is not None:
        return p.flint
    return ring(1).from_dict({(*e, 0): c for e, c in p.flint.to_dict().items()})


def _restore(terms: Mapping[tuple[int, int, int], Sequence[Fraction]], field: NumberField | None) -> Polynomial:
    return Polynomial.from_terms(terms if field else {e: c[0] for e, c in terms.items()}, field)
