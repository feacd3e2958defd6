"""The worked examples of the source chapter."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
import sympy

from parametric import (
    BezierCurve,
    BSplineSurface,
    FormulaCurve,
    HermiteCurve,
    ParabolicBlend,
    circle,
    coons,
    line,
    parabola,
    revolve,
    t,
    transform_sweep,
)
from parametric.textbook.matrices import (
    bspline_hermite_data,
    bspline_matrix,
    evaluate_form,
    hermite_data,
    hermite_matrix,
    parabolic_matrix,
)

S = np.linspace(0, 1, 41)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_example_5_1_cone():
    surface = revolve(line((1, 1, 0), (6, 2, 0)))
    near(surface(0.5, pi / 3), [3.5, 0.75, 1.5 * sqrt(3) / 2])


def test_example_5_2_parabolic_blend():
    points = [(0, 1, 0), (2, 3, 0), (4, 1, 0), (5, 2, 0)]
    surface = revolve(ParabolicBlend(points))
    found = surface(0.5, pi / 3)
    near(found, [49 / 16, 33 / 32, 33 * sqrt(3) / 32])
    assert abs(found[2] - 1.786181) > 3e-6  # printed
    product = parabolic_matrix() @ np.column_stack([points, np.ones(4)])
    near(product, np.array([[-1, 7, 0, 0], [1, -11, 0, 0], [4, 0, 0, 0], [4, 6, 0, 2]]) / 2)


def test_example_5_3_line_sweep():
    def screw(s):
        c, d = cos(2 * pi * s), sin(2 * pi * s)
        return [[1, 0, 0, 0], [0, c, d, 0], [0, -d, c, 0], [10 * s, 0, 0, 1]]

    near(transform_sweep([(0, 0, 0), (0, 3, 0)], screw)(0.5, 0.5), [5, -1.5, 0])


def test_example_5_4_cubic_sweep_is_not_what_is_printed():
    curve = HermiteCurve((0, 3, 0), (3, 0, 0), (3, 0, 0), (3, 0, 0))
    s = sympy.Symbol("s")
    lift = sympy.Matrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 10 * s, 1]])
    near(transform_sweep(curve, lift)(0.5, 0.5), [1.5, 1.5, 5])
    near(curve(1.0), [3, 0, 0])
    near(curve.monomial()[::-1, :2], [[0, 6], [0, -9], [3, 0], [0, 3]])
    printed = hermite_matrix().copy()
    printed[1, 3] = 1
    wrong = evaluate_form(printed, [(0, 3, 0), (3, 0, 0), (3, 0, 0), (3, 0, 0)], [0.5, 1.0])
    near(wrong[:, 0], [3, 9])  # the printed matrix misses the end point (3, 0, 0)


def test_hermite_matrix_interpolates():
    np.testing.assert_array_equal(hermite_matrix(), [[2, -2, 1, 1], [-3, 3, -2, -1], [0, 0, 1, 0], [1, 0, 0, 0]])


def test_hermite_data_of_a_bezier_net():
    p = np.random.default_rng(0).normal(size=(4, 4, 3))

    def corner(i, k, j, m):
        return 9 * (p[i, j] - p[k, j] - p[i, m] + p[k, m])

    expected = [
        [p[0, 0], p[0, 3], 3 * (p[0, 1] - p[0, 0]), 3 * (p[0, 3] - p[0, 2])],
        [p[3, 0], p[3, 3], 3 * (p[3, 1] - p[3, 0]), 3 * (p[3, 3] - p[3, 2])],
        [3 * (p[1, 0] - p[0, 0]), 3 * (p[1, 3] - p[0, 3]), corner(0, 1, 0, 1), corner(0, 1, 2, 3)],
        [3 * (p[3, 0] - p[2, 0]), 3 * (p[3, 3] - p[2, 3]), corner(2, 3, 0, 1), corner(2, 3, 2, 3)],
    ]
    near(hermite_data(p), expected)


def test_example_5_5_matrix_of_a_uniform_span_and_not_of_a_clamped_one():
    near(6 * bspline_matrix(), [[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]])
    net = np.random.default_rng(17).normal(size=(5, 6, 3))
    a, b = np.random.default_rng(18).random((2, 30))
    uniform = BSplineSurface(net, 3, (np.arange(-3, 6), np.arange(-3, 7)))
    for i in (1, 2):
        for j in (1, 2, 3):
            part = net[i - 1 : i + 3, j - 1 : j + 3]
            span = evaluate_form(bspline_matrix(), part, a, b)  # local parameters u - (i - 1), v - (j - 1)
            near(uniform(a + i - 1, b + j - 1), span)
            near(evaluate_form(hermite_matrix(), bspline_hermite_data(part), a, b), span)
    clamped = BSplineSurface(net, 3)
    first = evaluate_form(bspline_matrix(), net[:4, :4], 0.0, 0.0)
    assert np.abs(clamped(0.0, 0.0) - first).max() > 0.1


def test_example_5_5_closed_patch_is_the_periodic_basis():
    net = np.random.default_rng(19).normal(size=(5, 6, 3))
    closed = BSplineSurface(net, 3, "closed")
    for a, b in np.random.default_rng(20).random((10, 2)):
        nu, nv = 5 * a, 6 * b
        i, j = int(nu), int(nv)
        part = net[np.ix_((i + np.arange(4)) % 5, (j + np.arange(4)) % 6)]
        near(closed(a, b), evaluate_form(bspline_matrix(), part, nu - i, nv - j))


def test_example_5_7_plane_edges_give_a_plane_patch_for_every_blend():
    rng = np.random.default_rng(21)
    axes, origin = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2], rng.normal(size=3)
    corners = rng.normal(size=(2, 2, 2))

    def edge(a, b):
        return BezierCurve([origin + q @ axes for q in (a, *rng.normal(size=(2, 2)), b)])

    sides = (
        edge(corners[0, 0], corners[1, 0]),
        edge(corners[0, 1], corners[1, 1]),
        edge(corners[0, 0], corners[0, 1]),
        edge(corners[1, 0], corners[1, 1]),
    )
    normal = np.cross(*axes)
    for blend in ("linear", "cubic", (lambda s: (1 - s) ** 3, lambda s: 1 - s**2)):
        heights = (coons(*sides, blend).grid(S, S) - origin) @ normal
        assert np.abs(heights).max() < 1e-12
    tangents = [
        BezierCurve([sides[2].derivative(0.0), sides[3].derivative(0.0)]),
        BezierCurve([sides[2].derivative(1.0), sides[3].derivative(1.0)]),
        BezierCurve([sides[0].derivative(0.0), sides[1].derivative(0.0)]),
        BezierCurve([sides[0].derivative(1.0), sides[1].derivative(1.0)]),
    ]
    lifted = coons(*sides, ribbons=tangents, twists=np.full((2, 2, 3), normal))
    assert np.abs((lifted.grid(S, S) - origin) @ normal).max() > 1e-3  # only twists or ribbons leave the plane


def test_example_5_7_derivative_of_the_patch():
    """P_v(u, v) = C + u D, D = P_v(1, v) - P_v(0, v) - P00 + P01 + P10 - P11, C = P_v(0, v) + P(u, 1) - P(u, 0) + ...

    The print has -P00 + P00 in D. On a patch with straight bottom and top the sum is checked as it stands.
    """
    left, right = BezierCurve([(0, 0, 1), (0, 0.5, 3), (0, 1, 0)]), BezierCurve([(1, 0, 0), (1, 0.2, -1), (1, 1, 2)])
    bottom, top = line((0, 0, 1), (1, 0, 0)), line((0, 1, 0), (1, 1, 2))
    patch = coons(bottom, top, left, right)
    p00, p10, p01, p11 = bottom(0.0), bottom(1.0), top(0.0), top(1.0)
    for a, b in np.random.default_rng(30).random((5, 2)):
        c = left.derivative(b) + top(a) - bottom(a) + p00 - p01
        d = right.derivative(b) - left.derivative(b) - p00 + p01 + p10 - p11
        near(patch.derivative(a, b, 0, 1), c + a * d)


def test_figure_5_24_counts():
    surface = BSplineSurface(
        np.random.default_rng(24).normal(size=(6, 6, 3)),
        (2, 3),
        ([0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1], [0, 0, 0, 0, 0.33, 0.66, 1, 1, 1, 1]),
    )
    assert [k.count for k in surface.knots] == [6, 6]
    assert [k.values.size for k in surface.knots] == [9, 10]


def test_torus_and_paraboloid_equations():
    torus = revolve(circle(1, (0, 3, 0))).grid(np.linspace(0, 2 * pi, 30), np.linspace(0, 2 * pi, 30))
    near((np.hypot(torus[..., 1], torus[..., 2]) - 3) ** 2 + torus[..., 0] ** 2, 1)
    bowl = revolve(parabola(0.5, domain=(0, 2))).grid(np.linspace(0, 2, 30), np.linspace(0, 2 * pi, 30))
    near(bowl[..., 1] ** 2 + bowl[..., 2] ** 2, 4 * 0.5 * bowl[..., 0])


def test_iso_curves_and_arc_length_of_a_formula_curve():
    helix = FormulaCurve((sympy.cos(t), sympy.sin(t), t), (0, 2 * pi))
    assert helix.length() == pytest.approx(2 * pi * sqrt(2), rel=1e-13)
