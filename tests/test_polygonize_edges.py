"""Meshes where formulas and bounds meet in unlucky ways: poles, faces of the bounds, far places, kinks."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Ball, Box, Surface, polygonize, torus

POLES = {
    "tan(x) = y": 2,
    "z = 1/(x^2 + y^2 - 0.3)": 2,
    "(x^2 + y^2 + z^2 - 1)/(x - 0.123)": 1.5,
    "(x - 0.1234)^(-31) = 20 z": 1.5,
    "1/x + y": Box((-1, -1, -1), (1.1, 1, 1)),
    "(x - 0.1234)^(-3) = 20 z": 1.5,
}


@pytest.mark.parametrize("formula", POLES)
@pytest.mark.parametrize("cells", [24, 41])
def test_a_pole_is_no_surface(formula, cells):
    surface = Surface(formula)
    mesh = polygonize(surface, POLES[formula], resolution=cells)
    values, slopes = surface.field.gradients(mesh.vertices)
    assert len(mesh.faces) and (np.abs(values) <= 1e-9 * np.maximum(np.linalg.norm(slopes, axis=1), 1)).all()
    assert np.isfinite(mesh.normals).all()


def test_a_sphere_divided_by_a_plane_is_the_sphere_but_for_the_plane():
    mesh = polygonize(Surface("(x^2 + y^2 + z^2 - 1)/(x - 0.123)"), 1.5, resolution=40)
    assert mesh.report().components == 2
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 1e-12
    assert 0.9 * 4 * np.pi < mesh.area < 4 * np.pi


@pytest.mark.parametrize("formula", ["abs(x)^(2/3) + abs(y)^(2/3) + abs(z)^(2/3) = 1", "(x^2 + y^2)^(1/3) + z = 1"])
def test_normals_are_finite_where_gradients_are_not(formula):
    mesh = polygonize(Surface(formula), 1.2, resolution=24)
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-9
    assert mesh.separate().report().manifold


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 9), st.floats(-1, 1), st.sampled_from(["box", "ball", "seeds"]))
def test_polynomials_far_away_are_meshed_as_well_as_here(power, shift, kind):
    """A torus at 10^2 to 10^9: as round as the spacing of floats there allows."""
    place = np.array([10.0**power, 10.0**power * shift, 0])
    surface, more = torus(2, 1).translate(place), {}
    bounds = Ball(3.2, place) if kind == "ball" else Box(place - 3.2, place + 3.2)
    if kind == "seeds":
        more = {"seeds": place + (3, 0, 0), "method": "following"}
    mesh = polygonize(surface, bounds, resolution=30, **more)
    report = mesh.report()
    assert (report.components, report.genus, report.closed) == (1, 1, True)
    away = mesh.vertices - place
    off = np.hypot(np.hypot(away[:, 0], away[:, 1]) - 2, away[:, 2]) - 1
    assert np.abs(off).max() < 1e-12 + 8 * np.spacing(np.abs(place).max())


def test_a_cone_far_away_keeps_its_node_and_what_is_listed_moves_with_it():
    mesh = polygonize(Surface("(x - 1e6)^2 + y^2 = z^2"), Ball(2, (1e6, 0, 0)), resolution=24)
    assert mesh.vertices[mesh.points].tolist() == [[1e6, 0, 0]] and mesh.euler == 1 and not len(mesh.unresolved)


@pytest.mark.parametrize(
    ("formula", "bounds", "area"),
    [
        ("x y z", Box((0, 0, 0), (1, 1, 1)), 3),
        ("x y z", Box((0, -1, -1), (1, 1, 1)), 8),
        ("x (x^2 + y^2 + z^2 - 1)", Ball(1), 5 * np.pi),
    ],
)
@pytest.mark.parametrize("cells", [31, 32])
def test_what_lies_in_a_wall_of_the_bounds_belongs_to_the_mesh(formula, bounds, area, cells):
    mesh = polygonize(Surface(formula), bounds, resolution=cells)
    report = mesh.report()
    assert report.components == 1 and report.degenerate_faces == 0
    assert mesh.area == pytest.approx(area, rel=3e-3)


@pytest.mark.parametrize("formula", ["x + y = 2", "x + y + z = 3", "x^2 + y^2 = 2", "x^2 + y^2 + z^2 = 3"])
def test_touching_an_edge_or_a_corner_of_the_bounds_makes_no_face(formula):
    assert not len(polygonize(Surface(formula), 1, resolution=8, method="marching").faces)


marching = partial(polygonize, method="marching")


@given(st.integers(1, 6))
def test_points_of_the_lattice_where_f_only_touches_0_make_no_face(cells):
    assert not len(marching(Surface("x^2 + y^2 + z^2"), 1, resolution=2 * cells).faces)
    assert not len(marching(Surface("0 - x^2 - y^2 - z^2"), 1, resolution=2 * cells).faces)


@pytest.mark.parametrize("power", [2, 3, 4])
@pytest.mark.parametrize("sign", ["", "0 - "])
def test_multiplicities_do_not_hide_a_surface(power, sign):
    once = polygonize(Surface("x^2 + y^2 + z^2 = 1"), 1.5, resolution=24)
    several = polygonize(Surface(f"{sign}(x^2 + y^2 + z^2 - 1)^{power}"), 1.5, resolution=24)
    assert np.array_equal(several.vertices, once.vertices) and several.euler == 2
    assert several.volume == pytest.approx(-once.volume if sign and power == 3 else once.volume)


@pytest.mark.parametrize("formula", ["x^2 (x^2 + y^2 + z^2 - 1)", "0 - x^2 (x^2 + y^2 + z^2 - 1)^3"])
def test_faces_beside_an_even_factor_look_to_where_f_grows(formula):
    surface = Surface(formula)
    mesh = polygonize(surface, 1.5, resolution=24)
    assert mesh.area == pytest.approx(4 * np.pi + 9, rel=0.01) and mesh.euler == 3 and not len(mesh.unresolved)
    corners = mesh.vertices[mesh.faces]
    middles, across = corners.mean(axis=1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sphere = np.abs(middles[:, 0]) > 0.1
    assert (surface(middles + 0.05 * across) > surface(middles - 0.05 * across))[sphere].all()
