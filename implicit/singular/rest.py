"""Singular points beside the curves: all of them, exactly, where an ideal with finitely many points says so."""

from collections.abc import Sequence
from math import prod

from flint import fmpq_mpoly, fmpq_poly

from implicit.singular.arcs import real_roots
from implicit.singular.exact import ExactPoint, isolate
from implicit.singular.form import Form, evaluate, precision
from implicit.singular.ideal import RATIONAL, Ideal, coordinates, radical_of, singular_equations
from implicit.singular.region import Deadline

_FORMS = ((3, 5, 7, 11, 0), (5, -3, 11, 7, 0), (0, 1, 0, 0, 0), (13, 4, -9, 5, 0))
_BITS = 320
_TRIES = 400


def real_points(
    form: Form,
    deadline: Deadline,
    curves: Sequence[Sequence[fmpq_mpoly]] = (),
    around: Sequence[fmpq_mpoly] = (),
) -> list[ExactPoint] | None:
    """All real singular points off some curves, each given by two equations; None where not found out.

    `around` are polynomials that vanish on all the curves: first come the points where one of them does not.
    """
    equations = singular_equations(form)
    found: list[ExactPoint] = []
    if around:
        off = _off_all(form, equations, around, deadline)
        if off is not None:
            found, equations = off, [*equations, *around]
    whole = Ideal.of(equations)
    starts = [equations] if whole is None or not curves else [whole.members[:-1], equations]  # without v = 0
    attempts = _Attempts(form, deadline)
    for start in starts:
        more = attempts.off(start, [], curves)
        if more is not None:
            return [*found, *more]
    return None


def _off_all(
    form: Form, equations: list[fmpq_mpoly], around: Sequence[fmpq_mpoly], deadline: Deadline
) -> list[ExactPoint] | None:
    """The points where some polynomial is not 0, by the first that is not: in the order that can be solved."""
    basis = Ideal.of(around)
    if basis is None:
        return None
    left = sorted(basis.members[:-1], key=lambda g: (g.total_degree(), len(g.to_dict())))
    found: list[ExactPoint] = []
    zero: list[fmpq_mpoly] = []
    while left:
        for g in left:
            more = None if deadline.passed else solve(form, [*equations, *zero, RATIONAL.gens()[4] * g - 1])
            if more is not None:
                found, zero = [*found, *more], [*zero, g]
                left.remove(g)
                break
        else:
            return None
    return found


class _Attempts:
    """Searches for points off curves; which order of steps has small Groebner bases is found by trying."""

    def __init__(self, form: Form, deadline: Deadline) -> None:
        self.form, self.deadline, self.left = form, deadline, _TRIES

    def off(
        self, equations: list[fmpq_mpoly], apart: list[fmpq_mpoly], curves: Sequence[Sequence[fmpq_mpoly]]
    ) -> list[ExactPoint] | None:
        """The points where none of `apart` is 0 and that lie on none of the curves; that p != 0 is written 1 = v p.

        A point off the curve a = b = 0 has b != 0, or b = 0 and a != 0.
        """
        system = [*equations, RATIONAL.gens()[4] * prod(apart) - 1] if apart else equations
        self.left -= 1
        if not curves:
            return solve(self.form, system)
        if apart:
            known = Ideal.of(system)
            if known is not None and known.is_everything:
                return []
        first, second = curves[0]
        for a, b in ((first, second), (second, first)):
            if self.left < 0 or self.deadline.passed:
                return None
            one = self.off(equations, [*apart, b], curves[1:])
            if one is None:
                continue
            for more in ([b], []):
                two = self.off([*equations, *more], [*apart, a], curves[1:])
                if two is not None:
                    return [*one, *two]
        return None


def solve(form: Form, equations: list[fmpq_mpoly]) -> list[ExactPoint] | None:
    """The real points of equations with finitely many complex ones; None where there are more, or too many."""
    ideal = Ideal.of(equations)
    if ideal is None:
        return None
    if ideal.is_everything:
        return []
    if not ideal.is_finite or len(ideal.standard) > 120:
        return None
    radical = radical_of(equations)
    if radical is None:
        return None
    for linear in _FORMS:
        solved = coordinates(radical, linear)
        if solved is not None:
            return _real(form, *solved)
    return None


def _real(form: Form, minimal: fmpq_poly, coordinates: list[fmpq_poly]) -> list[ExactPoint] | None:
    """The real points among those over the roots of a polynomial, where w has its own value."""
    found = []
    for factor, _ in minimal.numer().factor()[1]:
        modulus = fmpq_poly(factor) / factor[factor.degree()]
        x, y, z, w = (c % modulus for c in coordinates)
        for theta in real_roots(modulus):
            with precision(_BITS):
                if not abs(evaluate(w, theta) - form.field.root).upper() < 1e-9:
                    continue
            near = isolate(modulus, theta)
            if near is None:
                return None
            found.append(ExactPoint(modulus, near, (x, y, z), w))
    return found
