"""The way back: a parametrization of an implicit surface, whose implicitization is the surface again."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import NotPolynomialError, Surface, implicitize, parametrize, x, y, z
from implicit.parametrize.chart import make_chart, u, v, verify

QUADRICS = {
    "ellipsoid": "x^2/4 + y^2/9 + z^2 = 1",
    "hyperboloid of one sheet": "x^2 + y^2/4 - z^2 = 1",
    "hyperboloid of two sheets": "x^2 + y^2 - z^2 = -1",
    "cone": "x^2 + 4 y^2 = z^2",
    "elliptic paraboloid": "z = x^2 + 2 y^2",
    "hyperbolic paraboloid": "z = x^2 - y^2",
    "elliptic cylinder": "x^2 + 4 y^2 = 9",
    "hyperbolic cylinder": "x^2 - y^2 = 1",
    "parabolic cylinder": "z = x^2",
    "plane": "x + 2 y - 3 z = 4",
}
OTHERS = {
    "torus": "(x^2 + y^2 + z^2 + 3)^2 = 16 (x^2 + y^2)",
    "torus along x": "((x - 1)^2 + y^2 + z^2 + 3)^2 = 16 (y^2 + z^2)",
    "Dupin cyclide": "(x^2 + y^2 + z^2 + 16 - 16)^2 - 4 (5 x - 12)^2 - 64 y^2",
    "surface of revolution": "x^2 + y^2 = z^2 (1 - z)^2",
    "monoid": "x^3 + y^3 + z^3 + x y z - x y",
}


def same_surface(chart, surface):
    back = implicitize(chart.coordinates, chart.parameters).polynomial
    factors = surface.polynomial.factors()
    assert len(factors) == 1
    ratio = {c[0] / surface.polynomial.terms[m][0] for m, c in back.terms.items()}
    assert len(ratio) == 1
    assert back.terms.keys() == surface.polynomial.terms.keys()


def assert_on(chart, surface):
    """f = 0 at points of the chart."""
    (u0, u1), (v0, v1) = chart.domain
    a, b = np.random.default_rng(0).random((2, 50))
    function = sympy.lambdify(chart.parameters, chart.coordinates, "numpy")
    points = np.stack(np.broadcast_arrays(*function(u0 + (u1 - u0) * a, v0 + (v1 - v0) * b)), axis=1)
    points = points[np.isfinite(points).all(axis=1)]
    size = np.abs(points).max() ** surface.degree + 1
    assert len(points) > 40
    assert np.abs(surface(points)).max() < 1e-10 * size * np.abs(surface.polynomial.coefficients).sum()


@pytest.mark.parametrize("kind", QUADRICS)
def test_quadrics_of_all_types(kind):
    surface = Surface(QUADRICS[kind])
    chart = parametrize(surface)
    assert chart.kind == kind
    assert_on(chart, surface)
    same_surface(chart, surface)


@pytest.mark.parametrize("name", OTHERS)
def test_cyclides_revolutions_and_monoids(name):
    surface = Surface(OTHERS[name])
    chart = parametrize(surface)
    assert name.startswith(chart.kind)
    assert_on(chart, surface)
    same_surface(chart, surface)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(sorted(set(QUADRICS) - {"plane"})))
def test_quadrics_in_any_position(seed, kind):
    random = np.random.default_rng(seed)
    matrix = sympy.Matrix(random.integers(-2, 3, (3, 3)))
    if matrix.det() == 0:
        matrix += 7 * sympy.eye(3)
    moved = matrix * sympy.Matrix([x, y, z]) + sympy.Matrix(random.integers(-3, 4, 3))
    expression = Surface(QUADRICS[kind]).expression.subs(dict(zip((x, y, z), moved, strict=True)), simultaneous=True)
    chart = parametrize(Surface(expression))
    assert chart.kind == kind
    assert_on(chart, Surface(expression))


def test_torus_and_revolution_about_a_tilted_axis():
    w = (x + 2 * y + 2 * z) / 3
    norm = x**2 + y**2 + z**2
    torus = Surface((norm + 3) ** 2 - 16 * (norm - w**2))
    chart = parametrize(torus)
    assert chart.kind == "torus"
    assert_on(chart, torus)
    bottle = Surface(sympy.expand(norm - w**2 - (w**2 + 1) ** 2))
    chart = parametrize(bottle)
    assert chart.kind == "surface of revolution"
    assert_on(chart, bottle)


def test_cyclides_of_all_kinds_are_recovered():
    for a, b, c, m in ((5, 4, 3, 4), (5, 3, 4, 2), (5, 4, 3, 6), (5, 4, 3, 3)):  # ring, horned, spindle, limit
        norm = x**2 + (y - 1) ** 2 + z**2
        expression = (norm + b**2 - m**2) ** 2 - 4 * (a * z - c * m) ** 2 - 4 * b**2 * x**2
        chart = parametrize(Surface(expression))
        assert chart.kind == "Dupin cyclide"
        assert_on(chart, Surface(expression))


def test_monoids():
    cubic = Surface("x y z + x^2 (x - y + 2 z) + x y + y z + z^2")
    chart = parametrize(cubic)
    assert chart.kind == "monoid"
    same_surface(chart, cubic)
    cayley = Surface("4 (x^2 + y^2 + z^2) + 16 x y z = 1")
    assert_on(parametrize(cayley), cayley)
    quartic = Surface("(x - 1)^4 + y^4 + z^4 + (x - 1) y z")
    assert_on(parametrize(quartic), quartic)


def assert_parametrizes(chart, surface):
    """f o S = 0, exactly, and the derivatives of S are independent, at places of small rational parameters."""
    jacobian = sympy.Matrix(chart.coordinates).jacobian(chart.parameters)
    for a, b in ((2, 3), (-3, 5), (4, -7)):
        place = dict(zip(chart.parameters, (sympy.Rational(a, 5), sympy.Rational(b, 11)), strict=True))
        point = dict(zip((x, y, z), (c.subs(place) for c in chart.coordinates), strict=True))
        assert sympy.expand(surface.expression.subs(point)) == 0
        assert jacobian.subs(place).rank() == 2


def affine_image(expression, seed):
    """The expression in random affine coordinates with rational coefficients."""
    random = np.random.default_rng(seed)
    matrix = sympy.Matrix(random.integers(-2, 3, (3, 3))) / int(random.integers(1, 4))
    if matrix.det() == 0:
        matrix += 7 * sympy.eye(3)
    moved = matrix * sympy.Matrix([x, y, z]) + sympy.Matrix(random.integers(-3, 4, 3)) / int(random.integers(1, 4))
    return sympy.expand(expression.subs(dict(zip((x, y, z), moved, strict=True)), simultaneous=True))


COEFFICIENTS = st.integers(-3, 3)


@settings(max_examples=12, deadline=None)
@given(
    st.dictionaries(st.tuples(st.integers(0, 3), st.integers(0, 3)), COEFFICIENTS, max_size=5), st.integers(0, 10**6)
)
def test_graphs_of_polynomials_are_monoids_in_any_position(terms, seed):
    """z = p(x, y) has a point of multiplicity d - 1 at infinity."""
    graph = z - x**3 - sum(c * x**i * y**j for (i, j), c in terms.items() if i + j <= 4)
    for expression in (graph, affine_image(graph, seed)):
        chart = parametrize(Surface(expression))
        assert_parametrizes(chart, Surface(expression))


@settings(max_examples=4, deadline=None)
@given(st.integers(3, 4), st.integers(0, 10**6))
def test_monoids_whose_vertices_fill_a_line(degree, seed):
    """x^d = y^(d - 1) z has multiplicity d - 1 along x = y = 0, but d at the origin."""
    cone = x**degree - y ** (degree - 1) * z
    for expression in (cone, affine_image(cone, seed)):
        chart = parametrize(Surface(expression))
        assert chart.kind == "monoid"
        assert_parametrizes(chart, Surface(expression))


@pytest.mark.parametrize("text", ["x^3 = y^2 z", "z = x^3 - 3x y^2", "z = x^4 + y", "x^2 y = z", "x y z = 1"])
def test_monoids_with_vertices_at_infinity_or_on_a_line(text):
    chart = parametrize(Surface(text))
    assert chart.kind == "monoid"
    assert_parametrizes(chart, Surface(text))
    same_surface(chart, Surface(text))


def test_a_vertex_at_infinity_in_an_irrational_direction():
    """f = w^3 + s, where s changes along (1, 0, sqrt(2)) and w does not."""
    surface = Surface(sympy.expand((z - sympy.sqrt(2) * x) ** 3 + y**3 + x))
    assert_parametrizes(parametrize(surface), surface)


def test_charts_are_verified():
    sphere = Surface("x^2 + y^2 + z^2 = 1").polynomial
    for wrong in ((u, v, u * v), (sympy.cos(u), sympy.sin(u), v), (1, 0, 0), (sympy.cos(u + v), sympy.sin(u + v), 0)):
        with pytest.raises(ArithmeticError, match="does not satisfy"):
            verify(sphere, make_chart(wrong, ((0, 1), (0, 1)), "sphere"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x^2 + y^2 + z^2 + 1", "no real point"),
        ("x^2 + y^2 + z^2", "one real point"),
        ("x^2 + y^2", "one real line"),
        ("x^2 - 2 y^2", "pair of planes"),
        ("x y (z - 1)", r"components .*parametrize each"),
        ("x^4 + y^4 + z^4 - 1", "degree 4 is known here"),
        ("x^3 + y^3 + z^3 - 1", "degree 3 is known here"),
    ],
)
def test_what_has_no_parametrization_here(text, message):
    with pytest.raises(ValueError, match=message):
        parametrize(Surface(text))


def test_formulas_that_are_no_polynomials():
    with pytest.raises(NotPolynomialError, match="polynomial with algebraic coefficients"):
        parametrize(Surface("sin(x) + y - z"))
