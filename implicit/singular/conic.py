"""Lines and conics among the singular curves: their equations and an exact parametrization."""

import sympy
from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from implicit.singular.arcs import Part, rows
from implicit.singular.ideal import RATIONAL
from implicit.singular.intersection import Shape, intersection
from implicit.singular.twist import t

Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]
Pair = tuple[sympy.Expr, sympy.Expr]


def shape_of(part: Part) -> Shape:
    """What kind of curve a part is; exact."""
    degree = part.polynomial.total_degree()
    shape = _line(part) if degree == 1 else _plane_curve(part)
    if shape is None:
        shape = intersection(part, degree)
    if shape is None:
        p = part.projection
        plane, slope = p.in_space(p.plane), p.in_space(p.plane.derivative(1))
        return Shape((plane, p.forms()[2] * slope - p.in_space(p.height)), (), (plane, slope))
    return shape


def _rational(c: fmpq) -> sympy.Rational:
    return sympy.Rational(int(c.p), int(c.q))


def _line(part: Part) -> Shape | None:
    """From two rational points; the direction in lowest terms, the point where the leading coordinate is 0."""
    points = []
    for at in (fmpq(1, 3), fmpq(-2, 3), fmpq(4, 3), fmpq(-5, 3)):
        over = _over(part, at)
        if over is not None:
            points.append(over)
    if len(points) < 2:
        return None
    p, q = points[:2]
    d = [b - a for a, b in zip(p, q, strict=True)]
    lead = max(range(3), key=lambda a: abs(d[a]))
    d = [c / d[lead] for c in d]
    p = [a - p[lead] * c for a, c in zip(p, d, strict=True)]
    gens = RATIONAL.gens()
    equations = tuple((gens[a] - p[a]) - (gens[lead] - p[lead]) * d[a] for a in range(3) if a != lead)
    x, y, z = (_rational(a) + t * _rational(c) for a, c in zip(p, d, strict=True))
    return Shape(equations, ((x, y, z),))


def _over(part: Part, at: fmpq) -> list[fmpq] | None:
    """The rational point of a line over a rational X."""
    line = [r(at) for r in rows(part.polynomial)]
    if len(line) < 2 or line[1] == 0:
        return None
    y = -line[0] / line[1]
    slope, height = (
        fmpq_poly([r(at) for r in rows(q)])(y) for q in (part.projection.plane.derivative(1), part.projection.height)
    )
    if slope == 0:
        return None
    return [
        sum((fmpq(c) * v for c, v in zip(row, (at, y, height / slope), strict=True)), fmpq(0))
        for row in part.projection.turn
    ]


def _plane_curve(part: Part) -> Shape | None:
    """A curve in a plane: by the plane and a cylinder, over two coordinates."""
    plane = _plane(part)
    if plane is None:
        return None
    a, b, c = plane
    forms = part.projection.forms()
    flat = forms[2] - forms[0] * a - forms[1] * b - c
    lead = max(range(3), key=lambda n: abs(_coefficient(flat, n)))
    gens = list(RATIONAL.gens())
    gens[lead] = gens[lead] - flat / _coefficient(flat, lead)
    section = part.projection.in_space(part.polynomial).compose(*gens, ctx=RATIONAL)
    if part.polynomial.total_degree() > 2:
        return Shape((flat, section))
    return Shape((flat, section), _parametrize(section, gens[lead], lead))


def _parametrize(section: fmpq_mpoly, height: fmpq_mpoly, lead: int) -> tuple[Triple, ...]:
    """A conic in the two coordinates besides `lead`, which is `height` as a function of them."""
    first, second = (n for n in range(3) if n != lead)
    found = []
    for pair in _conic_in_plane(section, first, second):
        out: list[sympy.Expr] = [sympy.Integer(0)] * 3
        out[first], out[second] = pair
        slopes = [(_rational(_coefficient(height, n)), out[n]) for n in (first, second)]
        out[lead] = sympy.expand(_rational(height[(0,) * 6]) + sum(m * v for m, v in slopes))
        found.append((out[0], out[1], out[2]))
    return tuple(found)


def _coefficient(p: fmpq_mpoly, axis: int) -> fmpq:
    return p[tuple(int(n == axis) for n in range(6))]


def _plane(part: Part) -> tuple[fmpq, fmpq, fmpq] | None:
    """a, b, c with Z = a X + b Y + c on a conic, if it is plane: R = (a X + b Y + c) dP/dY modulo the part."""
    x, y = part.polynomial.context().gens()
    slope = part.projection.plane.derivative(1)
    p = part.polynomial
    columns = [divmod(g * slope, p)[1] for g in (x, y, x * 0 + 1)]
    target = divmod(part.projection.height, p)[1]
    keys = sorted({m for q in (*columns, target) for m in q.to_dict()})
    matrix = fmpq_mat([[q.to_dict().get(m, fmpq(0)) for q in (*columns, target)] for m in keys])
    reduced, rank = matrix.rref()
    if rank != 3 or any(reduced[r, r] != 1 for r in range(3)):
        return None
    return reduced[0, 3], reduced[1, 3], reduced[2, 3]


def _conic_in_plane(section: fmpq_mpoly, first: int, second: int) -> list[Pair]:
    """Completed squares: C (v - v0 + B (u - u0) / 2C)^2 + (A - B^2 / 4C) (u - u0)^2 = F; two lines for F = 0."""
    powers = ((2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0))
    keys = [tuple(i if n == first else j if n == second else 0 for n in range(6)) for i, j in powers]
    a, b, c, d, e, f = (_rational(section[key]) for key in keys)
    if c == 0 and a == 0:
        return []
    if c == 0:
        return [(v, u) for u, v in _conic_in_plane(section, second, first)]
    rest = a - b**2 / (4 * c)
    if rest == 0:
        return _parabola(a, b, c, d, e, f)
    u0, v0 = sympy.Matrix([[2 * a, b], [b, 2 * c]]).LUsolve(sympy.Matrix([-d, -e]))
    level = -(f + (d * u0 + e * v0) / 2)
    p, q = level / rest, level / c
    if level == 0 and rest / c < 0:
        return [(u0 + t, sympy.expand(v0 + (sign * sympy.sqrt(-rest / c) - b / (2 * c)) * t)) for sign in (1, -1)]
    if p <= 0 and q <= 0:
        return []
    if p > 0 and q > 0:
        u, v = sympy.sqrt(p) * sympy.cos(t), sympy.sqrt(q) * sympy.sin(t)
    elif p > 0:
        u, v = sympy.sqrt(p) / sympy.cos(t), sympy.sqrt(-q) * sympy.tan(t)
    else:
        u, v = sympy.sqrt(-p) * sympy.tan(t), sympy.sqrt(q) / sympy.cos(t)
    return [(u0 + u, sympy.expand(v0 + v - b / (2 * c) * u))]


def _parabola(
    a: sympy.Rational, b: sympy.Rational, c: sympy.Rational, d: sympy.Rational, e: sympy.Rational, f: sympy.Rational
) -> list[Pair]:
    """C (Y + B X / 2C)^2 + D X + E Y + F = 0 by t = Y + B X / 2C; where that holds no X besides, two parallel lines."""
    slope = b / (2 * c)
    if d == e * slope:
        inside = e**2 - 4 * c * f
        signs = (1, -1) if inside > 0 else ()
        return [(t, (-e + sign * sympy.sqrt(inside)) / (2 * c) - slope * t) for sign in signs]
    x = -(c * t**2 + e * t + f) / (d - e * slope)
    return [(x, t - slope * x)]
