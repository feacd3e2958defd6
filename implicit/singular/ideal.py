"""Ideals over Q in x, y, z, w by Groebner bases: dimension, number of points, coordinates of finitely many points.

w is the generator of the field of the coefficients, with its minimal polynomial among the equations; over Q it is 0.
A fifth variable v is free for 1 = v p, which takes the zeros of p away.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import lcm

from flint import (
    Ordering,
    fmpq,
    fmpq_mat,
    fmpq_mpoly,
    fmpq_mpoly_ctx,
    fmpq_poly,
    fmpz_mpoly,
    fmpz_mpoly_ctx,
    fmpz_mpoly_vec,
)

from implicit.singular.form import Form

NAMES = ("x", "y", "z", "w", "v", "unit")
RATIONAL = fmpq_mpoly_ctx.get(NAMES, Ordering.degrevlex)
INTEGRAL = fmpz_mpoly_ctx.get(NAMES, Ordering.degrevlex)
Exponents = tuple[int, int, int, int, int]
Vector = dict[Exponents, fmpq]
_UNIT = INTEGRAL.gens()[5]

_LIMITS = (250, 4000, 40000)  # members, terms, bits: beyond them a basis is given up


def lift(form: Form) -> fmpq_mpoly:
    """The form as a polynomial in x, y, z, w."""
    return RATIONAL.from_dict(
        {(*m, n, 0, 0): a for m, c in form.terms.items() for n, a in enumerate(c.coeffs()) if a != 0}
    )


def field_equation(form: Form) -> fmpq_mpoly:
    """The minimal polynomial of w."""
    return RATIONAL.from_dict({(0, 0, 0, n, 0, 0): a for n, a in enumerate(form.field.modulus.coeffs()) if a != 0})


def whole(p: fmpq_mpoly) -> fmpz_mpoly:
    """The polynomial times its common denominator."""
    terms = p.to_dict()
    scale = lcm(*(int(c.q) for c in terms.values())) if terms else 1
    return INTEGRAL.from_dict({tuple(int(e) for e in m): int(c * scale) for m, c in terms.items()})


def singular_equations(form: Form) -> list[fmpq_mpoly]:
    """f, its gradient and the minimal polynomial of w."""
    return [lift(form), *(lift(g) for g in form.gradient), field_equation(form)]


@dataclass(frozen=True)
class Ideal:
    """A reduced Groebner basis (degrevlex)."""

    basis: tuple[fmpz_mpoly, ...]

    @classmethod
    def of(cls, equations: Iterable[fmpq_mpoly]) -> "Ideal | None":
        """The ideal of some equations; None where the basis grows too large."""
        members = [whole(e) for e in equations if e != 0]
        if not any(m.degrees()[4] for m in members):
            members.append(INTEGRAL.gens()[4])
        basis, finished = fmpz_mpoly_vec(members, INTEGRAL).buchberger_naive(limits=_LIMITS)
        if not finished:
            return None
        reduced = basis.autoreduction()
        return cls(tuple(reduced[n] for n in range(len(reduced))))

    @property
    def members(self) -> list[fmpq_mpoly]:
        """The basis, with v itself last if v does not occur otherwise."""
        found = [RATIONAL.from_dict({m: fmpq(c) for m, c in g.to_dict().items()}) for g in self.basis]
        return sorted(found, key=lambda g: g == RATIONAL.gens()[4])

    @cached_property
    def leading(self) -> list[Exponents]:
        """The leading exponents."""
        return [_exponents(g.monoms()[0]) for g in self.basis]

    @cached_property
    def is_everything(self) -> bool:
        """Whether there are no points, not even complex ones."""
        return any(sum(m) == 0 for m in self.leading)

    @cached_property
    def is_finite(self) -> bool:
        """Whether there are finitely many complex points."""
        return all(any(m[a] == sum(m) for m in self.leading) for a in range(5))

    @cached_property
    def standard(self) -> list[Exponents]:
        """The monomials outside the leading ideal, a basis of the quotient; only for finitely many points."""
        found: list[Exponents] = []
        layer: set[Exponents] = {(0,) * 5}
        while layer:
            kept = sorted(m for m in layer if not any(_divides(g, m) for g in self.leading))
            found.extend(kept)
            layer = {_raised(m, a) for m in kept for a in range(5)}
        return found

    def normal_form(self, p: fmpq_mpoly) -> Vector:
        """The unique combination of standard monomials that is p modulo the ideal.

        python-flint returns it up to a factor; the factor is read off a variable that occurs in no leading monomial.
        """
        terms = p.to_dict()
        scale = lcm(*(int(c.q) for c in terms.values())) if terms else 1
        reduced = (whole(p) + _UNIT).reduction_primitive_part(self._vector).to_dict()
        factor = next(c for m, c in reduced.items() if m[5])
        return {_exponents(m): fmpq(int(c), int(factor) * scale) for m, c in reduced.items() if not m[5]}

    @cached_property
    def _vector(self) -> fmpz_mpoly_vec:
        return fmpz_mpoly_vec(list(self.basis), INTEGRAL)

    def powers(self, form: Sequence[int], count: int) -> list[Vector]:
        """The normal forms of 1, v, v^2, ... for a linear form v in the variables."""
        image: dict[Exponents, Vector] = {}
        out: list[Vector] = [{(0,) * 5: fmpq(1)}]
        for _ in range(count):
            total: Vector = {}
            for m, c in out[-1].items():
                if m not in image:
                    raised = {(*_raised(m, a), 0): fmpq(n) for a, n in enumerate(form) if n}
                    image[m] = self.normal_form(RATIONAL.from_dict(raised))
                for e, a in image[m].items():
                    total[e] = total.get(e, fmpq(0)) + c * a
            out.append({e: a for e, a in total.items() if a != 0})
        return out

    def minimal_polynomial(self, form: Sequence[int]) -> fmpq_poly:
        """The polynomial of least degree in a linear form that vanishes at all the finitely many points."""
        n = len(self.standard)
        powers = self.powers(form, n)
        rows = fmpq_mat([[v.get(m, fmpq(0)) for v in powers] for m in self.standard])
        reduced, rank = rows.rref()
        return fmpq_poly([*(-reduced[r, rank] for r in range(rank)), 1])


def coordinates(radical: Ideal, form: Sequence[int]) -> tuple[fmpq_poly, list[fmpq_poly]] | None:
    """The points of a radical ideal by a linear form: its polynomial, and x, y, z, w as polynomials in it.

    None where two points agree in that form.
    """
    n = len(radical.standard)
    minimal = radical.minimal_polynomial(form)
    if minimal.degree() != n:
        return None
    powers = radical.powers(form, n - 1)
    matrix = fmpq_mat([[v.get(m, fmpq(0)) for v in powers] for m in radical.standard])
    columns = [radical.powers(_axis(a), 1)[1] for a in range(4)]
    targets = fmpq_mat([[v.get(m, fmpq(0)) for v in columns] for m in radical.standard])
    solution = matrix.solve(targets)
    return minimal, [fmpq_poly([solution[r, c] for r in range(n)]) for c in range(4)]


def radical_of(equations: Sequence[fmpq_mpoly]) -> Ideal | None:
    """The radical of an ideal with finitely many points (Seidenberg): with square-free polynomials in each variable."""
    ideal = Ideal.of(equations)
    if ideal is None or not ideal.is_finite:
        return None
    if ideal.is_everything:
        return ideal
    more = [univariate(square_free(ideal.minimal_polynomial(_axis(a))), a) for a in (0, 1, 2, 4)]
    return Ideal.of([*ideal.members, *more])


def square_free(p: fmpq_poly) -> fmpq_poly:
    """The polynomial with every root once, monic."""
    q = p // p.gcd(p.derivative())
    return q / q.coeffs()[-1]


def univariate(p: fmpq_poly, axis: int) -> fmpq_mpoly:
    """A polynomial in one of x, y, z, w."""
    return RATIONAL.from_dict({_power(axis, n): c for n, c in enumerate(p.coeffs()) if c != 0})


def _power(axis: int, n: int) -> tuple[int, ...]:
    return tuple(n if a == axis else 0 for a in range(6))


def _axis(axis: int) -> tuple[int, ...]:
    return tuple(int(a == axis) for a in range(5))


def _exponents(m: Sequence[int]) -> Exponents:
    x, y, z, w, v = (int(e) for e in m[:5])
    return x, y, z, w, v


def _divides(a: Exponents, b: Exponents) -> bool:
    return all(i <= j for i, j in zip(a, b, strict=True))


def _raised(m: Exponents, axis: int) -> Exponents:
    x, y, z, w, v = (e + (a == axis) for a, e in enumerate(m))
    return x, y, z, w, v
