"""Mended triangles: the topology stays, new vertices lie on the surface, and triangles face as the surface does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface, polygonize
from implicit.domain import to_bounds
from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.mend import mend
from implicit.topology import find_edges
from tests.singular_cases import case_of

SPHERE = "x^2 + y^2 + z^2 - 1"
TORUS = "(x^2 + y^2 + z^2 + 0.91)^2 - 4*(x^2 + y^2)"


def lay(formula: str) -> Local:
    surface = Surface(formula)
    return Local(surface.field, Grid.over(to_bounds(1.5), 8, 7), ())


def coarse(formula: str, cells: int):
    mesh = polygonize(Surface(formula), 1.5, resolution=cells, method="marching")
    return mesh.vertices, mesh.normals, mesh.faces


def none(mesh) -> np.ndarray:
    return np.zeros(len(mesh[0]), bool)


def facing(mesh) -> np.ndarray:
    vertices, normals, faces = mesh
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    return np.einsum("ij,ikj->ik", across, normals[faces]).min(axis=1) / np.maximum(length, 1e-300)


def bends(mesh) -> np.ndarray:
    _, normals, faces = mesh
    return np.einsum("nkc,nkc->nk", normals[faces], normals[np.roll(faces, -1, axis=1)])


def euler(mesh) -> int:
    vertices, _, faces = mesh
    return len(np.unique(faces)) - find_edges(faces, len(vertices)).count + len(faces)


@pytest.mark.parametrize(
    ("formula", "cells", "expected"),
    [("x^2 + 9*y^2 + z^2 - 1", 10, 2), ("x^4 + y^4 + z^4 - 1", 8, 2), (TORUS, 11, 0), (TORUS, 12, 0)],
)
def test_no_side_bends_far_and_the_topology_stays(formula, cells, expected):
    local, mesh = lay(formula), coarse(formula, cells)
    assert bends(mesh).min() < 0.7
    mended = mend(local, mesh, none(mesh))
    edges = find_edges(mended[2], len(mended[0]))
    assert edges.balanced and not edges.crowded and euler(mended) == euler(mesh) == expected
    assert bends(mended).min() >= 0.7 and facing(mended).min() >= 0.8
    values, slopes = local.field.gradients(mended[0])
    assert np.abs(values).max() <= 1e-10 * np.linalg.norm(slopes, axis=1).min()
    assert np.array_equal(mended[0][: len(mesh[0])], mesh[0])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(1e-4, 0.03))
def test_slivers_are_turned(seed, depth):
    """Faces of a fine sphere get a vertex close to the middle of a side, so that three vertices are nearly in line."""
    local, (vertices, normals, faces) = lay(SPHERE), coarse(SPHERE, 16)
    rows = np.random.default_rng(seed).choice(len(faces), 20, replace=False)
    p, q, r = faces[rows].T
    inner = (vertices[p] + vertices[q]) / 2 * (1 - depth) + depth * vertices[r]
    inner /= np.linalg.norm(inner, axis=1, keepdims=True)
    m = len(vertices) + np.arange(len(rows))
    parts = [np.column_stack(corners) for corners in ((p, q, m), (q, r, m), (r, p, m))]
    faces = np.concatenate([np.delete(faces, rows, axis=0), *parts])
    mesh = np.concatenate([vertices, inner]), np.concatenate([normals, inner]), faces
    mended = mend(local, mesh, none(mesh))
    assert facing(mesh).min() < 0.5 < facing(mended).min()
    assert find_edges(mended[2], len(mended[0])).balanced and euler(mended) == 2
    assert len(mended[0]) == len(mesh[0]) and len(mended[2]) == len(mesh[2])


def test_sides_at_singular_vertices_and_at_the_boundary_stay():
    local, (vertices, normals, faces) = lay(SPHERE), coarse(SPHERE, 6)
    everywhere = np.ones(len(vertices), bool)
    assert mend(local, (vertices, normals, faces), everywhere)[2].tolist() == faces.tolist()
    one = faces[:1]
    assert mend(local, (vertices, normals, one), ~everywhere)[2].tolist() == one.tolist()
    nothing = faces[:0]
    assert mend(local, (vertices, normals, nothing), ~everywhere)[2].tolist() == []


@pytest.mark.parametrize("name", ["whitney", "source_3_conoid", "steiner", "cuspidal_edge", "cayley"])
def test_away_from_singular_vertices_no_triangle_of_a_conforming_mesh_faces_elsewhere(name):
    surface, ball = case_of(name)
    mesh = conforming(surface, ball, 40)
    loose = np.ones(len(mesh.vertices), bool)
    loose[np.concatenate([mesh.points, *mesh.curves])] = False
    rows = loose[mesh.faces].all(axis=1)
    assert np.quantile(facing((mesh.vertices, mesh.normals, mesh.faces[rows])), 0.001) > 0.5


@pytest.mark.parametrize("cells", [32, 45, 64])
def test_at_pinch_points_triangles_face_as_the_normals_at_their_regular_corners(cells):
    surface, ball = case_of("source_3_conoid")
    mesh = conforming(surface, ball, cells)
    fixed = np.zeros(len(mesh.vertices), bool)
    fixed[np.concatenate([mesh.points, *mesh.curves])] = True
    a, b, c = (np.array(mesh.vertices)[mesh.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    cosines = np.einsum("ij,ikj->ik", across, mesh.normals[mesh.faces]) / np.linalg.norm(across, axis=1)[:, None]
    assert cosines[~fixed[mesh.faces]].min() > 0.5
