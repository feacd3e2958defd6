"""Inside, on and outside: certified signs of implicit surfaces, winding numbers of meshes, one contract for all."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import (
    SignAmbiguousError,
    Surface,
    UndecidedError,
    certified_floor,
    classify,
    implicitize,
    winding_number,
    x,
    y,
    z,
)

TORUS = "(x^2 + y^2 + z^2 + 1 - 4/25)^2 - 4 (x^2 + y^2)"
GYROID = "sin(x) cos(y) + sin(y) cos(z) + sin(z) cos(x)"
HUGE = 10**8

CASES = [  # id, surface, point, tolerance, answer
    ("sphere, center", "x^2 + y^2 + z^2 - 1", (0, 0, 0), 0, -1),
    ("Pythagorean quadruple", "x^2 + y^2 + z^2 - 2401", (12.0, 24.0, 41.0), 0, 0),
    ("one unit in the last place out", "x^2 + y^2 + z^2 - 2401", (12.0, 24.0, np.nextafter(41, 42)), 0, 1),
    ("one unit in the last place in", "x^2 + y^2 + z^2 - 2401", (12.0, 24.0, np.nextafter(41, 40)), 0, -1),
    ("hole of the torus", TORUS, (0, 0, 0), 0, 1),
    ("tube of the torus", TORUS, (1, 0, 0), 0, -1),
    ("just outside the torus", TORUS, (1.400000001, 0, 0), 0, 1),
    ("far sphere, multiplied out", sympy.expand((x - HUGE) ** 2 + (y - HUGE) ** 2 + z**2 - 1), (1e8, 1e8, 0.9), 0, -1),
    ("fifth power", sympy.expand((x**2 + y**2 + z**2 - 1) ** 5), (0.9999, 0, 0), 0, -1),
    ("monkey saddle", "z - x^3 + 3 x y^2", (0.5, 0.25, 0.03125), 0, 0),
    ("isolated point", "x^2 + y^2 + z^2", (0, 0, 0), 0, 0),
    ("near an isolated point", "x^2 + y^2 + z^2", (1e-200, 0, 0), 0, 1),
    ("underflow", "x^3 - y^3", (1e-120, 1e-121, 0), 0, 1),
    ("cone near its apex", "x^2 + y^2 - z^2", (0, 0, 0.001), 0.0008, 0),
    ("cone off its apex", "x^2 + y^2 - z^2", (0, 0, 0.001), 0.0007, -1),
    ("gyroid at the origin", GYROID, (0, 0, 0), 0, 0),
    ("gyroid beside the origin", GYROID, (5e-324, 0, 0), 0, 1),
    ("handle of the umbrella", "x^2 - y^2 z", (0, 0, -3), 0, 0),
    ("golden ratio", "x - (1 + sqrt(5)) y / 2", (0, 0, 7), 0, 0),
    ("near the golden ratio", "x - (1 + sqrt(5)) y / 2", (1.618033988749895, 1, 0), 0, 1),
    ("two boxes with a common face", "min(max(abs(x) - 1, abs(y)), max(abs(x - 2) - 1, abs(y)))", (1, 0, 0), 0, 0),
]


@pytest.mark.parametrize(("surface", "point", "tolerance", "answer"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
def test_cases_with_known_answers(surface, point, tolerance, answer):
    assert classify(Surface(surface), point, tolerance=tolerance) == answer


def test_even_multiplicities_are_refused():
    with pytest.raises(SignAmbiguousError, match=r"even multiplicity.*square-free"):
        classify(Surface(sympy.expand((x**2 + y**2 + z**2 - 1) ** 2)), (0, 0, 0))
    with pytest.raises(SignAmbiguousError, match=r"x"):
        classify(Surface("x^2 (y - z)"), (1, 0, 0))
    assert classify(Surface("x^3 (y - z)"), (1, 0, 1)) == -1


def exact_signs(expression, points):
    """A naive oracle: plain fractions."""
    polynomial = sympy.Poly(sympy.expand(sympy.nsimplify(expression)), x, y, z)
    terms = [(m, Fraction(int(c.p), int(c.q))) for m, c in polynomial.terms()]
    out = []
    for point in points:
        a, b, c = (Fraction(float(w)) for w in point)
        value = sum(q * a**i * b**j * c**k for (i, j, k), q in terms)
        out.append((value > 0) - (value < 0))
    return np.array(out)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(-16, -1))
def test_signs_near_the_torus_are_exact(seed, exponent):
    random = np.random.default_rng(seed)
    surface = Surface(TORUS)
    a, b = random.uniform(0, 2 * np.pi, (2, 20))
    radius = 0.4 + random.choice([-1, 1], 20) * 10.0**exponent
    ring = 1 + radius * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), radius * np.sin(b)], axis=1)
    assert (classify(surface, points) == exact_signs(surface.expression, points)).all()


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 12))
def test_rational_points_on_polynomials_and_their_neighbours(seed, degree):
    random = np.random.default_rng(seed)
    exponents = [e for e in random.integers(0, degree + 1, (8, 2)).tolist() if sum(e) <= degree]
    graph = sum(int(random.integers(-9, 9)) * x**i * y**j for i, j in exponents) + x**degree
    a, b = (Fraction(int(n), 4) for n in random.integers(-12, 12, 2))
    c = Fraction(
        str(graph.subs({x: sympy.Rational(a.numerator, a.denominator), y: sympy.Rational(b.numerator, b.denominator)}))
    )
    surface = Surface(z - graph)
    assert classify(surface, np.array([a, b, c], dtype=object), tolerance=0) == 0
    if Fraction(float(c)) == c:
        heights = [np.nextafter(float(c), -np.inf), float(c), np.nextafter(float(c), np.inf)]
        assert list(classify(surface, [(float(a), float(b), h) for h in heights])) == [-1, 0, 1]


def test_symmetric_lattice_agrees_with_exact_arithmetic():
    lattice = np.stack(np.meshgrid(*[np.arange(-6, 7) / 4] * 3, indexing="ij"), axis=-1)
    for text in ("x^2 + y^2 + z^2 - 1", "4 (x^2 + y^2 + z^2) + 16 x y z - 1", "x^2 + y^2 - z^2", "x y z"):
        surface = Surface(text)
        codes = classify(surface, lattice)
        assert codes.shape == lattice.shape[:-1]
        assert codes.dtype == np.int8
        assert (codes.ravel() == exact_signs(surface.expression, lattice.reshape(-1, 3))).all()


def test_long_polynomials_take_horner_lines_with_the_same_answers():
    random = np.random.default_rng(3)
    exponents = [(i, j, k) for i in range(9) for j in range(9 - i) for k in range(9 - i - j)]
    expression = sympy.Add(*(int(random.integers(-99, 99)) * x**i * y**j * z**k for i, j, k in exponents))
    points = np.concatenate([random.uniform(-1, 1, (300, 3)), random.integers(-2, 3, (40, 3)).astype(float)])
    surface = Surface(expression)
    assert (classify(surface, points) == exact_signs(expression, points)).all()
    near = classify(surface, points, tolerance=1e-3)
    assert (near[near != 0] == classify(surface, points)[near != 0]).all()


def test_tolerance_of_implicitized_patches():
    u, v = sympy.symbols("u v")
    patch = (u + v**2 / 3, v - u**2 / 4 + u * v / 5, u**2 * v**2 - u * v + u**2 / 2)
    surface = implicitize(patch, (u, v))
    a, b = np.random.default_rng(0).random((2, 60))
    points = np.stack(sympy.lambdify((u, v), patch)(a, b), axis=1)
    normals = surface.normal(points)
    assert (classify(surface, points + 0.9e-4 * normals, tolerance=1e-4) == 0).all()
    assert (classify(surface, points + 1.1e-4 * normals, tolerance=1e-4) == 1).all()
    assert (classify(surface, points - 1.1e-4 * normals, tolerance=1e-4) == -1).all()


def test_combinations_are_decided_by_the_same_proofs():
    ball, cube = Surface("x^2 + y^2 + z^2 = 1"), Surface("max(abs(x), abs(y), abs(z)) - 4/5")
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (2000, 3))
    a, b = classify(ball, points), classify(cube, points)
    assert (classify(ball & cube, points) == np.maximum(a, b)).all()
    assert (classify(ball | cube, points) == np.minimum(a, b)).all()
    assert (classify(ball - cube, points) == np.maximum(a, -b)).all()
    assert classify(ball & cube, (0.8, 0, 0), tolerance=0) in (0, 1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(-12, -1), st.sampled_from([0.5, 0.99, 1.02, 1.3, 3.0]))
def test_tolerance_is_a_distance(seed, exponent, share):
    random = np.random.default_rng(seed)
    tolerance = 10.0**exponent * 0.3
    directions = random.standard_normal((12, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    side = random.choice([-1, 1], 12)
    points = directions * (1 + share * tolerance * side)[:, None]
    expected = np.zeros(12) if share < 1 else side
    assert (classify(Surface("x^2 + y^2 + z^2 = 1"), points, tolerance=tolerance) == expected).all()


@pytest.mark.parametrize("tolerance", [0.003, 0.03, 0.15])
def test_tolerance_is_a_distance_from_curved_surfaces_and_creases(tolerance):
    points = np.random.default_rng(2).uniform(-1.5, 1.5, (1500, 3))
    ring = np.hypot(points[:, 0], points[:, 1])
    torus = np.hypot(ring - 1, points[:, 2]) - 0.4
    over = np.abs(points) - 0.75
    cube = np.linalg.norm(np.maximum(over, 0), axis=1) + np.minimum(over.max(axis=1), 0)
    for text, distance in ((TORUS, torus), ("max(abs(x), abs(y), abs(z)) - 3/4", cube)):
        codes = classify(Surface(text), points, tolerance=tolerance)
        far, near = abs(distance) > 1.011 * tolerance, abs(distance) <= tolerance
        assert (codes[far] == np.sign(distance[far])).all()
        assert (codes[near] == 0).all()
        assert np.isin(codes, (-1, 0, 1)).all()


def test_tolerance_at_singular_points():
    umbrella, cone = Surface("x^2 - y^2 z"), Surface("x^2 + y^2 - z^2")
    assert classify(umbrella, (0.001, 0, -1), tolerance=0.002) == 0
    assert classify(umbrella, (0.001, 0, -1), tolerance=0.0009) == 1
    assert classify(Surface("x^2 + y^2 + z^2"), (0.001, 0, 0), tolerance=0.0011) == 0
    distance = 0.001 / np.sqrt(2)
    assert classify(cone, (0, 0, 0.001), tolerance=distance * 1.001) == 0
    assert classify(cone, (0, 0, 0.001), tolerance=distance * 0.985) == -1


def test_tolerance_of_functions_that_are_no_polynomials():
    surface = Surface(GYROID)
    points = np.random.default_rng(1).uniform(-3, 3, (400, 3))
    codes = classify(surface, points, tolerance=0.05)
    slope = np.linalg.norm(surface.gradient(points), axis=1)
    first_order = abs(surface(points)) / slope
    assert (codes[first_order < 0.04] == 0).all()
    assert (codes[first_order > 0.07] == np.sign(surface(points))[first_order > 0.07]).all()


def test_zeros_of_functions_that_are_no_polynomials():
    surface = Surface("sin(x) - y")
    assert classify(surface, (0, 0, 0), tolerance=0) == 0
    assert classify(Surface("sin(x + y) - sin(x) cos(y) - cos(x) sin(y) + z"), (0.3, 0.4, 0)) == 0
    with pytest.raises(UndecidedError, match="exact answer was not proved at 1 of 2") as caught:
        classify(Surface("sin(x + y) - sin(x) cos(y) - cos(x) sin(y) + z"), [(1, 1, 1), (0.3, 0.4, 0)], tolerance=0)
    assert list(caught.value.indices) == [1]


def test_exact_points():
    sphere = Surface("x^2 + y^2 + z^2 = 1")
    third, two = Fraction(1, 3), Fraction(2, 3)
    assert classify(sphere, [third, two, two]) == 0
    assert classify(sphere, [sympy.Rational(1, 3), sympy.Rational(2, 3), sympy.Rational(2, 3)]) == 0
    assert classify(sphere, [third, two, two - Fraction(1, 10**40)]) == -1
    assert classify(Surface("x - y"), np.array([2**60 + 1, 2**60, 0])) == 1
    assert classify(Surface("x - y"), (3, 3, 0)) == 0


def test_shapes():
    sphere = Surface("x^2 + y^2 + z^2 = 1")
    assert np.shape(classify(sphere, (0, 0, 0))) == ()
    assert classify(sphere, np.zeros((4, 5, 3))).shape == (4, 5)
    assert classify(sphere, []).shape == (0,)
    assert classify(sphere, np.zeros((0, 3))).shape == (0,)
    assert classify(sphere, np.zeros((2, 0, 3))).shape == (2, 0)
    assert winding_number(sphere, [(0, 0, 0), (1, 0, 0), (2, 0, 0)]).tolist() == [1, 0.5, 0]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0, 0), (0, np.nan, 0)], r"points\[1\] is \[0.0, nan, 0.0\]"),
        (np.full((2, 2, 3), [0, np.inf, 0]), r"points\[0, 0\]"),
        ((np.nan, 0, 0), "the point is"),
        ((0, 0), "shape"),
        (5.0, "shape"),
        ([("a", "b", "c")], "real numbers"),
        ([(1j, 0, 0)], "real numbers"),
        ([(None, 0, 0)], "finite|real numbers"),
    ],
)
def test_bad_points(points, message):
    for verb in (classify, winding_number):
        with pytest.raises(ValueError, match=message):
            verb(Surface("x"), points)


def test_bad_arguments():
    with pytest.raises(ValueError, match="rule must be one of"):
        classify(Surface("x"), (0, 0, 0), rule="odd")
    for tolerance in (-1, np.nan, np.inf, "1"):
        with pytest.raises(ValueError, match="tolerance must be"):
            classify(Surface("x"), (0, 0, 0), tolerance=tolerance)
    for verb in (classify, winding_number):
        with pytest.raises(TypeError, match=r'Mesh, .* was wanted, got str; a formula becomes one by Surface\("'):
            verb("x", (0, 0, 0))


class Slab:
    """A solid that answers by itself."""

    def classify_points(self, points, *, tolerance, rule):
        assert (tolerance, rule) == (0.25, "positive")
        return np.sign(np.abs(points[:, 2]) - 1)

    def winding_numbers(self, points):
        return (np.abs(points[:, 2]) < 1) * 2.0


def test_other_solids_answer_by_their_own_methods():
    points = [[(0, 0, 0), (0, 0, 2)]]
    assert classify(Slab(), points, tolerance=0.25, rule="positive").tolist() == [[-1, 1]]
    assert winding_number(Slab(), points).tolist() == [[2, 0]]


def test_functions_without_a_formula():
    ball = Surface.from_function(lambda p: np.linalg.norm(p, axis=1) - 1, lipschitz=1)
    points = [(0, 0, 0), (2, 0, 0), (1.05, 0, 0), (0.96, 0, 0)]
    assert list(classify(ball, points)) == [-1, 1, 1, -1]
    assert list(classify(ball, points, tolerance=0.1)) == [-1, 1, 0, 0]
    with pytest.raises(UndecidedError, match="4 of 4"):
        classify(ball, points, tolerance=0)
    with pytest.raises(UndecidedError, match="2 of 4"):
        classify(Surface.from_function(lambda p: np.linalg.norm(p, axis=1) - 1), points, tolerance=0.1)


def test_floors_are_reported():
    assert certified_floor(Surface("min(x^2 + y^2 + sqrt(5), abs(z))")) > 0
    assert certified_floor(Surface("x^2 + sqrt(5) y")) == certified_floor(Surface("min(x, 1/y)")) == 0
    assert 0 < certified_floor(Surface("sin(x) + y")) < 1e-13
    assert certified_floor(Surface.from_function(lambda p: p[:, 0])) == np.inf
    with pytest.raises(TypeError, match="got int"):
        certified_floor(3)
