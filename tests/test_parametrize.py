"""The way back: a parametrization of an implicit surface, whose implicitization is the surface again."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import NotPolynomialError, Surface, implicitize, parametrize, x, y, z

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
