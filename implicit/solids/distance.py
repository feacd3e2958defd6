"""The signed distance to a solid, as an expression, where it is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy

from implicit.language.trees import build, is_branching, x, y, z

if TYPE_CHECKING:
    from implicit.surface import Surface


@dataclass(frozen=True)
class Distance:
    """`expression` is negative inside, changes by at most the way that one goes, and is the signed distance to the
    surface wherever it is positive (`outside`), or negative (`inside`), or both.
    """

    expression: sympy.Expr
    outside: bool
    inside: bool


def distance_like(surface: Surface, radius: sympy.Expr) -> sympy.Expr:
    """The distance where it is known, otherwise one to first order: f / |grad f| near the surface."""
    if surface.expression is None:
        raise ValueError("a surface given as a function has no formula, so it cannot be blended")
    return surface.distance.expression if surface.distance is not None else _normalized(surface.expression, radius)


def _normalized(f: sympy.Expr, radius: sympy.Expr) -> sympy.Expr:
    """The quotient f / sqrt(|grad f|^2 + (f / 4r)^2), near the surface f / |grad f|.

    It is nowhere more than 4r and defined where the gradient vanishes (after Rvachev's normalisation). Below min and
    max each branch is taken for itself.
    """
    if isinstance(f, sympy.Min | sympy.Max):
        return build(type(f), *(_normalized(part, radius) for part in f.args))
    if isinstance(f, sympy.Mul) and len(f.args) == 2 and f.args[0] is sympy.S.NegativeOne:
        return build(sympy.Mul, sympy.S.NegativeOne, _normalized(f.args[1], radius))
    if is_branching(f):
        return f
    slopes = [sympy.diff(f, s) for s in (x, y, z)]
    squares = [build(sympy.Pow, slope, sympy.Integer(2)) for slope in slopes if slope != 0]
    squares.append(build(sympy.Pow, build(sympy.Mul, 1 / (4 * radius), f), sympy.Integer(2)))
    return build(sympy.Mul, f, build(sympy.Pow, build(sympy.Add, *squares), sympy.Rational(-1, 2)))
