"""Surfaces of revolution: the axis from linear equations, then the profile as a rational curve.

Rotations about an axis with direction w leave f alone if (w x p + t) . grad f = 0 for a vector t across w. That is
linear in the six numbers w and t.
"""

import sympy

from implicit.language.trees import x, y, z
from implicit.parametrize.chart import TURN, Chart, make_chart, moved, u
from implicit.parametrize.monoid import rational_curve

_RADIUS, _HEIGHT = sympy.symbols("r h", real=True)


def parametrize_revolution(expression: sympy.Expr) -> Chart | None:
    """The chart of a surface of revolution whose profile is a rational curve that can be found; else None."""
    axis = find_axis(expression)
    if axis is None:
        return None
    matrix, center = axis
    local = moved((x, y, z), matrix, center)
    profile = sympy.expand(expression.subs(dict(zip((x, y, z), local, strict=True)), simultaneous=True))
    profile = sympy.expand(profile.subs({x: _RADIUS, y: 0, z: _HEIGHT}))
    for factor, _ in sympy.factor_list(profile, _RADIUS, _HEIGHT)[1]:
        curve = rational_curve(factor, (_RADIUS, _HEIGHT))
        if curve is not None:
            radius, height = curve
            turned = [radius * sympy.cos(u), radius * sympy.sin(u), height]
            return make_chart(moved(turned, matrix, center), (TURN, (-1.0, 1.0)), "surface of revolution")
    return None


def find_axis(expression: sympy.Expr) -> tuple[sympy.Matrix, sympy.Matrix] | None:
    """A rotation that takes the z-axis to the direction of the axis, and a point of the axis."""
    p, gradient = sympy.Matrix([x, y, z]), sympy.Matrix([expression.diff(s) for s in (x, y, z)])
    fields = [p.cross(gradient)[k] for k in range(3)] + list(gradient)
    columns = [sympy.Poly(f, x, y, z).as_dict() for f in fields]
    monomials = sorted({m for column in columns for m in column})
    kernel = sympy.Matrix([[column.get(m, 0) for column in columns] for m in monomials]).nullspace()
    for vector in kernel:
        direction, shift = vector[:3, 0], vector[3:, 0]
        if direction.norm() != 0 and sympy.simplify(direction.dot(shift)) == 0:
            center = direction.cross(shift) / direction.dot(direction)
            return _frame(direction), center.applyfunc(sympy.radsimp)
    return None


def _frame(direction: sympy.Matrix) -> sympy.Matrix:
    """An orthonormal, right-handed matrix with its third column along the direction."""
    third = direction / direction.norm()
    least = min(range(3), key=lambda k: abs(float(third[k])))
    first = sympy.eye(3)[:, least]
    first = first - third * third[least]
    first = first / first.norm()
    return sympy.Matrix.hstack(first, third.cross(first), third).applyfunc(sympy.radsimp)
