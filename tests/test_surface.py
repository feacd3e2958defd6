"""Surfaces: values and derivatives against differences and sympy, normals, curvature, errors."""

import pickle

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import (
    FormulaError,
    Mesh,
    SingularPointError,
    Surface,
    blend,
    offset,
    parametrize,
    polygonize,
    polygonize_from,
    singularities,
    x,
    y,
    z,
)

FORMULAS = [
    "x^2 + y^2 + z^2 = 1",
    "x^3 y - 2y z^2 + 0.3x = 1/7",
    "sqrt(5) x^4 + y^4 - pi z^2",
    "sin(3x) cos(y) + sin(y) cos(z) + exp(x z)",
    "sqrt(x^2 + y^2 + 1) - tan(z/2) + log(y + 4)",
    "tanh(x) / (z + 4) + atan(x y) + asin(y/4) + acos(z/4)",
    "(x + 3)^2.3 + (y^2 + 1)^(-1/3) + sinh(z) + cosh(y)^x",
    "max(x^2 - 1, y, min(z, x - y)) + abs(x - 2y)",
]
RNG = np.random.default_rng(5)
POINTS = RNG.uniform(-1, 1, (40, 3))


def exact(surface, point):
    place = dict(zip((x, y, z), map(sympy.Float, point), strict=True))
    return float(surface.expression.subs(place).evalf(30))


@pytest.mark.parametrize("text", FORMULAS)
def test_values_agree_with_sympy(text):
    surface = Surface(text)
    wanted = [exact(surface, p) for p in POINTS[:6]]
    assert np.allclose(surface(POINTS[:6]), wanted, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("text", FORMULAS)
def test_derivatives_agree_with_differences(text):
    surface, h = Surface(text), 1e-5
    steps = h * np.eye(3)
    slopes = np.stack([(surface(POINTS + s) - surface(POINTS - s)) / (2 * h) for s in steps], axis=-1)
    bends = np.stack([(surface.gradient(POINTS + s) - surface.gradient(POINTS - s)) / (2 * h) for s in steps], axis=-1)
    smooth = np.abs(surface.hessian(POINTS) - bends).max(axis=(1, 2)) < 1e-7 * (1 + np.abs(bends).max())
    assert smooth.mean() > 0.9  # all but points within h of a kink
    assert np.abs(surface.gradient(POINTS) - slopes)[smooth].max() < 1e-8 * (1 + np.abs(slopes).max())
    assert np.array_equal(surface.hessian(POINTS), surface.hessian(POINTS).swapaxes(1, 2)) or np.allclose(
        surface.hessian(POINTS), surface.hessian(POINTS).swapaxes(1, 2), rtol=1e-12, atol=1e-12
    )


def test_shapes_follow_the_points():
    surface = Surface("x^2 + y^2 = max(z, 1)")
    grid = RNG.uniform(-1, 1, (2, 4, 3))
    assert surface(grid).shape == (2, 4) and surface.gradient(grid).shape == (2, 4, 3)
    assert surface.hessian(grid).shape == (2, 4, 3, 3) and surface.normal(grid).shape == (2, 4, 3)
    assert np.ndim(surface((1, 2, 3))) == 0 and surface.gradient((1, 2, 3)).shape == (3,)
    assert surface(np.zeros((0, 3))).shape == (0,) and surface.gradient(np.zeros((0, 3))).shape == (0, 3)
    curvature = surface.curvature(grid)
    assert curvature.mean.shape == (2, 4) and curvature.directions.shape == (2, 4, 2, 3)


def test_points_are_not_changed():
    points = POINTS.copy()
    Surface("sin(x) + y")(points)
    assert np.array_equal(points, POINTS)


@pytest.mark.parametrize("points", [(1, 2), 1.0, [[1, 2]], (1, 2, 1j), ("a", "b", "c"), None])
def test_points_must_be_real_triples(points):
    with pytest.raises(ValueError, match="points must"):
        Surface("x + y + z")(points)


def test_normals_are_unit_gradients_and_none_at_singular_points():
    surface = Surface("x^2 + y^2 = z^2")
    assert np.allclose(np.linalg.norm(surface.normal(POINTS), axis=1), 1)
    for text, place in [
        ("x^2 + y^2 = z^2", (0, 0, 0)),
        ("1e-9 (x^2 + y^2 - z^2)", (0, 0, 0)),
        ("x^2 y = z^2", (0, 1, 0)),
        ("(x - 1/3)^2 + (y - 0.1)^3 = z^2", (1 / 3, 0.1, 0)),
    ]:
        for ask in ("normal", "curvature", "tangent_plane"):
            with pytest.raises(SingularPointError, match="gradient vanishes"):
                getattr(Surface(text), ask)(place)
    assert np.allclose(Surface("1e-9 (x^2 + y^2 + z^2 - 1)").normal((0, 0, 1e-3)), (0, 0, 1))


@given(st.floats(0.1, 10), st.integers(0, 39))
@settings(max_examples=20, deadline=None)
def test_curvature_of_spheres_and_cylinders(radius, index):
    p = POINTS[index] / np.linalg.norm(POINTS[index]) * radius
    ball = Surface("x^2 + y^2 + z^2 = r^2", r=radius).curvature(p)
    assert np.allclose([ball.gaussian, ball.mean, *ball.principal], [radius**-2, *[1 / radius] * 3])
    q = p / np.hypot(p[0], p[1]) * radius
    tube = Surface("sqrt(x^2 + y^2) = r", r=radius).curvature(q)
    assert np.allclose(tube.principal, [1 / radius, 0]) and np.allclose(np.abs(tube.directions[1]), (0, 0, 1))


def test_gauss_bonnet_on_the_torus():
    """The integral of the Gaussian curvature over a torus is 0, and K is the product of the principal curvatures."""
    surface, n = Surface("(x^2 + y^2 + z^2 + 3)^2 = 16(x^2 + y^2)"), 60
    a, b = np.meshgrid(*[2 * np.pi * np.arange(n) / n] * 2, indexing="ij")
    p = np.stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)], axis=-1)
    found = surface.curvature(p)
    assert abs((found.gaussian * (2 + np.cos(b))).sum()) < 1e-8
    assert np.allclose(found.gaussian, np.cos(b) / (2 + np.cos(b))) and np.allclose(found.principal[..., 0], 1)
    assert np.allclose(np.einsum("...i,...i", found.directions[..., 0, :], surface.normal(p)), 0, atol=1e-12)


def test_tangent_planes_touch():
    surface = Surface("x^2 y + z^3 = 2")
    for p in POINTS[:5]:
        plane = surface.tangent_plane(p)
        assert plane.degree == 1 and abs(plane(p)) < 1e-15
        assert np.allclose(plane.gradient(p), surface.gradient(p), rtol=1e-14)
    assert Surface("x^2 + y^2 + z^2 = 1").tangent_plane((0, 0, 1)) == Surface("2z = 2")
    with pytest.raises(ValueError, match="one point"):
        surface.tangent_plane([[0, 0, 1]])


def test_one_side_is_chosen_at_kinks():
    assert np.array_equal(Surface("abs(x)").gradient((0, 0, 0)), (1, 0, 0))
    assert np.array_equal(Surface("max(x, y, z)").gradient((1, 1, 1)), (1, 0, 0))
    assert np.array_equal(Surface("min(y, x)").gradient((1, 1, 1)), (0, 1, 0))
    assert np.array_equal(
        Surface("max(x, sqrt(y) - 1)").gradient((1, 0, 0)), (1, 0, 0)
    )  # nothing from the other branch


def test_accepts_sympy_in_any_symbols():
    a, b = sympy.symbols("x y")
    assert Surface(sympy.Eq(a**2, b)) == Surface("x^2 = y") == Surface(x**2 - y)
    assert Surface(sympy.Poly(a**2 - b)) == Surface("x^2 = y")


@pytest.mark.parametrize("symbols", [(x, y), sympy.symbols("x y")])
def test_an_equation_of_sympy_is_the_same_as_its_text(symbols):
    a, b = symbols
    pairs = [
        ((a, 1), "x = 1"),
        ((a, 0), "x = 0"),
        ((a**2, a + b), "x^2 = x + y"),
        ((0.3 * a, 0.1 * a + b), "0.3x = 0.1x + y"),
        ((sympy.Max(a, b), 1), "max(x, y) = 1"),
        ((a, sympy.Max(a, b)), "x = max(x, y)"),
        ((sympy.Max(a, b), 0), "max(x, y)"),
    ]
    for (left, right), text in pairs:
        surface = Surface(sympy.Eq(left, right))
        assert surface == Surface(text) == Surface(repr(surface)[9:-2])
    assert Surface(a**2 - 0.1 * sympy.Symbol("c"), c=2) == Surface("x^2 - 0.2")
    assert Surface(sympy.Max(a, b)).degree is None


@pytest.mark.parametrize(
    ("given", "parameters", "message"),
    [
        ("3", {}, "is a constant"),
        ("a", {"a": 1}, "is a constant"),
        (3, {}, "formula as text"),
        (None, {}, "formula as text"),
        (x > 0, {}, "formula as text"),
        (sympy.I * x, {}, "I occurs"),
        (x / 0, {}, "zoo"),
        (sympy.Function("f")(x), {}, r"f\(x\) occurs"),
        (sympy.floor(x), {}, "floor"),
        (sympy.Symbol("radius") * x, {}, "unknown name radius"),
        (sympy.Symbol("lenght") * x, {"length": 1}, "did you mean length"),
        (x, {"a": 1}, "has no a"),
        ("a x", {"a": 1j}, "finite real number"),
        ("a x", {"a": float("inf")}, "finite real number"),
        ("a x", {"a": "2"}, "finite real number"),
        ("a x", {"a": None}, "finite real number"),
        ("x", {"sin": 2}, "cannot be called sin"),
        ("x", {"y": 2}, "cannot be called y"),
    ],
)
def test_what_is_no_surface_is_refused(given, parameters, message):
    with pytest.raises(ValueError, match=message):
        Surface(given, **parameters)


@pytest.mark.parametrize(
    "ask",
    [
        lambda thing: polygonize(thing, 1),
        lambda thing: polygonize_from(thing, (0, 0, 0), 0.1),
        lambda thing: singularities(thing, 1),
        lambda thing: offset(thing, 0.1),
        lambda thing: blend(thing, Surface("x"), 0.1),
        lambda thing: blend(Surface("x"), thing, 0.1, "difference"),
        parametrize,
    ],
)
def test_verbs_of_surfaces_name_what_came_instead(ask):
    with pytest.raises(TypeError, match=r'a.* Surface was wanted, got str; a formula becomes one by Surface\("'):
        ask("x^2 + y^2 + z^2 = 1")
    for thing in (Mesh([], []), 3, None):
        with pytest.raises(TypeError, match=f"a.* Surface was wanted, got {type(thing).__name__}$"):
            ask(thing)


def test_values_compare_hash_pickle_and_print():
    for text in FORMULAS:
        surface = Surface(text)
        copy = pickle.loads(pickle.dumps(surface))
        assert copy == surface and hash(copy) == hash(surface) and np.array_equal(copy(POINTS), surface(POINTS))
        again = Surface(repr(surface)[9:-2])
        assert np.allclose(again(POINTS), surface(POINTS), rtol=1e-12, atol=1e-12)
    assert repr(Surface("x^2 = max(y, e)")) == 'Surface("x^2 - max(y, e)")'
    assert Surface("x") != Surface("2x")
    with pytest.raises(AttributeError):
        Surface("x").expression = y
    with pytest.raises(FormulaError):
        Surface("x +")


def test_functions_without_a_formula():
    def ball(p):
        return (p**2).sum(axis=1) - 1

    plain = Surface.from_function(ball)
    known = Surface.from_function(ball, gradient=lambda p: 2 * p)
    formula = Surface("x^2 + y^2 + z^2 = 1")
    assert np.array_equal(plain(POINTS), ball(POINTS)) and plain.degree is None and plain.expression is None
    assert np.allclose(plain.gradient(POINTS), formula.gradient(POINTS), atol=1e-8)
    assert np.allclose(known.hessian(POINTS), formula.hessian(POINTS), atol=1e-6)
    assert np.allclose(plain.hessian(POINTS), formula.hessian(POINTS), atol=1e-3)
    assert np.allclose(plain.normal(POINTS), formula.normal(POINTS), atol=1e-7)
    joined = (plain | Surface("x + 9")) & ~Surface("z - 9")
    assert np.allclose(joined(POINTS), (formula | Surface("x + 9"))(POINTS).clip(9 - POINTS[:, 2]))


def test_functions_are_called_only_in_their_bounds():
    seen = []

    def watched(p):
        seen.append(p)
        return p[:, 0]

    surface = Surface.from_function(watched, bounds=1)
    edge = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 1.0]])
    assert np.allclose(surface.gradient(edge), [[1, 0, 0], [1, 0, 0]])
    assert all((np.abs(p) <= 1).all() for p in seen)
    with pytest.raises(ValueError, match=r"asked for at \(2.0, 0.0, 0.0\)"):
        surface((2, 0, 0))


@pytest.mark.parametrize(
    ("function", "options", "message"),
    [
        (3, {}, "a function of points"),
        (lambda p: p, {}, "wanted"),
        (lambda p: p[:, 0], {"gradient": lambda p: p[:, 0]}, "gradient for 1 points"),
        (lambda p: p[:, 0], {"lipschitz": -1}, "positive and finite"),
    ],
)
def test_wrong_functions_are_refused(function, options, message):
    with pytest.raises(ValueError, match=message):
        Surface.from_function(function, **options).gradient((1, 2, 3))
