"""Exact values of an expression at exact points: rational numbers, or balls of growing precision."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from operator import add, mul
from typing import Any, TypeAlias

import flint
import sympy

from implicit.algebra.constants import enclose
from implicit.algebra.expand import to_fraction
from implicit.language.trees import postorder, x, y, z

Exact: TypeAlias = Sequence[flint.fmpq]
Step: TypeAlias = tuple[int, Callable[..., Any], tuple[int, ...]]

PRECISIONS = (64, 128, 256, 512, 1024, 2048, 4096)
"""Bits of the balls that are tried in turn."""

_FUNCTIONS: dict[type, Callable[[Any], Any]] = {
    sympy.sin: lambda a: a.sin(),
    sympy.cos: lambda a: a.cos(),
    sympy.tan: lambda a: a.tan(),
    sympy.exp: lambda a: a.exp(),
    sympy.log: lambda a: a.log(),
    sympy.sinh: lambda a: a.sinh(),
    sympy.cosh: lambda a: a.cosh(),
    sympy.tanh: lambda a: a.tanh(),
    sympy.asin: lambda a: a.asin(),
    sympy.acos: lambda a: a.acos(),
    sympy.atan: lambda a: a.atan(),
}


@dataclass(frozen=True, eq=False)
class ExactValues:
    """The values of an expression in x, y, z at points with rational coordinates.

    `rational` tells whether only +, -, *, /, whole powers, min, max and abs of rational numbers occur.
    """

    expression: sympy.Expr

    @cached_property
    def _order(self) -> list[sympy.Basic]:
        return postorder(self.expression)

    @cached_property
    def _steps(self) -> list[Step]:
        """(place, function, places of the operands) for each distinct subexpression that is computed."""
        place = {node: k for k, node in enumerate(self._order)}
        steps: list[Step] = []
        for k, node in enumerate(self._order):
            if not node.free_symbols or node in (x, y, z):
                continue
            operands = node.args[:1] if isinstance(node, sympy.Pow) and node.exp.is_Rational else node.args
            steps.append((k, _operation(node), tuple(place[a] for a in operands)))
        return steps

    @cached_property
    def _axes(self) -> list[tuple[int, int]]:
        """The places of x, y and z."""
        return [(k, (x, y, z).index(node)) for k, node in enumerate(self._order) if node in (x, y, z)]

    @cached_property
    def rational(self) -> bool:
        """Whether values at rational points are rational numbers by arithmetic alone."""
        for node in self._order:
            if node.is_Number:
                continue
            plain = node in (x, y, z) or isinstance(node, sympy.Add | sympy.Mul | sympy.Min | sympy.Max | sympy.Abs)
            if not plain and not (node.is_Pow and node.exp.is_Integer):
                return False
        return True

    @cached_property
    def _rational_numbers(self) -> list[Any]:
        return [to_fmpq(to_fraction(n)) if n.is_Number else None for n in self._order]

    def sign(self, point: Exact) -> int | None:
        """The sign of the value at a point; None where it could not be decided, or there is no real value."""
        if self.rational:
            try:
                value = self._run(self._rational_numbers, point)
            except ZeroDivisionError:
                return None
            return 1 if value > 0 else -1 if value < 0 else 0
        for bits in PRECISIONS:
            with flint.ctx.workprec(bits):
                ball = self.ball([flint.arb(c) for c in point])
                if ball > 0:
                    return 1
                if ball < 0:
                    return -1
                if ball.is_zero():
                    return 0
                if bits > 256 and not ball.is_finite():
                    return None
        return None

    def ball(self, point: Sequence[flint.arb]) -> flint.arb:
        """A ball around the value, in the current precision."""
        return self._run([None if n.free_symbols else enclose_here(n) for n in self._order], point)

    def _run(self, numbers: list[Any], point: Sequence[Any]) -> Any:
        values = numbers.copy()
        for place, axis in self._axes:
            values[place] = point[axis]
        for place, operation, operands in self._steps:
            if len(operands) == 1:
                values[place] = operation(values[operands[0]])
            elif len(operands) == 2:
                values[place] = operation(values[operands[0]], values[operands[1]])
            else:
                values[place] = operation(*[values[k] for k in operands])
        return values[-1]


def to_fmpq(value: Fraction | float) -> flint.fmpq:
    """A float or fraction as it is."""
    return flint.fmpq(*value.as_integer_ratio())


def enclose_here(number: sympy.Expr) -> flint.arb:
    """A ball round a constant: exact for rational numbers, otherwise as sharp as the current precision allows."""
    if number.is_Number:
        return flint.arb(to_fmpq(to_fraction(number)))
    return enclose(number)


def _operation(node: sympy.Basic) -> Callable[..., Any]:
    if isinstance(node, sympy.Add):
        return add if len(node.args) == 2 else _sum
    if isinstance(node, sympy.Mul):
        return mul if len(node.args) == 2 else _product
    if isinstance(node, sympy.Min | sympy.Max):
        return _least if isinstance(node, sympy.Min) else _greatest
    if isinstance(node, sympy.Abs):
        return abs
    if isinstance(node, sympy.Pow):
        return _power(node.exp)
    return _FUNCTIONS[type(node)]


def _sum(first: Any, *others: Any) -> Any:
    for other in others:
        first = first + other
    return first


def _product(first: Any, *others: Any) -> Any:
    for other in others:
        first = first * other
    return first


def _least(first: Any, *others: Any) -> Any:
    for other in others:
        first = first.min(other) if isinstance(first, flint.arb) else min(first, other)
    return first


def _greatest(first: Any, *others: Any) -> Any:
    for other in others:
        first = first.max(other) if isinstance(first, flint.arb) else max(first, other)
    return first


def _power(exponent: sympy.Expr) -> Callable[..., Any]:
    if exponent.is_Integer:
        whole = int(exponent)
        if whole == 2:
            return lambda base: base * base
        return lambda base: base**whole
    if exponent.is_Rational:
        fraction = to_fmpq(to_fraction(exponent))
        return lambda base: base.sqrt() if exponent == sympy.S.Half else base ** flint.arb(fraction)
    return lambda base, power: base**power
