"""Exact values of an expression at exact points: rational numbers, or balls of growing precision."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeAlias

import flint
import sympy

from implicit.constants import enclose
from implicit.expand import to_fraction
from implicit.trees import postorder, x, y, z

Exact: TypeAlias = tuple[Fraction, Fraction, Fraction]
Step: TypeAlias = tuple[Callable[..., Any], tuple[int, ...]]

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
    def _program(self) -> tuple[list[Step], list[sympy.Expr | None]]:
        """For each distinct subexpression a function and its operands, or a number."""
        order = postorder(self.expression)
        place = {node: k for k, node in enumerate(order)}
        steps: list[Step] = []
        numbers: list[sympy.Expr | None] = []
        for node in order:
            constant = not node.free_symbols
            numbers.append(node if constant or node in (x, y, z) else None)
            operands = () if constant else tuple(place[a] for a in node.args)
            steps.append((_operation(node) if operands else _nothing, operands))
        return steps, numbers

    @cached_property
    def rational(self) -> bool:
        """Whether values at rational points are rational numbers by arithmetic alone."""
        for node in postorder(self.expression):
            if node.is_Number:
                continue
            plain = node in (x, y, z) or isinstance(node, sympy.Add | sympy.Mul | sympy.Min | sympy.Max | sympy.Abs)
            if not plain and not (node.is_Pow and node.exp.is_Integer):
                return False
        return True

    @cached_property
    def _rational_numbers(self) -> list[Any]:
        return [_rational(n) if n is not None else None for n in self._program[1]]

    def sign(self, point: Exact) -> int | None:
        """The sign of the value at a point; None where it could not be decided, or there is no real value."""
        if self.rational:
            try:
                value = self._run(self._rational_numbers, [flint.fmpq(c.numerator, c.denominator) for c in point])
            except ZeroDivisionError:
                return None
            return int(value > 0) - int(value < 0)
        for bits in PRECISIONS:
            with flint.ctx.workprec(bits):
                ball = self.ball([flint.arb(flint.fmpq(c.numerator, c.denominator)) for c in point])
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
        numbers = [None if n is None or n in (x, y, z) else enclose_here(n) for n in self._program[1]]
        return self._run(numbers, point)

    def _run(self, numbers: list[Any], point: Sequence[Any]) -> Any:
        steps, constants = self._program
        axes = {x: point[0], y: point[1], z: point[2]}
        values: list[Any] = []
        for (operation, operands), number, constant in zip(steps, numbers, constants, strict=True):
            if operands:
                values.append(operation(*(values[k] for k in operands)))
            else:
                values.append(axes.get(constant, number))
        return values[-1]


def _nothing(*_: Any) -> Any:
    raise AssertionError("numbers and variables are not computed")


def _rational(number: sympy.Expr) -> Any:
    if not number.is_Number:
        return None
    value = to_fraction(number)
    return flint.fmpq(value.numerator, value.denominator)


def enclose_here(number: sympy.Expr) -> flint.arb:
    """A ball round a constant: exact for rational numbers, otherwise as sharp as the current precision allows."""
    if number.is_Number:
        value = to_fraction(number)
        return flint.arb(flint.fmpq(value.numerator, value.denominator))
    return enclose(number)


def _operation(node: sympy.Basic) -> Callable[..., Any]:
    if isinstance(node, sympy.Add):
        return _sum
    if isinstance(node, sympy.Mul):
        return _product
    if isinstance(node, sympy.Min | sympy.Max):
        return _least if isinstance(node, sympy.Min) else _greatest
    if isinstance(node, sympy.Abs):
        return abs
    if isinstance(node, sympy.Pow):
        return _power
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


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, flint.fmpq):
        return base ** int(exponent.p)
    if exponent.is_integer():
        return base ** int(exponent.unique_fmpz())
    return base.sqrt() if exponent == flint.arb(1) / 2 else base**exponent
