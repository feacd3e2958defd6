"""Implicitization: f(x(u, v), y(u, v), z(u, v)) = 0, f irreducible, of the degree that was counted."""

import random
from fractions import Fraction

import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, cos, pi, sin, sqrt, tan

from implicit import Surface, implicitize
from implicit.language.trees import x, y, z
from tests.rational import OTHERS, QUADRICS, bezier, random_net, u, v


def assert_identity(surface, coordinates, parameters=(u, v), by_expansion=False):
    """f vanishes on the surface: expanded symbolically, or exactly at random rational parameters."""
    if by_expansion:
        substituted = surface.expression.subs(dict(zip((x, y, z), coordinates, strict=True)), simultaneous=True)
        assert sympy.expand(sympy.numer(sympy.together(substituted))) == 0
        return
    r = random.Random(4)
    for _ in range(5):
        values = {p: sympy.Rational(r.randint(-50, 50), r.randint(1, 50)) for p in parameters}
        point = [sympy.sympify(c).subs(values) for c in coordinates]
        if not all(c.is_finite for c in point):
            continue
        if all(c.is_Rational for c in point) and surface.polynomial.field is None:
            exact = [Fraction(int(c.p), int(c.q)) for c in point]
            assert evaluate(surface.polynomial, exact) == 0
        else:
            digits = [c.evalf(120) for c in point]
            terms = surface.polynomial.to_sympy().as_coefficients_dict(x, y, z)
            parts = [c.evalf(120) * m.subs(dict(zip((x, y, z), digits, strict=True))) for m, c in terms.items()]
            assert abs(sum(parts)) <= 1e-80 * sum(map(abs, parts))


def evaluate(polynomial, point):
    """The value at a rational point, by plain fractions."""
    return sum(c[0] * point[0] ** i * point[1] ** j * point[2] ** k for (i, j, k), c in polynomial.terms.items())


def assert_right(surface, coordinates, degree, map_degree=1, by_expansion=False):
    certificate = surface.certificate
    assert (surface.degree, certificate.degree, certificate.map_degree) == (degree, degree, map_degree)
    assert certificate.proof == "exact"
    assert certificate.residual == certificate.chance == 0
    assert_identity(surface, coordinates, by_expansion=by_expansion)
    if degree < 10 and surface.polynomial.field is None:
        factors = surface.polynomial.factors()
        assert len(factors) == 1
        assert factors[0][1] == 1


@pytest.mark.parametrize("name", QUADRICS)
def test_quadrics_satisfy_their_equation(name):
    surface = implicitize(QUADRICS[name], (u, v))
    assert_right(surface, QUADRICS[name], 1 if name == "plane" else 2, surface.certificate.map_degree)


@pytest.mark.parametrize("name", OTHERS)
def test_classical_surfaces_have_their_degree(name):
    coordinates, degree, map_degree = OTHERS[name]
    assert_right(implicitize(coordinates, (u, v)), coordinates, degree, map_degree)


def test_sphere_and_torus_are_negative_inside_whatever_the_orientation():
    for order in ((u, v), (v, u)):
        for coordinates in (QUADRICS["sphere"], OTHERS["torus"][0], QUADRICS["cylinder"]):
            surface = implicitize(coordinates, order)
            inside = (2, 0, 0) if surface.degree == 4 else (0, 0, 0)
            assert surface(inside) < 0 < surface((9, 9, 9))


def test_gradient_follows_the_normal_where_nothing_is_inside():
    coordinates = (u, v, u * v)
    ahead, behind = implicitize(coordinates, (u, v)), implicitize(coordinates, (v, u))
    assert ahead.gradient((0, 0, 0))[2] > 0 > behind.gradient((0, 0, 0))[2]


def test_known_equations():
    assert implicitize(QUADRICS["sphere"], (u, v)) == Surface("x^2 + y^2 + z^2 - 1")
    assert implicitize((u * v, u, v**2), (u, v)).polynomial in (
        Surface("x^2 - y^2 z").polynomial,
        Surface("y^2 z - x^2").polynomial,
    )


def test_identity_expanded_symbolically():
    for name in ("hyperbolic paraboloid", "sphere, stereographic", "plane"):
        assert_identity(implicitize(QUADRICS[name], (u, v)), QUADRICS[name], by_expansion=True)
    enneper = OTHERS["Enneper"][0]
    assert_identity(implicitize(enneper, (u, v)), enneper, by_expansion=True)


def test_sphere_is_covered_twice_by_longitude_and_latitude():
    assert implicitize(QUADRICS["sphere"], (u, v)).certificate.map_degree == 2
    assert implicitize(QUADRICS["sphere, stereographic"], (u, v)).certificate.map_degree == 1


def test_base_points_are_counted():
    points = [(0, 0), (1, 0), (0, 1), (2, 3), (-1, 5), (3, -2)]
    monomials = [u**i * v**j for i in range(4) for j in range(4 - i)]
    rows = sympy.Matrix([[m.subs({u: a, v: b}) for m in monomials] for a, b in points])
    cubics = [sum(c * m for c, m in zip(column, monomials, strict=True)) for column in rows.nullspace()]
    coordinates = tuple(c / cubics[3] for c in cubics[:3])
    surface = implicitize(coordinates, (u, v))
    assert surface.certificate.base_points == 6
    assert_right(surface, coordinates, 3)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([(1, 1, 2), (1, 2, 4), (1, 3, 6), (2, 2, 8)]))
def test_random_integer_nets_have_degree_2mn(seed, shape):
    m, n, degree = shape
    coordinates = bezier(random_net(m, n, seed, size=30))
    assert_right(implicitize(coordinates, (u, v)), coordinates, degree)


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10**6))
def test_rational_nets(seed):
    r = random.Random(seed)
    net, weight = random_net(1, 2, seed), bezier([[(r.randint(1, 9), 0, 0) for _ in range(3)] for _ in range(2)])[0]
    coordinates = tuple(c / weight for c in bezier(net))
    assert_right(implicitize(coordinates, (u, v)), coordinates, 4)


def test_generic_bicubic_patch_is_proved_exactly():
    coordinates = bezier(random_net(3, 3, 4))
    surface = implicitize(coordinates, (u, v))
    assert len(surface.polynomial.terms) == 1330
    assert_right(surface, coordinates, 18)


def test_number_fields():
    for coordinates, degree in (
        ((sqrt(2) * u, v, u * v), 2),
        ((cos(u + pi / 4), 2 * sin(u), v), 2),
        ((sqrt(2) * u + sqrt(3) * v, u * v, u**2), 3),
        ((u + sympy.cbrt(2) * v, u * v, u**2), 3),
        ((u / sqrt(1 + sqrt(5)), v, u**2 - v**2), 2),
    ):
        surface = implicitize(coordinates, (u, v))
        assert surface.polynomial.field is not None
        assert_right(surface, coordinates, degree)


def test_boy_surface_over_the_field_of_sqrt_2():
    den = 2 - sqrt(2) * sin(3 * u) * sin(2 * v)
    coordinates = (
        (sqrt(2) * cos(2 * u) * cos(v) ** 2 + cos(u) * sin(2 * v)) / den,
        (sqrt(2) * sin(2 * u) * cos(v) ** 2 - sin(u) * sin(2 * v)) / den,
        3 * cos(v) ** 2 / den,
    )
    surface = implicitize(coordinates, (u, v))
    assert_right(surface, coordinates, 6, surface.certificate.map_degree)


def test_common_factors_are_cancelled():
    expected = implicitize((u, v, u * v), (u, v))
    factor = (u**2 + v + 1) / (v + 7)
    assert implicitize((u * factor / factor, v, u * v), (u, v)) == expected
    hidden = [sympy.Mul(c, u**2 + 1, 1 / (u**2 + 1), evaluate=False) for c in (u, v, u * v)]
    assert implicitize(hidden, (u, v)) == expected
    root = (u**2 - 2) / (u - sqrt(2))
    assert implicitize([sympy.Mul(c, root, 1 / root, evaluate=False) for c in (u, v, u * v)], (u, v)) == expected


def test_integer_multiples_of_angles_share_one_unit():
    expected = implicitize((cos(u), sin(u), v), (u, v))
    assert implicitize((cos(3 * u), sin(3 * u), v), (u, v)) == expected
    assert implicitize((cos(2 * pi * u), sin(2 * pi * u), v), (u, v)) == expected
    assert implicitize((cos(Rational(2, 3) * u), sin(-Rational(2, 3) * u), v), (u, v)) == expected
    assert implicitize((1 / cos(u), tan(u), v), (u, v)).degree == 2
    assert implicitize((2**u, 4**u * v, v), (u, v)).degree == 3
