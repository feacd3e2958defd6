"""Following from seeds: the same pieces as a grid of the same spacing finds, by cubes and by tetrahedra, unbounded."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from implicit import Ball, Surface, polygonize, polygonize_from
from implicit.polygonizers.following import LIMIT
from implicit.polygonizers.tetrahedra import _TABLE

TWO = Surface("min((x + 1)^2 + y^2 + z^2, (x - 1)^2 + y^2 + z^2) = 0.6^2")
TORUS = Surface("(x^2 + y^2 + z^2 + 4 - 0.25)^2 = 16 (x^2 + y^2)")


def pieces(mesh):
    """One vertex of each connected piece."""
    links = np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(len(mesh.vertices),) * 2)
    return mesh.vertices[np.unique(connected_components(graph, directed=False)[1], return_index=True)[1]]


def rows(points):
    return {tuple(row) for row in np.round(points, 9)}


def test_a_seed_finds_its_piece_and_no_other():
    mesh = polygonize(TWO, 2, resolution=40, method="following", seeds=(1.5, 0.1, 0))
    report = mesh.report()
    assert report.closed and report.manifold and (report.components, report.euler) == (1, 2)
    assert mesh.vertices[:, 0].min() > 0 and mesh.volume > 0
    assert rows(mesh.vertices) < rows(polygonize(TWO, 2, resolution=40, method="marching").vertices)


@pytest.mark.parametrize(
    "surface",
    [TWO, TORUS, Surface("x^4 - 5 x^2 + y^4 - 5 y^2 + z^4 - 5 z^2 + 10"), Surface("cos(3 x) + cos(3 y) + cos(3 z)")],
)
def test_a_seed_on_each_piece_finds_the_mesh_of_the_grid(surface):
    grid = polygonize(surface, 2.9, resolution=45, method="marching")
    mesh = polygonize(surface, 2.9, resolution=45, method="following", seeds=pieces(grid))
    assert len(mesh.faces) == len(grid.faces) and rows(mesh.vertices) == rows(grid.vertices)
    without = polygonize(surface, 2.9, resolution=45, method="following")
    assert np.array_equal(without.vertices, grid.vertices) and np.array_equal(without.faces, grid.faces)


@pytest.mark.parametrize("decomposition", ["cube", "tetrahedron"])
def test_without_bounds(decomposition):
    mesh = polygonize_from(TORUS, [(2.4, 0.1, 0)], 0.11, decomposition=decomposition)
    report = mesh.report()
    assert report.closed and report.manifold and report.oriented and report.genus == 1
    assert report.degenerate_faces == 0
    assert mesh.volume == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=0.02)
    values, slopes = TORUS.field.gradients(mesh.vertices)
    assert np.max(np.abs(values) / np.linalg.norm(slopes, axis=1)) < 1e-11
    assert np.all(np.sum(mesh.normals * slopes, axis=1) > 0)


@pytest.mark.parametrize("formula", ["x + y + z", "x^2 + y^2 + z^2 = 1", "max(abs(x), abs(y), abs(z)) = 1"])
def test_tetrahedra_with_zeros_on_lattice_points(formula):
    surface = Surface(f"max({formula.replace('=', '- (')}{')' if '=' in formula else ''}, x^2 + y^2 + z^2 - 4)")
    report = polygonize_from(surface, (0.6, 0.6, -1.2), 0.25, decomposition="tetrahedron").report()
    assert report.closed and report.manifold and report.oriented and report.euler == 2


def test_all_patterns_of_a_tetrahedron():
    for table in _TABLE:
        for pattern, triangles in enumerate(table):
            inside = bin(pattern).count("1")
            assert len(triangles) == (0, 1, 2, 1, 0)[inside]
            assert len({edge for triangle in triangles for edge in triangle}) == (0, 3, 4, 3, 0)[inside]


def test_work_is_proportional_to_the_surface():
    """A ball of radius 1 in a box a hundred times as wide: only samples near it are taken."""
    seen = 0

    def ball(points):
        nonlocal seen
        seen += len(points)
        return np.sum(points**2, axis=1) - 1

    surface = Surface.from_function(ball, gradient=lambda points: 2 * points)
    mesh = polygonize(surface, 100, resolution=1000, method="following", seeds=(1, 0, 0))
    assert mesh.report().closed and seen < 500_000


def test_balls_clip_what_is_followed():
    mesh = polygonize(Surface("z = x y"), Ball(1), resolution=30, seeds=(0, 0, 0))
    assert mesh.report().euler == 1
    assert np.linalg.norm(mesh.vertices, axis=1).max() < 1 + 1e-14


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: polygonize(TWO, 2, seeds=[(0, 0)]), r"seeds must be finite points \(n, 3\), got shape \(1, 2\)"),
        (lambda: polygonize(TWO, 2, seeds=[], method="following"), "seeds must be finite points"),
        (lambda: polygonize(TWO, 2, seeds=(1, 0, 0), method="marching"), 'seeds are for method="following"'),
        (
            lambda: polygonize_from(TWO, (9.0, 0, 0), 0.1),
            r"seed 0 at \(9.0, 0.0, 0.0\) has no point of the surface within",
        ),
        (lambda: polygonize_from(TWO, (1.6, 0, 0), 0), "cell must be a positive length, got 0"),
        (
            lambda: polygonize_from(TWO, (1.6, 0, 0), 0.1, decomposition="prism"),
            "decomposition must be one of cube, tetra",
        ),
        (
            lambda: polygonize_from(Surface("z + y^2 + 0 x"), (0, 0, 0), 100.0),
            f"more than {LIMIT} cells from the seeds",
        ),
    ],
)
def test_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
