"""Surfaces over Q(sqrt m) that are rational in other units: x = sqrt(m) X for some of the coordinates."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import sympy
from flint import arb, fmpq_poly
from numpy.typing import NDArray

from implicit.singular.form import RATIONALS, Form


@dataclass(frozen=True)
class Twist:
    """The surface in coordinates divided by w where `axes` is 1; `form` is over Q where that is possible."""

    form: Form
    original: Form
    axes: tuple[int, int, int]

    @property
    def scale(self) -> NDArray[np.float64]:
        """What the new coordinates are multiplied by to give the old ones (3,)."""
        w = float(arb(self.original.field.root).mid())
        return np.array([w if axis else 1.0 for axis in self.axes])

    @property
    def symbols(self) -> tuple[sympy.Expr, ...]:
        """The same as sympy numbers."""
        if not any(self.axes):
            return (sympy.Integer(1),) * 3
        square = -self.original.field.modulus[0]
        w = sympy.sqrt(sympy.Rational(int(square.p), int(square.q)))
        return tuple((w if self.scale[a] > 0 else -w) if axis else sympy.Integer(1) for a, axis in enumerate(self.axes))


def untwist(form: Form) -> Twist:
    """The form over Q in other units, or as it is."""
    modulus = form.field.modulus
    if form.field.degree == 2 and modulus[1] == 0:
        for axes in product((0, 1), repeat=3):
            rational = _in_units(form, (axes[0], axes[1], axes[2]))
            if rational is not None:
                return Twist(rational, form, (axes[0], axes[1], axes[2]))
    return Twist(form, form, (0, 0, 0))


def _in_units(form: Form, axes: tuple[int, int, int]) -> Form | None:
    """The form with x replaced by w x on the axes, if all coefficients, or all divided by w, are rational."""
    terms = {}
    for m, c in form.terms.items():
        power = sum(e for e, axis in zip(m, axes, strict=True) if axis)
        terms[m] = c * fmpq_poly([0] * power + [1]) % form.field.modulus
    for place in (0, 1):
        if all(c[1 - place] == 0 for c in terms.values()):
            return Form({m: fmpq_poly([c[place]]) for m, c in terms.items()}, RATIONALS)
    return None
