"""Moved, turned and scaled surfaces: f(M^-1 (p - t)) = 0."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike

from implicit.algebra.expand import to_fraction
from implicit.blackbox import MovedField
from implicit.language.trees import build, substitute, x, y, z
from implicit.solids.distance import Distance
from implicit.surface import Surface


def exact(number: object, name: str) -> sympy.Expr:
    """A real number as an exact sympy number; floats count as decimals. `name` is what an error calls it."""
    if isinstance(number, sympy.Expr) and not number.is_Float and number.is_real and not number.free_symbols:
        return number
    if isinstance(number, numbers.Rational):
        return sympy.Rational(int(number.numerator), int(number.denominator))
    try:
        value = math.nan if isinstance(number, str | bytes) else float(number)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} must be a finite real number, got {number!r}")
    return sympy.Rational(*to_fraction(value).as_integer_ratio())


def vector(values: object, name: str) -> sympy.Matrix:
    """Three real numbers as an exact column."""
    several = isinstance(values, Sequence | sympy.MatrixBase) or (isinstance(values, np.ndarray) and values.ndim > 0)
    row = list(values) if several else [values]  # type: ignore[call-overload]
    if len(row) != 3:
        raise ValueError(f"{name} must be three numbers, got {values!r}")
    return sympy.Matrix([exact(number, f"each number of {name}") for number in row])


def transform(surface: Surface, matrix: ArrayLike) -> Surface:
    """The surface moved by an affine map p -> M p + t, given as (3, 3) or (4, 4) acting on columns."""
    table = np.asarray(matrix, dtype=object)
    if table.shape not in ((3, 3), (4, 4)):
        raise ValueError(f"a matrix of shape (3, 3) or (4, 4) was wanted, got {table.shape}")
    rows = sympy.Matrix([[exact(entry, "each entry of a matrix") for entry in row] for row in table.tolist()])
    if rows.shape == (4, 4):
        if list(rows.row(3)) != [0, 0, 0, 1]:
            raise ValueError(f"the last row of a (4, 4) matrix must be (0, 0, 0, 1), got {tuple(rows.row(3))}")
        return move(surface, rows[:3, :3], rows[:3, 3])
    return move(surface, rows, sympy.zeros(3, 1))


def rotation(angle: Any, axis: object) -> sympy.Matrix:
    """The matrix of a turn by an angle in radians about an axis through the origin (Rodrigues)."""
    direction = vector(axis, "an axis")
    length = sympy.sqrt(direction.dot(direction))
    if length == 0:
        raise ValueError("a rotation needs an axis other than (0, 0, 0)")
    a, b, c = direction / length
    value = exact(angle, "an angle")
    turns = float(value) / (np.pi / 2)
    if not isinstance(angle, sympy.Expr) and abs(turns - round(turns)) < 1e-15 * max(1.0, abs(turns)):
        angle = round(turns) * sympy.pi / 2
    cos, sin = (
        (sympy.cos(angle), sympy.sin(angle))
        if isinstance(angle, sympy.Expr)
        else (exact(math.cos(angle), "a cosine"), exact(math.sin(angle), "a sine"))
    )
    cross = sympy.Matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    outer = sympy.Matrix([a, b, c]) * sympy.Matrix([[a, b, c]])
    return (sympy.eye(3) * cos + cross * sin + outer * (1 - cos)).applyfunc(sympy.expand)


def move(surface: Surface, matrix: sympy.Matrix, shift: sympy.Matrix, stretch: sympy.Expr | None = None) -> Surface:
    """The surface moved by p -> M p + t; `stretch` says by how much distances grow, where they all do alike."""
    if matrix == sympy.eye(3):
        inverse = matrix
    elif matrix.det() == 0:
        raise ValueError("the matrix has determinant 0: it would flatten the surface")
    else:
        inverse = matrix.inv()
    if surface.expression is None:
        back = -(inverse * shift)
        numbers = tuple(tuple(float(c) for c in row) for row in inverse.tolist())
        return Surface.from_field(MovedField(surface.field, numbers, tuple(float(c) for c in back)))
    place = inverse * (sympy.Matrix([x, y, z]) - shift)
    values = dict(zip((x, y, z), place, strict=True))
    known, moved = surface.distance, None
    if known is not None and stretch is not None:
        expression = substitute(known.expression, values)
        expression = expression if stretch == 1 else build(sympy.Mul, stretch, expression)
        moved = Distance(expression, known.outside, known.inside)
    return Surface.from_expression(substitute(surface.expression, values), moved)


def translate(surface: Surface, by: object) -> Surface:
    """The surface moved by a vector."""
    return move(surface, sympy.eye(3), vector(by, "a translation"), sympy.S.One)


def rotate(surface: Surface, angle: Any, axis: object, center: object) -> Surface:
    """The surface turned about an axis through a centre."""
    matrix, middle = rotation(angle, axis), vector(center, "center")
    return move(surface, matrix, middle - matrix * middle, sympy.S.One)


def scale(surface: Surface, factor: object, center: object) -> Surface:
    """The surface scaled from a centre."""
    even = isinstance(factor, numbers.Real | sympy.Expr)
    factors = sympy.Matrix([exact(factor, "a factor")] * 3) if even else vector(factor, "factors")
    if any(f == 0 for f in factors):
        raise ValueError("a scaling by 0 would flatten the surface")
    matrix, middle = sympy.diag(*factors), vector(center, "center")
    return move(surface, matrix, middle - matrix * middle, abs(factors[0]) if even else None)
