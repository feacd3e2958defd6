"""Interpolation and least squares; surfaces z = g(x, y)."""

import numpy as np
import pytest
import sympy

from parametric import (
    BSplineSurface,
    approximate,
    continuity,
    fit_scattered,
    graph,
    interpolate,
    interpolate_curve,
    polynomial_coefficients,
)

RNG = np.random.default_rng(0)
GRID = np.stack([*np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij"), RNG.normal(size=(6, 5))], axis=-1)
X = np.array([0.0, 1, 1.5, 3, 4])
Y = np.array([-1.0, 0, 2, 3])
HEIGHTS = RNG.normal(size=(5, 4))


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def runge(x):
    return 1 / (1 + 25 * x**2)


@pytest.mark.parametrize("degrees", [(1, 1), (2, 3), (3, 3), (5, 4)])
@pytest.mark.parametrize("parameters", ["uniform", "chord", "centripetal"])
def test_interpolation_passes_through_every_point(degrees, parameters):
    surface = interpolate(GRID, degrees, parameters)
    assert isinstance(surface, BSplineSurface)
    assert surface.degrees == degrees
    for corner in ((0, 0), (-1, 0), (0, -1), (-1, -1)):
        near(surface(float(corner[0] == -1), float(corner[1] == -1)), GRID[corner])
    if parameters == "uniform":
        near(surface.grid(np.linspace(0, 1, 6), np.linspace(0, 1, 5)), GRID, 1e-11)


def test_given_parameters_are_kept():
    u, v = np.array([2, 3, 5, 6, 7, 11.0]), np.array([0, 1, 2, 4, 8.0])
    surface = interpolate(GRID, (3, 2), (u, v))
    assert surface.domain == ((2, 11), (0, 8))
    near(surface.grid(u, v), GRID, 1e-11)


def test_interpolating_a_spline_of_the_same_knots_returns_it():
    surface = interpolate(GRID, (3, 3), "uniform")
    again = interpolate(surface.grid(np.linspace(0, 1, 6), np.linspace(0, 1, 5)), (3, 3), "uniform")
    near(again.points, surface.points, 1e-11)


def test_interpolated_curves_pass_through_their_points():
    points = RNG.normal(size=(9, 3))
    near(interpolate_curve(points, 3, np.arange(9.0))(np.arange(9.0)), points)
    chords = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    near(interpolate_curve(points)(np.clip(chords / chords[-1], 0, 1)), points)


def test_least_squares_is_orthogonal_to_its_residual():
    u, v = np.linspace(0, 1, 30), np.linspace(0, 1, 25)
    points = np.stack([*np.meshgrid(u, v, indexing="ij"), RNG.normal(size=(30, 25))], axis=-1)
    surface = approximate(points, (7, 6), (3, 2), (u, v))
    residual = points - surface.grid(u, v)
    projected = np.einsum("ai,bj,abc->ijc", surface.knots[0].design(u), surface.knots[1].design(v), residual)
    near(projected, 0, 1e-11)
    assert surface.points.shape == (7, 6, 3)


def test_scattered_fit_reproduces_a_spline_and_smooths_where_data_is_missing():
    target = BSplineSurface(RNG.normal(size=(6, 5, 3)), (3, 2))
    u, v = RNG.random((2, 400))
    fitted = fit_scattered(target(u, v), u, v, (6, 5), (3, 2))
    near(fitted.points, target.points, 1e-8)
    few = fit_scattered(target(u[:10], v[:10]), u[:10], v[:10], (6, 5), (3, 2), smoothing=1e-8)
    near(few(u[:10], v[:10]), target(u[:10], v[:10]), 1e-2)
    with pytest.raises(ValueError, match="10 points do not determine 30 control points: use fewer, or smoothing > 0"):
        fit_scattered(target(u[:10], v[:10]), u[:10], v[:10], (6, 5), (3, 2))


@pytest.mark.parametrize("pieces", ["one", "C0", "C1"])
def test_graphs_pass_through_their_heights(pieces):
    surface = graph(HEIGHTS, X, Y, pieces=pieces)
    assert surface.domain == ((0, 4), (-1, 3))
    near(surface.grid(X, Y)[..., 2], HEIGHTS, 1e-10)
    a, b = np.linspace(0, 4, 31), np.linspace(-1, 3, 31)
    points = surface.grid(a, b)
    near(points[..., 0], np.broadcast_to(a[:, None], (31, 31)))
    near(points[..., 1], np.broadcast_to(b, (31, 31)))


def test_one_polynomial_is_the_polynomial():
    coefficients = RNG.normal(size=(5, 4))
    heights = np.polynomial.polynomial.polygrid2d(X, Y, coefficients)
    near(polynomial_coefficients(heights, X, Y), coefficients, 1e-9)
    a, b = np.linspace(0, 4, 9), np.linspace(-1, 3, 9)
    near(graph(heights, X, Y).grid(a, b)[..., 2], np.polynomial.polynomial.polygrid2d(a, b, coefficients), 1e-9)


def test_patches_join_c0_and_c1():
    for pieces, smooth in (("C0", False), ("C1", True)):
        surface = graph(HEIGHTS, X, Y, pieces=pieces)
        report = continuity(surface.restrict(u=(0, 1.5)), "u1", surface.restrict(u=(1.5, 4)), "u0")
        assert report.c0
        assert report.c1 == smooth


def test_c1_patches_reproduce_quadratics():
    heights = X[:, None] ** 2 - 2 * X[:, None] * Y + 3 * Y**2
    a, b = np.linspace(0, 4, 9)[:, None], np.linspace(-1, 3, 9)
    near(graph(heights, X, Y, pieces="C1")(a, b)[..., 2], a**2 - 2 * a * b + 3 * b**2, 1e-11)


def test_runge_warning_of_the_chapter():
    """One polynomial through 21 even points is off by about 60; patches are off by 0.05 and less."""
    x, y, fine = np.linspace(-1, 1, 21), np.array([0.0, 1]), np.linspace(-1, 1, 801)
    heights = np.stack([runge(x)] * 2, axis=1)
    errors = [np.abs(graph(heights, x, y, pieces=p)(fine, 0.5)[:, 2] - runge(fine)).max() for p in ("one", "C0", "C1")]
    assert 50 < errors[0] < 70
    assert errors[1] < 0.06
    assert errors[2] < errors[1]


def test_graph_of_a_formula():
    x, y = sympy.symbols("x y")
    surface = graph(sympy.sin(x) * y, (0, 2), (1, 3))
    near(surface(0.5, 2.0), [0.5, 2, 2 * np.sin(0.5)])
    assert surface.domain == ((0, 2), (1, 3))
    numeric = graph(lambda a, b: np.sin(a) * b, (0, 2), (1, 3))
    a, b = np.linspace(0, 2, 9), np.linspace(1, 3, 9)
    near(numeric(a, b), surface(a, b))
    for order in ((1, 0), (0, 1), (1, 1)):
        near(
            numeric.derivative(a[:, None], b, *order),
            surface.derivative(a[:, None], b, *order),
            10.0 ** (5 * sum(order) / 2 - 12),
        )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: interpolate(GRID, (6, 3)), "degree 6 needs at least 7 points in a row, got 6"),
        (lambda: interpolate(GRID, (3, 3), "arc"), "parameters must be one of uniform, centripetal, chord or given"),
        (lambda: interpolate(GRID, (3, 3), (np.arange(6), np.arange(4))), "parameters v must be 5 increasing numbers"),
        (lambda: interpolate(GRID[[0, 0, 1, 2, 3]]), "points 0 and 1 coincide in every row"),
        (lambda: interpolate(GRID[0]), "points must be points of shape"),
        (lambda: approximate(GRID, (7, 4)), "6 points in a row do not determine 7 control points"),
        (lambda: approximate(GRID, (3, 4)), "degree 3 needs at least 4 control points, got 3"),
        (lambda: fit_scattered(GRID[0], [0, 1], [0, 1], (4, 4)), "every point needs one u and one v, got 5, 2 and 2"),
        (lambda: fit_scattered(GRID[0], np.arange(5), np.zeros(5), (4, 4)), r"parameter u must lie in \[0, 1\], got 4"),
        (lambda: graph(HEIGHTS, X, Y, pieces="C2"), "pieces must be one of one, C0, C1, got 'C2'"),
        (
            lambda: graph(HEIGHTS, Y, X),
            r"of shape \(4, 5\) to match x and y, got shape \(5, 4\)",
        ),
        (lambda: graph(lambda a, b: np.nan, (0, 1), (0, 1)), "function must return three finite coordinates"),
        (lambda: graph(HEIGHTS, X[::-1], Y), "x must be two or more increasing numbers"),
        (lambda: graph(sympy.Symbol("w"), (0, 1), (0, 1)), "z may only depend on x and y, but contains w"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()
