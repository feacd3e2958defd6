"""The curves of singular points, all complex ones, in exact form: a plane projection and the way back from it.

In general coordinates (X, Y, Z) the curve of degree d lies over the plane curve P(X, Y) = 0 of degree d, and on it
Z dP/dY = R(X, Y), w dP/dY = S(X, Y) (Kronecker's form). The polynomials are interpolated from slices X = constant
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly

from implicit.singular.form import Form
from implicit.singular.ideal import RATIONAL, coordinates, radical_of, singular_equations
from implicit.singular.region import Deadline

_POOR = 4  # slices that may meet special points before the direction is given up
PLANE = fmpq_mpoly_ctx.get(("X", "Y"), Ordering.lex)

# General directions: (x, y, z) = matrix (X, Y, Z), unimodular; the next is tried where one is not general enough.
_TURNS = (
    ((1, 2, -1), (1, 3, 1), (0, 1, 3)),
    ((1, -3, 2), (2, -5, 1), (1, -2, 0)),
    ((1, 1, 4), (-2, -1, -5), (3, 1, 7)),
    ((2, 5, 3), (1, 3, -2), (-1, -3, 3)),
    ((1, 4, -7), (3, 13, -16), (-5, -18, 46)),
    ((1, 5, -3), (-4, -19, 6), (7, 38, -38)),
)


@dataclass(frozen=True)
class Projection:
    """The curve over P = 0: `plane` is P, `height` R and `number` S; `turn` maps (X, Y, Z) to (x, y, z)."""

    plane: fmpq_mpoly
    height: fmpq_mpoly
    number: fmpq_mpoly
    turn: tuple[tuple[int, ...], ...]

    def forms(self) -> list[fmpq_mpoly]:
        """X, Y and Z in terms of x, y, z."""
        inverse = fmpq_mat([[fmpq(c) for c in row] for row in self.turn]).inv()
        gens = RATIONAL.gens()[:3]
        return [sum((g * inverse[r, c] for c, g in enumerate(gens)), start=gens[0] * 0) for r in range(3)]

    def in_space(self, p: fmpq_mpoly) -> fmpq_mpoly:
        """A polynomial in X, Y as one in x, y, z."""
        return p.compose(*self.forms()[:2], ctx=RATIONAL)

    @cached_property
    def parts(self) -> list["Projection"]:
        """The same for each irreducible factor of P over Q."""
        return [self._restricted(p) for p, _ in self.plane.factor()[1]]

    @cached_property
    def is_general(self) -> bool:
        """Whether the parts are known: no line among them is one with Y constant, along which nothing would change."""
        try:
            return bool(self.parts) or not self.plane.total_degree()
        except ArithmeticError:
            return False

    def _restricted(self, p: fmpq_mpoly) -> "Projection":
        """R' with Z dp/dY = R' on the part p: as P = p q, there R = Z dp/dY q, so R' q = R modulo p."""
        q = divmod(self.plane, p)[0]
        degree = int(p.total_degree())
        x, y = PLANE.gens()
        basis = [x**i * y**j for i in range(degree) for j in range(degree + 1 - i)]
        columns = [divmod(m * q, p)[1] for m in basis]
        solved = []
        for value in (self.height, self.number):
            weights = _combination(columns, divmod(value, p)[1])
            solved.append(sum((m * c for m, c in zip(basis, weights, strict=True)), start=x * 0))
        return Projection(p, solved[0], solved[1], self.turn)


def project(form: Form, deadline: Deadline) -> Projection | None:
    """The complex curves of singular points; P = 1 where there are none, None where that was not found out."""
    equations = [turned(singular_equations(form), turn) for turn in _TURNS]
    degrees = [_points_of(part, deadline) for part in equations]
    for turn, part, degree in zip(_TURNS, equations, degrees, strict=True):
        if degree < max(degrees):
            continue
        slices = _slices(part, deadline)
        if slices is not None:
            found = _interpolate(slices, turn)
            if found is None or found.is_general:
                return found
        if deadline.passed:
            return None
    return None


def turned(equations: list[fmpq_mpoly], turn: tuple[tuple[int, ...], ...]) -> list[fmpq_mpoly]:
    """The equations in X, Y, Z."""
    gens = RATIONAL.gens()
    images = [sum((g * c for g, c in zip(gens[:3], row, strict=True)), start=gens[0] * 0) for row in turn]
    return [e.compose(*images, *gens[3:], ctx=RATIONAL) for e in equations]


def _combination(columns: list[fmpq_mpoly], target: fmpq_mpoly) -> list[fmpq]:
    """The weights of columns that add up to the target."""
    tables = [c.to_dict() for c in (*columns, target)]
    keys = sorted({m for table in tables for m in table})
    reduced, rank = fmpq_mat([[table.get(m, fmpq(0)) for table in tables] for m in keys]).rref()
    weights, column = [fmpq(0)] * len(columns), 0
    for row in range(rank):
        while reduced[row, column] == 0:
            column += 1
        if column == len(columns):
            raise ArithmeticError("a coordinate of a curve is no polynomial on a part of it")
        weights[column] = reduced[row, len(columns)]
    return weights


Slice = tuple[fmpq_poly, fmpq_poly, fmpq_poly]


def _points_of(equations: list[fmpq_mpoly], deadline: Deadline) -> int:
    """How many points a slice has, -1 if unknown; a line with X constant meets no slice, but in other directions."""
    slices = (_slice(equations, c) for c in islice(_places(), _POOR) if not deadline.passed)
    return next((int(slice_[0].degree()) for slice_ in slices if slice_), -1)


def _slices(equations: list[fmpq_mpoly], deadline: Deadline) -> list[tuple[fmpq, Slice]] | None:
    """Slices X = c: the polynomial of the Y of its points, and Z and w times the derivative of it."""
    found: list[tuple[fmpq, Slice]] = []
    degree, poor = -1, 0
    for c in _places():
        if deadline.passed or poor > _POOR:
            return None
        slice_ = _slice(equations, c)
        if slice_ is None or slice_[0].degree() < degree:
            poor += 1
            continue
        if slice_[0].degree() > degree:
            degree, found, poor = int(slice_[0].degree()), [], poor + len(found)
        found.append((c, slice_))
        if len(found) == degree + 3:
            return found
    return None


def _places() -> Iterator[fmpq]:
    for n in range(200):
        yield fmpq((n + 1) // 2 * (-1) ** n) + fmpq(1, 3)


def _slice(equations: list[fmpq_mpoly], c: fmpq) -> Slice | None:
    gens = RATIONAL.gens()
    cut = [e.compose(gens[0] * 0 + c, *gens[1:], ctx=RATIONAL) for e in equations]
    radical = radical_of([*cut, gens[0]])
    if radical is None:
        return None
    if radical.is_everything:
        return fmpq_poly([1]), fmpq_poly([0]), fmpq_poly([0])
    found = coordinates(radical, (0, 1, 0, 0, 0))
    if found is None:
        return None
    minimal, (_, _, z, w) = found
    slope = minimal.derivative()
    return minimal, z * slope % minimal, w * slope % minimal


def _interpolate(slices: list[tuple[fmpq, Slice]], turn: tuple[tuple[int, ...], ...]) -> Projection | None:
    """The polynomials in X and Y; None unless the last two slices confirm the degrees in X."""
    degree = int(slices[0][1][0].degree())
    places = [c for c, _ in slices]
    vandermonde = fmpq_mat([[c**n for n in range(len(places))] for c in places])
    out = []
    for which in range(3):
        rows = [[s[which][n] for n in range(degree + 1)] for _, s in slices]
        solved = vandermonde.solve(fmpq_mat(rows))
        terms = {}
        for n in range(degree + 1):
            for power in range(len(places)):
                if solved[power, n] != 0:
                    if power + n > degree:
                        return None
                    terms[power, n] = solved[power, n]
        out.append(PLANE.from_dict(terms))
    return Projection(out[0], out[1], out[2], turn)
