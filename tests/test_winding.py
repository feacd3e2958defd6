"""Inside, on, outside of shells without a mesh; fractional winding numbers of open ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import OpenSurfaceError, Surface, UndecidedError, classify, winding_number
from implicit.sides.winding import MeshWinding
from parametric import (
    BezierSurface,
    BSplineSurface,
    FormulaSurface,
    Shell,
    circle,
    line,
    polyline,
    revolve,
    rotation,
    sweep,
    teapot,
    tessellate,
    u,
    v,
)
from tests.solids import (
    box_patches,
    disc_patches,
    from_weighted,
    hemisphere_patches,
    moebius_patches,
    reparametrized,
    torus_patches,
)

DISTANCES = (1e-3, 1e-6, 1e-9, 1e-12, 1e-13, 1e-14)


def near_torus(distance, count, seed=0, major=1.0, minor=0.4):
    """Points at a distance from the torus, and the sign of the exact distance (extended precision)."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0, 2 * np.pi, (2, count)).astype(np.longdouble)
    reach = minor + distance * np.where(np.arange(count) % 2, 1, -1).astype(np.longdouble)
    ring = major + reach * np.cos(b)
    return side_of_torus(np.stack([ring * np.cos(a), ring * np.sin(a), reach * np.sin(b)], 1).astype(float))


def side_of_torus(points, major=1.0, minor=0.4):
    x, y, z = points.T.astype(np.longdouble)
    off = np.hypot(np.hypot(x, y) - major, z) - np.longdouble(minor)
    return points, np.sign(off).astype(int), np.abs(off).astype(float)


@pytest.mark.parametrize("distance", DISTANCES)
def test_no_wrong_answer_near_a_torus(distance):
    points, side, _ = near_torus(distance, 4000)
    codes = classify(Shell(torus_patches()), points)
    wrong = (codes != 0) & (codes != side)
    assert not wrong.any()
    if distance >= 1e-14:
        assert (codes == 0).mean() <= 0.001


def test_no_wrong_answer_on_a_symmetric_lattice():
    axis = np.linspace(-1.5, 1.5, 25)
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    points, side, off = side_of_torus(lattice)
    solid = Shell(torus_patches())
    codes = classify(solid, points)
    clear = off > solid.solid.floor
    assert (codes[clear] == side[clear]).all()
    assert (codes[~clear] == 0).all()


def test_random_points_agree_with_the_implicit_torus():
    points, side, _ = side_of_torus(np.random.default_rng(1).uniform(-1.5, 1.5, (100_000, 3)))
    assert (classify(Shell(torus_patches()), points) == side).all()


def test_the_shape_of_the_points_is_kept():
    solid = Shell(torus_patches())
    assert classify(solid, (1, 0, 0)) == -1 and classify(solid, np.zeros((2, 3, 3))).shape == (2, 3)
    assert classify(solid, np.zeros((0, 3))).shape == (0,) and winding_number(solid, np.zeros((0, 3))).shape == (0,)
    with pytest.raises(ValueError, match="must be finite"):
        classify(solid, [(0, 0, 0), (0, np.nan, 0)])


@settings(max_examples=12, deadline=None)
@given(st.floats(-11, -1), st.integers(0, 1000))
def test_tolerance_is_a_distance(exponent, seed):
    tolerance = 10.0**exponent
    solid = Shell(torus_patches())
    for factor, on in ((0.99, True), (1.011, False)):
        points, side, _ = near_torus(factor * tolerance, 200, seed)
        codes = classify(solid, points, tolerance=tolerance)
        assert (codes == 0).all() if on else (codes == side).all()


def test_an_exact_answer_or_none():
    solid = Shell(torus_patches())
    assert list(classify(solid, [(1, 0, 0), (0, 0, 0), (1.4 + 1e-9, 0, 0)], tolerance=0)) == [-1, 1, 1]
    corner = solid.surfaces[0].points[0, 0]
    assert classify(solid, corner, tolerance=0) == 0
    with pytest.raises(UndecidedError, match="the certified floor of this shell is") as caught:
        classify(solid, [(0, 0, 0), (0.6, 0, np.nextafter(0, 1))], tolerance=0)
    assert list(caught.value.indices) == [1]
    assert classify(solid, (0.6, 0, np.nextafter(0, 1))) == 0


def test_rules_count_windings():
    inside = (1.0, 0.125, 0.015625)
    twice, turned = Shell(torus_patches() * 2), Shell(torus_patches(reverse=True))
    spindle = Shell(torus_patches(major=0.25))
    assert winding_number(twice, inside) == 2 and winding_number(turned, inside) == -1
    assert list(winding_number(spindle, [(0, 0, 0.05), (0.3, 0.0078125, 0)])) == [0, 1]
    answers = {
        rule: [int(classify(solid, inside, rule=rule)) for solid in (twice, turned)]
        for rule in ("nonzero", "positive", "evenodd")
    }
    assert answers == {"nonzero": [-1, -1], "positive": [-1, 1], "evenodd": [1, -1]}


def test_turned_patches_do_not_matter():
    mixed = [BezierSurface(p.points[::-1], p.weights[::-1]) if k % 3 else p for k, p in enumerate(torus_patches())]
    points, side, _ = near_torus(1e-9, 500)
    assert (classify(Shell(mixed), points) == side).all()


@settings(max_examples=6, deadline=None)
@given(st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.integers(0, 15))
def test_sides_at_different_speeds_do_not_matter(a, b, k):
    patches = torus_patches()
    patches[k] = reparametrized(reparametrized(patches[k], a, 0), b, 1)
    shell = Shell(patches)
    assert shell.closed
    for distance in (1e-2, 1e-6, 1e-10):
        points, side, _ = near_torus(distance, 400, k)
        assert (classify(shell, points) == side).all()
    around = [e for e in shell.edges if k in (arc.side.surface_index for arc in e.arcs)]
    assert len(around) == 4
    places = np.concatenate([edge.points(np.linspace(0.1, 0.9, 40)) for edge in around])
    inward = places - places * [1, 1, 0] / np.hypot(places[:, 0], places[:, 1])[:, None]
    for s, code in ((-1e-8, -1), (1e-8, 1)):
        assert (classify(shell, places + s * inward) == code).all()


@pytest.mark.parametrize("speed", [1 + 1e-3, 1 + 1e-5, 1 + 1e-7, 1 + 1e-9, 1 + 1e-11, 1 + 1e-13, 1.0])
def test_a_speed_that_is_nearly_the_same_is_no_gap(speed):
    patches = torus_patches()
    patches[5] = reparametrized(reparametrized(patches[5], speed, 0), 1 / speed, 1)
    points, side, _ = near_torus(1e-10, 400)
    assert (classify(Shell(patches), points) == side).all()


def test_a_long_side_beside_two_short_ones_does_not_matter():
    patches = torus_patches()
    patches[5:6] = patches[5].split(v=0.3)
    points, side, _ = near_torus(1e-7, 2000)
    assert (classify(Shell(patches), points) == side).all()


def test_a_closed_bspline_agrees_with_its_offsets():
    rng = np.random.default_rng(2)
    a, b = np.meshgrid(np.arange(8) * np.pi / 4, np.arange(8) * np.pi / 4, indexing="ij")
    bump = 0.4 * (1 + 0.2 * rng.uniform(-1, 1, a.shape))
    net = np.stack([(1 + bump * np.cos(b)) * np.cos(a), (1 + bump * np.cos(b)) * np.sin(a), bump * np.sin(b)], -1)
    surface = BSplineSurface(net, (3, 3), ("closed", "closed"))
    (u0, u1), (v0, v1) = surface.domain
    s, t = rng.uniform(u0, u1, 1500), rng.uniform(v0, v1, 1500)
    for distance in (1e-3, 1e-6, 1e-9, 1e-12):
        for sign in (-1, 1):
            assert (classify(surface, surface(s, t) + sign * distance * surface.normal(s, t)) == sign).all()


def test_shells_far_from_the_origin_say_on_where_floats_end():
    net = [BezierSurface(p.points + 1e6, p.weights) for p in torus_patches()]
    points, side, _ = near_torus(1e-7, 500)
    codes = classify(Shell(net), points + 1e6)
    assert (codes == side).all()
    points, side, _ = near_torus(1e-12, 500)
    assert (classify(Shell(net), points + 1e6) == 0).all()


def test_solids_made_by_sweeping_turning_and_formulas():
    import sympy

    square = polyline([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0), (-0.5, -0.5, 0)])
    bar = sweep(square, line((0, 0, 0), (0, 0, 2)), caps=True)
    ring = revolve(circle(0.4, center=(0, 1, 0)))
    ball = FormulaSurface(
        (sympy.cos(u) * sympy.cos(v), sympy.sin(u) * sympy.cos(v), sympy.sin(v)),
        ((0, 2 * np.pi), (-np.pi / 2, np.pi / 2)),
    )
    tiny = 1e-10
    cases = [
        (bar, (0, 0, 1), (0, 0, 2 - tiny), (0.5 - tiny, 0.1, 1), (0, 0, 2 + tiny), (0.5 + tiny, 0.1, 1)),
        (ring, (0, 1, 0), (0, 0, 1.4 - tiny), (0.4 - tiny, 0, 1), (0, 0, 1.4 + tiny), (0, 0, 0)),
        (ball, (0, 0, 0), (0.6, 0, 0.8 - tiny), (0, 0, 1 - tiny), (0.6, 0, 0.8 + tiny), (0, 0, 1 + tiny)),
    ]
    for solid, *points in cases:
        assert list(classify(solid, points)) == [-1, -1, -1, 1, 1]


def test_box_corners_and_edges():
    box = Shell(box_patches((1, 2, 3)))
    e = 1e-12
    points = [
        (e, e, e),
        (-e, e, e),
        (1 - e, 2 - e, 3 - e),
        (1 + e, 2 - e, 3 - e),
        (0.5, 1, 1.5),
        (0.5, 0, 0),
        (1, 2, 3),
    ]
    assert list(classify(box, points)) == [-1, 1, -1, 1, -1, 0, 0]


def test_open_shells_have_fractional_numbers_and_no_inside():
    shell = Shell(hemisphere_patches())
    with pytest.raises(OpenSurfaceError, match="got one with 4 naked edges: Edge\\(naked: surface 0 v0\\)"):
        classify(shell, (0, 0, 0))
    heights = np.array([-3.0, -1.0, -0.25, 1.5, 2.0])
    points = np.stack([np.zeros(5), np.zeros(5), heights], 1)
    # On the axis: half of 1 - cos of the angle under which the rim is seen.
    seen = 0.5 * (1 - np.abs(heights) / np.hypot(heights, 1))
    assert np.abs(winding_number(shell, points) - np.where(heights > 0, -seen, seen)).max() < 1e-12
    assert abs(winding_number(shell, (0, 0, 0)) - 0.5) < 1e-12


def test_a_face_taken_twice_is_the_cause():
    faces = box_patches()
    with pytest.raises(OpenSurfaceError, match=r"got one with 4 edges of more than two surfaces.*: Edge\(crowded"):
        classify(Shell([*faces, faces[0]]), (0, 0, 0))
    with pytest.raises(OpenSurfaceError, match=r"got one with 3 naked edges and 3 edges of more than two surfaces"):
        classify(Shell([*faces[1:], faces[-1]]), (0, 0, 0))


def test_a_disc_and_a_cylinder_against_closed_forms():
    disc = Shell(disc_patches())
    h = np.array([0.01, 0.5, 2.0, -0.01, -0.5, -2.0])
    points = np.stack([0 * h, 0 * h, h], 1)
    exact = -np.sign(h) * 0.5 * (1 - np.abs(h) / np.hypot(h, 1))
    assert np.abs(winding_number(disc, points) - exact).max() < 1e-12
    wall = []
    for patch in disc_patches():
        low = np.concatenate([patch.points[:, 0] * patch.weights[:, :1], patch.weights[:, :1]], axis=1)
        high = low.copy()
        high[:, 2] = 2 * high[:, 3]
        wall.append(from_weighted(np.stack([low, high], axis=1)))
    z = np.array([0.25, 1.0, 1.75])
    exact = 0.5 * (z / np.hypot(z, 1) + (2 - z) / np.hypot(2 - z, 1))
    assert np.abs(winding_number(Shell(wall), np.stack([0 * z, 0 * z, z], 1)) - exact).max() < 1e-12


def test_hemisphere_and_disc_add_up_everywhere():
    points = np.random.default_rng(3).uniform(-1.5, 1.5, (3000, 3))
    both = winding_number(Shell(hemisphere_patches()), points) + winding_number(Shell(disc_patches(False)), points)
    inside = (np.linalg.norm(points, axis=1) < 1) & (points[:, 2] > 0)
    assert np.abs(both - inside).max() < 1e-11


def test_the_teapot_agrees_with_its_mesh():
    pot = teapot()
    points = np.random.default_rng(4).uniform((-3, -2, 0), (3.5, 2, 3.2), (60, 3))
    mesh = tessellate(pot, tolerance=3e-3)
    points = points[~MeshWinding(mesh).within(points, 3e-3)]
    assert len(points) > 50
    assert np.abs(winding_number(pot, points) - winding_number(mesh, points)).max() < 0.02


def test_on_the_surface_there_is_no_winding_number():
    shell = Shell(torus_patches())
    assert np.isnan(winding_number(shell, shell.surfaces[0](0.3, 0.6)))


def test_a_strip_with_one_side_has_no_inside():
    with pytest.raises(OpenSurfaceError, match="two sides"):
        classify(Shell(moebius_patches()), (0, 0, 0))


def test_shell_and_implicit_surface_agree_wherever_both_decide():
    surface, shell = Surface("(x^2 + y^2 + z^2 + 1 - 4/25)^2 - 4 (x^2 + y^2)"), Shell(torus_patches())
    batches = [near_torus(10.0**-k, 3000, k)[0] for k in (2, 6, 10, 13)]
    points = np.concatenate([np.random.default_rng(5).uniform(-1.5, 1.5, (20_000, 3)), *batches])
    one, other = classify(surface, points), classify(shell, points)
    decided = (one != 0) & (other != 0)
    assert (one[decided] == other[decided]).all() and decided.mean() > 0.999


def test_gaps_between_matched_edges_raise_the_floor():
    faces = box_patches((1, 2, 3))
    faces[0] = BezierSurface(faces[0].points + (-1e-4, 0, 0))
    shell = Shell(faces, tolerance=1e-3)
    assert shell.closed and 1e-4 < shell.solid.floor < 2e-3
    assert list(classify(shell, [(0.5, 1, 1), (0.005, 0.005, 0.005), (-0.005, 1, 1), (-5e-5, 1e-5, 1)])) == [
        -1,
        -1,
        1,
        0,
    ]


def test_caps_that_start_elsewhere_than_the_wall():
    """A cylinder whose caps are turned against its wall: no corner, and no part of an edge, is common."""
    wall = []
    for patch in disc_patches():
        low = np.concatenate([patch.points[:, 0] * patch.weights[:, :1], patch.weights[:, :1]], axis=1)
        wall.append(from_weighted(np.stack([low, low + np.outer(low[:, 3], (0, 0, 2, 0))], axis=1)))
    turn = rotation((0, 0, 1), 0.6)[:3, :3]
    caps = [BezierSurface(p.points @ turn.T + (0, 0, h), p.weights) for h in (0, 2) for p in disc_patches(h == 2)]
    shell = Shell(wall + caps)
    assert shell.closed and len(shell.solid.pieces.rim) == 16
    rng = np.random.default_rng(6)
    angle = rng.uniform(0, 2 * np.pi, 2000)
    for distance in (1e-3, 1e-6, 1e-9):
        reach, height = 1 + distance * rng.normal(size=2000), distance * rng.normal(size=2000)
        points = np.stack([reach * np.cos(angle), reach * np.sin(angle), height], 1)
        off = np.maximum(np.hypot(points[:, 0], points[:, 1]) - 1, -height)
        codes = classify(shell, points)
        clear = np.abs(off) > 2 * shell.solid.floor
        assert (codes[clear] == np.sign(off[clear])).all()
