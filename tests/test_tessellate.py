"""Meshes of surfaces and shells: conforming, within tolerance, with normals and parameters from the surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit.sides.winding import MeshWinding
from parametric import (
    BezierSurface,
    BSplineSurface,
    FormulaSurface,
    Shell,
    circle,
    coons,
    extrude,
    grid_mesh,
    helix,
    iso_curves,
    line,
    polyline,
    revolve,
    sweep,
    teapot,
    tessellate,
    u,
    v,
)
from tests.solids import (
    box_patches,
    disc_patches,
    hemisphere_patches,
    pillow_patches,
    random_pillow,
    random_quilt,
    reparametrized,
    torus_patches,
)

SQUARE = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0), (-0.5, -0.5, 0)]


def assert_within(shell, mesh, tolerance, count=3000, seed=3):
    """No sampled point of the surfaces is farther than the tolerance from the mesh."""
    rng = np.random.default_rng(seed)
    near = MeshWinding(mesh)
    for surface in shell.surfaces:
        (u0, u1), (v0, v1) = surface.domain
        samples = surface(rng.uniform(u0, u1, count), rng.uniform(v0, v1, count))
        assert near.within(samples, tolerance).all()


def boundary_length(mesh):
    edges = MeshWinding(mesh).boundary
    return np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1).sum()


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.integers(2, 4), st.integers(2, 4), st.sampled_from([0.1, 0.01]))
def test_random_quilts_have_no_cracks(seed, m, n, tolerance):
    shell = Shell(random_quilt(np.random.default_rng(seed), m, n))
    mesh = tessellate(shell, tolerance=tolerance)
    report = mesh.report()
    assert report.manifold and report.oriented and report.euler == 1 and report.components == 1
    assert report.degenerate_faces == 0
    assert_within(shell, mesh, tolerance, 300)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.2, 5.0), st.floats(0.2, 5.0), st.integers(0, 15))
def test_sides_at_different_speeds_have_no_cracks(a, b, k):
    patches = torus_patches()
    patches[k] = reparametrized(reparametrized(patches[k], a, 0), b, 1)
    report = tessellate(Shell(patches), tolerance=0.01).report()
    assert report.closed and report.manifold and report.oriented and report.genus == 1


def test_a_long_side_beside_two_short_ones_has_no_cracks():
    patches = torus_patches()
    patches[5:6] = patches[5].split(v=0.3)
    patches[10:11] = patches[10].split(u=0.7)
    mesh = tessellate(Shell(patches), tolerance=0.01)
    assert mesh.report().closed and mesh.report().manifold and mesh.report().genus == 1


def assert_sphere(mesh):
    """Two triangles at every edge, in opposite directions, no triangle twice, and Euler characteristic 2."""
    report = mesh.report()
    assert report.closed and report.manifold and report.oriented and report.euler == 2
    assert len(np.unique(np.sort(mesh.faces, axis=1), axis=0)) == len(mesh.faces)


@pytest.mark.parametrize("tolerance", [0.2, 0.05, 0.02, 0.01])
@pytest.mark.parametrize("k", [0.2, 0.3, 0.45])
def test_two_patches_that_cut_off_the_same_corner_share_no_chord(k, tolerance):
    net = [
        [(0, 0, 0), (-k, 0.5, 0), (0, 1, 0)],
        [(0.5, -k, 0), (0.5, 0.5, 0.2), (0.5, 1 + k, 0)],
        [(1, 0, 0), (1 + k, 0.5, 0), (1, 1, 0)],
    ]
    shell = Shell(pillow_patches(net))
    mesh = tessellate(shell, tolerance=tolerance)
    assert_sphere(mesh)
    assert_within(shell, mesh, tolerance, 500)


@pytest.mark.parametrize("weight", [1e2, 1e4])
def test_pillows_with_a_heavy_corner_are_spheres(weight):
    x, y = np.meshgrid(np.arange(4) / 3, np.arange(4) / 3, indexing="ij")
    net, weights = np.stack([x, y, np.pad(np.full((2, 2), 0.5), 1)], -1), np.ones((4, 4))
    weights[0, 0] = weight
    for tolerance in (0.02, 0.005, 0.001):
        assert_sphere(tessellate(Shell(pillow_patches(net, weights)), tolerance=tolerance))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.booleans(), st.booleans(), st.floats(0.005, 0.3))
def test_random_pillows_are_spheres(seed, rational, certified, tolerance):
    shell = Shell(random_pillow(np.random.default_rng(seed), rational))
    mesh = tessellate(shell, tolerance=tolerance, certified=certified)
    assert_sphere(mesh)
    assert_within(shell, mesh, tolerance, 100)


def test_a_closed_shell_has_positive_volume_whichever_way_it_was_built():
    exact = 2 * np.pi**2 * 0.16
    for reverse in (False, True):
        mesh = tessellate(Shell(torus_patches(reverse=reverse)), tolerance=1e-3)
        assert 0 < exact - mesh.volume < 1e-3 * 4 * np.pi**2 * 0.4
        ring = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
        outward = mesh.vertices - mesh.vertices * [1, 1, 0] / ring[:, None]
        assert np.allclose(mesh.normals, outward / 0.4, atol=1e-9)


def test_solids_have_the_volumes_of_theory():
    tolerance = 1e-3
    solids = {
        2.0: sweep(polyline(SQUARE), line((0, 0, 0), (0, 0, 2)), caps=True),
        2 * np.pi: sweep(circle(1), line((0, 0, 0), (0, 0, 2)), caps=True),
        2 * np.pi * 7 / 12: sweep(
            circle(1), line((0, 0, 0), (0, 0, 2)), caps=True, scale=lambda t: 1 - np.asarray(t) / 2
        ),
        2.0 + 1e-12: sweep(polyline(SQUARE), line((0, 0, 0), (0, 0, 2)), caps=True, twist=np.pi / 2),
        2 * np.pi**2 * 0.16: Shell([revolve(circle(0.4, center=(0, 1, 0)))]),
        4 * np.pi / 3: Shell(hemisphere_patches() + hemisphere_patches(upper=False)),
        2 * np.pi / 3: Shell(hemisphere_patches() + disc_patches(upward=False)),
    }
    for volume, solid in solids.items():
        mesh = tessellate(solid, tolerance=tolerance)
        report = mesh.report()
        assert report.closed and report.manifold and report.oriented and report.degenerate_faces == 0
        assert abs(mesh.volume - volume) <= tolerance * mesh.area


def test_a_helical_tube_has_the_volume_of_its_length_times_its_section():
    tube = sweep(circle(0.2), helix(1, 0.5, 2), caps=True)
    mesh = tessellate(tube, tolerance=2e-3)
    length = 2 * np.hypot(2 * np.pi, 0.5)
    assert mesh.report().closed and mesh.report().manifold
    assert abs(mesh.volume - length * np.pi * 0.04) < 2e-3 * mesh.area


def test_a_box_keeps_its_edges_and_needs_few_triangles():
    mesh = tessellate(Shell(box_patches((1, 2, 3))), tolerance=1e-3)
    assert len(mesh.faces) == 12 and mesh.volume == pytest.approx(6)


def test_a_sliver_20_to_1_converges_in_area():
    x = np.linspace(0, 20, 4)
    net = np.stack(
        [np.broadcast_to(x[:, None], (4, 4)), np.broadcast_to(np.linspace(0, 1, 4), (4, 4)), np.zeros((4, 4))], -1
    )
    net[1:3, :, 2] = 3.0
    areas = [tessellate(BezierSurface(net), tolerance=t).area for t in (1e-1, 1e-2, 1e-3, 1e-4)]
    t = np.linspace(0, 1, 200_001)
    z = 9 * t * (1 - t)
    exact = np.hypot(np.diff(20 * t), np.diff(z)).sum()
    errors = np.abs(np.array(areas) - exact)
    assert (errors[1:] < errors[:-1] / 3).all() and errors[-1] < 1e-3


def test_poles_have_one_vertex_and_the_right_normal():
    mesh = tessellate(Shell(hemisphere_patches() + hemisphere_patches(upper=False)), tolerance=1e-2)
    top = np.flatnonzero(mesh.vertices[:, 2] > 1 - 1e-12)
    assert len(top) == 1 and np.allclose(mesh.normals[top[0]], (0, 0, 1))
    assert np.allclose(mesh.normals, mesh.vertices, atol=1e-6)


def test_a_formula_surface_with_seam_and_poles_closes():
    import sympy

    ball = FormulaSurface(
        (sympy.cos(u) * sympy.cos(v), sympy.sin(u) * sympy.cos(v), sympy.sin(v)),
        ((0, 2 * np.pi), (-np.pi / 2, np.pi / 2)),
    )
    mesh = tessellate(ball, tolerance=1e-2)
    assert mesh.report().closed and mesh.report().genus == 0
    assert 0 < 4 * np.pi / 3 - mesh.volume < 1e-2 * 4 * np.pi


def test_parameters_lead_back_to_the_vertices():
    shell = Shell(torus_patches())
    mesh = tessellate(shell, tolerance=1e-2)
    for k, surface in enumerate(shell.surfaces):
        here = mesh.vertex_surfaces == k
        assert np.abs(surface(*mesh.parameters[here].T) - mesh.vertices[here]).max() < 1e-12
    assert set(mesh.face_surfaces) == set(range(16))


@pytest.mark.parametrize("tolerance", [1e-1, 1e-2])
def test_certified_meshes_keep_the_tolerance_everywhere(tolerance):
    for shell in (
        Shell(torus_patches()),
        Shell(hemisphere_patches()),
        Shell(random_quilt(np.random.default_rng(1), 2, 2)),
    ):
        mesh = tessellate(shell, tolerance=tolerance, certified=True)
        assert mesh.report().manifold
        assert_within(shell, mesh, tolerance)


def test_a_certificate_bounds_what_is_measured():
    from parametric.tessellation.batch import evaluator
    from parametric.tessellation.cells import Cells, first_splits
    from parametric.tessellation.certificate import certified_deviations
    from parametric.tessellation.deviation import triangle_deviations
    from parametric.tessellation.triangulation import Triangulation

    shell = teapot()
    cells = Cells(shell, [first_splits(s, 1.0) for s in shell.surfaces])
    cells.build()
    net = Triangulation(cells, evaluator(shell))
    which = np.arange(len(net.triangles.home))
    assert (triangle_deviations(net, which) <= certified_deviations(net, which)).all()


def test_formulas_cannot_be_certified():
    with pytest.raises(ValueError, match="certified=True needs surfaces made of Bezier patches, got a FormulaSurface"):
        tessellate(FormulaSurface((u, v, u * v), ((0, 1), (0, 1))), tolerance=0.1, certified=True)


@pytest.mark.parametrize("tolerance", [0, -1, np.nan, np.inf])
def test_a_tolerance_is_a_positive_length(tolerance):
    with pytest.raises(ValueError, match="tolerance must be a positive length"):
        tessellate(box_patches()[0], tolerance=tolerance)


def test_coons_and_extruded_surfaces_mesh():
    arc = [(0, 0, 0), (0.5, 0, 1), (1, 0, 0)]
    from parametric import BezierCurve

    patch = coons(
        BezierCurve(arc),
        BezierCurve([(x, 1, z) for x, _, z in arc]),
        line((0, 0, 0), (0, 1, 0)),
        line((1, 0, 0), (1, 1, 0)),
    )
    for surface in (patch, extrude(BezierCurve(arc), (0, 1, 0))):
        mesh = tessellate(surface, tolerance=1e-3)
        assert mesh.report().euler == 1 and mesh.report().manifold
        assert_within(Shell([surface]), mesh, 1e-3)


def test_uniform_grids_have_two_triangles_per_cell_along_the_chosen_diagonal():
    flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    for diagonal, first in (("falling", (0.5, 0.0)), ("rising", (0.0, 0.0))):
        mesh = grid_mesh(flat, 2, 3, diagonal=diagonal)
        assert len(mesh.faces) == 12 and mesh.area == pytest.approx(1) and mesh.report().euler == 1
        shared = set(mesh.faces[0]) & set(mesh.faces[1])
        assert first in {tuple(mesh.parameters[k]) for k in shared}
        assert np.allclose(mesh.normals, (0, 0, 1))
    with pytest.raises(ValueError, match="diagonal must be"):
        grid_mesh(flat, 2, 2, diagonal="down")
    with pytest.raises(ValueError, match="at least one cell"):
        grid_mesh(flat, 0, 2)


def test_iso_parametric_curves_lie_on_the_surface():
    patch = torus_patches()[0]
    curves = iso_curves(patch, [0.25, 0.5], [0.5], tolerance=1e-3)
    assert len(curves) == 3
    assert np.allclose(curves[0][0], patch(0.25, 0.0)) and np.allclose(curves[2][-1], patch(1.0, 0.5))
    for t, curve in zip((0.25, 0.5), curves):
        ring = np.hypot(curve[:, 0], curve[:, 1]) - 1
        assert np.abs(np.hypot(ring, curve[:, 2]) - 0.4).max() < 1e-12
        dense = patch(t, np.linspace(0, 1, 500))
        steps = curve[None, 1:] - curve[None, :-1]
        along = np.clip(((dense[:, None] - curve[:-1]) * steps).sum(-1) / (steps**2).sum(-1), 0, 1)
        gaps = np.linalg.norm(dense[:, None] - curve[:-1] - along[..., None] * steps, axis=-1).min(axis=1)
        assert gaps.max() <= 1e-3


def test_rough_surfaces_come_to_an_end():
    x, y = np.meshgrid(np.arange(33.0), np.arange(33.0), indexing="ij")
    rough = BSplineSurface(np.stack([x, y, np.random.default_rng(0).normal(size=x.shape)], -1), (3, 3))
    report = tessellate(rough, tolerance=1e-2).report()
    assert report.manifold and report.euler == 1
