"""Joints: what is reported, and control points moved to make them smooth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parametric import (
    BezierSurface,
    BSplineSurface,
    circle,
    continuity,
    line,
    make_c0,
    make_c1,
    make_g1,
    revolve,
)
from parametric.place import rotation

EDGES = ("u0", "u1", "v0", "v1")
QUICK = settings(max_examples=15, deadline=None)


def net(seed, shape=(4, 4)):
    return np.random.default_rng(seed).normal(size=(*shape, 3))


def turned(surface, edge):
    """The same Bezier surface with its edge u0 as the given edge."""
    points = surface.points
    if edge[0] == "v":
        points = points.transpose(1, 0, 2)
    if edge[1] == "1":
        points = points[::-1] if edge[0] == "u" else points[:, ::-1]
    return BezierSurface(points)


@given(st.integers(0, 10**6), st.floats(0.2, 0.8))
@QUICK
def test_a_split_surface_is_c2_and_g2_at_the_cut(seed, cut):
    surface = BSplineSurface(net(seed, (6, 5)), 3)
    left, right = surface.restrict(u=(0, cut)), surface.restrict(u=(cut, 1))
    report = continuity(left, "u1", right, "u0", tolerance=1e-8)
    assert report.c0
    assert report.c1
    assert report.c2
    assert report.g1
    assert report.g2
    assert not report.reversed


def test_halves_on_other_intervals_are_g_but_not_c():
    left, right = BezierSurface(net(0)).split(u=0.3)
    report = continuity(left, "u1", right, "u0")
    assert (report.c0, report.c1, report.g1, report.g2) == (True, False, True, True)
    assert report.residuals["c1"] > 0.1


@pytest.mark.parametrize("edge", EDGES)
def test_every_edge_can_be_joined(edge):
    left, right = BezierSurface(net(1)).split(u=0.5)
    report = continuity(left, "u1", turned(right, edge), edge)
    assert report.c1
    assert report.c2
    other = continuity(turned(right, edge), edge, left, "u1")
    assert other.c1


def test_an_edge_run_backwards_is_found():
    left, right = BezierSurface(net(1)).split(u=0.5)
    flipped = BezierSurface(right.points[:, ::-1])
    report = continuity(left, "u1", flipped, "u0")
    assert report.reversed
    assert report.c2


def test_residuals_have_their_units():
    flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    gap = flat.transform([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0.25], [0, 0, 0, 1]])
    assert continuity(flat, "u1", gap, "u0").residuals["c0"] == pytest.approx(0.25)
    roof = flat.transform(rotation((0, 1, 0), -0.3)).transform([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    report = continuity(flat, "u1", roof, "u0")
    assert report.residuals["g1"] == pytest.approx(0.3)
    assert (report.c0, report.g1) == (True, False)


def test_a_fold_is_not_smooth():
    flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    assert continuity(flat, "u1", flat, "u1").residuals["g1"] == pytest.approx(np.pi)


def test_cylinder_and_plane_are_g1_but_not_g2():
    quarter = revolve(line((0, 1, 0), (2, 1, 0)), angle=np.pi / 2)  # ends at (x, 0, 1) with direction -y
    plane = BezierSurface([[(0, 0, 1), (0, -1, 1)], [(2, 0, 1), (2, -1, 1)]])
    report = continuity(quarter, "v1", plane, "v0")
    assert report.c1
    assert report.g1
    assert not report.g2
    assert report.residuals["g2"] == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("edge_a", EDGES)
@pytest.mark.parametrize("edge_b", EDGES)
def test_setters_make_what_they_say(edge_a, edge_b):
    a, b = BezierSurface(net(2)), BezierSurface(net(3))
    assert not continuity(a, edge_a, b, edge_b).c0
    before = b.points.copy()
    joined = make_c0(a, edge_a, b, edge_b)
    assert continuity(a, edge_a, joined, edge_b).c0
    joined = make_c1(a, edge_a, b, edge_b)
    assert continuity(a, edge_a, joined, edge_b).c1
    stretched = continuity(a, edge_a, make_g1(a, edge_a, b, edge_b, 2.5), edge_b)
    assert (stretched.c0, stretched.c1, stretched.g1) == (True, False, True)
    np.testing.assert_array_equal(b.points, before)
    moved = np.abs(joined.points - b.points).max(axis=-1) > 0
    assert moved.sum() == 8  # two rows of four and nothing else


def test_setters_respect_knots():
    a = BSplineSurface(net(4, (7, 5)), (3, 2))
    b = BSplineSurface(net(5, (5, 5)), (2, 2), ([3, 3, 3, 3.2, 4, 5, 5, 5], "clamped"))
    assert continuity(a, "u1", make_c1(a, "u1", b, "u0"), "u0").c1
    assert continuity(a, "u0", make_c1(a, "u0", b, "u1"), "u1").c1


def test_curves_join_too():
    whole = circle(2)
    first, second = circle(2, angle=1.0), circle(2).to_nurbs().restrict(0.0, 0.5)
    assert continuity(whole, "t1", whole, "t0").c2
    assert continuity(first, "t0", second, "t0").residuals["g1"] == pytest.approx(np.pi)
    straight = line((2, -3, 0), (2, 0, 0))
    report = continuity(straight, "t1", whole, "t0")
    assert (report.c0, report.g1, report.c1, report.g2) == (True, True, False, False)
    assert report.residuals["g2"] == pytest.approx(0.5)


FLAT = BezierSurface(net(0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: continuity(FLAT, "left", FLAT, "u0"), "an edge is one of u0, u1, v0, v1, got 'left'"),
        (lambda: continuity(circle(), "u0", circle(), "t0"), "an end of a curve is one of t0, t1, got 'u0'"),
        (lambda: make_c1(FLAT, "u1", BezierSurface(net(0, (4, 3))), "u0"), "same degree and knots along the joint"),
        (lambda: make_c1(FLAT, "x", FLAT, "u0"), "an edge is one of"),
        (lambda: make_c1(BezierSurface(net(0), np.ones((4, 4))), "u1", FLAT, "u0"), "not rational ones"),
        (lambda: make_c1(BSplineSurface(net(0), 3, "open"), "u1", FLAT, "u0"), "must be clamped at u1"),
        (lambda: make_g1(FLAT, "u1", FLAT, "u0", -1), "ratio of derivatives must be positive, got -1"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_surface_does_not_join_a_curve():
    with pytest.raises(TypeError, match="between two surfaces or two curves"):
        continuity(FLAT, "u0", circle(), "t0")
    with pytest.raises(TypeError, match="a parametric surface was wanted, got str"):
        continuity(FLAT, "u0", "FLAT", "u1")
