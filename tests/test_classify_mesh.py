"""Winding numbers of meshes, and classification by them."""

import numpy as np
import pytest

from implicit import (
    Mesh,
    OpenSurfaceError,
    Surface,
    UndecidedError,
    certified_floor,
    classify,
    polygonize,
    winding_number,
)
from implicit.sides.winding import MeshWinding, solid_angles

TORUS = "(x^2 + y^2 + z^2 + 1 - 4/25)^2 - 4 (x^2 + y^2)"


@pytest.fixture(scope="module")
def torus():
    return polygonize(Surface(TORUS), 1.5, resolution=32)


def test_meshes_agree_with_their_surface_away_from_it(torus):
    lattice = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 21)] * 3, indexing="ij"), axis=-1)
    slope = np.linalg.norm(Surface(TORUS).gradient(lattice), axis=-1)
    clear = abs(Surface(TORUS)(lattice)) > 0.02 * slope + 1e-3
    assert (classify(torus, lattice) == classify(Surface(TORUS), lattice))[clear].all()


def test_winding_numbers_agree_with_solid_angles(torus):
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (40, 3))
    half = Mesh(torus.vertices, torus.faces[torus.vertices[torus.faces].mean(axis=1)[:, 2] > 0])
    for mesh in (torus, half):
        naive = [solid_angles(mesh.vertices[mesh.faces] - p).sum() / (4 * np.pi) for p in points]
        assert np.abs(winding_number(mesh, points) - naive).max() < 1e-12


def cube(size=1.0):
    corners = np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)], dtype=float) * size
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    return Mesh(corners, np.array(faces))


def test_cube_lattice_with_every_tie():
    lattice = np.stack(np.meshgrid(*[np.arange(-2, 7) / 4] * 3, indexing="ij"), axis=-1)
    distance = np.abs(lattice - 0.5).max(axis=-1) - 0.5
    assert cube().volume == pytest.approx(1)
    assert (classify(cube(), lattice) == np.sign(distance)).all()


def test_rules_for_winding_numbers():
    box = cube()
    twice = Mesh(box.vertices, np.concatenate([box.faces, box.faces]))
    reversed_ = Mesh(box.vertices, box.faces[:, ::-1])
    point = (0.4, 0.3, 0.2)
    assert [float(winding_number(m, point)) for m in (box, twice, reversed_)] == [1, 2, -1]
    for rule, answers in (("nonzero", (-1, -1, -1)), ("positive", (-1, -1, 1)), ("evenodd", (-1, 1, -1))):
        assert tuple(classify(m, point, rule=rule) for m in (box, twice, reversed_)) == answers


def test_tolerance_of_meshes():
    box = cube()
    for gap in (1e-12, 1e-6, 1e-2):
        assert list(classify(box, [(0.3, 0.4, -gap), (0.3, 0.4, gap)])) == [1, -1]
        assert list(classify(box, [(0.3, 0.4, -gap), (-gap, -gap, -gap)], tolerance=gap * 1.01)) == [0, 1]
    with pytest.raises(UndecidedError, match="rounding hides the side") as caught:
        classify(box, [(5, 5, 5), (0.25, 0.25, 0)], tolerance=0)
    assert list(caught.value.indices) == [1]
    assert classify(box, (0.25, 0.25, 0)) == 0


def test_open_meshes_name_their_edges():
    open_box = Mesh(cube().vertices, cube().faces[2:])
    with pytest.raises(OpenSurfaceError, match=r"4 edges have faces on one side only: .*0"):
        classify(open_box, (0.5, 0.5, 0.5))
    assert 0.5 < winding_number(open_box, (0.5, 0.5, 0.5)) < 1
    assert winding_number(open_box, (0.5, 0.5, 0.5)) == pytest.approx(5 / 6, abs=1e-14)


def test_empty_mesh_is_outside_everywhere():
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    assert list(classify(empty, [(0, 0, 0), (1, 2, 3)])) == [1, 1]
    assert MeshWinding(empty).floor == 0


def test_floor_of_meshes_is_reported():
    assert 0 < certified_floor(cube()) < 1e-13
