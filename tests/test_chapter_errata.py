"""Misprints of the source chapter: the right formula is the one in use."""

from math import cos, pi, sin

import numpy as np
import pytest

from parametric import (
    BezierCurve,
    BezierSurface,
    BSplineSurface,
    FormulaSurface,
    continuity,
    coons,
    ellipse,
    hyperbola,
    line,
    revolve,
    rotation,
    transform_sweep,
    u,
    v,
)
from parametric.textbook.matrices import (
    bezier_matrix,
    evaluate_form,
    powers,
)

S = np.linspace(0, 1, 41)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_bicubic_bezier_form_has_degree_three_in_both_parameters():
    p = np.random.default_rng(1).normal(size=(4, 4, 3))
    surface = BezierSurface(p)
    a, b = np.random.default_rng(2).random((2, 50))
    near(evaluate_form(bezier_matrix(), p, a, b), surface(a, b))
    row = [(1 - 0.3) ** 3, 3 * 0.3 * 0.7**2, 3 * 0.3**2 * 0.7, 0.3**3]
    near(powers(0.3) @ bezier_matrix(), row)


def test_partially_bicubic_patch_has_no_corner_twist():
    patch = coons(
        *[
            BezierCurve(p)
            for p in (
                [(0, 0, 0), (1, 0, 3), (2, 0, 0)],
                [(0, 2, 1), (1, 3, 0), (2, 2, 0)],
                [(0, 0, 0), (0, 1, 5), (0, 2, 1)],
                [(2, 0, 0), (2, 1, -2), (2, 2, 0)],
            )
        ],
        "cubic",
    )
    near(patch.twist([0, 0, 1, 1], [0, 1, 0, 1]), 0)


def test_tangents_and_twist_by_their_own_parameters():
    surface = FormulaSurface((u**2, u * v, v**3), ((1, 2), (1, 2)))
    near(surface.derivative(1.5, 1.25, 1, 0), [3, 1.25, 0])
    near(surface.derivative(1.5, 1.25, 0, 1), [0, 1.5, 3 * 1.25**2])
    near(surface.twist(1.5, 1.25), [0, 1, 0])
    h = 1e-6
    for i, j in ((1, 0), (0, 1)):
        a, b = ((0, h), (h, 0))[i == 0]
        limit = (surface.derivative(1.5 + a, 1.25 + b, i, j) - surface.derivative(1.5 - a, 1.25 - b, i, j)) / (2 * h)
        near(limit, surface.twist(1.5, 1.25), 1e-8)


def test_exchanging_parameters_turns_the_normal():
    net = np.random.default_rng(22).normal(size=(4, 3, 3))
    one, other = BezierSurface(net), BezierSurface(net.transpose(1, 0, 2))
    near(one.normal(0.3, 0.6), -other.normal(0.6, 0.3))
    near(one.normal(0.3, 0.6), one.true_normal(0.3, 0.6) / np.linalg.norm(one.true_normal(0.3, 0.6)))


def test_a_plane_may_have_a_twist():
    plane = FormulaSurface((u, u * v, 0), ((1, 2), (0, 1)))
    near(plane.twist(1.5, 0.5), [0, 1, 0])
    near(plane.normal(1.5, 0.5), [0, 0, 1])


def test_equation_5_7_sphere_about_x_and_5_8_about_y():
    angles = np.linspace(0, 2 * pi, 25)
    about_x = revolve(ellipse(2, 2, domain=(0, pi))).grid(np.linspace(0, pi, 25), angles)
    about_y = revolve(ellipse(2, 2, domain=(-pi / 2, pi / 2)), ((0, 0, 0), (0, 1, 0))).grid(
        np.linspace(-pi / 2, pi / 2, 25), angles
    )
    for sphere in (about_x, about_y):
        near(np.linalg.norm(sphere, axis=-1), 2)
        assert np.ptp(sphere, axis=(0, 1)) == pytest.approx([4, 4, 4], abs=1e-12)
    half = revolve(ellipse(2, 2, domain=(0, pi)), ((0, 0, 0), (0, 1, 0))).grid(np.linspace(0, pi, 25), angles)
    assert half[..., 1].min() > -1e-12  # the printed range about the y-axis covers one half twice


def test_equation_5_11_hyperboloid_of_two_sheets_about_x_and_of_one_sheet_about_y():
    curve = hyperbola(2, 1, domain=(-1.2, 1.2))
    s, angles = np.linspace(-1.2, 1.2, 25), np.linspace(0, 2 * pi, 25)
    x, y, z = np.moveaxis(revolve(curve).grid(s, angles), -1, 0)
    near(x**2 / 4 - y**2 - z**2, 1, 1e-11)
    assert x.min() >= 2 - 1e-12
    x, y, z = np.moveaxis(revolve(curve, ((0, 0, 0), (0, 1, 0))).grid(s, angles), -1, 0)
    near((x**2 + z**2) / 4 - y**2, 1, 1e-11)


def test_equation_5_14_row_three_turns_space_curves():
    point = revolve(line((1, 2, 3), (2, 2, 3)))(0.0, 0.7)
    near(point, [1, 2 * cos(0.7) - 3 * sin(0.7), 2 * sin(0.7) + 3 * cos(0.7)])


def test_equation_5_15_any_axis_by_rodrigues():
    point, direction = np.array([1.0, -2, 0.5]), np.array([2.0, 1, -2])
    surface = revolve(line((0, 1, 1), (3, 1, 2)), (point, direction))
    start = np.append(line((0, 1, 1), (3, 1, 2))(0.3), 1)
    near(surface(0.3, 1.1), (rotation(direction, 1.1, point) @ start)[:3])
    turned = surface(0.3, [0.0, 1.1, 4.0])
    heights, radii = (turned - point) @ direction, np.linalg.norm(np.cross(turned - point, direction), axis=-1)
    assert np.ptp(heights) < 1e-12
    assert np.ptp(radii) < 1e-12


def test_equation_5_16_circle_without_division_by_zero():
    def turn(s):
        c, d = cos(2 * pi * s), sin(2 * pi * s)
        return [[c, d, 0, 0], [-d, c, 0, 0], [0, 0, 1, 0], [0, 0, 2 * s, 1]]

    for start in ((3, 0, 1), (0, 3, 1), (-3, 0, 1), (1, -2, 1)):  # r/x and r/y of the print divide by zero on the axes
        helix = transform_sweep([start, np.add(start, (0, 0, 1))], turn).iso_u(0.0)(S)
        near(np.hypot(helix[:, 0], helix[:, 1]), np.hypot(start[0], start[1]))
        near(helix[:, 2], 1 + 2 * S)


def test_translations_only_are_plane_on_straight_paths_only():
    def bent(s):
        return [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 10 * s, 10 * s**2, 1]]

    points = transform_sweep([(0, 0, 0), (1, 0, 0)], bent).grid([0, 1], S).reshape(-1, 3)
    assert np.linalg.matrix_rank(points - points[0]) == 3


def test_rows_run_with_u_and_the_last_of_row_zero_is_p_0n():
    net = np.random.default_rng(23).normal(size=(3, 5, 3))
    surface = BezierSurface(net)
    near(surface([0, 1, 0, 1], [0, 0, 1, 1]), [net[0, 0], net[2, 0], net[0, 4], net[2, 4]])
    near(surface.iso_u(0).points, net[0])
    near(surface.iso_u(1).points, net[2])
    near(surface.iso_v(1).points, net[:, 4])


def test_case_2_one_inner_knot_needs_degree_plus_two_points():
    net = np.zeros((5, 4, 3)) + np.indices((5, 4)).sum(axis=0)[..., None]
    with pytest.raises(ValueError, match="5 control points of degree 2 need 8 u knots, got 7"):
        BSplineSurface(net, (2, 2), ([0, 0, 0, 0.5, 1, 1, 1], [0, 0, 0, 0.5, 1, 1, 1]))


def test_case_3_crease():
    """At a knot of multiplicity k the surface is C^(p-k), here C^0 in u; v is C^2."""
    net = np.random.default_rng(25).normal(size=(5, 5, 3))
    surface = BSplineSurface(net, (2, 3), ([0, 0, 0, 0.5, 0.5, 1, 1, 1], [0, 0, 0, 0, 0.5, 1, 1, 1, 1]))
    left, right = surface.restrict(u=(0, 0.5)), surface.restrict(u=(0.5, 1))
    report = continuity(left, "u1", right, "u0")
    assert report.c0
    assert not report.g1
    assert continuity(surface.restrict(v=(0, 0.5)), "v1", surface.restrict(v=(0.5, 1)), "v0").c2
