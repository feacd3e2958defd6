"""The algebraic constants of a parametrization as polynomials in one algebraic integer."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from types import MappingProxyType
from typing import Any

import sympy
from flint import fmpq, fmpq_mpoly_ctx

from implicit.algebra.numberfield import NumberField, make_field
from implicit.errors import TranscendentalError

_RING = fmpq_mpoly_ctx.get(("s", "t", "a"), "lex")


@dataclass(frozen=True)
class Scalars:
    """Z[a] for a real algebraic integer a = `scale` * w, where w generates the number field.

    `modulus` is the monic minimal polynomial of a, constant term first; over the rationals, that of a = 0.
    `constants` maps algebraic numbers to their coefficients with respect to 1, a, a^2, ...
    """

    number_field: NumberField | None
    scale: int
    modulus: tuple[int, ...]
    constants: Mapping[sympy.Expr, tuple[fmpq, ...]]

    @property
    def degree(self) -> int:
        """The degree over the rationals."""
        return len(self.modulus) - 1

    @cached_property
    def _relation(self) -> Any:
        return _RING.from_dict({(0, 0, k): c for k, c in enumerate(self.modulus) if c})

    def reduce(self, polynomial: Any) -> Any:
        """A polynomial in s, t, a with powers of a below the degree of the field."""
        return polynomial if self.degree == 1 else polynomial % self._relation

    @cached_property
    def growth(self) -> int:
        """A number c with |x y| <= c |x| |y| for the sums |.| of absolute coefficients of integers of the field."""
        worst, power = 1, [1] + [0] * (self.degree - 1)
        for _ in range(2 * (self.degree - 1)):
            top, power = power[-1], [0, *power[:-1]]
            power = [c - top * m for c, m in zip(power, self.modulus, strict=False)]
            worst = max(worst, sum(map(abs, power)))
        return worst

    @cached_property
    def _generator(self) -> float:
        return self.scale * float(self.number_field.generator) if self.number_field else 0.0

    def value(self, element: Sequence[int]) -> float:
        """An element as a float."""
        return float(sum(c * self._generator**k for k, c in enumerate(element)))

    def coordinates(self, element: Sequence[int]) -> tuple[Fraction, ...]:
        """An element with respect to the powers of w."""
        return tuple(Fraction(c * self.scale**k) for k, c in enumerate(element))


RATIONALS = Scalars(None, 1, (0, 1), MappingProxyType({}))


def read_scalars(expressions: Iterable[sympy.Expr], phases: Iterable[sympy.Expr] = ()) -> Scalars:
    """The smallest field found that holds all constants of the expressions; TranscendentalError for pi and its like."""
    constants = _constants([*expressions, *phases])
    if not constants:
        return RATIONALS
    field, forms = make_field(constants)
    leading = field.minimal[-1]
    modulus = tuple(c * leading ** (field.degree - 1 - k) for k, c in enumerate(field.minimal[:-1])) + (1,)
    table = {}
    for e, form in zip(constants, forms, strict=True):
        scaled = [c / leading**k for k, c in enumerate(form)]
        table[e] = tuple(fmpq(c.numerator, c.denominator) for c in scaled)
    return Scalars(field, leading, modulus, MappingProxyType(table))


def _constants(expressions: list[sympy.Expr]) -> list[sympy.Expr]:
    """The irrational numbers in the expressions, real and algebraic, in a fixed order."""
    found: dict[sympy.Expr, None] = {}
    stack = list(expressions)
    while stack:
        e = stack.pop()
        if e.is_Rational or e.is_Float or e.is_Symbol:
            continue
        if not e.free_symbols and not (e.is_Add or e.is_Mul or (e.is_Pow and e.exp.is_Integer)):
            found[e] = None
        elif e.free_symbols and (e.func.__name__ in _WAVES or (e.is_Pow and e.exp.free_symbols)):
            continue
        else:
            stack.extend(e.args)
    for e in found:
        if e.is_real is False or e.is_finite is False:
            raise ValueError(f"{e} is no real number")
        if not e.is_algebraic:
            raise TranscendentalError(f"{e} is no algebraic number; give a rational approximation of it")
    return sorted(found, key=sympy.default_sort_key)


_WAVES = {"sin", "cos", "tan", "cot", "sec", "csc", "exp", "sinh", "cosh", "tanh", "coth", "sech", "csch"}
