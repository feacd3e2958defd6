"""Lone real points of complex curves, told apart exactly where they are near each other or near a real curve."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from flint import fmpq_mpoly, fmpq_poly
from numpy.typing import NDArray

from implicit.singular.arcs import Part
from implicit.singular.chains import distance
from implicit.singular.coincide import coincide
from implicit.singular.exact import ExactPoint
from implicit.singular.form import Form, Monomial
from implicit.singular.ideal import singular_equations
from implicit.singular.intersection import Shape, containing
from implicit.singular.region import Deadline
from implicit.singular.rest import solve
from implicit.singular.twist import Twist

Floats = NDArray[np.float64]

_CLEARLY = 1e3  # times as far away are other spots than the one that a place is
_ROUNDING = 1e-6
"""Of the reach: nothing nearer is told apart by floats."""


@dataclass(frozen=True, eq=False)
class Branch:
    """A complex curve of singular points: a part of the projection, its real polylines and its lone real points.

    `around` are some polynomials that vanish on it; they and the form are in the coordinates of `shape`.
    """

    part: Part
    shape: Shape
    form: Form
    around: list[fmpq_mpoly]
    lines: list[Floats] = field(default_factory=list)
    lone: list[Floats] = field(default_factory=list)

    @cached_property
    def equations(self) -> list[fmpq_mpoly]:
        """Polynomials that vanish on the curve and together nowhere else: cones of its degree, from all points."""
        return containing(self.part, int(self.part.polynomial.total_degree()))

    def carries(self, point: ExactPoint) -> bool:
        """Whether an exact point, in the coordinates of the equations, lies on the complex curve."""
        values: dict[Monomial, fmpq_poly] = {}  # of the monomials, which most of the equations have in common
        return all(_value(g, point, values) == 0 for g in self.equations)

    def near(self, place: Floats, reach: float) -> bool:
        """Whether a place is near the real curve."""
        return any(distance(place, np.concatenate([line, line[-1:]])) < reach for line in self.lines)

    @cached_property
    def over(self) -> list[ExactPoint] | None:
        """The real singular points where its equations hold on lines too."""
        return solve(self.form, [*singular_equations(self.form), *self.around, *self.shape.upright])

    def pinches(self) -> list[ExactPoint] | None:
        """Real singular points, among them all real points where the curve has no tangent, as at its lone points."""
        if self.shape.upright:
            return self.over
        a, b = self.shape.equations
        slopes = [(a.derivative(k), b.derivative(k)) for k in range(3)]
        flat = [slopes[k - 2][0] * slopes[k - 1][1] - slopes[k - 2][1] * slopes[k - 1][0] for k in range(3)]
        return solve(self.form, [*singular_equations(self.form), *self.around, a, b, *flat])


def sort_lone(
    branches: Sequence[Branch], twist: Twist, reach: float, deadline: Deadline
) -> tuple[list[Floats], list[Floats]]:
    """Lone points that are on no real curve, each once, and places of which that is not known.

    Those that are not within `reach` of others or of a real curve are as they are; the others are decided exactly.
    """
    clear, doubtful = _apart(branches, reach)
    known = _pinches([branch for _, branch in doubtful], deadline)
    if known is None:
        return clear, [place for place, _ in doubtful]
    spots, unknown = [twist.outside(np.array(e.position)) for e in known], []
    owners: dict[int, list[Branch]] = {}
    for place, branch in doubtful:
        n = _nearest(place, spots, reach)
        if n is None:
            unknown.append(place)
        else:
            owners.setdefault(n, []).append(branch)
    for n, own in owners.items():
        others = [b for b in branches if b not in own and b.near(spots[n], reach)]
        if not any(b.carries(known[n]) for b in others):
            clear.append(spots[n])
    return clear, unknown


def _nearest(place: Floats, spots: list[Floats], reach: float) -> int | None:
    """Which spot a place is, to rounding; None where two of them, or none, come into question."""
    away = np.array([np.abs(spot - place).max() for spot in spots])
    near = np.flatnonzero(away < max(_CLEARLY * float(away.min(initial=np.inf)), _ROUNDING * reach))
    return int(near[0]) if len(near) == 1 and away[near[0]] < reach else None


def _apart(branches: Sequence[Branch], reach: float) -> tuple[list[Floats], list[tuple[Floats, Branch]]]:
    """The lone points that are far from others and from real curves, and the others with the curves they are on."""
    places = [(p, branch) for branch in branches for p in branch.lone]
    clear, doubtful = [], []
    for n, (p, branch) in enumerate(places):
        others = [q for q, _ in places[:n] + places[n + 1 :]]
        if any(np.abs(p - q).max() < reach for q in others) or any(b.near(p, reach) for b in branches):
            doubtful.append((p, branch))
        else:
            clear.append(p)
    return clear, doubtful


def _pinches(branches: Sequence[Branch], deadline: Deadline) -> list[ExactPoint] | None:
    """The pinches of all these curves, each once; None where they could not be found."""
    known: list[ExactPoint] = []
    for branch in dict.fromkeys(branches):
        more = None if deadline.passed else branch.pinches()
        if more is None:
            return None
        for e in more:
            if not any(coincide(e, other) for other in known):
                known.append(e)
    return known


def _value(g: fmpq_mpoly, point: ExactPoint, values: dict[Monomial, fmpq_poly]) -> fmpq_poly:
    """The exact value of a polynomial in x, y, z; the values of monomials are kept."""
    total = fmpq_poly([0])
    for exponents, c in g.to_dict().items():
        m = int(exponents[0]), int(exponents[1]), int(exponents[2])
        if m not in values:
            values[m] = point.substitute(Form({m: fmpq_poly([1])}))
        total += values[m] * c
    return total
