"""The result of `parametrize`: three expressions in two parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from operator import mul
from typing import TypeAlias

import sympy

from implicit.algebra.polynomial import Polynomial
from implicit.language.trees import x, y, z

u, v = sympy.symbols("u v", real=True)
TURN = (0.0, float(2 * sympy.pi))

Triple: TypeAlias = tuple[sympy.Expr, sympy.Expr, sympy.Expr]
Domain: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
Term: TypeAlias = tuple[tuple[int, int, int], sympy.Expr]
Parameters: TypeAlias = dict[sympy.Symbol, sympy.Rational]

_PLACES: tuple[Parameters, ...] = (
    {u: sympy.Rational(3, 7), v: sympy.Rational(5, 11)},
    {u: sympy.Rational(-2, 5), v: sympy.Rational(9, 13)},
)


@dataclass(frozen=True)
class Chart:
    """A parametrization (x, y, z)(u, v) of a surface.

    Attributes
    ----------
    coordinates
        Three sympy expressions, rational functions of u and v or of their sines, cosines, ...
    parameters
        The symbols u and v.
    domain
        A finite rectangle ((u0, u1), (v0, v1)) to draw: all of a compact surface, a part of others.
    kind
        "ellipsoid", "torus", "monoid", ...
    """

    coordinates: Triple
    parameters: tuple[sympy.Symbol, sympy.Symbol]
    domain: Domain
    kind: str


def make_chart(coordinates: Sequence[sympy.Expr], domain: Domain, kind: str) -> Chart:
    """A chart in the symbols u and v."""
    a, b, c = (sympy.sympify(e) for e in coordinates)
    return Chart((a, b, c), (u, v), domain, kind)


def moved(local: Sequence[sympy.Expr], matrix: sympy.Matrix, center: sympy.Matrix) -> Triple:
    """Place local coordinates in space: matrix * local + center."""
    a, b, c = matrix * sympy.Matrix(list(local)) + center
    return a, b, c


def verify(polynomial: Polynomial, chart: Chart) -> None:
    """Raise ArithmeticError unless f vanishes on the chart and its tangents span planes.

    Charts that are rational over Q are proved by an identity, others are checked to 60 digits at points with rational
    parameters.
    """
    terms = sympy.Poly(polynomial.to_sympy(), x, y, z).terms()
    proved = _vanishes(terms, chart.coordinates)
    fits = all(_fits(terms, chart.coordinates, at) for at in _PLACES) if proved is None else proved
    if not fits or not any(_spans(chart.coordinates, at) for at in _PLACES):
        raise ArithmeticError(f"the parametrization of a {chart.kind} does not satisfy f = 0; please report this")


def _vanishes(terms: list[Term], coordinates: Triple) -> bool | None:
    """Whether f = 0 identically, by f made homogeneous at numerators and denominator; None for charts not over Q."""
    functions = sympy.QQ.frac_field(u, v)
    try:
        parts = [functions.from_sympy(c) for c in coordinates]
        numbers = [sympy.QQ.from_sympy(c) for _, c in terms]
    except (sympy.CoercionFailed, ValueError):  # the latter from functions, as cos(u)
        return None
    below = parts[0].denom.lcm(parts[1].denom).lcm(parts[2].denom)
    places = [p.numer * below.exquo(p.denom) for p in parts] + [below]
    degree = max(sum(m) for m, _ in terms)
    powers = [list(accumulate([place] * degree, mul, initial=place.ring.one)) for place in places]
    total = below * 0
    for ((i, j, k), _), c in zip(terms, numbers, strict=True):
        total += powers[0][i] * powers[1][j] * powers[2][k] * powers[3][degree - i - j - k] * c
    return bool(total == 0)


def _fits(terms: list[Term], coordinates: Triple, at: Parameters) -> bool:
    point = [sympy.N(c.subs(at), 80) for c in coordinates]
    parts = [sympy.N(c, 80) * point[0] ** i * point[1] ** j * point[2] ** k for (i, j, k), c in terms]
    return bool(abs(sum(parts)) <= sympy.Float("1e-60") * sum(map(abs, parts)))


def _spans(coordinates: Triple, at: Parameters) -> bool:
    """Whether the derivatives by u and v are independent there."""
    first, second = (sympy.Matrix([sympy.N(c.diff(s).subs(at), 80) for c in coordinates]) for s in (u, v))
    return any(abs(c) > sympy.Float("1e-60") * first.norm() * second.norm() for c in first.cross(second))
