"""Ruled and lofted surfaces and Gordon's: they contain every curve they were made from."""

import numpy as np
import pytest
import sympy

from parametric import BezierSurface, FormulaSurface, circle, gordon, loft, ruled, u, v

S = np.linspace(0, 1, 21)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_ruled_surface_between_any_two_curves():
    cone = ruled(circle(1), circle(2, (0, 0, 3)))
    assert cone.domain == ((0, 2 * np.pi), (0, 1))
    near(cone(1.0, S), (1 - S)[:, None] * circle(1)(1.0) + S[:, None] * circle(2, (0, 0, 3))(1.0))
    mixed = ruled(circle(1), [(0, 0, 1), (1, 0, 1), (1, 1, 1)])
    assert mixed.domain == ((0, 1), (0, 1))
    near(mixed(0.5, 1.0), [1, 0, 1])
    near(cone.to_nurbs().iso_v(0.5)(0.0), [1.5, 0, 1.5])
    cylinder = ruled(circle(2), circle(2, (0, 0, 1))).to_nurbs()
    points = cylinder.grid(2 * np.pi * S, S)
    near(np.hypot(points[..., 0], points[..., 1]), 2)


def test_loft_passes_through_every_section():
    sections = [circle(r, (0, 0, z)) for r, z in ((1, 0), (2, 1), (1.5, 2), (0.5, 3), (1, 5))]
    surface = loft(sections, [0, 0.2, 0.5, 0.6, 1])
    angles = 2 * np.pi * S
    for section, place in zip(sections, (0, 0.2, 0.5, 0.6, 1)):
        near(surface(angles, place), section(angles))


def network(surface, at_u, at_v):
    return [lambda s, y=y: surface(s, np.full_like(s, y)) for y in at_v], [
        lambda s, x=x: surface(np.full_like(s, x), s) for x in at_u
    ]


@pytest.mark.parametrize(
    ("at_u", "at_v"), [((0, 1), (0, 1)), ((0, 0.4, 1), (0, 0.3, 0.8, 1)), ((0, 0.1, 0.5, 0.6, 1), (0, 0.5, 1))]
)
def test_gordon_interpolates_every_curve(at_u, at_v):
    """sverchok's Gordon surface misses the inner curves (its issue 3603)."""
    target = FormulaSurface((u, v, sympy.sin(3 * u) * sympy.cos(2 * v)), ((0, 1), (0, 1)))
    rows, columns = network(target, at_u, at_v)
    surface = gordon(rows, columns)
    for curve, place in zip(rows, at_v):
        near(surface(S, place), curve(S))
    for curve, place in zip(columns, at_u):
        near(surface(place, S), curve(S))


def test_gordon_reproduces_a_bicubic_surface():
    target = BezierSurface(np.random.default_rng(0).normal(size=(4, 4, 3)))
    places = np.array([0, 1 / 3, 2 / 3, 1])
    surface = gordon([target.iso_v(p) for p in places], [target.iso_u(p) for p in places], places, places)
    near(surface.grid(S, S), target.grid(S, S))
