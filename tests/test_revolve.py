"""Surfaces of revolution and conics: they satisfy their implicit equations."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
import sympy

from implicit import SingularPointError
from parametric import (
    BezierCurve,
    Conic,
    circle,
    ellipse,
    helix,
    hyperbola,
    line,
    parabola,
    polyline,
    revolve,
    rotation,
    t,
)

Y_AXIS = ((0, 0, 0), (0, 1, 0))
QUADRICS = {
    "sphere": (circle(2, angle=pi), None, lambda x, y, z: (x * x + y * y + z * z) / 4 - 1),
    "ellipsoid": (ellipse(3, 1, domain=(0, pi)), None, lambda x, y, z: x * x / 9 + y * y + z * z - 1),
    "paraboloid": (parabola(0.5), None, lambda x, y, z: y * y + z * z - 2 * x),
    "two sheets": (hyperbola(1, 2), None, lambda x, y, z: x * x - (y * y + z * z) / 4 - 1),
    "one sheet": (hyperbola(1, 2, domain=(-1, 1)), Y_AXIS, lambda x, y, z: x * x + z * z - y * y / 4 - 1),
    "cylinder": (line((0, 2), (5, 2)), None, lambda x, y, z: (y * y + z * z) / 4 - 1),
    "cone": (line((0, 0), (1, 2)), None, lambda x, y, z: (y * y + z * z) / 4 - x * x),
    "torus": (circle(1, (0, 3)), None, lambda x, y, z: ((x * x + y * y + z * z + 8) / 24) ** 2 - (y * y + z * z) / 16),
    "elliptical torus": (ellipse(2, 1, (0, 3)), None, lambda x, y, z: (np.hypot(y, z) - 3) ** 2 + x * x / 4 - 1),
}


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def on_grid(surface, count=30):
    (a, b), (c, d) = surface.domain
    return np.moveaxis(surface.grid(np.linspace(a, b, count), np.linspace(c, d, count)), -1, 0)


@pytest.mark.parametrize("name", QUADRICS)
def test_implicit_residual(name):
    curve, axis, equation = QUADRICS[name]
    surface = revolve(curve) if axis is None else revolve(curve, axis)
    assert np.abs(equation(*on_grid(surface))).max() <= 1e-13
    assert np.abs(equation(*on_grid(surface.to_nurbs()))).max() <= 1e-13


@pytest.mark.parametrize("name", ["sphere", "paraboloid", "cone", "cylinder", "torus"])
def test_implicitize_gives_the_equation(name):
    curve, _, equation = QUADRICS[name]
    surface = revolve(curve)
    found = surface.implicitize()
    assert found.degree == (4 if name == "torus" else 2)
    points = np.random.default_rng(0).normal(size=(20, 3))
    ratio = found(points) / equation(*points.T)
    near(ratio / ratio[0], 1, 1e-9)


def test_the_second_parameter_is_the_true_angle():
    """splipy's revolve takes the rational parameter for it: (3.5, 0.7336, 1.3084) on the cone of Example 5.1."""
    surface = revolve(line((1, 1, 0), (6, 2, 0)), angle=2.0)
    for angle in (0.0, 0.3, pi / 3, 1.9):
        near(surface(0.5, angle), [3.5, 1.5 * cos(angle), 1.5 * sin(angle)])
    near(surface.to_nurbs()(0.5, [0.0, 1.0, 2.0])[:, 1], 1.5 * np.cos([0, 1, 2]))


def test_exact_nurbs_lies_on_the_surface_about_any_axis():
    point, direction = np.array([1.0, 2, -1]), np.array([1.0, -1, 2])
    curve = BezierCurve(np.random.default_rng(0).normal(size=(4, 3)))
    for angle in (0.7, pi, 5.0, 2 * pi):
        surface = revolve(curve, (point, direction), angle)
        nurbs = surface.to_nurbs()
        assert nurbs.domain == surface.domain
        where = np.linspace(0, angle, 17)
        found = nurbs(0.3, where)
        start = np.append(curve(0.3), 1)
        unit = direction / np.linalg.norm(direction)
        e1 = start[:3] - point - ((start[:3] - point) @ unit) * unit
        across = found - point - ((start[:3] - point) @ unit) * unit
        phi = np.unwrap(np.arctan2(across @ np.cross(unit, e1), across @ e1))
        near(found, [(rotation(direction, p, point) @ start)[:3] for p in phi], 1e-12)


def test_derivatives_are_limits():
    surface = revolve(helix(1, 2), ((0, 1, 0), (1, 1, 0)), 3.0)
    rng = np.random.default_rng(0)
    a, b, h = 0.1 + 6 * rng.random(20), 0.1 + 2.8 * rng.random(20), 1e-5
    for i, j in ((1, 0), (0, 1), (1, 1), (0, 3)):
        step = (0, h) if j else (h, 0)
        lower = (i, j - 1) if j else (i - 1, j)
        limit = surface.derivative(a + step[0], b + step[1], *lower) - surface.derivative(
            a - step[0], b - step[1], *lower
        )
        near(surface.derivative(a, b, i, j), limit / (2 * h), 1e-7)


def test_iso_curves_are_circles_and_turned_profiles():
    surface = revolve(parabola(1), ((0, 1, 0), (1, 1, 0)), 4.0)
    where = np.linspace(0, 1, 9)
    near(surface.iso_u(0.3)(4 * where), surface(0.3, 4 * where))
    near(surface.iso_v(1.7)(where), surface(where, 1.7))
    assert surface.iso_u(0.3).to_nurbs().degree == surface.iso_v(1.7).to_nurbs().degree == 2
    with pytest.raises(ValueError, match=r"parameter v must lie in \[0, 4\], got 5"):
        surface.iso_v(5.0)


def test_orientation_is_as_stated():
    """Towards the axis where the profile runs along it, away where it runs back: the circle from +x runs back."""
    along = revolve(line((0, 1), (3, 1)))
    near(along.normal(0.5, 0.0), [0, -1, 0])
    back = revolve(line((3, 1), (0, 1)))
    near(back.normal(0.5, 0.0), [0, 1, 0])
    sphere = revolve(circle(2, angle=pi))
    angles = np.linspace(0.1, 3, 9)
    near(sphere.normal(angles, 0.7), sphere(angles, 0.7) / 2)


def test_normals_at_the_poles_are_limits_and_a_cone_has_none_at_its_tip():
    near(revolve(circle(2, angle=pi)).normal([0.0, pi], 1.0), [[1, 0, 0], [-1, 0, 0]])
    near(revolve(parabola(1)).normal(0.0, 2.0), [1, 0, 0])
    cone = revolve(line((0, 0), (1, 1)))
    with pytest.raises(SingularPointError, match=r"no normal at \(u, v\) = \(0, 1\)"):
        cone.normal(0.0, 1.0)
    found = cone.normal([0.0, 0.5], 0.0, undefined="nan")
    assert np.isnan(found[0]).all()
    near(found[1], [sqrt(0.5), -sqrt(0.5), 0])


def test_profiles_of_any_kind():
    points = [(0, 1, 0), (1, 2, 0), (3, 1, 0)]
    near(revolve(points)(0.5, pi / 2), [1, 0, 2])
    near(revolve(lambda s: (s, 1 + s, 0))(0.5, pi / 2), [0.5, 0, 1.5])
    assert revolve(polyline(points)).breaks[0].tolist() == [0, 0.5, 1]


@pytest.mark.parametrize(
    ("curve", "equation"),
    [
        (circle(2, (1, 1, 3)), lambda x, y, z: (x - 1) ** 2 + (y - 1) ** 2 - 4),
        (ellipse(3, 1, domain=(0.3, 5)), lambda x, y, z: x * x / 9 + y * y - 1),
        (hyperbola(2, 1, (1, 0), (-1, 1.2)), lambda x, y, z: (x - 1) ** 2 / 4 - y * y - 1),
        (parabola(2, (0, 1), (-1, 2)), lambda x, y, z: (y - 1) ** 2 - 8 * x),
    ],
)
def test_conics_are_exact_and_so_are_their_nurbs(curve, equation):
    where = np.linspace(*curve.domain, 60)
    for form in (curve, curve.to_nurbs()):
        assert form.domain == curve.domain
        assert np.abs(equation(*form(where).T)).max() < 1e-13 * 60
    near(curve.to_nurbs()([*curve.domain]), curve([*curve.domain]))


def test_conic_parameters_are_those_of_the_textbook():
    near(circle(2)(0.7), [2 * cos(0.7), 2 * sin(0.7), 0])
    near(ellipse(3, 2)(0.7), [3 * cos(0.7), 2 * sin(0.7), 0])
    near(hyperbola(3, 2)(0.7), [3 / cos(0.7), 2 * np.tan(0.7), 0])
    near(parabola(3)(0.7), [3 * 0.49, 6 * 0.7, 0])
    near(helix(2, 3)(pi), [-2, 0, 1.5])


def test_conic_derivatives_against_sympy():
    for curve in (ellipse(3, 2), hyperbola(3, 2)):
        for order in (1, 2, 3):
            expected = [float(e.diff(t, order).subs(t, 0.4)) for e in curve.expressions()]
            near(curve.derivative(0.4, order), expected, 1e-10)


def test_parts_of_conics_keep_their_parameter_and_are_exact():
    whole = ellipse(3, 2)
    for curve in (whole, whole.over((0, 1)), whole.transform(rotation((1, 2, 3), 0.4)), whole.reversed()):
        cut = curve.domain[1] / 3
        first, second = curve.split(cut)
        assert (first.domain[1], second.domain[0]) == (cut, cut)
        where = np.linspace(0, cut, 9)
        near(first(where), curve(where))
        near(first.to_nurbs()([0.0, cut]), curve([0.0, cut]))
        assert first.elevate().degree == 3
        assert len(curve.bezier_pieces()) == 4
    with pytest.raises(ValueError, match="a part of a FormulaCurve is no rational curve"):
        helix(1, 1).split(1.0)[0].to_nurbs()


def test_expressions_of_a_revolution():
    x, y, z = revolve(circle(1, (0, 3))).expressions()
    assert sympy.simplify((x**2 + y**2 + z**2 + 8) ** 2 - 36 * (y**2 + z**2)) == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: revolve(circle(), angle=0), r"angle of revolution must be in \(0, 2 pi\], got 0"),
        (lambda: revolve(circle(), angle=7), r"angle of revolution must be in \(0, 2 pi\], got 7"),
        (lambda: revolve(circle(), ((0, 0, 0), (0, 0, 0))), "direction must not be the zero vector"),
        (lambda: revolve(circle(), ((0, 0, 0),)), r"an axis is a pair \(point, direction\)"),
        (lambda: revolve(circle(), angle=1)(0.0, 1.5), r"parameter v must lie in \[0, 1\], got 1.5"),
        (lambda: revolve(circle(), angle=1)(-1.0, 0.5), r"parameter u must lie in \[0, 6.28319\], got -1"),
        (lambda: circle(-1), "radius must be positive and finite, got -1"),
        (lambda: circle(1, angle=0), "the angles must be two finite increasing numbers"),
        (lambda: hyperbola(1, 1, domain=(0, 2)), r"t inside \(-pi/2, pi/2\)"),
        (lambda: parabola(0), "a must be positive"),
        (lambda: helix(1, 1, turns=0), "turns must be positive"),
        (lambda: revolve(lambda s: (s, 1, 0)).to_nurbs(), "a FunctionCurve is no rational curve"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_capped_partial_turns_are_closed():
    wedge = revolve([(0, 1), (2, 1), (2, 2), (0, 2), (0, 1)], angle=1.0, caps=True)
    assert wedge.closed
    with pytest.raises(ValueError, match="a full turn has no ends to cap"):
        revolve(circle(1, (0, 3)), caps=True)


def test_procedural_surfaces_cannot_be_changed():
    surface = revolve(circle())
    with pytest.raises(AttributeError, match="a RevolvedSurface cannot be changed"):
        surface.angle = 1.0


def test_conics_cannot_be_changed():
    curve = circle()
    assert isinstance(curve, Conic)
    with pytest.raises(ValueError, match="read-only"):
        curve.matrix[0, 0] = 1
