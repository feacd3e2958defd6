"""Singular points beside the curves: all of them, exactly, where an ideal with finitely many points says so."""

from collections.abc import Sequence
from itertools import product
from math import prod

import numpy as np
from flint import fmpq_mpoly
from numpy.typing import NDArray

from implicit.singular.arcs import real_roots
from implicit.singular.form import Form, evaluate, precision
from implicit.singular.ideal import RATIONAL, Ideal, coordinates, radical_of, singular_equations

Floats = NDArray[np.float64]

_FORMS = ((3, 5, 7, 11, 0), (5, -3, 11, 7, 0), (0, 1, 0, 0, 0), (13, 4, -9, 5, 0))
_BITS = 320
_CHOICES = 32


def real_points(form: Form, curves: Sequence[Sequence[fmpq_mpoly]] = ()) -> Floats | None:
    """All real singular points (n, 3) off some curves, given by equations; None where that is not found out.

    A point off all the curves satisfies 1 = v p for some product p of one equation of each curve.
    """
    equations = singular_equations(form)
    if not curves:
        return _solve(form, equations)
    if prod(len(c) for c in curves) > _CHOICES:
        return None
    whole = Ideal.of(equations)
    if whole is not None:
        equations = whole.members[:-1]  # without v = 0
    v, found = RATIONAL.gens()[4], []
    for choice in product(*curves):
        points = _solve(form, [*equations, v * prod(choice) - 1])
        if points is None:
            return None
        found.append(points)
    return np.concatenate(found)


def _solve(form: Form, equations: list[fmpq_mpoly]) -> Floats | None:
    ideal = Ideal.of(equations)
    if ideal is None:
        return None
    if ideal.is_everything:
        return np.zeros((0, 3))
    if not ideal.is_finite or len(ideal.standard) > 120:
        return None
    radical = radical_of(equations)
    if radical is None:
        return None
    for linear in _FORMS:
        solved = coordinates(radical, linear)
        if solved is not None:
            minimal, (x, y, z, w) = solved
            with precision(_BITS):
                root = form.field.root
                thetas = [t for t in real_roots(minimal) if abs(evaluate(w, t) - root).upper() < 1e-9]
                return np.array([[float(evaluate(c, t).mid()) for c in (x, y, z)] for t in thetas]).reshape(-1, 3)
    return None
