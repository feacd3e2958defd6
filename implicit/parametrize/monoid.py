"""Monoids: a surface of degree d with a point of multiplicity d - 1 meets each line through it in one more point.

Where that point, the vertex, is at infinity the lines are parallel, and f is of degree 1 along them, as for graphs.
"""

from collections.abc import Iterator, Sequence
from itertools import product

import sympy

from implicit.language.trees import x, y, z
from implicit.parametrize.chart import Chart, make_chart, u, v

_DOMAIN = ((-1.0, 1.0), (-1.0, 1.0))
_SAMPLES = (0, 1, -1, 2, -2)
"""Where vertices fill a line, at most one point of it is of multiplicity d and no vertex."""


def parametrize_monoid(expression: sympy.Expr) -> Chart | None:
    """The chart of a monoid, from its vertex along the lines (u, v, 1), or along parallels; None if none is found."""
    for vertex in vertices(expression, (x, y, z)):
        forms = _forms(expression, (x, y, z), vertex)
        if forms is None:
            continue
        direction = _direction(forms, (x, y, z))
        if direction is None:
            continue
        along, (g, h) = direction
        coordinates = [c - w * g / h for c, w in zip(vertex, along, strict=True)]
        return make_chart([sympy.together(c) for c in coordinates], _DOMAIN, "monoid")
    charts = (_along_parallels(expression, direction) for direction in directions(expression))
    return next((chart for chart in charts if chart is not None), None)


def directions(expression: sympy.Expr) -> Iterator[tuple[sympy.Expr, ...]]:
    """Real directions w with (w . grad)^2 f = 0: vertices at infinity, those with rational coordinates first."""
    (a, b), one, zero = sympy.symbols("a b", real=True), sympy.Integer(1), sympy.Integer(0)
    form = sympy.hessian(expression, (x, y, z))
    found: list[tuple[sympy.Expr, ...]] = []
    for direction, names in (((a, b, one), (a, b)), ((a, one, zero), (a,)), ((one, zero, zero), ())):
        w = sympy.Matrix(direction)
        bend = sympy.Poly(sympy.expand((w.T * form * w)[0]), x, y, z)
        system = [c for c in (sympy.expand(c) for c in bend.coeffs()) if c != 0]
        if not system:
            found += _samples({}, direction)
        elif not any(not c.free_symbols for c in system):
            for solution in sympy.solve(sorted(system, key=sympy.count_ops), names, dict=True):
                found += _samples(solution, direction)
    yield from _rational_first(found)


def _along_parallels(expression: sympy.Expr, direction: Sequence[sympy.Expr]) -> Chart | None:
    """The chart p + s w with p in a plane of two axes, where f = level + s slope; None where the slope is 0."""
    s = sympy.Dummy("s", real=True)
    lead = next(k for k in reversed(range(3)) if direction[k] != 0)
    start: list[sympy.Expr] = [u, v]
    start.insert(lead, sympy.Integer(0))
    line = {name: p + s * w for name, p, w in zip((x, y, z), start, direction, strict=True)}
    powers = sympy.Poly(sympy.expand(expression.subs(line, simultaneous=True)), s)
    slope, level = (sympy.simplify(powers.coeff_monomial(m)) for m in (s, 1))
    if slope == 0:
        return None
    coordinates = [sympy.together(p - w * level / slope) for p, w in zip(start, direction, strict=True)]
    return make_chart(coordinates, _DOMAIN, "monoid")


def vertices(expression: sympy.Expr, names: Sequence[sympy.Symbol]) -> Iterator[tuple[sympy.Expr, ...]]:
    """Real points where all derivatives up to order d - 2 vanish, those with rational coordinates first."""
    degree = sympy.Poly(expression, *names).total_degree()
    if degree < 2:
        return
    system = [
        expression.diff(*((s, n) for s, n in zip(names, orders, strict=True)))
        for orders in product(range(degree - 1), repeat=len(names))
        if sum(orders) <= degree - 2
    ]
    system = [e for e in (sympy.expand(e) for e in system) if e != 0]
    if any(not e.free_symbols for e in system):
        return
    found: list[tuple[sympy.Expr, ...]] = []
    for solution in sympy.solve(sorted(_radical(system, names), key=sympy.count_ops), names, dict=True):
        found += _samples(solution, names)
    yield from _rational_first(found)


def _radical(system: list[sympy.Expr], names: Sequence[sympy.Symbol]) -> list[sympy.Expr]:
    """Equations over Q without powers in their basis, which makes those of a line linear; others as they are."""
    if not all(c.is_Rational for e in system for c in sympy.Poly(e, *names).coeffs()):
        return system
    while True:
        basis = list(sympy.groebner(system, *names, order="lex").exprs)
        system = [sympy.sqf_part(e, *names) if e.free_symbols else e for e in basis]
        if system == basis:
            return basis


def _samples(solution: dict[sympy.Symbol, sympy.Expr], point: Sequence[sympy.Expr]) -> list[tuple[sympy.Expr, ...]]:
    """Real values of a point whose coordinates a solution gives; names that are left over take some small values."""
    point = [sympy.expand(c.subs(solution)) for c in point]
    free = sorted(set().union(*(c.free_symbols for c in point)), key=str)
    found = []
    for values in product(_SAMPLES, repeat=len(free)):
        place = tuple(sympy.simplify(c.subs(dict(zip(free, values, strict=True)))) for c in point)
        if all(c.is_real for c in place):
            found.append(place)
    return found


def _rational_first(points: list[tuple[sympy.Expr, ...]]) -> list[tuple[sympy.Expr, ...]]:
    return sorted(dict.fromkeys(points), key=lambda p: (not all(c.is_Rational for c in p), sympy.count_ops(p)))


def _forms(
    expression: sympy.Expr, names: Sequence[sympy.Symbol], vertex: Sequence[sympy.Expr]
) -> tuple[sympy.Expr, sympy.Expr] | None:
    """The homogeneous parts g of degree d - 1 and h of degree d about the vertex; None if there are others."""
    shift = {s: s + c for s, c in zip(names, vertex, strict=True)}
    polynomial = sympy.Poly(sympy.expand(expression.subs(shift, simultaneous=True)), *names)
    degree = polynomial.total_degree()
    parts = {degree: sympy.Integer(0), degree - 1: sympy.Integer(0)}
    for monomial, c in polynomial.terms():
        c = sympy.simplify(c)
        if c != 0:
            if sum(monomial) not in parts:
                return None
            parts[sum(monomial)] += c * sympy.prod(s**n for s, n in zip(names, monomial, strict=True))
    return parts[degree - 1], parts[degree]


def _direction(
    forms: tuple[sympy.Expr, sympy.Expr], names: Sequence[sympy.Symbol]
) -> tuple[Sequence[sympy.Expr], tuple[sympy.Expr, sympy.Expr]] | None:
    """Directions (u, v, 1) in some order of the axes, with g and h there; h must not vanish on all of them."""
    one = sympy.Integer(1)
    choices = ([u, v, one], [u, one, v], [one, u, v]) if len(names) == 3 else ([v, one], [one, v])
    best = None
    for along in choices:
        g, h = (sympy.factor(f.subs(dict(zip(names, along, strict=True)), simultaneous=True)) for f in forms)
        if g != 0 and h != 0 and (best is None or sympy.count_ops(g / h) < sympy.count_ops(best[1][0] / best[1][1])):
            best = along, (g, h)
    return best


def rational_curve(expression: sympy.Expr, names: tuple[sympy.Symbol, sympy.Symbol]) -> list[sympy.Expr] | None:
    """A plane curve in the parameter v: lines, graphs, conics with a rational point found, curves with a vertex."""
    polynomial = sympy.Poly(expression, *names)
    for k in (0, 1):
        if polynomial.degree(names[k]) == 1:
            slope = expression.coeff(names[k], 1)
            rest = sympy.expand(expression - slope * names[k])
            solved = (-rest / slope).subs(names[1 - k], v)
            return [solved, v] if k == 0 else [v, solved]
    points = vertices(expression, names) if polynomial.total_degree() > 2 else _points_on_conic(expression, names)
    for vertex in points:
        forms = _forms(expression, names, vertex)
        direction = _direction(forms, names) if forms is not None else None
        if direction is not None:
            along, (g, h) = direction
            return [sympy.together(c - w * g / h) for c, w in zip(vertex, along, strict=True)]
    return None


def _points_on_conic(
    expression: sympy.Expr, names: tuple[sympy.Symbol, sympy.Symbol]
) -> Iterator[tuple[sympy.Expr, ...]]:
    """Real points of a conic on simple lines, and on the line through its center."""
    slopes = [expression.diff(s) for s in names]
    centers = sympy.solve(slopes, names, dict=True)
    levels: list[sympy.Expr] = [sympy.Integer(n) for n in (0, 1, -1, 2, -2)]
    for k in (0, 1):
        for level in [c[names[k]] for c in centers if names[k] in c] + levels:
            for other in sympy.solve(expression.subs(names[k], level), names[1 - k]):
                if other.is_real and not other.free_symbols:
                    yield (level, other) if k == 0 else (other, level)
