"""Ordinary solids. Spheres, tori, infinite cylinders, double cones and planes are polynomials, so that exact questions
(singular points, classification, degree) can be asked of them; the others are intersections of such. Their distances
are known as well, for blends and offsets.
"""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import Any

import sympy

from implicit.language.trees import build, x, y, z
from implicit.solids.combine import branch
from implicit.solids.distance import Distance
from implicit.solids.motion import exact, vector
from implicit.surface import Surface

Triple = Sequence[float]


def _positive(number: object, name: str) -> sympy.Expr:
    value = exact(number, name)
    if not value > 0:
        raise ValueError(f"{name} must be positive, got {number!r}")
    return value


def _length(*parts: sympy.Expr) -> sympy.Expr:
    """The root of the sum of squares, for parts that may hold min, max and abs."""
    square = build(sympy.Add, *(build(sympy.Pow, part, sympy.Integer(2)) for part in parts))
    return build(sympy.Pow, square, sympy.S.Half)


def _absolute(part: sympy.Expr) -> sympy.Expr:
    return build(sympy.Abs, part)


def _minus(a: sympy.Expr, number: sympy.Expr) -> sympy.Expr:
    return build(sympy.Add, a, -number)


def _corner(*parts: sympy.Expr) -> sympy.Expr:
    """The distance to where all parts are negative, for parts that are distances to planes at right angles."""
    outside = _length(*(build(sympy.Max, part, sympy.S.Zero) for part in parts))
    return build(sympy.Add, outside, build(sympy.Min, build(sympy.Max, *parts), sympy.S.Zero))


def sphere(radius: float = 1, center: Triple = (0, 0, 0)) -> Surface:
    """The ball x^2 + y^2 + z^2 <= radius^2 about a centre.

    >>> sphere(2)
    Surface("x^2 + y^2 + z^2 - 4")
    """
    r = _positive(radius, "radius")
    square = x**2 + y**2 + z**2
    surface = Surface.from_expression(square - r**2, Distance(sympy.sqrt(square) - r, True, True))
    return _at(surface, center)


def torus(major: float = 1, minor: float = 0.25, center: Triple = (0, 0, 0)) -> Surface:
    """The ring of points within `minor` of a circle of radius `major` in the plane z = 0 about a centre; degree 4.

    >>> torus(2, 1).degree
    4
    """
    a, b = _positive(major, "major"), _positive(minor, "minor")
    if b > a:
        raise ValueError(f"a ring needs minor <= major, got major {major!r}, minor {minor!r}")
    f = (x**2 + y**2 + z**2 + a**2 - b**2) ** 2 - 4 * a**2 * (x**2 + y**2)
    distance = sympy.sqrt((sympy.sqrt(x**2 + y**2) - a) ** 2 + z**2) - b
    return _at(Surface.from_expression(f, Distance(distance, True, True)), center)


def cylinder(radius: float = 1, height: float | None = None, center: Triple = (0, 0, 0)) -> Surface:
    """The cylinder x^2 + y^2 <= radius^2 along z; with a height it ends at height / 2 above and below its centre.

    >>> cylinder(1), cylinder(1, height=2)
    (Surface("x^2 + y^2 - 1"), Surface("max(x^2 + y^2 - 1, abs(z) - 1)"))
    """
    r = _positive(radius, "radius")
    f, side = x**2 + y**2 - r**2, sympy.sqrt(x**2 + y**2) - r
    if height is None:
        return _at(Surface.from_expression(f, Distance(side, True, True)), center)
    end = _minus(_absolute(z), _positive(height, "height") / 2)
    return _at(Surface.from_expression(branch(sympy.Max, f, end), Distance(_corner(side, end), True, True)), center)


def cone(radius: float = 1, height: float | None = 1, center: Triple = (0, 0, 0)) -> Surface:
    """The solid cone with a disc of the given radius about `center` as base and its tip `height` above in z.

    With height None: the double cone x^2 + y^2 <= radius^2 z^2 with its tip at `center`.

    >>> cone(1, None)
    Surface("x^2 + y^2 - z^2")
    """
    r = _positive(radius, "radius")
    if height is None:
        return _at(Surface.from_expression(x**2 + y**2 - r**2 * z**2), center)
    h = _positive(height, "height")
    f = x**2 + y**2 - (r / h) ** 2 * (h - z) ** 2
    side = (h * sympy.sqrt(x**2 + y**2) + r * (z - h)) / sympy.sqrt(r**2 + h**2)
    solid = build(sympy.Max, f, -z, z - h)
    return _at(Surface.from_expression(solid, Distance(build(sympy.Max, side, -z), False, True)), center)


def box(sides: float | Triple = 1, center: Triple = (0, 0, 0)) -> Surface:
    """The box with the given side lengths (one number for a cube) about a centre.

    >>> box((2, 2, 4))
    Surface("max(abs(x) - 1, abs(y) - 1, abs(z) - 2)")
    """
    lengths: Any = [sides] * 3 if isinstance(sides, numbers.Real | sympy.Expr) else sides
    halves = [_positive(length, "side") / 2 for length in vector(lengths, "sides")]
    faces = [_minus(_absolute(s), half) for s, half in zip((x, y, z), halves, strict=True)]
    return _at(Surface.from_expression(build(sympy.Max, *faces), Distance(_corner(*faces), True, True)), center)


def capsule(start: Triple = (0, 0, -1), end: Triple = (0, 0, 1), radius: float = 0.5) -> Surface:
    """The points within `radius` of the segment from start to end.

    >>> round(float(capsule((0, 0, 0), (3, 0, 0), 1)((4, 0, 0))), 12)
    0.0
    """
    r, a, b = _positive(radius, "radius"), vector(start, "start"), vector(end, "end")
    way = b - a
    square = way.dot(way)
    if square == 0:
        return sphere(radius, start)
    place = sympy.Matrix([x, y, z]) - a
    share = build(sympy.Min, build(sympy.Max, sympy.expand(place.dot(way)) / square, sympy.S.Zero), sympy.S.One)
    rest = [build(sympy.Add, p, build(sympy.Mul, -w, share)) if w != 0 else p for p, w in zip(place, way, strict=True)]
    reach = build(sympy.Add, *(build(sympy.Pow, part, sympy.Integer(2)) for part in rest))
    distance = _minus(build(sympy.Pow, reach, sympy.S.Half), r)
    return Surface.from_expression(_minus(reach, r**2), Distance(distance, True, True))


def plane(normal: Triple = (0, 0, 1), point: Triple = (0, 0, 0)) -> Surface:
    """The half space n . (p - point) <= 0 behind the plane through `point` with outward normal n.

    >>> plane((0, 0, 1), (0, 0, 2))
    Surface("z - 2")
    """
    n, place = vector(normal, "normal"), vector(point, "point")
    if n.dot(n) == 0:
        raise ValueError("a plane needs a normal other than (0, 0, 0)")
    f = sympy.expand(n.dot(sympy.Matrix([x, y, z]) - place))
    return Surface.from_expression(f, Distance(f / sympy.sqrt(n.dot(n)), True, True))


def _at(surface: Surface, center: Triple) -> Surface:
    place = vector(center, "center")
    return surface if not any(place) else surface.translate(place)
