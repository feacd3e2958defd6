"""Coordinates for exact algebra: small coefficients, and over Q(sqrt m) units x = sqrt(m) X that make them rational."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import sympy
from flint import arb, fmpq, fmpq_poly
from numpy.typing import NDArray

from implicit.singular.exact import ExactPoint
from implicit.singular.form import RATIONALS, Form, precision
from implicit.singular.placement import Placement, place
from implicit.singular.proof import Point

Floats = NDArray[np.float64]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]

t = sympy.Symbol("t", real=True)


@dataclass(frozen=True)
class Twist:
    """The surface in coordinates X, over Q where possible: (x, y, z) = M D X + shift, D = w on the axes that are 1."""

    form: Form
    placement: Placement
    axes: tuple[int, int, int]

    @cached_property
    def matrix(self) -> Floats:
        """What the new coordinates are multiplied by (3, 3)."""
        w = float(arb(self.placement.form.field.root).mid())
        return self.placement.floats[0] * np.array([w if axis else 1.0 for axis in self.axes])

    @property
    def shift(self) -> Floats:
        """What is added after that (3,)."""
        return self.placement.floats[1]

    def outside(self, points: Floats) -> Floats:
        """Points (n, 3) in the old coordinates."""
        return np.asarray(points @ self.matrix.T + self.shift)

    def place(self, point: ExactPoint, bits: int) -> Point:
        """Enclosures of the old coordinates of an exact point."""
        matrix, shift = self.placement.matrix, self.placement.shift
        with precision(bits):
            w = self.placement.form.field.root
            inside = [c * w if axis else c for c, axis in zip(point.value(bits), self.axes, strict=True)]
            x, y, z = (sum((arb(matrix[r, c]) * inside[c] for c in range(3)), arb(shift[r, 0])) for r in range(3))
            return x, y, z

    def expression(self, inside: Triple) -> Triple:
        """A parametrization in the old coordinates."""
        scaled = [sympy.expand(c * s) for c, s in zip(inside, self._symbols(), strict=True)]
        matrix, shift = self.placement.matrix, self.placement.shift
        x, y, z = (
            sympy.expand(sum(_symbol(matrix[r, c]) * scaled[c] for c in range(3)) + _symbol(shift[r, 0]))
            for r in range(3)
        )
        return _from_rest((x, y, z))

    def _symbols(self) -> tuple[sympy.Expr, ...]:
        if not any(self.axes):
            return (sympy.Integer(1),) * 3
        field = self.placement.form.field
        square = -field.modulus[0]
        w = sympy.sqrt(sympy.Rational(int(square.p), int(square.q)))
        w = w if float(arb(field.root).mid()) > 0 else -w
        return tuple(w if axis else sympy.Integer(1) for axis in self.axes)


def _from_rest(expression: Triple) -> Triple:
    """A line with rational direction by its leading coordinate; other curves as they are."""
    direction = [c.diff(t) for c in expression]
    if not all(d.is_Rational for d in direction) or not any(direction):
        return expression
    lead = max(range(3), key=lambda a: abs(direction[a]))
    at = (t - expression[lead].subs(t, 0)) / direction[lead]
    x, y, z = (sympy.expand(c.subs(t, at)) for c in expression)
    return x, y, z


def _symbol(c: fmpq) -> sympy.Rational:
    return sympy.Rational(int(c.p), int(c.q))


def untwist(form: Form) -> Twist:
    """The form with small coefficients, over Q in other units where that is possible."""
    placement = place(form)
    modulus = form.field.modulus
    if form.field.degree == 2 and modulus[1] == 0:
        for axes in product((0, 1), repeat=3):
            rational = _in_units(placement.form, (axes[0], axes[1], axes[2]))
            if rational is not None:
                return Twist(rational, placement, (axes[0], axes[1], axes[2]))
    return Twist(placement.form, placement, (0, 0, 0))


def _in_units(form: Form, axes: tuple[int, int, int]) -> Form | None:
    """The form with x replaced by w x on the axes, if all coefficients, or all divided by w, are rational."""
    terms = {}
    for m, c in form.terms.items():
        power = sum(e for e, axis in zip(m, axes, strict=True) if axis)
        terms[m] = c * fmpq_poly([0] * power + [1]) % form.field.modulus
    for power in (0, 1):
        if all(c[1 - power] == 0 for c in terms.values()):
            return Form({m: fmpq_poly([c[power]]) for m, c in terms.items()}, RATIONALS)
    return None
