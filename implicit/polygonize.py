"""From a surface to a mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.domain import Ball, Bounds, to_bounds
from implicit.mesh import Mesh, assemble
from implicit.polygonizers.clip import clip
from implicit.polygonizers.lattice import Lattice
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.weld import fill_normals, squeeze, weld
from implicit.work import Job, Progress, check_workers

if TYPE_CHECKING:
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

METHODS = ("auto", "marching", "following", "conforming")


def polygonize(
    surface: Surface,
    bounds: Bounds | float,
    *,
    resolution: int = 64,
    tolerance: float | None = None,
    method: str = "auto",
    seeds: ArrayLike | None = None,
    certify: bool = False,
    progress: Progress | None = None,
    workers: int = 1,
) -> Mesh:
    """The mesh of f = 0 within `bounds`: vertices on the surface, unit normals along its gradient, outward faces.

    bounds      a Box, a Ball, which cuts the mesh exactly on its sphere, or a number r for Box((-r,)*3, (r,)*3)
    resolution  cells along the longest side of the bounds
    method      "marching": marching cubes on every cell that the surface may meet. "conforming": the singular
                points of a polynomial surface become vertices of the mesh (see `implicit.polygonizers.conforming`).
                "auto" chooses.
    progress    called with the share done, from 0 to 1
    workers     threads, -1 for all processors; the mesh is the same, bit for bit, for any number

    Promised: each vertex lies on a lattice edge with one end inside (f < 0) and one not, within 1e-12 of the size of
    the bounds of a root of f there; the mesh is closed and manifold but for its boundary, which lies on the bounds.
    Space is skipped only where f is proved to have one sign. A surface that misses the bounds gives an empty mesh.
    Not promised: features smaller than a cell, and what happens at singular points, are seen by the lattice's signs
    alone.

    Raises ValueError for arguments out of range and where the formula is not finite, MemoryError before a mesh that
    cannot fit is begun. `tolerance`, `certify` and the method "following" raise ValueError: they are not there yet.

    Source: Lorensen and Cline, Marching cubes, 1987, doi:10.1145/37402.37422; the cases are derived, not copied.

    >>> from implicit import Ball, Surface
    >>> mesh = polygonize(Surface("x^2 + y^2 + z^2 = 1"), 1.5, resolution=16)
    >>> print(mesh.report())
    534 vertices, 1596 edges, 1064 faces: closed, manifold, oriented
    1 component, Euler characteristic 2, genus 0
    """
    domain = to_bounds(bounds)
    _check(resolution, tolerance, method, seeds, certify)
    if method == "conforming":
        from implicit.polygonizers.conforming import conforming

        return conforming(surface, domain, int(resolution), progress=progress, workers=workers)
    lattice = Lattice.over(domain, int(resolution))
    sampler = choose_sampler(surface, lattice)
    job = Job(len(sampler.bricks), progress, check_workers(workers))
    marched = march(sampler, job)
    vertices, normals, faces = marched.vertices, marched.normals, marched.faces
    changed = weld(vertices, faces, marched.pinned)
    if isinstance(domain, Ball):
        vertices, normals, faces = clip(vertices, normals, faces, domain, surface.field, lattice.step)
        changed = True
    if changed:
        squeeze(vertices, normals, faces)
    if changed or marched.flat:
        fill_normals(vertices, normals, faces)
    return assemble(vertices, faces, normals)


def _check(resolution: int, tolerance: Any, method: str, seeds: Any, certify: bool) -> None:
    if isinstance(resolution, bool) or not isinstance(resolution, int | np.integer) or resolution < 1:
        raise ValueError(f"resolution must be a positive whole number of cells, got {resolution!r}")
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    if method == "following":
        raise ValueError('method="following" is not there yet; "marching", "conforming" and "auto" are')
    if seeds is not None:
        raise ValueError('seeds are for method="following", which is not there yet')
    if tolerance is not None:
        raise ValueError("tolerance= (an adaptive mesh) is not there yet; choose a resolution instead")
    if certify:
        raise ValueError("certify= (a proof of the topology) is not there yet")
