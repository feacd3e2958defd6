"""Implicitization: f(x(u, v), y(u, v), z(u, v)) = 0, f irreducible, of the degree that was counted."""

import random
import time
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, cos, cosh, exp, pi, sin, sinh, sqrt, symbols, tan

from implicit import (
    NotASurfaceError,
    NotPolynomialError,
    Surface,
    TimeLimitError,
    TranscendentalError,
    implicitize,
    matrix_form,
)
from implicit.implicitize.clock import Clock
from implicit.implicitize.degree import count
from implicit.implicitize.eliminate import Implicit, lift, null_space_image
from implicit.implicitize.homogeneous import read_coordinates, simplest
from implicit.implicitize.modular import Remainders, split_primes
from implicit.implicitize.planes import minors_image, square_image
from implicit.implicitize.proof import prove_identity, prove_irreducible
from implicit.implicitize.solve import _prove
from implicit.trees import x, y, z

u, v = symbols("u v", real=True)

HALF = (1 - u**2) / (1 + u**2), 2 * u / (1 + u**2)
HALF_V = (1 - v**2) / (1 + v**2), 2 * v / (1 + v**2)
N = 1 + u**2 + v**2

QUADRICS = {
    "sphere": (cos(u) * cos(v), sin(u) * cos(v), sin(v)),
    "sphere, stereographic": (2 * u / N, 2 * v / N, (u**2 + v**2 - 1) / N),
    "ellipsoid": (2 * HALF[0] * HALF_V[0], 3 * HALF[1] * HALF_V[0], 5 * HALF_V[1]),
    "cone": (v * cos(u), v * sin(u), v),
    "cylinder": (cos(u), sin(u), v),
    "elliptic cylinder at an angle": (2 * cos(u) + v, sin(u) - v, v),
    "hyperboloid of one sheet": (HALF[0] - v * HALF[1], HALF[1] + v * HALF[0], v),
    "hyperboloid of two sheets": (sinh(v) * cos(u), sinh(v) * sin(u), cosh(v)),
    "elliptic paraboloid": (v * cos(u), 2 * v * sin(u), v**2),
    "hyperbolic paraboloid": (u, v, u * v),
    "parabolic cylinder": (u, u**2, v),
    "hyperbolic cylinder": (cosh(u), sinh(u), v),
    "plane": (u, v, 2 * u - 3 * v + 1),
}
DEN = 5 - 3 * cos(u) * cos(v)
OTHERS = {
    "torus": (((2 + cos(v)) * cos(u), (2 + cos(v)) * sin(u), sin(v)), 4, 1),
    "horn torus": (((1 + cos(v)) * cos(u), (1 + cos(v)) * sin(u), sin(v)), 4, 1),
    "spindle torus": (((1 + 2 * cos(v)) * cos(u), (1 + 2 * cos(v)) * sin(u), 2 * sin(v)), 4, 1),
    "ring cyclide": (
        ((4 * (3 - 5 * cos(u) * cos(v)) + 16 * cos(u)) / DEN, 4 * sin(u) * (5 - 4 * cos(v)) / DEN,
         4 * sin(v) * (3 * cos(u) - 4) / DEN), 4, 1),
    "Steiner": ((2 * v / N, 2 * u / N, 2 * u * v / N), 4, 1),
    "cross-cap": ((2 * u * v / N, 2 * u / N, (1 - v**2) / N), 4, 1),
    "Whitney umbrella": ((u * v, u, v**2), 3, 1),
    "Enneper": ((u - u**3 / 3 + u * v**2, v - v**3 / 3 + v * u**2, u**2 - v**2), 9, 1),
    "Moebius strip": (((1 + v * cos(u / 2)) * cos(u), (1 + v * cos(u / 2)) * sin(u), v * sin(u / 2)), 3, 2),
    "monkey saddle": ((u, v, u**3 - 3 * u * v**2), 3, 1),
}  # fmt: skip


def bezier(points):
    """Expressions of a Bezier patch with control points [i][j]."""
    m, n = len(points) - 1, len(points[0]) - 1
    blend_u = [sympy.binomial(m, i) * u**i * (1 - u) ** (m - i) for i in range(m + 1)]
    blend_v = [sympy.binomial(n, j) * v**j * (1 - v) ** (n - j) for j in range(n + 1)]
    pairs = [(i, j) for i in range(m + 1) for j in range(n + 1)]
    return tuple(sum(sympy.Rational(points[i][j][k]) * blend_u[i] * blend_v[j] for i, j in pairs) for k in range(3))


def random_net(m, n, seed, size=9):
    r = random.Random(seed)
    return [[tuple(r.randint(-size, size) for _ in range(3)) for _ in range(n + 1)] for _ in range(m + 1)]


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


def test_floats_are_exact_binary_fractions_or_simple_ones():
    exact = implicitize((0.1 * u, v, u * v), (u, v))
    assert exact.polynomial.terms[0, 0, 1][0] / exact.polynomial.terms[1, 1, 0][0] == -Fraction(0.1)
    assert implicitize((0.1 * u, v, u * v), (u, v), rationalize=1e-9) == implicitize((u / 10, v, u * v), (u, v))


@given(st.fractions(), st.fractions(min_value=Fraction(1, 10**9), max_value=1))
def test_simplest_fraction_in_an_interval(middle, radius):
    found = simplest(middle - radius, middle + radius)
    assert abs(found - middle) <= radius
    for denominator in range(1, min(found.denominator, 200)):
        below = (middle + radius) * denominator // 1
        assert below < (middle - radius) * denominator


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(-(10**30), 10**30), min_size=2, max_size=6).filter(any), st.integers(1, 10**20))
def test_fractions_come_back_from_remainders(numbers, denominator):
    remainders, stream, found = Remainders(), split_primes((0, 1)), None
    for _ in range(20):
        p, _ = next(stream)
        inverse = pow(denominator, -1, p)
        remainders.add([n * inverse % p for n in numbers], p)
        found = remainders.fractions()
    content = np.gcd.reduce(np.array(numbers, dtype=object))
    assert found == [n // content for n in numbers]


@pytest.mark.parametrize("coordinates", [(u, u**2, u**3), (u + v, (u + v) ** 2, 1), (cos(u), sin(u), 1)])
def test_a_curve_is_no_surface(coordinates):
    with pytest.raises(NotASurfaceError, match="curve"):
        implicitize(coordinates, (u, v))


def test_a_point_is_no_surface():
    with pytest.raises(NotASurfaceError, match="point"):
        implicitize((1, 2, 3), (u, v))


@pytest.mark.parametrize(
    ("coordinates", "message"),
    [
        ((u * cos(u), u * sin(u), v), "by itself"),
        ((cos(u), sin(sqrt(2) * u), v), "common unit"),
        ((cos(u), exp(u), v), "circular and in exponential"),
        ((sin(u * v), u, v), "no sum of multiples"),
        ((pi * u, v, u * v), "pi is no algebraic number"),
        ((sympy.log(u), v, u), "no rational function"),
        ((exp(u + 1), v, exp(2 * u) * v), "transcendental factor"),
    ],
)
def test_transcendental_coordinates(coordinates, message):
    with pytest.raises(TranscendentalError, match=message):
        implicitize(coordinates, (u, v))


def test_roots_of_parameters_are_refused():
    with pytest.raises(NotPolynomialError, match="substitution"):
        implicitize((sqrt(u), v, u * v), (u, v))


def test_zero_denominators():
    with pytest.raises(ValueError, match="coordinate y is not finite"):
        implicitize((u, sympy.zoo * v, v), (u, v))
    nothing = sympy.Add(u**2, -(u**2), evaluate=False)
    with pytest.raises(ValueError, match="denominator of coordinate z"):
        implicitize((u, v, sympy.Pow(nothing, -1, evaluate=False)), (u, v))


@pytest.mark.parametrize(
    ("coordinates", "parameters", "message"),
    [
        ((u, v), (u, v), "three coordinates"),
        ((u, v, u * v), (u, u), "two different"),
        ((u, v, u * v), ("u", "v"), "two different"),
        ((u, v, symbols("a") * u), (u, v), "contain a"),
    ],
)
def test_wrong_arguments(coordinates, parameters, message):
    with pytest.raises(ValueError, match=message):
        implicitize(coordinates, parameters)


def test_texts_are_refused():
    with pytest.raises(TypeError, match="text"):
        implicitize(("u", v, u * v), (u, v))


def test_high_degrees_are_estimated_first():
    coordinates = bezier(random_net(4, 4, 1))
    with pytest.raises(TimeLimitError, match=r"degree 32 and up to 6545 terms.*timeout"):
        implicitize(coordinates, (u, v))
    with pytest.raises(TimeLimitError, match="does not fit timeout=1"):
        implicitize(coordinates, (u, v), timeout=1)


def test_timeout_is_honoured():
    coordinates = bezier(random_net(3, 3, 6, size=10**9))
    start = time.monotonic()
    with pytest.raises(TimeoutError, match="no answer within timeout"):
        implicitize(coordinates, (u, v), timeout=0.3)
    assert time.monotonic() - start < 10


def test_without_time_for_the_proof_the_answer_is_modular():
    coordinates = read_coordinates(bezier(random_net(2, 2, 3)), (u, v))
    counted = count(coordinates)
    found = lift(coordinates, 8, square_image(8, Clock()), Clock())
    certificate = _prove(coordinates, counted, found, "moving planes", Clock(0.0))
    assert certificate.proof == "modular"
    assert 0 < certificate.chance < 1e-5
    assert _prove(coordinates, counted, found, "moving planes", Clock()).proof == "exact"


def test_the_proof_refuses_a_wrong_polynomial():
    coordinates = read_coordinates((u, v, u * v), (u, v))
    wrong = Implicit(2, {(1, 1, 0): (1,), (0, 0, 1): (-1,), (0, 0, 0): (2**31 - 1,)}, 1)
    assert not prove_identity(coordinates, wrong, Clock())
    square = Implicit(2, {(2, 0, 0): (1,), (0, 2, 0): (-1,)}, 1)
    assert not prove_irreducible(coordinates, square, Clock())
    product = Implicit(4, {(4, 0, 0): (1,), (0, 4, 0): (-1,), (0, 0, 1): (0,)}, 1)
    assert not prove_irreducible(coordinates, product, Clock(), attempts=40)


def test_three_methods_find_the_same_polynomial():
    for coordinates in (bezier(random_net(2, 2, 8)), OTHERS["torus"][0], OTHERS["Moebius strip"][0]):
        read = read_coordinates(coordinates, (u, v))
        counted = count(read)
        d, k = counted.degree, counted.map_degree
        images = [null_space_image(d), minors_image(d, k, Clock()), square_image(d, Clock())]
        found = [lift(read, d, image, Clock()) for image in images]
        assert (found[2] is None) == (d == 4 or k == 2)
        terms = [{m: Fraction(e[0], max(f.terms.items())[1][0]) for m, e in f.terms.items()} for f in found if f]
        assert all(t == terms[0] for t in terms)


def test_integer_multiples_of_angles_share_one_unit():
    expected = implicitize((cos(u), sin(u), v), (u, v))
    assert implicitize((cos(3 * u), sin(3 * u), v), (u, v)) == expected
    assert implicitize((cos(2 * pi * u), sin(2 * pi * u), v), (u, v)) == expected
    assert implicitize((cos(Rational(2, 3) * u), sin(-Rational(2, 3) * u), v), (u, v)) == expected
    assert implicitize((1 / cos(u), tan(u), v), (u, v)).degree == 2
    assert implicitize((2**u, 4**u * v, v), (u, v)).degree == 3


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 3), (3, 1), (2, 2), (3, 3)])
def test_matrix_form_inverts_contains_and_evaluates(m, n):
    coordinates = bezier(random_net(m, n, 4))
    form = matrix_form(coordinates, (u, v))
    parameters = np.random.default_rng(m).random((200, 2))
    points = np.stack(sympy.lambdify((u, v), coordinates)(*parameters.T), axis=1)
    assert form.degree == 2 * m * n
    assert form.planes.shape[1] == form.planes.shape[2] == 2 * m * n
    assert np.abs(form.invert(points) - parameters).max() < 1e-10
    assert form.contains(points, 1e-9).all()
    normals = np.random.default_rng(0).standard_normal(points.shape)
    assert not form.contains(points + 0.5 * normals, 1e-9).any()
    elsewhere = np.random.default_rng(1).uniform(-5, 5, (40, 3))
    matrices = np.einsum("nk,kij->nij", np.column_stack([elsewhere, np.ones(40)]), form.planes)
    assert np.allclose(form(elsewhere), np.linalg.det(matrices), rtol=1e-6)


def test_determinant_of_the_matrix_form_is_a_multiple_of_the_polynomial():
    coordinates = bezier(random_net(2, 2, 5))
    form, surface = matrix_form(coordinates, (u, v)), implicitize(coordinates, (u, v))
    points = np.random.default_rng(1).uniform(-9, 9, (50, 3))
    ratio = form(points) / surface(points)
    assert np.ptp(ratio) < 1e-9 * abs(ratio).max()


def test_matrix_form_with_base_points_and_angles():
    form = matrix_form(OTHERS["torus"][0], (u, v), ((-3, 3), (-3, 3)))
    assert form.invert((3, 0, 0)) == pytest.approx((0, 0), abs=1e-9)
    assert form.invert((0, 2, 1)) == pytest.approx((np.pi / 2, np.pi / 2), abs=1e-9)
    assert list(form.contains([(3, 0, 0), (2, 0, 0), (0, 0, 0)])) == [True, False, False]
    with pytest.raises(ValueError, match="8 x 12"):
        form((0, 0, 0))
    with pytest.raises(ValueError, match="shape"):
        form.contains((0, 0))


def test_matrix_form_separates_crossing_sheets():
    whitney = matrix_form((u * v, u, v**2), (u, v), ((-2, 2), (-2, 2)))
    both = [tuple(np.round(whitney.invert((0, 0, 1)), 6)), tuple(np.round(whitney.invert((0, 0, 2.25)), 6))]
    assert [(a, abs(b)) for a, b in both] == [(0, 1), (0, 1.5)]


def test_approximation_reports_its_distance():
    net = [[(i, j, ((i * j) % 3) / 4) for j in range(4)] for i in range(4)]
    coordinates = bezier(net)
    errors = []
    for degree in (2, 4, 6):
        surface = implicitize(coordinates, (u, v), method="approximate", degree=degree)
        assert (surface.certificate.proof, surface.degree) == ("approximate", degree)
        errors.append(surface.certificate.residual)
    assert errors[0] > 10 * errors[1] > 100 * errors[2] > 0
    a, b = np.random.default_rng(3).random((2, 500))
    points = np.stack(sympy.lambdify((u, v), coordinates)(a, b), axis=1)
    slope = np.linalg.norm(surface.gradient(points), axis=1)
    assert (abs(surface(points)) / slope).max() < 3 * errors[2]


def test_approximation_takes_transcendental_coordinates():
    spiral = (u * cos(u), u * sin(u), v)
    assert implicitize(spiral, (u, v), method="approximate", degree=6).certificate.residual < 1e-6


def test_approximation_refuses_what_is_no_surface():
    with pytest.raises(NotASurfaceError, match="line"):
        implicitize((u, 2 * u, 3 * u), (u, v), method="approximate")
    with pytest.raises(ValueError, match="degree must be"):
        implicitize((u, v, u * v), (u, v), method="approximate", degree=0)
    with pytest.raises(ValueError, match="method must be"):
        implicitize((u, v, u * v), (u, v), method="guess")
    with pytest.raises(ValueError, match="not finite"):
        implicitize((sympy.log(u - 1), v, u * v), (u, v), method="approximate")
