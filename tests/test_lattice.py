"""The lattice of a ball: only the bricks near it are swept, and what meets the ball is the same as when all are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from implicit import Ball, Surface, polygonize
from implicit.polygonizers.lattice import CELLS, Lattice
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.weld import weld
from implicit.work import Job

SURFACES = {
    "planes": "(x - 0.3) (y + 0.2) (z - x) = 0.01",
    "cone": "x^2 + y^2 = z^2",
    "gyroid": "sin(4 x) cos(4 y) + sin(4 y) cos(4 z) + sin(4 z) cos(4 x)",
    "blocks": "min(abs(x - 1) - 0.3, abs(y) + abs(z) - 0.9, abs(x + y + z) - 0.1)",
}
BALLS = st.builds(Ball, st.floats(0.2, 2), st.tuples(*[st.floats(-1, 1)] * 3))


def bricks_of(lattice):
    """The lower and upper corners (n, 3) of all bricks, and which they are (n, 3)."""
    which = np.indices(lattice.bricks).reshape(3, -1).T
    ends = [np.minimum(CELLS * (which + side), lattice.cells) for side in (0, 1)]
    low, high = (np.column_stack([axis[end[:, i]] for i, axis in enumerate(lattice.axes)]) for end in ends)
    return low, high, which


def assert_same_triangles(first, second):
    """The same triangles whatever their order, to rounding: how many steps vertices take depends on their company."""
    tree = cKDTree(first[0])
    triangles = []
    for vertices, faces in (first, second):
        place = np.array([min(near, default=-1) for near in tree.query_ball_point(vertices, 1e-10)])
        assert (place >= 0).all()
        turned = place[faces]
        lead = turned.argmin(axis=1)[:, None]
        turned = np.take_along_axis(turned, (lead + np.arange(3)) % 3, axis=1)
        triangles.append(turned[np.lexsort(turned.T)])
    assert np.array_equal(*triangles)


def near(surface, lattice, ball):
    """The faces of the sweep that meet a ball, or come within a tenth of a cell of it."""
    sampler = choose_sampler(surface, lattice)
    marched = march(sampler, Job(len(sampler.bricks)))
    vertices, _, faces = weld(marched.vertices, marched.normals, marched.faces, marched.pinned)
    inside = np.linalg.norm(vertices - ball.center, axis=1) <= ball.radius + 0.1 * lattice.step
    faces = faces[inside[faces].any(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


@given(BALLS, st.integers(1, 40), st.integers(0, 2))
def test_every_brick_that_meets_the_ball_is_swept(ball, resolution, level):
    lattice = Lattice.over(ball, resolution)
    low, high, which = bricks_of(lattice)
    gap = np.linalg.norm(np.maximum(np.maximum(low - ball.center, ball.center - high), 0), axis=1)
    swept = lattice.met()[tuple(which.T)]
    assert swept[gap <= ball.radius].all()
    assert not swept[gap > ball.radius + 2.1 * lattice.step].any()
    assert lattice.met(2**level)[tuple(which.T >> level)][swept].all()


@given(BALLS, st.integers(1, 40))
def test_ends_are_where_no_brick_is_swept_beyond(ball, resolution):
    lattice = Lattice.over(ball, resolution)
    met = np.pad(lattice.met(), ((0, 1),) * 3)
    bricks = lattice.all_bricks()
    for axis, ends in enumerate(lattice.ends(bricks).T):
        beyond = bricks + np.eye(3, dtype=int)[axis]
        assert np.array_equal(ends, ~met[tuple(beyond.T)])


@pytest.mark.parametrize("name", SURFACES)
@settings(max_examples=15, deadline=None)
@example(Ball(0.25, (0, 1, 1)), 5)
@example(Ball(0.21875, (1, 0.21875, 1)), 5)
@given(BALLS, st.integers(5, 50))
def test_the_sweep_of_a_ball_has_all_faces_that_meet_it(name, ball, resolution):
    surface, lattice = Surface(SURFACES[name]), Lattice.over(ball, resolution)
    assert_same_triangles(near(surface, lattice, ball), near(surface, replace(lattice, within=None), ball))


@pytest.mark.parametrize("name", ["gyroid", "blocks"])
def test_runs_of_several_workers_meet_within_a_ball(name):
    surface, ball = Surface(SURFACES[name]), Ball(1.5, (0.2, 0.1, 0))
    lattice = Lattice.over(ball, 220)
    assert len(choose_sampler(surface, lattice).bricks) > 3000  # several runs
    one, two = (polygonize(surface, ball, resolution=220, method="marching", workers=n) for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices) and np.array_equal(one.faces, two.faces)
    assert_same_triangles(near(surface, lattice, ball), near(surface, replace(lattice, within=None), ball))


def test_what_is_not_finite_far_from_the_ball_does_not_matter():
    surface = Surface("sqrt(2 - x^2 - y^2 - z^2) = 1")
    assert polygonize(surface, Ball(1.1), resolution=200).report().genus == 0
    with pytest.raises(ValueError, match="no finite value"):
        polygonize(surface, 1.1, resolution=200)
