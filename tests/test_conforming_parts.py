"""Parts of the conforming polygonizer against what they replace: naive counts, whole fillings, single circles."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from implicit import Ball, Surface
from implicit.polygonizers.conforming.check import turning
from implicit.polygonizers.conforming.curves.arc import Arc
from implicit.polygonizers.conforming.curves.ring import Circle, Circles, counts, crossings, stable
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local, among, distinct, frame, merged, pairs_of
from implicit.polygonizers.conforming.points.blowup import germs_at, regular_cones
from implicit.polygonizers.conforming.points.squares import Lattice
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity, dead_vertices
from implicit.polygonizers.conforming.tetrahedra.region import build_region, cells_round

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SIZE = np.array([14, 12, 13])


def _local(formula: str) -> Local:
    return Local(Surface(formula).field, Grid.over(Ball(1), 16, 6), ())


def test_keys_are_found_and_kept_in_order() -> None:
    rng = np.random.default_rng(0)
    keys, more = rng.integers(0, 50, 40), rng.integers(0, 50, 30)
    assert (distinct(keys) == np.unique(keys)).all()
    assert (merged(np.sort(keys), more) == np.sort(np.concatenate([keys, more]))).all()
    assert (among(more, np.sort(keys)) == np.isin(more, keys)).all()
    assert not among(more, keys[:0]).any()


@pytest.mark.parametrize("reach", [1, 2, 3])
def test_cells_round_places_are_those_within_reach(reach: int) -> None:
    places = np.random.default_rng(reach).uniform(-1, 15, (9, 3))
    cells = np.floor(places)
    inside = cells[((cells >= 0) & (cells < SIZE)).all(axis=1)]
    everywhere = np.indices(tuple(SIZE)).reshape(3, -1).T
    near = np.abs(everywhere[:, None] - inside).max(axis=2).min(axis=1) <= reach
    assert (cells_round(places, reach, SIZE) == everywhere[near]).all()


def _volume(places: Floats, tetrahedra: Ints) -> float:
    corners = places[tetrahedra]
    return float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6)


def _is_delaunay(places: Floats, tetrahedra: Ints, vertices: Floats) -> bool:
    for corners in places[tetrahedra]:
        system = 2 * (corners[1:] - corners[0])
        if abs(np.linalg.det(system)) > 1e-9:
            center = np.linalg.solve(system, (corners[1:] ** 2 - corners[0] ** 2).sum(axis=1))
            radius = np.linalg.norm(corners[0] - center)
            if (np.linalg.norm(vertices - center, axis=1) < radius * (1 - 1e-6)).any():
                return False
    return True


def test_a_filling_that_grows_fills_the_region_with_delaunay_tetrahedra() -> None:
    """Vertices and cells come in three steps; each time the region is filled exactly, and all vertices are used."""
    rng = np.random.default_rng(1)
    cavity, region, none = Cavity(), None, np.zeros((0, 4))
    new = np.zeros((0, 3))
    for center in ((5, 5, 5), (6.5, 5, 6), (7.5, 7, 7)):
        new = np.concatenate([new, np.array(center) + rng.uniform(-1, 1, (12, 3))])
        cells = cells_round(new, 2, SIZE)
        region = build_region(cells, SIZE, region)
        dead = dead_vertices(region, none, new)
        stay, fresh, known, fits = cavity.fill(region, dead, new)
        places = np.concatenate([region.places, new])
        whole = _volume(places, region.tetrahedra)
        assert fits and known <= len(fresh)
        assert _volume(places, stay) + _volume(places, fresh) == pytest.approx(whole, rel=1e-9)
        used = np.unique(np.concatenate([stay, fresh, region.pyramids[:, :4]], axis=0))
        assert np.isin(len(region.places) + np.arange(len(new)), used).all() and not dead[used[used < len(dead)]].any()
        assert _is_delaunay(places, fresh, new)


def test_places_do_not_move_when_a_region_grows() -> None:
    small = build_region(cells_round(np.array([[5.0, 5, 5]]), 2, SIZE), SIZE)
    large = build_region(cells_round(np.array([[5.0, 5, 5]]), 4, SIZE), SIZE, small)
    assert (large.places[small.renumbered(large)] == small.places).all()
    assert large.holds(small.cells).all() and not small.holds(large.cells).all()


def test_many_circles_are_crossed_as_each_alone() -> None:
    local = _local("(x^2 - y^3)*(x + y - 2*z)*(x^2 + (y - 3*z)^2 - 1/50)")
    rng = np.random.default_rng(2)
    middle = local.grid.to_units(np.zeros((1, 3)))[0]
    axes = rng.normal(size=(30, 3))
    circles = [
        Circle(middle + rng.uniform(-2, 2, 3), *frame(axis / np.linalg.norm(axis)), float(rng.uniform(0.5, 4)))
        for axis in axes
    ]
    together = crossings(local, circles)
    for circle, angles in zip(circles, together, strict=True):
        assert angles == pytest.approx(crossings(local, [circle])[0], abs=1e-12)
        corners = circle.at(2 * np.pi * np.arange(13) / 12 + 0.0123)
        share = np.linspace(0, 1, 500)[:, None]
        signs = local.signs(np.concatenate([p + share * (q - p) for p, q in pairwise(corners)]))
        assert len(angles) >= np.count_nonzero(np.diff(signs))
        assert (np.diff(angles) >= 0).all()
    assert [len(angles) for angles in together] == counts(local, Circles.of(circles))[0].tolist()


def test_stable_circles_are_crossed_as_often_at_all_scales() -> None:
    local = _local("x^2 - y^3 + 5*y^4")
    middle = local.grid.to_units(np.zeros((1, 3)))[0]
    circles = [Circle(middle, *frame(np.array([0.0, 0, 1])), radius) for radius in (0.2, 1.0, 5.0)]
    found, number = stable(local, circles, 1e-3)
    assert number.tolist() == [2, 2, 2]
    for circle in found:
        assert circle is not None
        smaller = Circles.of([circle.scaled(share) for share in (1.0, 0.3, 0.1, 0.02)])
        assert counts(local, smaller)[0].tolist() == [2] * 4


def test_an_arc_is_cut_where_it_leaves_a_sphere() -> None:
    local = _local("x^2 + y^2 - z^3*x^2")
    z = np.linspace(-0.7, 0.7, 141)
    nodes = local.grid.to_units(np.column_stack([0 * z, 0 * z, z]))
    arc = Arc(local, nodes, False, -1, -1, 0)
    center = nodes[70]
    low, high = np.array([70.0, 70.0]), np.array([140.0, 0.0])
    found = arc.where(lambda places: np.linalg.norm(places - center, axis=1) - 2.345, low, high)
    assert np.linalg.norm(arc.places(found) - center, axis=1) == pytest.approx([2.345] * 2, abs=1e-11)


def test_turning_lists_the_faces_whose_normals_part() -> None:
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(60, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = rng.integers(0, 60, (200, 3))
    special = np.array([3, 7])
    rows, cosines = turning(normals, faces, special, 0.4)
    least = np.array(
        [min(normals[a] @ normals[b], normals[b] @ normals[c], normals[c] @ normals[a]) for a, b, c in faces]
    )
    wanted = np.flatnonzero((least < 0.4) & ~np.isin(faces, special).any(axis=1))
    assert (rows == wanted).all()
    assert cosines == pytest.approx(least[wanted])


@pytest.mark.parametrize(
    ("formula", "smooth"),
    [("x^2 + 2*y^2 - z^2", True), ("x^3 + y^3 + z^3", True), ("x^2 + y^2 - z^3", False), ("x^2*y - z^3 + y^4", False)],
)
def test_tangent_cones_are_smooth_or_no_block_is_tried(formula: str, smooth: bool) -> None:
    assert regular_cones(germs_at(Surface(formula).field, np.zeros((1, 3)), 0.1)).tolist() == [smooth]  # type: ignore[arg-type]


def test_each_edge_is_named_once() -> None:
    simplices = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    assert pairs_of(simplices).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3], [2, 4], [3, 4]]


def test_beside_each_edge_of_a_block_are_squares_or_its_rib() -> None:
    lattice = Lattice.of(np.array([[-1.3, -2.2, -1.1], [0.1, 0.2, 0.3]]), np.array([[1.7, 1.8, 1.9], [3.1, 2.2, 1.3]]))
    boxes = np.concatenate([lattice.squares, lattice.ends])[lattice.beside]
    edges = lattice.edges[:, None]
    assert (boxes[:, :, 3] == edges[:, :, 3]).all()
    assert (boxes[..., 0] <= edges[..., 0] + 1e-12).all()
    assert (boxes[..., 1] >= edges[..., 1] - 1e-12).all()
    rib = lattice.beside >= len(lattice.squares)
    assert (rib.sum(axis=1) <= 1).all()
    assert np.array_equal(boxes[rib], np.broadcast_to(edges, boxes.shape)[rib])
