"""Rational coordinates in homogeneous form: integer polynomials X, Y, Z, W with (x, y, z) = (X, Y, Z)/W."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from itertools import product
from math import gcd, lcm
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

import sympy
from flint import fmpq, fmpq_mpoly_ctx

from implicit.errors import NotPolynomialError, TranscendentalError, wrong_kind
from implicit.implicitize.angles import Angles, Substitution, read_angles
from implicit.implicitize.scalars import Scalars, read_scalars

Terms: TypeAlias = Mapping[tuple[int, int], tuple[int, ...]]
Ratio: TypeAlias = tuple[Any, Any]
"""A fraction of two polynomials in s, t and the generator a of the number field."""

RING = fmpq_mpoly_ctx.get(("s", "t", "a"), "lex")
S, T, A = RING.gens()
ZERO, ONE = RING.constant(0), RING.constant(1)


@dataclass(frozen=True)
class Coordinates:
    """Integer polynomials X, Y, Z, W without common factor, each a mapping (i, j) -> coefficient of s^i t^j.

    A coefficient is an integer of `field`, a tuple of its coordinates with respect to the powers of the generator.
    `substitutions` tell what s and t stand for, such as tan(u/2).
    """

    terms: tuple[Terms, Terms, Terms, Terms]
    field: Scalars
    substitutions: tuple[Substitution, Substitution]

    @cached_property
    def bidegree(self) -> tuple[int, int]:
        """The largest exponents of s and of t."""
        keys = [key for terms in self.terms for key in terms]
        return max((k[0] for k in keys), default=0), max((k[1] for k in keys), default=0)

    @cached_property
    def sizes(self) -> tuple[int, int, int, int]:
        """A bound for each polynomial: the sum of the absolute values of all integers in it."""
        x, y, z, w = (sum(abs(c) for element in terms.values() for c in element) for terms in self.terms)
        return x, y, z, w


def read_coordinates(
    coordinates: Sequence[Any], parameters: Sequence[Any], rationalize: float | None = None
) -> Coordinates:
    """Three expressions in two parameters as homogeneous integer coordinates.

    Sines, cosines and exponentials of multiples of a parameter are replaced by rational functions of one variable.
    A float stands for its exact binary value. With `rationalize`, floats and fractions are replaced by the simplest
    fractions within that distance.
    """
    names = to_symbols(parameters)
    expressions = to_expressions(coordinates)
    strange = set().union(*(e.free_symbols for e in expressions)) - set(names)
    if strange:
        listed = ", ".join(sorted(map(str, strange)))
        raise ValueError(
            f"the coordinates contain {listed}; the parameters are {names[0]} and {names[1]}: give numbers"
        )
    angles = read_angles(expressions, names)
    field = read_scalars(expressions, angles.phases)
    reader = _Reader(names, angles, field, rationalize)
    ratios = []
    for name, expression in zip("xyz", expressions, strict=True):
        try:
            ratios.append(reader.read(expression))
        except ZeroDivisionError:
            raise ValueError(f"the denominator of coordinate {name} = {expression} is zero") from None
    first, second = (angles.substitution(name) for name in names)
    return Coordinates(_clear(ratios, field), field, (first, second))


def to_expressions(coordinates: Sequence[Any]) -> list[sympy.Expr]:
    """Three coordinates as sympy expressions."""
    if isinstance(coordinates, str):
        _refuse_text(coordinates)
    if not isinstance(coordinates, Iterable):
        raise wrong_kind("a sequence of three coordinates (x, y, z), such as surface.expressions(),", coordinates)
    given = list(coordinates)
    if len(given) != 3:
        raise ValueError(f"a surface has three coordinates (x, y, z), got {len(given)}")
    expressions = [_expression(coordinate) for coordinate in given]
    for name, expression in zip("xyz", expressions, strict=True):
        if expression.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
            raise ValueError(f"coordinate {name} is not finite, its denominator is zero: {expression}")
    return expressions


def to_symbols(parameters: Sequence[Any]) -> tuple[sympy.Symbol, sympy.Symbol]:
    """Two parameters, which must be sympy symbols."""
    names = tuple(parameters) if isinstance(parameters, Iterable) else (parameters,)
    if len(names) != 2 or names[0] == names[1] or not all(isinstance(n, sympy.Symbol) for n in names):
        raise ValueError(f"parameters must be two different sympy symbols, got {parameters!r}")
    return names


def _expression(coordinate: Any) -> sympy.Expr:
    if isinstance(coordinate, str):
        _refuse_text(coordinate)
    try:
        expression = sympy.sympify(coordinate)
    except sympy.SympifyError:
        expression = None
    if not isinstance(expression, sympy.Expr):
        raise wrong_kind("a sympy expression or a number for each coordinate", coordinate)
    return expression


def _refuse_text(text: str) -> NoReturn:
    raise TypeError(f"coordinates must be sympy expressions or numbers, got the text {text!r}")


def _clear(ratios: list[Ratio], field: Scalars) -> tuple[Terms, Terms, Terms, Terms]:
    """Common denominator, integer coefficients, no common factor."""
    w = reduce(lambda a, b: a * (b // a.gcd(b)), (den for _, den in ratios))
    polynomials = [field.reduce(p) for p in (*(num * (w // den) for num, den in ratios), w)]
    common = reduce(lambda a, b: a.gcd(b), polynomials)
    if not common.is_constant() and common.degrees()[2] == 0:
        polynomials = [p // common for p in polynomials]
    scale = lcm(*(int(c.q) for p in polynomials for c in p.coeffs()))
    content = gcd(*(int(c.p) * (scale // int(c.q)) for p in polynomials for c in p.coeffs()))
    out: list[Terms] = []
    for p in polynomials:
        terms: dict[tuple[int, int], list[int]] = {}
        for (i, j, k), c in p.to_dict().items():
            terms.setdefault((int(i), int(j)), [0] * field.degree)[int(k)] = int(c.p) * (scale // int(c.q)) // content
        out.append(MappingProxyType({key: tuple(value) for key, value in terms.items()}))
    return out[0], out[1], out[2], out[3]


class _Reader:
    """Expression to fraction, by one walk down the tree."""

    def __init__(
        self, names: tuple[sympy.Symbol, sympy.Symbol], angles: Angles, field: Scalars, rationalize: float | None
    ) -> None:
        self.variables = dict(zip(names, (S, T), strict=True))
        self.angles, self.field, self.rationalize = angles, field, rationalize
        self.seen: dict[sympy.Expr, Ratio] = {}

    def read(self, e: sympy.Expr) -> Ratio:
        if e not in self.seen:
            self.seen[e] = self._read(e)
        return self.seen[e]

    def _read(self, e: sympy.Expr) -> Ratio:
        if e.is_Integer:
            return RING.constant(int(e.p)), ONE
        if e.is_Rational or e.is_Float:
            value = exact_number(e, self.rationalize)
            return RING.constant(fmpq(value.numerator, value.denominator)), ONE
        if e.is_Symbol:
            return self.variables[e], ONE
        if e.is_Add:
            return reduce(self.add, map(self.read, e.args))
        if e.is_Mul:
            return reduce(self.multiply, map(self.read, e.args))
        if e in self.field.constants:
            return RING.from_dict({(0, 0, k): c for k, c in enumerate(self.field.constants[e]) if c}), ONE
        if e.is_Pow and e.exp.is_Integer:
            return self.power(self.read(e.base), int(e.exp))
        if self.angles.covers(e):
            return self.angle(e)
        if e.is_Pow or isinstance(e, sympy.Abs | sympy.Min | sympy.Max | sympy.Piecewise):
            raise NotPolynomialError(f"{e} is no rational function of the parameters; a substitution may make it one")
        raise TranscendentalError(
            f"{e} is no rational function of the parameters, nor of sines, cosines or exponentials of them"
        )

    def angle(self, e: sympy.Expr) -> Ratio:
        """A circular or exponential function of multiples of the parameters, by its product of unit powers."""
        real, imaginary = (ONE, ONE), (ZERO, ONE)
        wave = self.angles.wave(e)
        for name, multiple in wave.multiples:
            variable = self.variables[name]
            if not wave.circular:
                real = self.multiply(real, self.power((variable, ONE), multiple))
                continue
            c, s = (1 - variable**2, 1 + variable**2), (2 * variable, 1 + variable**2)
            if multiple < 0:
                s = (-s[0], s[1])
            for _ in range(abs(multiple)):
                real, imaginary = self._turn(real, imaginary, c, s)
        if wave.circular:
            real, imaginary = self._turn(real, imaginary, *map(self.read, wave.phase))
        return self._name(wave.function, real, imaginary)

    def _turn(self, real: Ratio, imaginary: Ratio, c: Ratio, s: Ratio) -> tuple[Ratio, Ratio]:
        a, b = self.multiply(real, c), self.multiply(imaginary, s)
        return self.add(a, (-b[0], b[1])), self.add(self.multiply(real, s), self.multiply(imaginary, c))

    def _name(self, function: str, real: Ratio, imaginary: Ratio) -> Ratio:
        """sin, cosh, ... from cos and sin, or from e^w."""
        if function == "exp":
            return real
        if function.endswith("h"):
            inverse, half = self.power(real, -1), (RING.constant(fmpq(1, 2)), ONE)
            minus = (-inverse[0], inverse[1])
            c, s = self.multiply(half, self.add(real, inverse)), self.multiply(half, self.add(real, minus))
        else:
            c, s = real, imaginary
        top, bottom = {"cos": (c, None), "sin": (s, None), "tan": (s, c), "cot": (c, s), "sec": (None, c)}.get(
            function.removesuffix("h"), (None, s)
        )
        ratio = top or (ONE, ONE)
        return self.multiply(ratio, self.power(bottom, -1)) if bottom else ratio

    def add(self, a: Ratio, b: Ratio) -> Ratio:
        if a[1] == b[1]:
            return self._cancel(a[0] + b[0], a[1])
        common = a[1].gcd(b[1])
        left, right = b[1] // common, a[1] // common
        return self._cancel(a[0] * left + b[0] * right, a[1] * left)

    def multiply(self, a: Ratio, b: Ratio) -> Ratio:
        return self._cancel(a[0] * b[0], a[1] * b[1])

    def power(self, a: Ratio, exponent: int) -> Ratio:
        num, den = a if exponent >= 0 else (a[1], a[0])
        if den.is_zero():
            raise ZeroDivisionError
        return self._cancel(num ** abs(exponent), den ** abs(exponent))

    def _cancel(self, num: Any, den: Any) -> Ratio:
        if den.is_constant():
            return self.field.reduce(num / den.leading_coefficient()), ONE
        num, den = self.field.reduce(num), self.field.reduce(den)
        if den.is_zero():
            raise ZeroDivisionError
        common = num.gcd(den)
        return (num, den) if common.is_constant() else (num // common, den // common)


def exact_number(value: sympy.Number, rationalize: float | None) -> Fraction:
    """A fraction, or the binary value of a float; or the simplest fraction within `rationalize` of it."""
    exact = sympy.Rational(value)
    fraction = Fraction(int(exact.p), int(exact.q))
    if rationalize is None:
        return fraction
    return simplest(fraction - Fraction(rationalize), fraction + Fraction(rationalize))


def simplest(low: Fraction, high: Fraction) -> Fraction:
    """The fraction of smallest denominator in a closed interval (Stern-Brocot)."""
    if low <= 0 <= high:
        return Fraction(0)
    if high < 0:
        return -simplest(-high, -low)
    whole = low.numerator // low.denominator
    if whole == low:
        return Fraction(whole)
    if whole + 1 <= high:
        return Fraction(whole + 1)
    return whole + 1 / simplest(1 / (high - whole), 1 / (low - whole))


def all_monomials(degree: int) -> list[tuple[int, int, int]]:
    """The exponents of x, y, z up to a total degree."""
    whole = range(degree + 1)
    return [(i, j, k) for i, j, k in product(whole, whole, whole) if i + j + k <= degree]
