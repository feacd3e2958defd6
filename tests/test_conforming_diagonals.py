"""Diagonals in cells: nothing changes but them, and triangles come nearer to the surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from implicit import Ball, Surface
from implicit.polygonizers.conforming.assemble import MARGIN
from implicit.polygonizers.conforming.diagonals import choose_diagonals
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.topology import find_edges
from implicit.work import Job
from tests.benchmarks.conforming_distance import cubes, distances, quantiles
from tests.singular_cases import case_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SADDLE, BALL = "z - x*y - x/9 - y/7", Ball(1)


def swept(surface: Surface, cells: int) -> tuple[Floats, Floats, Ints, Ints]:
    """Vertices, normals, faces of the sweep, and those with other diagonals."""
    sampler = choose_sampler(surface, Grid.over(BALL, cells, 3).lattice)
    marched = march(sampler, Job(len(sampler.bricks), None, 1))
    chosen = marched.faces.copy()
    choose_diagonals(marched.vertices, marched.normals, chosen)
    return marched.vertices, marched.normals, marched.faces, chosen


def inner(vertices: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """The keys of edges through the inside of cells, and those of all others."""
    keys = find_edges(faces, len(vertices)).keys
    ends = vertices[keys // len(vertices)], vertices[keys % len(vertices)]
    within = (ends[0] != ends[1]).all(axis=1)
    return keys[within], keys[~within]


def off(surface: Surface, vertices: Floats, faces: Ints) -> Floats:
    return distances(surface, vertices[faces].mean(axis=1))


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(-9, 9), min_size=10, max_size=10), st.integers(7, 16))
def test_only_edges_within_cells_change(numbers: list[int], cells: int) -> None:
    terms = ("x^3", "y^3", "z^2", "x*y", "y*z", "z*x", "x", "y", "z", "1")
    surface = Surface(" + ".join(f"{n}*{term}/10" for n, term in zip(numbers, terms)) + " + x^2*z")
    vertices, normals, faces, chosen = swept(surface, cells)
    old, new = (inner(vertices, some) for some in (faces, chosen))
    assert (old[1] == new[1]).all() and len(old[0]) == len(new[0])
    before, after = (find_edges(some, len(vertices)) for some in (faces, chosen))
    assert after.crowded == 0 and after.boundary == before.boundary and after.oriented
    assert (np.unique(chosen) == np.unique(faces)).all()
    changed = (chosen != faces).any(axis=1)
    a, b, c = (vertices[chosen[changed, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    cosines = np.einsum("ij,ikj->ik", across, normals[chosen[changed]])
    assert (cosines >= 0.8 * np.linalg.norm(across, axis=1)[:, None] * (1 - 1e-12)).all()


def test_a_saddle_is_nearer_and_a_plane_stays() -> None:
    saddle = Surface(SADDLE)
    vertices, _, faces, chosen = swept(saddle, 20)
    before, after = (off(saddle, vertices, some) for some in (faces, chosen))
    assert (after.sum(), np.median(after)) < (0.9 * before.sum(), np.median(before))
    *_, faces, chosen = swept(Surface("x + y/3 - z/7"), 20)
    assert (faces == chosen).all()


def test_the_sag_of_sides_is_the_distance_of_the_middle() -> None:
    saddle = Surface(SADDLE)
    errors = []
    for cells in (20, 40):
        vertices, normals, faces, _ = swept(saddle, cells)
        sides, turns = (np.roll(some[faces], -1, axis=1) - some[faces] for some in (vertices, normals))
        told = np.abs(np.einsum("nkc,nkc->n", sides, turns)) / 18
        errors.append(np.abs(told - off(saddle, vertices, faces)).max() * cells**2)
    assert errors[1] < 0.6 * errors[0]


def test_vertices_at_one_place_stay_with_their_faces() -> None:
    surface = Surface("x^2 + y^2 - z^2")
    grid = Grid(np.full(3, -2.0), 0.25, np.full(3, 16))
    sampler = choose_sampler(surface, grid.lattice)
    marched = march(sampler, Job(len(sampler.bricks), None, 1))
    assert len(marched.pinned)
    chosen = marched.faces.copy()
    choose_diagonals(marched.vertices, marched.normals, chosen)
    old, new = (inner(marched.vertices, some) for some in (marched.faces, chosen))
    assert (old[1] == new[1]).all() and not np.array_equal(old[0], new[0])


def test_no_triangles_no_choice() -> None:
    none = np.zeros((0, 3))
    choose_diagonals(none, none, np.zeros((0, 3), np.int64))


@pytest.mark.parametrize("name", ["A2", "A3m", "double_cone", "dingdong", "spindle_torus"])
@pytest.mark.parametrize("cells", [24, 41])
def test_triangles_are_no_farther_than_those_of_marching_cubes(name: str, cells: int) -> None:
    from implicit.polygonizers.conforming import conforming

    surface, ball = case_of(name)
    mesh = conforming(surface, ball, cells)
    theirs = cubes(surface, ball, Grid.over(ball, cells, MARGIN).step)
    assert (quantiles(surface, np.array(mesh.vertices)[mesh.faces]) <= quantiles(surface, theirs))[:2].all()
