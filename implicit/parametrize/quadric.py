"""Quadrics of all types: completing squares brings them to a sum of squares, the signs tell which one it is."""

import sympy

from implicit.language.trees import x, y, z
from implicit.parametrize.chart import TURN, Chart, make_chart, moved, u, v

_UNIT = (-1.0, 1.0)
_CIRCLE = sympy.cos(u), sympy.sin(u)


def parametrize_plane(expression: sympy.Expr) -> Chart:
    """A plane, solved for the last coordinate that occurs."""
    for k, axis in ((2, z), (1, y), (0, x)):
        slope = expression.coeff(axis, 1)
        if slope != 0:
            others = [s for s in (x, y, z) if s != axis]
            solved = sympy.expand(axis - expression / slope).subs(dict(zip(others, (u, v), strict=True)))
            coordinates = [u, v]
            coordinates.insert(k, solved)
            return make_chart(coordinates, (_UNIT, _UNIT), "plane")
    raise ValueError("a plane was wanted, got a constant")


def parametrize_quadric(expression: sympy.Expr) -> Chart:
    """A quadric, in coordinates q with p = M q + c where f is d1 q1^2 + d2 q2^2 + d3 q3^2 + e q3 + k."""
    squares, linear, constant, matrix, center = complete_squares(expression)
    local, domain, kind = _standard(squares, linear, constant)
    return make_chart(moved(local, matrix, center), domain, kind)


def complete_squares(
    expression: sympy.Expr,
) -> tuple[list[sympy.Expr], sympy.Expr, sympy.Expr, sympy.Matrix, sympy.Matrix]:
    """(d1, d2, d3), e, k, M and c as above (Lagrange); nonzero d first, more positive than negative ones."""
    form = sympy.hessian(expression, (x, y, z)) / 2
    matrix, squares = _diagonal(form)
    if sum(1 for d in squares if d.is_positive) < sum(1 for d in squares if d.is_negative):
        matrix, squares_, linear, constant, center = _center(-expression, matrix, [-d for d in squares])
    else:
        matrix, squares_, linear, constant, center = _center(expression, matrix, squares)
    return squares_, linear, constant, matrix, center


def _diagonal(form: sympy.Matrix) -> tuple[sympy.Matrix, list[sympy.Expr]]:
    """M and d with M^T form M = diag(d), exactly."""
    size = form.rows
    matrix, work = sympy.eye(size), form.copy()
    for k in range(size):
        pivot = next((i for i in range(k, size) if work[i, i] != 0), None)
        if pivot is None:
            pair = next(((i, j) for i in range(k, size) for j in range(i + 1, size) if work[i, j] != 0), None)
            if pair is None:
                break
            change = sympy.eye(size)  # q_i = r_i - r_j, q_j = r_i + r_j makes squares of a product
            change[pair[0], pair[1]], change[pair[1], pair[0]] = -1, 1
            matrix, work = matrix * change, (change.T * work * change).applyfunc(sympy.nsimplify)
            pivot = pair[0]
        swap = sympy.eye(size)
        swap.col_swap(k, pivot)
        matrix, work = matrix * swap, swap.T * work * swap
        clear = sympy.eye(size)
        for j in range(k + 1, size):
            clear[k, j] = -work[k, j] / work[k, k]
        matrix, work = matrix * clear, (clear.T * work * clear).applyfunc(sympy.radsimp)
    return matrix, [work[i, i] for i in range(size)]


def _center(
    expression: sympy.Expr, matrix: sympy.Matrix, squares: list[sympy.Expr]
) -> tuple[sympy.Matrix, list[sympy.Expr], sympy.Expr, sympy.Expr, sympy.Matrix]:
    """Sort the squares, remove linear terms where there are squares, and gather the others in one."""
    order = sorted(range(3), key=lambda k: (squares[k] == 0, bool(squares[k].is_negative)))
    squares = [squares[k] for k in order]
    matrix = matrix[:, order]
    origin = {x: 0, y: 0, z: 0}
    gradient = matrix.T * sympy.Matrix([expression.diff(s).subs(origin) for s in (x, y, z)])
    center = matrix * sympy.Matrix([-gradient[k] / (2 * d) if d != 0 else 0 for k, d in enumerate(squares)])
    constant = sympy.radsimp(
        sympy.expand(expression.subs(dict(zip((x, y, z), center, strict=True)), simultaneous=True))
    )
    free = [k for k, d in enumerate(squares) if d == 0 and gradient[k] != 0]
    if not free:
        return matrix, squares, sympy.Integer(0), constant, center
    # one free direction along the linear form, the others across it; the constant goes into the center
    lead = free[-1]
    change = sympy.eye(3)
    for k in range(3):
        if squares[k] == 0 and k != lead:
            change[lead, k] = -gradient[k] / gradient[lead]
    change.col_swap(lead, 2)
    matrix = matrix * change
    center = center - matrix[:, 2] * constant / gradient[lead]
    return matrix, squares, gradient[lead], sympy.Integer(0), center


def _standard(
    squares: list[sympy.Expr], linear: sympy.Expr, constant: sympy.Expr
) -> tuple[list[sympy.Expr], tuple[tuple[float, float], tuple[float, float]], str]:
    """A parametrization of d1 q1^2 + d2 q2^2 + d3 q3^2 + e q3 + k = 0."""
    rank = sum(1 for d in squares if d != 0)
    negative = sum(1 for d in squares if d.is_negative)
    cos, sin = _CIRCLE
    if linear != 0:
        height = -sum(d * q**2 for d, q in zip(squares, (u, v, 0), strict=True)) / linear
        kind = "parabolic cylinder" if rank == 1 else "hyperbolic paraboloid" if negative else "elliptic paraboloid"
        if kind == "elliptic paraboloid":
            a, b = (1 / sympy.sqrt(d) for d in squares[:2])
            return [a * v * cos, b * v * sin, -(v**2) / linear], (TURN, (0.0, 1.0)), kind
        if kind == "hyperbolic paraboloid":  # along its straight lines
            a, b = 1 / sympy.sqrt(squares[0]), 1 / sympy.sqrt(-squares[1])
            return [a * (u + v), b * (u - v), -4 * u * v / linear], (_UNIT, _UNIT), kind
        return [u, v, height.subs(v, 0)], (_UNIT, _UNIT), kind
    sign = sympy.sign(sympy.nsimplify(constant)) if constant != 0 else 0
    a, b, c = (sympy.sqrt(abs(constant / d)) if d != 0 and constant != 0 else _root(d) for d in squares)
    if rank == 3 and constant != 0:
        if negative == 0 and sign < 0:
            return [a * cos * sympy.cos(v), b * sin * sympy.cos(v), c * sympy.sin(v)], (TURN, _LATITUDE), "ellipsoid"
        if negative == 1 and sign < 0:  # along its straight lines
            return [a * (cos - v * sin), b * (sin + v * cos), c * v], (TURN, _UNIT), "hyperboloid of one sheet"
        if negative == 1:
            ratio = 2 * v / (1 - v**2)
            local = [a * ratio * cos, b * ratio * sin, c * (1 + v**2) / (1 - v**2)]
            return local, (TURN, (0.0, 0.6)), "hyperboloid of two sheets"
    if rank == 3 and constant == 0 and negative == 1:
        return [a * v * cos, b * v * sin, c * v], (TURN, _UNIT), "cone"
    if rank == 2 and constant != 0:
        if negative == 0 and sign < 0:
            return [a * cos, b * sin, v], (TURN, _UNIT), "elliptic cylinder"
        if negative == 1:
            first, second = a * sympy.cosh(u), b * sympy.sinh(u)
            if sign > 0:
                first, second = a * sympy.sinh(u), b * sympy.cosh(u)
            return [first, second, v], (_UNIT, _UNIT), "hyperbolic cylinder"
    raise ValueError(_refusal(rank, negative, constant))


_LATITUDE = (-float(sympy.pi) / 2, float(sympy.pi) / 2)


def _root(square: sympy.Expr) -> sympy.Expr:
    return 1 / sympy.sqrt(abs(square)) if square != 0 else sympy.Integer(1)


def _refusal(rank: int, negative: int, constant: sympy.Expr) -> str:
    if negative == 0 and rank > 1:
        what = "no real point" if constant != 0 else ("one real point" if rank == 3 else "one real line")
        return f"a quadric with real points was wanted, this one has {what}"
    return "an irreducible quadric was wanted, this one is a pair of planes: parametrize each factor of f"
