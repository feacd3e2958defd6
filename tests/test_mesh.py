"""Meshes: what is counted, and what is refused."""

import numpy as np
import pytest

from implicit import Mesh, OpenSurfaceError

CUBE = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], float)
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([t for a, b, c, d in SQUARES for t in ((a, b, c), (a, c, d))])


def cube() -> Mesh:
    return Mesh(CUBE, FACES)


def torus_grid(m: int, n: int) -> np.ndarray:
    i, j = np.meshgrid(np.arange(m), np.arange(n), indexing="ij")
    a, b = i * n + j, (i + 1) % m * n + j
    c, d = (i + 1) % m * n + (j + 1) % n, i * n + (j + 1) % n
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def test_cube():
    mesh = cube()
    report = mesh.report()
    assert (report.vertices, report.edges, report.faces) == (8, 18, 12)
    assert report.closed and report.manifold and report.oriented
    assert (report.components, report.euler, report.genus, mesh.euler) == (1, 2, 0, 2)
    assert mesh.area == pytest.approx(6)
    assert mesh.volume == pytest.approx(1)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    assert np.all(np.sum(mesh.normals * (CUBE - 0.5), axis=1) > 0)


def test_volume_is_signed_and_does_not_depend_on_the_origin():
    inward = Mesh(CUBE + 1e3, FACES[:, ::-1])
    assert inward.volume == pytest.approx(-1)


def test_torus_has_genus_one():
    faces = torus_grid(7, 5)
    mesh = Mesh(np.random.default_rng(0).normal(size=(35, 3)), faces)
    report = mesh.report()
    assert report.closed and report.manifold and report.oriented
    assert (report.euler, report.genus) == (0, 1)


def test_open_mesh():
    mesh = Mesh(CUBE, FACES[:-1])
    report = mesh.report()
    assert not report.closed and report.manifold and report.oriented
    assert (report.boundary_edges, report.euler, report.genus) == (3, 1, None)
    assert "open (3 boundary edges)" in str(report)
    with pytest.raises(OpenSurfaceError, match="3 boundary edges"):
        _ = mesh.volume


def test_turned_face_is_not_oriented():
    faces = FACES.copy()
    faces[3] = faces[3][::-1]
    report = Mesh(CUBE, faces).report()
    assert report.closed and report.manifold and not report.oriented and report.genus is None


def test_edge_with_four_faces():
    other = np.where(np.isin(FACES, (0, 1)), FACES, FACES + 8)
    mesh = Mesh(np.concatenate([CUBE, -CUBE]), np.concatenate([FACES, other]))
    report = mesh.report()
    assert report.nonmanifold_edges == 1 and not report.manifold
    assert report.closed and report.components == 1
    assert "1 edge(s) with more than two faces" in str(report)


def test_vertex_where_two_cubes_touch():
    other = np.where(FACES == 0, 0, FACES + 8)
    report = Mesh(np.concatenate([CUBE, -CUBE]), np.concatenate([FACES, other])).report()
    assert (report.nonmanifold_edges, report.nonmanifold_vertices, report.components) == (0, 1, 1)
    assert not report.manifold and report.closed


def test_two_components_and_a_vertex_nobody_uses():
    points = np.concatenate([CUBE, CUBE + 3, [[9.0, 9, 9]]])
    report = Mesh(points, np.concatenate([FACES, FACES + 8])).report()
    assert (report.components, report.euler, report.genus, report.vertices) == (2, 4, 0, 16)


def test_curve_off_the_faces_counts_in_the_characteristic():
    points = np.concatenate([CUBE, [[0, 0, 2.0], [0, 0, 3.0]]])
    mesh = Mesh(points, FACES, curves=[[1, 8, 9], [0, 1]])
    assert mesh.euler == 2 + 2 - 2
    assert mesh.report().components == 1 and mesh.report().curves == 2


def test_degenerate_faces():
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)]
    assert Mesh(points, [(0, 1, 2), (0, 1, 3), (0, 0, 3)]).report().degenerate_faces == 2


def test_empty_mesh():
    mesh = Mesh([], [])
    report = mesh.report()
    assert report.empty and not report.closed and report.euler == 0
    assert (mesh.area, mesh.volume) == (0, 0)
    assert str(report) == "empty mesh: no vertices, no faces"


def test_arrays_are_read_only_and_the_caller_keeps_his():
    points, faces = CUBE.copy(), FACES.copy()
    mesh = Mesh(points, faces)
    points[:] = 7
    faces[:] = 0
    assert mesh.volume == pytest.approx(1)
    for array in (mesh.vertices, mesh.faces, mesh.normals, mesh.points):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    again = Mesh(mesh.vertices, mesh.faces, mesh.normals)
    assert again.vertices is mesh.vertices


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((CUBE, [(0, 1, 8)]), r"face 0 names vertex 8, but the mesh has 8 vertices \(0 to 7\)"),
        ((CUBE, [(0, 1, 2), (0, -1, 2)]), "face 1 names vertex -1"),
        ((CUBE, [(0, 1, 2, 3)]), r"faces must have shape \(n, 3\), got \(1, 4\)"),
        ((CUBE, [(0.0, 1.0, 2.0)]), "faces must be integers, got float64"),
        ((CUBE[:, :2], FACES), r"vertices must have shape \(n, 3\), got \(8, 2\)"),
        (([(0, 0, 0), (1, np.nan, 0)], []), r"every vertex must be finite, got vertex 1 = \(1.0, nan, 0.0\)"),
        ((CUBE, FACES, CUBE[:5]), "normals must be one per vertex, got 5 for 8 vertices"),
        ((CUBE, FACES, None, [[0, 9]]), "curve 0, place 1, names vertex 9"),
        ((CUBE, FACES, None, (), [1.5]), "points must be a list of vertex indices"),
    ],
)
def test_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Mesh(*arguments)
