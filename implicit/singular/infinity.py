"""Singular points in the plane at infinity, exactly, where there are finitely many."""

import numpy as np
import sympy
from flint import fmpq_mpoly, fmpq_poly

from implicit.singular.exact import MAX_DEGREE
from implicit.singular.form import Form
from implicit.singular.germ import Germ
from implicit.singular.ideal import RATIONAL, singular_equations
from implicit.singular.kinds import SingularPoint
from implicit.singular.rest import solve


def points_at_infinity(form: Form) -> tuple[SingularPoint, ...]:
    """The real singular points of the projective closure on t = 0, where F(x, y, z, t) = t^d f(x/t, y/t, z/t).

    Position and exact coordinates are directions (x, y, z) whose last coordinate that is not 0 is 1; types are those
    of the closure. Found in the charts z = 1, then z = 0 and y = 1, then y = z = 0 and x = 1.

    Raises
    ------
    ValueError
        Where there are infinitely many, real or complex, or too many to eliminate.
    """
    found: list[SingularPoint] = []
    gens = RATIONAL.gens()
    for one in (2, 1, 0):
        chart = in_chart(form, one)
        rest: list[fmpq_mpoly] = [gens[2], *gens[one:2]]  # at infinity, and what other charts have shown already
        points = solve(chart, [*singular_equations(chart), *rest])
        if points is None:
            raise ValueError("finitely many singular points at infinity were wanted, and few enough to eliminate")
        for point in points:
            position = np.insert(np.array(point.position)[:2], one, 1.0)
            position.flags.writeable = False
            if point.degree > MAX_DEGREE:
                found.append(SingularPoint(position))
                continue
            symbols = list(point.symbols[:2])
            symbols.insert(one, sympy.Integer(1))
            germ = Germ(chart, point)
            found.append(SingularPoint(position, (symbols[0], symbols[1], symbols[2]), germ.type, germ.milnor))
    return tuple(found)


def in_chart(form: Form, one: int) -> Form:
    """The closure where one coordinate is 1: the other two keep their order, the third is t."""
    first, second = (a for a in range(3) if a != one)
    terms: dict[tuple[int, int, int], fmpq_poly] = {
        (m[first], m[second], form.degree - sum(m)): c for m, c in form.terms.items()
    }
    return Form(terms, form.field)
