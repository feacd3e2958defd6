"""Monoids: a surface of degree d with a point of multiplicity d - 1 meets each line through it in one more point."""

from collections.abc import Iterator, Sequence
from itertools import product

import sympy

from implicit.language.trees import x, y, z
from implicit.parametrize.chart import Chart, make_chart, u, v


def parametrize_monoid(expression: sympy.Expr) -> Chart | None:
    """The chart of a monoid, from its vertex along the lines (u, v, 1); None if no such point is found."""
    for vertex in vertices(expression, (x, y, z)):
        forms = _forms(expression, (x, y, z), vertex)
        if forms is None:
            continue
        direction = _direction(forms, (x, y, z))
        if direction is None:
            continue
        along, (g, h) = direction
        coordinates = [c - w * g / h for c, w in zip(vertex, along, strict=True)]
        return make_chart([sympy.together(c) for c in coordinates], ((-1.0, 1.0), (-1.0, 1.0)), "monoid")
    return None


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
    found = []
    for solution in sympy.solve(sorted(system, key=sympy.count_ops), names, dict=True):
        point = [sympy.expand(solution.get(s, s)) for s in names]
        point = [sympy.simplify(c.subs(dict.fromkeys(names, 0))) for c in point]
        if all(c.is_real for c in point):
            found.append(tuple(point))
    yield from sorted(dict.fromkeys(found), key=lambda p: (not all(c.is_Rational for c in p), sympy.count_ops(p)))


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
