"""Bezier and B-spline curves: the algorithms leave the curve where it is."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from parametric import BezierCurve, BSplineCurve, FunctionCurve, HermiteCurve, ParabolicBlend, line, polyline
from parametric.curve import to_curve
from parametric.textbook.algorithms import de_boor, de_casteljau

QUICK = settings(max_examples=25, deadline=None)
S = np.linspace(0, 1, 33)


@st.composite
def curves(draw, kinds=("clamped", "open", "closed"), rational=True):
    degree, kind = draw(st.integers(1, 5)), draw(st.sampled_from(kinds))
    count = draw(st.integers(degree + 1, degree + 6))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    weights = rng.random(count) + 0.5 if rational and draw(st.booleans()) else None
    return BSplineCurve(rng.normal(size=(count, 3)), degree, kind, weights)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@given(curves())
@QUICK
def test_elevation_insertion_reversal_and_pieces_leave_the_curve(curve):
    near(curve.elevate(2)(S), curve(S))
    near(curve.insert_knot(0.37)(S), curve(S))
    near(curve.insert_knot(0.37).remove_knot(0.37).points, curve.points, 1e-11)
    near(curve.reversed()(S), curve(1 - S))
    near(curve.over((2, 5))(2 + 3 * S), curve(S))
    ends = curve.breaks
    for piece, low, high in zip(curve.bezier_pieces(), ends[:-1], ends[1:]):
        near(piece(S), curve(np.clip(low + (high - low) * S, low, high)))


@given(curves(), st.floats(0.05, 0.95))
@QUICK
def test_split_parts_are_the_curve(curve, t):
    left, right = curve.split(t)
    near(left(t * S), curve(t * S))
    near(right(t + (1 - t) * S), curve(t + (1 - t) * S))
    near(left(t), right(t))


@given(curves(rational=False))
@QUICK
def test_de_boor_agrees(curve):
    net, knots = curve.knots.unwrap(curve.points), curve.knots.values.tolist()
    for t in (0.0, 0.31, 0.5, 0.77, 1.0):
        near(de_boor(net, knots, curve.degree, t)[-1][0], curve(t))


@given(curves())
@QUICK
def test_derivatives_are_limits(curve):
    inside = S[1:-1] + 0.001
    inside = inside[np.abs(inside[:, None] - curve.breaks).min(axis=1) > 2e-4]
    for order in (1, 2):
        h = 1e-5
        limit = (curve.derivative(inside + h, order - 1) - curve.derivative(inside - h, order - 1)) / (2 * h)
        near(curve.derivative(inside, order), limit, 1e-4 * max(1, np.abs(limit).max()))


@given(curves(kinds=("clamped",)))
@QUICK
def test_affine_invariance_and_end_points(curve):
    matrix = np.vstack([np.random.default_rng(0).normal(size=(3, 4)), [0, 0, 0, 1]])
    near(curve.transform(matrix)(S), curve(S) @ matrix[:3, :3].T + matrix[:3, 3])
    near(curve([0, 1]), curve.points[[0, -1]])


@given(curves())
@QUICK
def test_strong_convex_hull(curve):
    points, first = curve.knots.unwrap(curve.points), curve.knots.first
    for k, (low, high) in enumerate(zip(curve.breaks[:-1], curve.breaks[1:])):
        local = points[first[k] : first[k] + curve.degree + 1]
        if curve.degree >= 3:
            hull = ConvexHull(local)
            heights = curve(low + (high - low) * S[:-1]) @ hull.equations[:, :3].T + hull.equations[:, 3]
            assert heights.max() < 1e-11


def test_derivative_against_exact_arithmetic():
    points = [[Fraction(k**3 - 4 * k), Fraction(7 * k, 3), Fraction(1, k + 1)] for k in range(6)]
    curve = BezierCurve(np.array(points, dtype=float))
    for t in (Fraction(1, 3), Fraction(5, 8)):
        level = de_casteljau(np.array(points, dtype=object), t)[-2]
        exact = 5 * (level[1] - level[0])
        np.testing.assert_allclose(curve.derivative(float(t)), exact.astype(float), rtol=1e-14)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_c_p_minus_k_at_a_knot_of_multiplicity_k(k):
    inner = [0.3] * k + [0.5, 0.6, 0.7, 0.8][: 5 - k]
    curve = BSplineCurve(np.random.default_rng(0).normal(size=(9, 3)), 3, [0] * 4 + inner + [1] * 4)
    left, right = curve.split(0.3)
    jumps = [np.abs(left.derivative(0.3, r) - right.derivative(0.3, r)).max() for r in range(4)]
    assert max(jumps[: 4 - k]) < 1e-10
    assert jumps[4 - k] > 1e-2


@pytest.mark.parametrize("p", [1, 2, 3, 4])
def test_closed_curves_close_smoothly(p):
    curve = BSplineCurve(np.random.default_rng(0).normal(size=(7, 3)), p, "closed")
    for order in range(p):
        near(curve.derivative(0.0, order), curve.derivative(1.0, order), 1e-10)
    assert curve.closed
    assert curve.insert_knot(0.1).closed


def test_high_degree_is_stable():
    curve = BezierCurve(np.random.default_rng(0).normal(size=(31, 3)))
    for t in (0.1, 0.5, 0.93):
        near(curve(t), de_casteljau(curve.points, t)[-1][0], 1e-14)


def test_hermite_curve_meets_its_data():
    rng = np.random.default_rng(0)
    p0, p1, d0, d1 = rng.normal(size=(4, 3))
    curve = HermiteCurve(p0, p1, d0, d1)
    near(curve([0, 1]), [p0, p1])
    near(curve.derivative([0, 1]), [d0, d1])


def test_parabolic_blend_of_many_points_is_c1_and_interpolates():
    points = np.random.default_rng(0).normal(size=(7, 3))
    curve = ParabolicBlend(points)
    near(curve(np.arange(5.0)), points[1:-1])
    near(curve.derivative(np.arange(5.0)), (points[2:] - points[:-2]) / 2)
    left, right = curve.split(2)
    near(left.derivative(2), right.derivative(2))


def test_parabolic_blend_blends_parabolas():
    p = np.random.default_rng(1).normal(size=(4, 3))
    t = 0.3
    first = np.array([np.polyval(np.polyfit([-1, 0, 1], p[:3, c], 2), t) for c in range(3)])
    second = np.array([np.polyval(np.polyfit([0, 1, 2], p[1:, c], 2), t) for c in range(3)])
    near(ParabolicBlend(p)(t), (1 - t) * first + t * second)


def test_polyline_passes_its_vertices_at_equal_steps():
    points = np.random.default_rng(0).normal(size=(5, 3))
    near(polyline(points)([0, 0.25, 0.5, 0.75, 1]), points)


def test_arc_length():
    assert polyline([(0, 0), (1, 0), (1, 2)]).length() == pytest.approx(3, rel=1e-13)
    assert line((0, 0, 0), (2, 3, 6)).length(0.25, 0.75) == pytest.approx(3.5, rel=1e-13)
    assert line((0, 0, 0), (2, 3, 6)).length(0.75, 0.25) == pytest.approx(-3.5, rel=1e-13)
    quadratic = BezierCurve([(0, 0), (0.5, 0), (1, 1)])  # y = x^2
    assert quadratic.length() == pytest.approx((2 * np.sqrt(5) + np.arcsinh(2)) / 4, rel=1e-12)


def test_function_curves_of_every_signature():
    shapes = [
        lambda t: (np.cos(t), np.sin(t), t),
        lambda t: np.stack([np.cos(t), np.sin(t), t + 0 * t], axis=-1),
        lambda t: [float(np.cos(t)), float(np.sin(t)), float(t)],
    ]
    s = np.linspace(0, 3, 50)
    for function in shapes:
        curve = FunctionCurve(function, (0, 3))
        near(curve(s), np.stack([np.cos(s), np.sin(s), s], axis=-1))
        near(curve.derivative(s), np.stack([-np.sin(s), np.cos(s), 1 + 0 * s], axis=-1), 1e-9)
    near(FunctionCurve(lambda t: (t, t**2))(0.5), [0.5, 0.25, 0])


def test_arguments_are_neither_changed_nor_kept():
    points = np.random.default_rng(0).normal(size=(5, 3))
    copy = points.copy()
    curve = BSplineCurve(points, 3)
    curve.elevate(), curve.insert_knot(0.5), curve.split(0.5), curve.reversed()
    np.testing.assert_array_equal(points, copy)
    points[0] = 7
    np.testing.assert_array_equal(curve.points, copy)
    with pytest.raises(ValueError, match="read-only"):
        curve.points[0] = 7
    with pytest.raises(AttributeError, match="cannot be changed"):
        curve.points = copy


POINTS = np.zeros((4, 3)) + np.arange(4)[:, None]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BezierCurve(np.zeros((2, 2, 3))), r"control points must be points of shape \(m, 3\) or \(m, 2\)"),
        (lambda: BezierCurve([(0, 0, 0)]), "at least two control points"),
        (lambda: BezierCurve([(0, 0, np.inf), (1, 1, 1)]), "control points must be finite"),
        (lambda: BezierCurve(POINTS, [1, 0, 1, 1]), "weights must be positive and finite, got 0 to 1"),
        (lambda: BezierCurve(POINTS, [1, 1]), r"weights must have one number for each point, shape \(4,\)"),
        (lambda: BezierCurve(POINTS)(1.1), r"parameter t must lie in \[0, 1\], got 1.1"),
        (lambda: BezierCurve(POINTS)(np.nan), r"parameter t must lie in \[0, 1\], got nan"),
        (lambda: BSplineCurve(POINTS, 2, "open")(-0.1), r"parameter t must lie in \[0, 1\]"),
        (lambda: BezierCurve(POINTS).split(1.0), r"splits at a parameter inside, got 1"),
        (lambda: BezierCurve(POINTS).elevate(-1), "raised by zero or more, got -1"),
        (lambda: BezierCurve(POINTS).insert_knot(0.5, 4), "has multiplicity 0 and cannot be inserted 4 times more"),
        (lambda: BezierCurve(POINTS).insert_knot(0.5, 0), "inserted at least once, got 0"),
        (lambda: BezierCurve(POINTS).remove_knot(0.5), r"0.5 is no inner knot; inner knots are \[\]"),
        (lambda: BSplineCurve(POINTS**2, 2).remove_knot(0.5), "cannot be removed: control points are off by"),
        (lambda: BezierCurve(POINTS, [1, 2, 1, 1]).derivative_curve(), "rational B-spline is no B-spline"),
        (lambda: BezierCurve(POINTS, [1, 2, 1, 1]).monomial(), "rational curve is no polynomial"),
        (lambda: polyline(POINTS).derivative_curve(), "derivative of a polyline"),
        (lambda: BSplineCurve(POINTS, 2).expressions(), "2 pieces: take expressions of one of bezier_pieces"),
        (lambda: ParabolicBlend(POINTS[:3]), "at least four points, got 3"),
        (lambda: line((0, 0, 0), (1, 1, 1, 1)), "b must be points of shape"),
        (lambda: line((0, 0), (1, 1)).over((1, 1)), "domain must be two finite increasing numbers"),
        (lambda: line((0, 0), (1, 1)).transform(np.eye(3)), r"affine map is a finite matrix \(4, 4\)"),
        (lambda: to_curve([1, 2, 3], "rail"), "rail must be a curve, a callable or the vertices of a polyline"),
        (lambda: to_curve(lambda t: 3.0, "rail"), "function must return three finite coordinates, got 3.0"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()
