"""The exercises of the source chapter."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
import sympy

from parametric import (
    BezierCurve,
    BezierSurface,
    BSplineCurve,
    KnotVector,
    continuity,
    coons,
    t,
)
from parametric.textbook.algorithms import basis_function, bernstein, de_boor, de_casteljau

S = np.linspace(0, 1, 41)
PARABOLA = [(-1, 0), (0, 1), (2, 0)]


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_saq_2a_points_split_and_elevation():
    curve = BezierCurve(PARABOLA)
    near(curve.monomial()[:, :2], [[-1, 0], [2, 2], [1, -2]])
    expected = [(-1, 0), (-0.4375, 0.375), (0.25, 0.5), (1.0625, 0.375), (2, 0)]
    near(curve([0, 0.25, 0.5, 0.75, 1])[:, :2], expected)
    for value, point in zip((0, 0.25, 0.5, 0.75, 1), expected):
        near(de_casteljau(PARABOLA, value)[-1][0], point)
    left, right = curve.split(0.4)
    near(left.points[:, :2], [(-1, 0), (-0.6, 0.4), (-0.04, 0.48)])
    near(right.points[:, :2], [(-0.04, 0.48), (0.8, 0.6), (2, 0)])
    near(curve.elevate().points[:, :2], [(-1, 0), (-1 / 3, 2 / 3), (2 / 3, 2 / 3), (2, 0)])
    twice = [(-1, 0), (-0.5, 0.5), (1 / 6, 2 / 3), (1, 0.5), (2, 0)]
    near(curve.elevate(2).points[:, :2], twice)


def test_saq_2b_a_quadratic_bezier_curve_is_a_parabola():
    x, y, _ = BezierCurve(PARABOLA).expressions()
    a, b = sympy.symbols("a b")
    conic = sympy.Poly(sympy.resultant(a - x, b - y, t), a, b)
    square = [conic.coeff_monomial(m) for m in (a**2, a * b, b**2)]
    assert square[1] ** 2 - 4 * square[0] * square[2] == 0


def test_saq_2c_equal_curves_have_equal_control_points():
    curve = BezierCurve(np.random.default_rng(0).normal(size=(6, 3)))
    places = np.arange(6) / 5
    near(np.linalg.solve(curve.knots.design(places), curve(places)), curve.points, 1e-11)


def test_saq_2d_monomial_form():
    points = np.random.default_rng(3).normal(size=(5, 3))

    def entry(i, j):
        return (-1) ** (j - i) * comb(4, i) * comb(4 - i, j - i) if j >= i else 0

    matrix = np.array([[entry(i, j) for j in range(5)] for i in range(5)])
    near(BezierCurve(points).monomial(), matrix.T @ points)


@pytest.mark.parametrize(("n", "i"), [(3, 1), (4, 2), (7, 5)])
def test_saq_2f_largest_value_of_a_bernstein_polynomial(n, i):
    peak = Fraction(comb(n, i) * i**i * (n - i) ** (n - i), n**n)
    assert bernstein(n, i, Fraction(i, n)) == peak
    assert all(bernstein(n, i, Fraction(k, 100)) <= peak for k in range(101))


def test_saq_2g_derivative():
    curve = BezierCurve(np.random.default_rng(4).normal(size=(6, 3)))
    near(curve.derivative(S), BezierCurve(5 * np.diff(curve.points, axis=0))(S))
    near(curve.derivative_curve()(S), curve.derivative(S))


@pytest.mark.parametrize("s", [0.25, 0.5, 0.8])
def test_saq_2h_joint_of_curves_on_two_intervals(s):
    p = np.random.default_rng(5).normal(size=(4, 3))
    second = p[3] + (1 - s) / 2 * (3 / s) * (p[3] - p[2])  # (m/s)(P_m - P_m-1) = (n/(1-s))(Q_1 - Q_0)
    left = BezierCurve(p).over((0, s))
    right = BezierCurve([p[3], second, (1, 2, 3)]).over((s, 1))
    assert continuity(left, "t1", right, "t0").c1
    same_ends = BezierCurve([p[3], p[3] + (p[3] - p[2]) * 1.5, (1, 2, 3)]).over((s, 1))
    assert continuity(left, "t1", same_ends, "t0").c1 == (s == 0.5)


def test_saq_2i_difference_points():
    curve = BezierCurve(np.random.default_rng(6).normal(size=(7, 3)))
    for k in range(5):
        expected = sum((-1) ** (k - j) * comb(k, j) * curve.points[j : 7 - k + j] for j in range(k + 1))
        near(curve.differences(k), expected)


@pytest.mark.parametrize("s", [0.3, 0.7])
def test_saq_2j_ratio_at_a_subdivision_is_s_to_one_minus_s(s):
    curve = BezierCurve(np.random.default_rng(7).normal(size=(4, 3)))
    left, right = curve.split(s)
    before, after = left.points[3] - left.points[2], right.points[1] - right.points[0]
    near((1 - s) * before, s * after)
    assert continuity(left.over((0, s)), "t1", right.over((s, 1)), "t0").c2


def test_saq_2k_composite_bicubic():
    p = np.random.default_rng(8).normal(size=(4, 4, 3))
    q = np.random.default_rng(9).normal(size=(4, 4, 3))
    assert not continuity(BezierSurface(p), "u1", BezierSurface(q), "u0").c0
    q[0] = p[3]
    report = continuity(BezierSurface(p), "u1", BezierSurface(q), "u0")
    assert report.c0
    assert not report.g1
    q[1] = q[0] + (p[3] - p[2])
    assert continuity(BezierSurface(p), "u1", BezierSurface(q), "u0").c1
    q[1] = q[0] + 2.5 * (p[3] - p[2])
    report = continuity(BezierSurface(p), "u1", BezierSurface(q), "u0")
    assert report.g1
    assert not report.c1


@pytest.mark.parametrize("knots", [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1]])
def test_saq_3a_b_splines_without_inner_knots_are_bernstein(knots):
    p = len(knots) // 2 - 1
    for i in range(p + 1):
        for value in (Fraction(1, 3), Fraction(0), Fraction(1)):
            assert basis_function(knots, i, p, value) == bernstein(p, i, value)


def test_saq_3b_clamped_curves_start_and_end_at_control_points():
    points = np.random.default_rng(10).normal(size=(8, 3))
    for p in (1, 2, 3, 5):
        near(BSplineCurve(points, p)([0, 1]), points[[0, -1]])


def test_saq_3c_d_repeated_control_points_lie_on_the_curve():
    points = np.random.default_rng(11).normal(size=(9, 3))
    points[4] = points[5] = points[3]  # P_(i-p+1) ... P_i with p = 3, i = 5
    curve = BSplineCurve(points, 3)
    near(curve(curve.knots.values[6]), points[3])  # at the knot u_(i+1)


def test_saq_3e_a_knot_of_multiplicity_one_less_than_the_degree_lies_on_a_leg():
    points = np.random.default_rng(12).normal(size=(7, 3))
    curve = BSplineCurve(points, 3, [0, 0, 0, 0, 0.4, 0.4, 0.7, 1, 1, 1, 1])
    at, leg = curve(0.4) - points[2], points[3] - points[2]
    assert np.linalg.norm(np.cross(at, leg)) < 1e-12
    assert 0 < at @ leg < leg @ leg


def test_saq_3f_derivative_spline():
    points = np.random.default_rng(13).normal(size=(7, 3))
    knots = [0, 0, 0, 0, 2 / 5, 3 / 5, 3 / 5, 1, 1, 1, 1]
    derived = BSplineCurve(points, 3, knots).derivative_curve()
    assert derived.degree == 2
    near(derived.knots.values, [0, 0, 0, 2 / 5, 3 / 5, 3 / 5, 1, 1, 1])
    expected = np.array([15 / 2, 5, 5, 5, 15 / 2, 15 / 2])[:, None] * np.diff(points, axis=0)
    near(derived.points, expected)


@pytest.mark.parametrize("kind", ["clamped", "open", "closed"])
def test_saq_3g_derivative_of_open_and_closed_curves(kind):
    curve = BSplineCurve(np.random.default_rng(14).normal(size=(8, 3)), 3, kind)
    near(curve.derivative_curve()(S), curve.derivative(S), 1e-11)
    assert curve.derivative_curve().closed == (kind == "closed")


@pytest.mark.parametrize("p", [2, 3])
def test_saq_3h_de_boor_becomes_de_casteljau(p):
    points = [[Fraction(k * k - 3 * k), Fraction(k**3, 2)] for k in range(p + 1)]
    knots = [Fraction(0)] * (p + 1) + [Fraction(1)] * (p + 1)
    for value in (Fraction(1, 3), Fraction(3, 4)):
        first = de_boor(np.array(points, dtype=object), knots, p, value)
        second = de_casteljau(np.array(points, dtype=object), value)
        assert all((a == b).all() for a, b in zip(first, second))


def test_saq_3i_bezier_pieces():
    n, p = 8, 3
    pieces = BSplineCurve(np.random.default_rng(15).normal(size=(n + 1, 3)), p).bezier_pieces()
    assert len(pieces) == n - p + 1
    distinct = {tuple(np.round(q, 9)) for piece in pieces for q in piece.points}
    assert len(distinct) == (n - p + 1) * p + 1


def arc(s):
    return 4 * s * (1 - s)


def test_saq_4b_bilinear_coons_patch_leaves_the_hull_of_its_edges():
    arcs = [lambda s: (s, 0, arc(s)), lambda s: (s, 1, arc(s)), lambda s: (0, s, arc(s)), lambda s: (1, s, arc(s))]
    near(coons(*arcs)(0.5, 0.5), [0.5, 0.5, 2])  # every edge has z <= 1


def test_saq_4c_cubic_edges_give_a_bicubic_patch():
    rng = np.random.default_rng(16)
    corners = rng.normal(size=(2, 2, 3))

    def between(a, b):
        return BezierCurve([a, *rng.normal(size=(2, 3)), b])

    patch = coons(
        between(corners[0, 0], corners[1, 0]),
        between(corners[0, 1], corners[1, 1]),
        between(corners[0, 0], corners[0, 1]),
        between(corners[1, 0], corners[1, 1]),
    )
    tensor = patch.to_nurbs()
    assert tensor.degrees == (3, 3)
    assert tensor.points.shape == (4, 4, 3)
    near(tensor.grid(S, S), patch.grid(S, S))


def test_saq_4d_cross_derivative_depends_on_the_opposite_edge():
    sides = [lambda s: (s, 0, 0), lambda s: (s, 1, 0), lambda s: (0, s, 0)]
    flat = coons(*sides, lambda s: (1, s, 0))
    bumped = coons(*sides, lambda s: (1, s, arc(s)))
    change = bumped.derivative(0.0, S, 1, 0) - flat.derivative(0.0, S, 1, 0)
    near(change[:, 2], arc(S), 1e-9)
    smooth = [coons(*sides, right, "cubic") for right in (lambda s: (1, s, 0), lambda s: (1, s, arc(s)))]
    difference = smooth[1].derivative(0.0, S, 1, 0) - smooth[0].derivative(0.0, S, 1, 0)
    near(difference, 0, 1e-9)


def test_exercise_1a_uniform_basis():
    knots = [Fraction(k) for k in range(5)]
    for value in (Fraction(1, 3), Fraction(4, 3), Fraction(8, 3)):
        expected = [value**2 / 2, -(value**2) + 3 * value - Fraction(3, 2), value**2 / 2 - 3 * value + Fraction(9, 2)]
        assert basis_function(knots, 0, 2, value) == expected[int(value)]
        assert basis_function(knots, 1, 2, value + 1) == expected[int(value)]


def test_exercise_1b_triple_knot():
    knots = [Fraction(k) for k in (0, 1, 2, 3, 3, 3, 4, 5, 6)]
    pieces = {
        (1, 1): lambda x: x**2 / 2 - x + Fraction(1, 2),
        (1, 2): lambda x: -3 * x**2 / 2 + 7 * x - Fraction(15, 2),
        (2, 2): lambda x: (x - 2) ** 2,
        (3, 3): lambda x: (x - 4) ** 2,
        (4, 3): lambda x: -3 * x**2 / 2 + 11 * x - Fraction(39, 2),
        (4, 4): lambda x: x**2 / 2 - 5 * x + Fraction(25, 2),
    }
    for (i, start), formula in pieces.items():
        for part in (Fraction(0), Fraction(1, 3), Fraction(6, 7)):
            assert basis_function(knots, i, 2, start + part) == formula(start + part)
    assert all(basis_function(knots, 3, 1, Fraction(k, 7)) == 0 for k in range(43))
    assert KnotVector([0, 1, 2, 3, 3, 3, 4, 5, 6], 2).domain == (2, 4)
