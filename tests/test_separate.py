"""Meshes whose sheets cross or touch, taken apart: manifold, with the same triangles."""

import numpy as np
import pytest

from implicit import Ball, Mesh, Surface, polygonize

CROSSING = {
    "cone": ("x^2 + y^2 = z^2", 1.2),
    "umbrella": ("x^2 = y^2 z", 1.2),
    "three planes": ("x y z", 1.1),
    "two spheres": ("((x - 1/2)^2 + y^2 + z^2 - 1) ((x + 1/2)^2 + y^2 + z^2 - 1)", 2.0),
    "Cayley": ("4 x y z + x^2 + y^2 + z^2 = 1", 2.0),
    "spindle": ("(x^2 + y^2 + z^2 - 9/16)^2 = 4 (x^2 + y^2)", 2.5),
}


@pytest.mark.parametrize("name", CROSSING)
def test_the_sheets_are_manifold_and_the_triangles_the_same(name):
    formula, radius = CROSSING[name]
    mesh = polygonize(Surface(formula), Ball(radius), resolution=20, method="conforming")
    before, apart = mesh.report(), mesh.separate()
    report = apart.report()
    assert report.manifold and report.oriented and report.faces == before.faces
    assert apart.area == pytest.approx(mesh.area, rel=1e-14)
    assert np.array_equal(apart.vertices[apart.faces], mesh.vertices[mesh.faces])
    assert report.closed == before.closed
    if before.closed:
        assert apart.volume == pytest.approx(mesh.volume, rel=1e-12)
    lengths = np.linalg.norm(apart.normals, axis=1)
    assert lengths == pytest.approx(np.ones(len(lengths)))


def test_cubes_that_share_an_edge_part_along_it():
    corners = np.array([(x, y, z) for x in (0, 1, 2) for y in (0, 1, 2) for z in (0, 1)], float)

    def number(x, y, z):
        return 6 * x + 2 * y + z

    def cube(x, y):
        c = [number(x + a, y + b, d) for a in (0, 1) for b in (0, 1) for d in (0, 1)]
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return [(c[q[i]], c[q[j]], c[q[k]]) for q in quads for i, j, k in ((0, 1, 2), (0, 2, 3))]

    mesh = Mesh(corners, cube(0, 0) + cube(1, 1))
    assert mesh.report().nonmanifold_edges == 1 and mesh.volume == pytest.approx(2)
    report = mesh.separate().report()
    assert report.manifold and report.closed and (report.components, report.euler) == (2, 4)


def test_a_manifold_mesh_stays_as_it_is():
    mesh = polygonize(Surface("x^2 + y^2 + z^2 = 1"), 1.2, resolution=12)
    apart = mesh.separate()
    assert np.array_equal(apart.vertices[apart.faces], mesh.vertices[mesh.faces])
    assert len(apart.vertices) == len(mesh.vertices)
