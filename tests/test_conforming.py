"""Singular surfaces: the singular points are vertices, and the topology round them is the true one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Ball, Box, Surface, polygonize
from implicit.mesh import Mesh
from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.points.block import find_blocks
from implicit.polygonizers.conforming.points.blowup import are_cones, germs_at
from implicit.singular import SingularLocus, SingularPoint
from tests.benchmarks.conforming import turned
from tests.singular_cases import case_of, residual, topology, truth_of

NODES = ("double_cone", "dingdong", "source_1", "cayley", "spindle_torus")
OTHERS = ("A2", "A3m", "D4p", "source_2_intended")
CURVES = ("source_2_printed", "source_3_conoid", "whitney", "cuspidal_edge", "two_spheres_crossing", "three_planes")


@pytest.mark.parametrize("name", NODES)
def test_nodes_are_vertices_with_their_cones(name: str) -> None:
    surface, ball = case_of(name)
    mesh = conforming(surface, ball, 48)
    found = topology(mesh)
    assert found.pop("crowded") == 0
    assert found == truth_of(name)
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0
    assert residual(surface, mesh) <= 1e-12 * ball.radius
    assert np.linalg.norm(surface.gradient(mesh.vertices[mesh.points]), axis=1).max() < 1e-12


@pytest.mark.parametrize("name", OTHERS + CURVES)
def test_singular_sets_are_parts_of_the_mesh(name: str) -> None:
    surface, ball = case_of(name)
    mesh = conforming(surface, ball, 20)
    found = topology(mesh)
    assert found.pop("crowded") == 0
    assert found == truth_of(name)
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0
    assert residual(surface, mesh) <= 1e-10 * ball.radius
    for indices in (mesh.points, *mesh.curves):
        assert np.linalg.norm(surface.gradient(mesh.vertices[indices]), axis=1).max(initial=0) < 1e-10


@pytest.mark.parametrize("resolution", [28, 40, 52])
def test_sheets_that_nearly_touch_do_not_join(resolution: int) -> None:
    """At an A5 point two sheets part like y^3: near it a handle between them is one wrong triangle away."""
    surface, ball = case_of("source_2_intended")
    mesh = conforming(surface, ball, resolution)
    found = topology(mesh)
    assert found.pop("crowded") == 0 and found == truth_of("source_2_intended")
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0


@pytest.mark.parametrize("name", ["A3m", "D4p", "whitney", "cayley"])
def test_turned_surfaces_are_no_different(name: str) -> None:
    surface, ball = case_of(name)
    mesh = conforming(turned(surface, 1), ball, 24)
    found = topology(mesh)
    assert found.pop("crowded") == 0 and found == truth_of(name)
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0


def test_curves_run_to_the_boundary() -> None:
    mesh = conforming(Surface("x^2 = y^2 z"), Ball(1), 20)
    ends = np.array([mesh.vertices[curve[[0, -1]], 2] for curve in mesh.curves])
    assert np.sort(ends.ravel()) == pytest.approx([-1, 0, 0, 1], abs=1e-12)


def test_polygonize_takes_the_method() -> None:
    surface = Surface("x^2 + y^2 = z^2")
    mesh = polygonize(surface, 1, resolution=16, method="conforming")
    assert mesh.vertices[mesh.points].tolist() == [[0, 0, 0]]
    assert mesh.report().boundary_edges > 0


def test_a_box_cuts_on_its_faces() -> None:
    box = Box((-1, -0.8, -1.1), (0.9, 1, 1))
    mesh = conforming(Surface("x^2 + y^2 = z^2"), box, 24)
    faces = np.array(mesh.faces)
    directed = np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]])
    keys = {tuple(edge) for edge in directed.tolist()}
    rim = mesh.vertices[sorted({i for a, b in keys if (b, a) not in keys for i in (a, b)})]
    assert ((rim == box.lower) | (rim == box.upper)).any(axis=1).all()
    assert box.contains(mesh.vertices).all()


@pytest.mark.parametrize("cells", [24, 33, 64])
@pytest.mark.parametrize("formula", ["x^2 + y^2 = z^2", "x^2 + y^2 + z^3", "x^2 = y^3 + z^5"])
def test_where_a_surface_touches_an_edge_of_a_box_vertices_stay_on_it(formula: str, cells: int) -> None:
    surface = Surface(formula)
    mesh = polygonize(surface, 1, resolution=cells)
    values, slopes = surface.field.gradients(mesh.vertices)
    regular = np.linalg.norm(slopes, axis=1) > 1e-6
    assert (np.abs(values[regular]) <= 1e-8 * np.linalg.norm(slopes[regular], axis=1)).all()
    assert mesh.report().degenerate_faces == 0 and not len(mesh.unresolved)


def _locus(*points: tuple[float, float, float]) -> SingularLocus:
    return SingularLocus(tuple(SingularPoint(np.array(p)) for p in points), (), np.zeros((0, 2, 3)), True)


def _refused(mesh: Mesh) -> bool:
    return mesh.unresolved is not None and len(mesh.unresolved) > 0


@pytest.mark.parametrize("points", [(), ((0.03, 0.0, 0.01),), ((1e-4, 0.0, 0.0),)])
def test_a_node_missing_or_displaced_is_refused(points: tuple[tuple[float, float, float], ...]) -> None:
    assert _refused(conforming(Surface("x^2 + y^2 = z^2"), Ball(1), 32, _locus(*points)))


def test_one_of_four_nodes_missing_is_refused() -> None:
    surface, ball = case_of("cayley")
    assert _refused(conforming(surface, ball, 48, _locus((1, 1, 1), (1, -1, -1), (-1, 1, -1))))


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10**6))
def test_a_block_is_found_for_random_cones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    form = turn @ np.diag([*rng.uniform(0.5, 2, 2), -1]) @ turn.T
    x, y, z = (f"({name} - {value:.6f})" for name, value in zip("xyz", rng.uniform(-0.3, 0.3, 3), strict=True))
    names = (x, y, z)
    terms = [f"({form[i, j]:.12f})*{names[i]}*{names[j]}" for i in range(3) for j in range(3)]
    surface = Surface(" + ".join(terms))
    mesh = conforming(surface, Ball(1), 24)
    if not _refused(mesh):
        found = topology(mesh)
        assert (found["euler"], found["pieces"], found["links"]) == (1, 2, [(2, 0)])


def test_no_cone_is_proved_where_there_is_none() -> None:
    grid = Grid.over(Ball(1), 16, 6)
    smooth = Surface("x^2 + y^2 + z^2 = 1/4").field
    ends = np.full((1, 3), 2.0)
    assert not are_cones(germs_at(smooth, np.array([[0.0, 0, 0.5]]), grid.step), -ends, ends)[0]
    nowhere, first = np.zeros((0, 3)), np.array([0])
    cusp = Surface("x^2 + y^2 = z^3").field
    assert find_blocks(cusp, grid, np.zeros((1, 3)), first, nowhere)[1].tolist() == [0]
    two = Surface("(x^2 + y^2 - z^2)*(x^2 + y^2 + z^2 - 1/100)").field
    assert find_blocks(two, Grid.over(Ball(1), 8, 6), np.zeros((1, 3)), first, nowhere)[1].tolist() == [0]


def test_blocks_take_in_what_is_coarse_or_keep_away_from_it() -> None:
    grid, field = Grid.over(Ball(1), 24, 6), Surface("x^2 + y^2 = z^2").field
    origin, first = np.zeros((1, 3)), np.array([0])
    (small,), _ = find_blocks(field, grid, origin, first, origin[:0])
    beside = (small.lower + small.upper) / 2 * [[0, 1, 1]] + [[small.upper[0] + 0.5, 0, 0]]
    (block,), _ = find_blocks(field, grid, origin, first, beside)
    assert block.holds(np.floor(beside).astype(np.int64)).all()
    farther = beside + [[2.0, 0, 0], [4.0, 0, 0]]
    assert find_blocks(field, grid, origin, first, np.concatenate([beside, farther]))[1].tolist() == [0]


def test_a_solitary_point_is_a_vertex_without_faces() -> None:
    mesh = conforming(Surface("(x^2 + y^2 + z^2)*(x^2 + y^2 + z^2 - 1)"), Ball(2), 24)
    assert mesh.vertices[mesh.points].tolist() == [[0, 0, 0]]
    assert topology(mesh)["links"] == [(0, 0)]
    assert not _refused(mesh)
