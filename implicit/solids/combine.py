"""Solids from solids: union, intersection, difference, complement, blends and offsets.

A solid is where f <= 0. The union of two has the least of both functions, the intersection the largest, and the
complement the opposite sign. Nothing is simplified: a solid of a hundred parts is built in milliseconds.
"""

from __future__ import annotations

from typing import Any, Literal

import sympy

from implicit.blackbox import BranchField, MovedField
from implicit.language.trees import build
from implicit.solids.distance import Distance, distance_like
from implicit.solids.motion import exact
from implicit.surface import Surface, check_surface


def _parts(expression: sympy.Expr, kind: Any) -> tuple[sympy.Expr, ...]:
    return expression.args if isinstance(expression, kind) else (expression,)


def negative(expression: sympy.Expr) -> sympy.Expr:
    """The opposite sign, without -(-f)."""
    if isinstance(expression, sympy.Mul) and expression.args[0] is sympy.S.NegativeOne and len(expression.args) == 2:
        return expression.args[1]
    return build(sympy.Mul, sympy.S.NegativeOne, expression)


def branch(kind: Any, a: sympy.Expr, b: sympy.Expr) -> sympy.Expr:
    """Min or Max of both, flat."""
    return build(kind, *_parts(a, kind), *_parts(b, kind))


def union(a: Surface, b: Surface) -> Surface:
    """Where a or b is: min(f, g)."""
    if a.expression is None or b.expression is None:
        return Surface.from_field(BranchField((a.field, b.field), True))
    return Surface.from_expression(branch(sympy.Min, a.expression, b.expression), _join(a, b, sympy.Min))


def intersection(a: Surface, b: Surface) -> Surface:
    """Where a and b are: max(f, g)."""
    if a.expression is None or b.expression is None:
        return Surface.from_field(BranchField((a.field, b.field), False))
    return Surface.from_expression(branch(sympy.Max, a.expression, b.expression), _join(a, b, sympy.Max))


def complement(a: Surface) -> Surface:
    """Everything but a: -f."""
    if a.expression is None:
        return Surface.from_field(MovedField(a.field, sign=-1.0))
    known = a.distance
    turned = Distance(negative(known.expression), known.inside, known.outside) if known else None
    return Surface.from_expression(negative(a.expression), turned)


def difference(a: Surface, b: Surface) -> Surface:
    """Where a is and b is not: max(f, -g)."""
    return intersection(a, complement(b))


def _join(a: Surface, b: Surface, kind: Any) -> Distance | None:
    """The least of two distances is right outside, the largest inside."""
    one, two = a.distance, b.distance
    if one is None or two is None:
        return None
    least = kind is sympy.Min
    outside, inside = least and one.outside and two.outside, not least and one.inside and two.inside
    return Distance(branch(kind, one.expression, two.expression), outside, inside)


def blend(
    a: Surface, b: Surface, radius: float, kind: Literal["union", "intersection", "difference"] = "union"
) -> Surface:
    """Combine two solids and round the edge where they meet with a circle of the given radius.

    With d and e the distances to both and r the radius, the union is
    max(r, min(d, e)) - |(max(r - d, 0), max(r - e, 0))|, which is d where e >= r and e where d >= r: the blend is
    tangent to both parts and changes nothing farther than the radius from either. Where the parts meet at right angles
    its section is a quarter circle.

    The radius is a length where the distances are known, as for the shapes of this package, moved or scaled evenly and
    combined. For other formulas f / |grad f| stands for the distance, to first order.

    Raises
    ------
    ValueError
        For a radius that is not positive, another kind, or a surface given as a function without a formula.
    TypeError
        For parts that are no implicit Surface.

    Examples
    --------
    >>> from implicit.solids.shapes import plane, sphere
    >>> solid = blend(sphere(1), plane((0, 0, 1), (0, 0, 0)), 0.25)
    >>> bool(solid((1.05, 0, 0.05)) < 0), bool(solid((1.3, 0, 0.05)) < 0)
    (True, False)
    """
    if kind not in ("union", "intersection", "difference"):
        raise ValueError(f'kind must be "union", "intersection" or "difference", got {kind!r}')
    for part in (a, b):
        check_surface(part)
    r = exact(radius, "the positive radius of a blend")
    if not r > 0:
        raise ValueError(f"a blend needs a positive finite radius, got {radius!r}")
    if kind != "union":
        other = complement(b) if kind == "intersection" else b
        return complement(blend(complement(a), other, radius))
    d, e = distance_like(a, r), distance_like(b, r)
    near = [build(sympy.Max, build(sympy.Add, r, negative(part)), sympy.S.Zero) for part in (d, e)]
    square = build(sympy.Add, *(build(sympy.Pow, part, sympy.Integer(2)) for part in near))
    far = build(sympy.Max, r, branch(sympy.Min, d, e))
    rounded = build(sympy.Add, far, negative(build(sympy.Pow, square, sympy.S.Half)))
    return Surface.from_expression(rounded, Distance(rounded, False, False))


def offset(surface: Surface, distance: float) -> Surface:
    """The surface at a distance outside (positive) or inside (negative) of a solid.

    Right where the distance of the solid is known: for spheres, tori, cylinders, boxes, capsules and planes, moved or
    scaled evenly, both ways; for unions of these outward; for intersections of these and for cones inward. Everything
    else is refused, because f - distance would not lie at that distance.

    Raises
    ------
    ValueError
        Where the distance is not known on that side, or is no finite real number.
    TypeError
        For what is no implicit Surface.

    Examples
    --------
    >>> from implicit.solids.shapes import box
    >>> rounded = offset(box(2), 0.5)
    >>> float(rounded((1.5, 0, 0))), bool(rounded((1.4, 1.4, 1.4)) > 0)
    (0.0, True)
    """
    check_surface(surface)
    amount = exact(distance, "the distance of an offset")
    known = surface.distance
    side = "outside" if amount > 0 else "inside"
    if known is None or not getattr(known, side):
        raise ValueError(f"the distance to this surface is not known on its {side}, so it cannot be offset there")
    moved = build(sympy.Add, known.expression, -amount)
    both = known.outside and known.inside
    return Surface.from_expression(moved, Distance(moved, both or bool(amount > 0), both or bool(amount < 0)))
