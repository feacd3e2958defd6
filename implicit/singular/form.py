"""A polynomial with exact real coefficients in Q(w), and its values to any precision.

w is a real algebraic integer; over Q the field is w = 0 with modulus w. Values are python-flint arbs: intervals that
are rounded outward, at the precision that is asked for.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from flint import acb, arb, arb_poly, ctx, fmpq, fmpq_poly
from numpy.typing import NDArray

from implicit.algebra.polynomial import Polynomial

Monomial = tuple[int, int, int]


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Work with arbs of `bits` bits inside the block."""
    before = ctx.prec
    ctx.prec = int(bits)
    try:
        yield
    finally:
        ctx.prec = before


@dataclass(frozen=True)
class Field:
    """Q(w): the monic integral minimal polynomial of w, and a ball that holds no other root of it."""

    modulus: fmpq_poly
    near: arb

    @property
    def degree(self) -> int:
        """The degree of the field over Q."""
        return int(self.modulus.degree())

    @property
    def root(self) -> arb:
        """The value of w to the working precision, by Newton's iteration from the isolating ball."""
        if self.degree == 1:
            return arb(-self.modulus[0])
        bits, slope = ctx.prec, self.modulus.derivative()
        with precision(bits + 32):
            x = self.near.mid()
            for _ in range(int(np.ceil(np.log2(bits + 32))) + 4):
                x = (x - evaluate(self.modulus, x) / evaluate(slope, x)).mid()
            around = x + arb(0, 2.0**-30)
            return x - evaluate(self.modulus, x) / evaluate(slope, around)

    @cached_property
    def conjugates(self) -> list[float]:
        """Upper bounds of the absolute values of all complex conjugates of w."""
        if self.degree == 1:
            return [abs(float(self.modulus[0]))]
        return [float(acb(root).abs_upper()) for root, _ in self.modulus.numer().complex_roots()]


def _rational(number: Fraction) -> fmpq:
    return fmpq(number.numerator, number.denominator)


def evaluate(polynomial: fmpq_poly, at: arb) -> arb:
    """An enclosure of a rational polynomial at an arb."""
    return arb_poly(polynomial)(at)


RATIONALS = Field(fmpq_poly([0, 1]), arb(0))


@dataclass(frozen=True)
class Form:
    """An exact polynomial in x, y, z: each coefficient is a polynomial in w of lower degree than the field."""

    terms: dict[Monomial, fmpq_poly]
    field: Field = RATIONALS

    @classmethod
    def of(cls, polynomial: Polynomial) -> "Form":
        """The same polynomial, over Z[w] with w times the leading coefficient of its minimal polynomial for w."""
        if polynomial.field is None:
            return cls({m: fmpq_poly([_rational(c[0])]) for m, c in polynomial.terms.items()})
        minimal, (low, high) = polynomial.field.minimal, polynomial.field.interval
        lead, n = minimal[-1], len(minimal) - 1
        modulus = fmpq_poly([fmpq(c * lead ** (n - 1 - k)) for k, c in enumerate(minimal[:-1])] + [1])
        with precision(256):
            a, b = arb(_rational(low)) * lead, arb(_rational(high)) * lead
            near = a.union(b)
        terms = {
            m: fmpq_poly([_rational(c) / fmpq(lead) ** k for k, c in enumerate(coordinates)])
            for m, coordinates in polynomial.terms.items()
        }
        return cls(terms, Field(modulus, near))

    @cached_property
    def degree(self) -> int:
        """The total degree, -1 for zero."""
        return max((sum(m) for m in self.terms), default=-1)

    @cached_property
    def degrees(self) -> tuple[int, int, int]:
        """The degree in each variable."""
        m = np.array(list(self.terms) or [(0, 0, 0)])
        return tuple(int(d) for d in m.max(axis=0))  # type: ignore[return-value]

    def derivative(self, axis: int) -> "Form":
        """The exact partial derivative along an axis."""
        out = {}
        for m, c in self.terms.items():
            if m[axis]:
                lowered = (m[0] - (axis == 0), m[1] - (axis == 1), m[2] - (axis == 2))
                out[lowered] = c * m[axis]
        return Form(out, self.field)

    @cached_property
    def gradient(self) -> tuple["Form", "Form", "Form"]:
        """The three partial derivatives."""
        return self.derivative(0), self.derivative(1), self.derivative(2)

    @cached_property
    def hessian(self) -> tuple[tuple["Form", ...], ...]:
        """The second partial derivatives."""
        return tuple(tuple(g.derivative(a) for a in range(3)) for g in self.gradient)

    def coefficients(self) -> dict[Monomial, arb]:
        """Every coefficient to the working precision."""
        root = self.field.root
        return {m: evaluate(c, root) if c.degree() > 0 else arb(c[0]) for m, c in self.terms.items()}

    def nested(self) -> "Nested":
        """The polynomial at the working precision, ready to be evaluated."""
        return Nested(self.coefficients())

    def in_box(self, lower: NDArray[np.float64], upper: NDArray[np.float64]) -> tuple[NDArray, NDArray]:  # type: ignore[type-arg]
        """Power coefficients as double pairs, of f divided by a power of two, in variables that run over [-1, 1]."""
        shape = tuple(d + 1 for d in self.degrees)
        with precision(256 + 16 * self.degree):
            dense = np.full(shape, arb(0), dtype=object)
            for m, c in self.coefficients().items():
                dense[m] = c
            for a in range(3):
                middle, half = (arb(lower[a]) + arb(upper[a])) / 2, (arb(upper[a]) - arb(lower[a])) / 2
                dense = np.moveaxis(_shifted(np.moveaxis(dense, a, 0), middle, half), 0, a)
            largest = max((float(abs(c).upper()) for c in dense.flat), default=1.0)
            scale = arb(2) ** -int(np.frexp(largest)[1]) if np.isfinite(largest) and largest else arb(1)
            flat = [c * scale for c in dense.flat]
            high = np.array([float(c.mid()) for c in flat])
            low = np.array([float((c - float(h)).mid()) for c, h in zip(flat, high, strict=True)])
        return high.reshape(shape), low.reshape(shape)


def _shifted(lines: NDArray[np.object_], middle: arb, half: arb) -> NDArray[np.object_]:
    """Power coefficients along the first axis after x -> middle + half x."""
    out = lines.copy()
    n = len(out) - 1
    for i in range(n):
        for j in range(n - 1, i - 1, -1):
            out[j] = out[j] + middle * out[j + 1]
    for j in range(n + 1):
        out[j] = out[j] * half**j
    return out


class Nested:
    """A polynomial of arbs in Horner's nested form."""

    def __init__(self, coefficients: dict[Monomial, arb]) -> None:
        rows: dict[int, dict[int, dict[int, arb]]] = {}
        for (i, j, k), c in coefficients.items():
            rows.setdefault(i, {}).setdefault(j, {})[k] = c
        self.rows = rows

    def __call__(self, x: arb, y: arb, z: arb) -> arb:
        """An enclosure of the value at a point or box of arbs."""
        return _horner(
            {i: _horner({j: _horner(deep, z) for j, deep in row.items()}, y) for i, row in self.rows.items()}, x
        )


def _horner(coefficients: dict[int, arb], x: arb) -> arb:
    value, last = arb(0), None
    for power in sorted(coefficients, reverse=True):
        if last is not None:
            value = value * power_of(x, last - power)
        value = value + coefficients[power]
        last = power
    return value if not last else value * power_of(x, last)


def power_of(x: arb, n: int) -> arb:
    """X to a positive power by products: arb's own power of an interval around 0 is nan."""
    return x if n == 1 else power_of(x * x, n // 2) * (x if n % 2 else 1)
