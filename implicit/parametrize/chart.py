"""The result of `parametrize`: three expressions in two parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy

from implicit.algebra.polynomial import Polynomial
from implicit.language.trees import x, y, z

u, v = sympy.symbols("u v", real=True)
TURN = (0.0, float(2 * sympy.pi))

Triple: TypeAlias = tuple[sympy.Expr, sympy.Expr, sympy.Expr]
Domain: TypeAlias = tuple[tuple[float, float], tuple[float, float]]


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
    """Raise ArithmeticError unless f vanishes on the chart, to 60 digits at some points with rational parameters."""
    expression = polynomial.to_sympy()
    terms = sympy.Poly(expression, x, y, z).terms()
    for a, b in ((sympy.Rational(3, 7), sympy.Rational(5, 11)), (sympy.Rational(-2, 5), sympy.Rational(9, 13))):
        point = [sympy.N(c.subs({u: a, v: b}), 80) for c in chart.coordinates]
        parts = [sympy.N(c, 80) * point[0] ** i * point[1] ** j * point[2] ** k for (i, j, k), c in terms]
        if not abs(sum(parts)) <= sympy.Float("1e-60") * sum(map(abs, parts)):
            raise ArithmeticError(f"the parametrization of a {chart.kind} does not satisfy f = 0; please report this")
