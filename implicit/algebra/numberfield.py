"""Real number fields Q(w): exact arithmetic with sqrt(2), (1 + sqrt(5))/2 and other algebraic numbers.

w is a chosen real root of an irreducible integer polynomial; every number of the field is a polynomial in w.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import flint
import sympy

_PRECISION = 256  # bits of the first enclosure of w


@dataclass(frozen=True)
class NumberField:
    """The field Q(w).

    `minimal` holds the integer coefficients of the minimal polynomial of w, constant first; `interval` isolates w
    among its roots; `generator` is w as a sympy number.
    """

    minimal: tuple[int, ...]
    interval: tuple[Fraction, Fraction]
    generator: sympy.Expr = field(compare=False)

    @property
    def degree(self) -> int:
        """The dimension of the field over Q."""
        return len(self.minimal) - 1

    def enclosure(self, bits: int = _PRECISION) -> "flint.arb":
        """A ball around w, about `bits` bits sharp."""
        with flint.ctx.workprec(bits):
            low, high = (flint.arb(flint.fmpq(q.numerator, q.denominator)) for q in self.interval)
            for root, _ in flint.fmpz_poly(list(self.minimal)).complex_roots():
                if root.imag == 0 and low < root.real < high:
                    return root.real
        raise ArithmeticError(f"no root of {self.minimal} in {self.interval}")


def make_field(numbers: Sequence[sympy.Expr]) -> tuple[NumberField, list[list[Fraction]]]:
    """The field of some real algebraic numbers, and each of them as a polynomial in w, constant first."""
    if len(numbers) == 1:
        generator = numbers[0]
        minimal = _minimal_polynomial(generator)
        powers = [[Fraction(0), Fraction(1)]]
    else:
        w = sympy.Dummy("w")
        polynomial, mix, forms = sympy.primitive_element(list(numbers), w, ex=True, polys=True)
        generator = sympy.Add(*(c * number for c, number in zip(mix, numbers, strict=True)))
        minimal = _primitive(polynomial.all_coeffs())
        powers = [[Fraction(int(c.p), int(c.q)) for c in map(sympy.Rational, reversed(form))] for form in forms]
    return NumberField(minimal, _isolate(minimal, generator), generator), powers


def _minimal_polynomial(number: sympy.Expr) -> tuple[int, ...]:
    base, exponent = number.as_base_exp()
    if base.is_Rational and exponent.is_Rational and exponent.p == 1:
        candidate = [-int(base.p), *[0] * (int(exponent.q) - 1), int(base.q)]
        _, factors = flint.fmpz_poly(candidate).factor()
        if len(factors) == 1 and factors[0][1] == 1:
            return tuple(candidate)
    w = sympy.Dummy("w")
    return _primitive(sympy.minimal_polynomial(number, w, polys=True).all_coeffs())


def _primitive(descending: Sequence[sympy.Rational]) -> tuple[int, ...]:
    numbers = [sympy.Rational(c) for c in reversed(descending)]
    scale = sympy.ilcm(1, *(int(c.q) for c in numbers))
    whole = [int(c * scale) for c in numbers]
    shared = int(sympy.igcd(*whole))
    return tuple(c // shared for c in whole)


def _isolate(minimal: tuple[int, ...], generator: sympy.Expr) -> tuple[Fraction, Fraction]:
    """A rational interval around the generator that no other root of its minimal polynomial touches."""
    digits = 40
    while digits < 1000:
        middle = Fraction(str(generator.evalf(digits)))
        width = Fraction(1, 10 ** (digits // 2)) * max(Fraction(1), abs(middle))
        low, high = middle - width, middle + width
        inside = 0
        with flint.ctx.workprec(8 * digits):
            a, b = (flint.arb(flint.fmpq(q.numerator, q.denominator)) for q in (low, high))
            for root, _ in flint.fmpz_poly(list(minimal)).complex_roots():
                apart = root.real < a or root.real > b or not root.imag.contains(0)
                inside += not apart
        if inside == 1:
            return low, high
        digits *= 2
    raise ArithmeticError(f"cannot separate {generator} from its conjugates")
