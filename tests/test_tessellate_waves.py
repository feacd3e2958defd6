"""Meshes of waves: places at which lines are halved must not decide how many triangles there are."""

import numpy as np
import pytest
import sympy as sp

from implicit.sides.winding import MeshWinding
from parametric import FormulaSurface, Shell, tessellate, u, v
from parametric.tessellation.samples import ALONG, CLOSELY, ENDS_AND_BETWEEN, INSIDE
from tests.solids import pillow_patches

WAVES = {
    "along u": lambda n: sp.sin(n * sp.pi * u),
    "along v": lambda n: sp.cos(n * sp.pi * v),
    "aslant": lambda n: sp.sin(n * sp.pi * (u + v)),
    "that fade": lambda n: 4 * v * (1 - v) * sp.sin(n * sp.pi * u),
}


def wave_mesh(kind, n, tolerance=0.05):
    surface = FormulaSurface((u, v, WAVES[kind](n)), ((0, 1), (0, 1)))
    return surface, tessellate(surface, tolerance=tolerance)


@pytest.mark.parametrize("kind", WAVES)
@pytest.mark.parametrize("n", [16, 24, 32, 48])
def test_waves_that_fit_the_halving_need_no_more_triangles_than_their_neighbours(kind, n):
    neighbours = [len(wave_mesh(kind, m)[1].faces) for m in (n - 1, n + 1)]
    _, mesh = wave_mesh(kind, n)
    assert len(mesh.faces) <= 2 * min(neighbours)
    assert mesh.report().manifold and mesh.report().euler == 1


@pytest.mark.parametrize("kind", WAVES)
@pytest.mark.parametrize("n", [15, 16, 17, 32, 48])
def test_waves_keep_the_tolerance_between_the_samples(kind, n):
    surface, mesh = wave_mesh(kind, n)
    closely, loosely = np.linspace(0, 1, 1001), np.linspace(0, 1, 14)
    s, t = (loosely, closely) if kind == "along v" else (closely, loosely)
    points = surface.grid(s, t).reshape(-1, 3)
    assert MeshWinding(mesh).within(points, 0.05).all()


def test_twice_the_waves_need_no_more_than_eight_times_the_triangles():
    for kind in WAVES:
        counts = [len(wave_mesh(kind, n)[1].faces) for n in (12, 24, 48)]
        assert counts[1] <= 8 * counts[0] and counts[2] <= 8 * counts[1]


def test_no_wave_vanishes_at_all_samples():
    waves = np.arange(1, 129)[:, None] * np.pi
    for t in (ALONG, CLOSELY, ENDS_AND_BETWEEN):
        assert np.allclose(t + t[::-1], 1)
        assert np.abs(np.sin(waves * t)).max(axis=1).min() > 0.01
    assert np.allclose(INSIDE.sum(axis=1), 1) and (INSIDE > 0).all()


def test_a_corner_a_million_times_as_heavy_comes_to_an_end():
    x, y = np.meshgrid(np.arange(4) / 3, np.arange(4) / 3, indexing="ij")
    net, weights = np.stack([x, y, np.pad(np.full((2, 2), 0.5), 1)], -1), np.ones((4, 4))
    weights[0, 0] = 1e6
    shell = Shell(pillow_patches(net, weights))
    mesh = tessellate(shell, tolerance=0.005)
    assert mesh.report().closed and mesh.report().manifold and mesh.report().euler == 2
    far = 1 - np.geomspace(1e-6, 1, 150)  # the heavy corner takes nearly all of the domain
    for surface in shell.surfaces:
        assert MeshWinding(mesh).within(surface.grid(np.append(far, 1), np.append(far, 1)).reshape(-1, 3), 0.005).all()
