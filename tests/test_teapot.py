"""The Utah teapot: its parts, and a mesh of it without cracks."""

import numpy as np
import pytest

from implicit.sides.winding import MeshWinding
from parametric import teapot, tessellate


def test_the_pot_has_32_patches_16_open_edges_and_two_poles():
    pot = teapot()
    report = pot.report()
    assert len(pot.surfaces) == 32 and not pot.closed
    assert (report.shared, report.naked, report.crowded, report.degenerate) == (52, 16, 0, 8)
    poles = {tuple(np.round(edge.points(np.array([0.5]))[0], 12)) for edge in pot.edges if edge.kind == "degenerate"}
    assert poles == {(0.0, 0.0, 3.15), (0.0, 0.0, 0.0)}


def test_the_pot_stands_on_zero_and_points_outward():
    pot = teapot()
    heights = np.concatenate([s.points[..., 2].ravel() for s in pot.surfaces])
    assert heights.min() == 0 and heights.max() == 3.15
    body = pot.surfaces[4]
    assert body.normal(0.5, 0.5) @ (body(0.5, 0.5) - (0, 0, 1.2)) > 0
    assert np.allclose(pot.surfaces[20].normal(0, 0.5), (0, 0, 1))  # the lid's pole
    assert np.allclose(pot.surfaces[28].normal(0, 0.5), (0, 0, -1))  # the bottom's


@pytest.mark.parametrize(("tolerance", "most"), [(1e-2, 5_500), (1e-3, 50_000)])
def test_the_mesh_has_no_cracks_and_keeps_the_tolerance(tolerance, most):
    pot = teapot()
    mesh = tessellate(pot, tolerance=tolerance)
    report = mesh.report()
    assert len(mesh.faces) <= most
    assert report.manifold and report.oriented and report.degenerate_faces == 0
    assert report.components == 4  # body with bottom and rim, lid, handle, spout
    assert boundary_gap(pot, mesh) < 1e-9
    rng = np.random.default_rng(7)
    samples = np.concatenate([s(*rng.uniform(size=(2, 100_000 // 32))) for s in pot.surfaces])
    assert MeshWinding(mesh).within(samples, tolerance).all()


def boundary_gap(shell, mesh):
    """The largest distance of a boundary vertex of the mesh from the naked edges of the shell."""
    from scipy.spatial import cKDTree

    rim = np.unique(MeshWinding(mesh).boundary)
    gaps = []
    for vertex in rim:
        k, (u, v) = mesh.vertex_surfaces[vertex], mesh.parameters[vertex]
        names = {edge.arcs[0].side.name for edge in shell.boundary if edge.arcs[0].side.surface_index == k}
        on = {"u0": u, "u1": 1 - u, "v0": v, "v1": 1 - v}
        gaps.append(min((on[name] for name in names), default=np.inf))
    curve = np.concatenate([edge.points(np.linspace(0, 1, 2001)) for edge in shell.boundary])
    far = cKDTree(curve).query(mesh.vertices[rim])[0].max()
    return far if not np.isfinite(gaps).all() else max(gaps)
