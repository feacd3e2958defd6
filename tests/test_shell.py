"""Edges are found by geometry, whatever the directions and parametrizations of the sides."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parametric import BezierSurface, Shell
from tests.solids import (
    box_patches,
    disc_patches,
    hemisphere_patches,
    moebius_patches,
    random_quilt,
    reparametrized,
    torus_patches,
)


def kinds(shell):
    report = shell.report()
    return report.shared, report.naked, report.crowded, report.degenerate


def test_a_torus_of_16_patches_is_closed_with_32_edges():
    shell = Shell(torus_patches())
    assert shell.closed and shell.orientable and kinds(shell) == (32, 0, 0, 0)
    assert shell.boundary == ()


def test_a_hemisphere_is_open_along_its_equator_and_has_a_pole_in_each_patch():
    shell = Shell(hemisphere_patches())
    assert not shell.closed and kinds(shell) == (4, 4, 0, 4)
    rim = np.concatenate([edge.points(np.linspace(0, 1, 9)) for edge in shell.boundary])
    assert np.abs(rim[:, 2]).max() == 0 and np.abs(np.hypot(rim[:, 0], rim[:, 1]) - 1).max() < 1e-15


def test_hemisphere_and_disc_close_each_other():
    shell = Shell(hemisphere_patches() + disc_patches(upward=False))
    assert shell.closed and (shell.turns == 1).all()
    assert "closed" in repr(shell)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.integers(2, 4), st.integers(2, 4))
def test_random_quilts_share_every_inner_edge(seed, m, n):
    shell = Shell(random_quilt(np.random.default_rng(seed), m, n))
    assert kinds(shell) == (m * (n - 1) + n * (m - 1), 2 * (m + n), 0, 0)
    assert shell.orientable and not shell.closed and (shell.components == 0).all()
    assert shell.report().gap < 1e-13


def test_turned_surfaces_are_turned_back_and_outward():
    patches = torus_patches()
    mixed = [BezierSurface(p.points[::-1], p.weights[::-1]) if k % 3 == 1 else p for k, p in enumerate(patches)]
    shell = Shell(mixed)
    assert shell.closed and [k for k in range(16) if shell.turns[k] < 0] == [1, 4, 7, 10, 13]


def test_a_shell_whose_surfaces_agree_is_left_as_it_is():
    shell = Shell(torus_patches(reverse=True))
    assert shell.closed and (shell.turns == 1).all()


def test_edges_run_at_different_speeds():
    patches = torus_patches()
    patches[5] = reparametrized(reparametrized(patches[5], 3.0, 0), 0.5, 1)
    shell = Shell(patches)
    assert shell.closed and kinds(shell) == (32, 0, 0, 0)
    bent = [edge for edge in shell.edges if not all(arc.proportional for arc in edge.arcs)]
    assert len(bent) == 4
    s = np.linspace(0, 1, 33)
    for edge in bent:
        there = [arc.side.points(arc.parameter(s)) for arc in edge.arcs]
        assert np.linalg.norm(there[0] - there[1], axis=1).max() < 1e-12
        arc = edge.arcs[1]
        assert np.abs(arc.locate(arc.parameter(s)) - s).max() < 1e-9


def test_a_long_side_meets_two_short_ones():
    patches = torus_patches()
    patches[5:6] = patches[5].split(v=0.5)
    shell = Shell(patches)
    assert shell.closed and kinds(shell)[1:] == (0, 0, 0)
    assert kinds(shell)[0] == 32 + 1 + 2  # two sides are cut in half, and the halves share a new one


def test_a_solid_taken_twice_is_closed_too():
    assert Shell(torus_patches() * 2).closed


def test_three_walls_on_one_edge_bound_nothing():
    walls = [
        BezierSurface([[(0, 0, 0), (0, 0, 1)], [(np.cos(a), np.sin(a), 0), (np.cos(a), np.sin(a), 1)]])
        for a in (0.0, 2.0, 4.0)
    ]
    shell = Shell(walls)
    assert kinds(shell) == (0, 9, 1, 0) and not shell.closed


def test_surfaces_that_touch_in_a_point_stay_apart():
    flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    other = BezierSurface([[(1, 1, 0), (1, 2, 0)], [(2, 1, 0), (2, 2, 0)]])
    assert len(Shell([flat, other]).corners) == 8


def test_a_moebius_strip_has_one_side():
    shell = Shell(moebius_patches())
    assert kinds(shell)[:2] == (4, 8) and not shell.orientable and not shell.closed


def test_the_tolerance_decides_what_is_one_edge():
    flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    near = BezierSurface([[(1.001, 0, 0), (1.001, 1, 0)], [(2, 0, 0), (2, 1, 0)]])
    assert len(Shell([flat, near]).boundary) == 8
    joined = Shell([flat, near], tolerance=0.01)
    assert len(joined.boundary) == 6 and joined.report().gap == pytest.approx(0.001)
    assert "largest gap 0.001 (matched within 0.01)" in str(joined.report())


def test_box_of_six_faces():
    shell = Shell(box_patches())
    assert shell.closed and kinds(shell) == (12, 0, 0, 0) and (shell.turns == 1).all()


@pytest.mark.parametrize(
    ("surfaces", "options", "message"),
    [
        ([], {}, "at least one surface"),
        ([1], {}, "made of parametric surfaces, got a int at place 0"),
        (box_patches(), {"tolerance": 0.0}, "positive length"),
        (box_patches(), {"tolerance": np.nan}, "positive length"),
    ],
)
def test_errors_name_what_came(surfaces, options, message):
    with pytest.raises(ValueError, match=message):
        Shell(surfaces, **options)


def test_a_shell_does_not_change():
    with pytest.raises(AttributeError, match="cannot be changed"):
        Shell(box_patches()).surfaces = ()
