"""From a surface to a mesh."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.domain import Ball, Bounds, to_bounds
from implicit.mesh import Mesh, assemble
from implicit.polygonizers.clip import clip
from implicit.polygonizers.following import drop_pieces, follow, lattice_round, to_surface
from implicit.polygonizers.lattice import Lattice
from implicit.polygonizers.marching import march
from implicit.polygonizers.multiple import has_multiple_factors, mesh_once
from implicit.polygonizers.poles import without_poles
from implicit.polygonizers.recentre import far_centre, mesh_at
from implicit.polygonizers.samples import Sampler, choose_sampler
from implicit.polygonizers.smooth import is_smooth
from implicit.polygonizers.weld import fill_normals, squeeze, weld
from implicit.surface import Surface, check_surface
from implicit.work import Job, Progress, check_workers

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

METHODS = ("auto", "marching", "following", "conforming")
DECOMPOSITIONS = ("cube", "tetrahedron")


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
                "following": only the pieces that pass near the seeds, with work proportional to them; without
                seeds, every piece that the lattice sees. "auto": "following" with seeds, "conforming" for a polynomial
                with singular points in the bounds (or what may be some), else "marching".
    seeds       points (n, 3) or (3,), each within a quarter of the bounds' size of the surface along the gradient
    progress    called with the share done, from 0 to 1
    workers     threads, -1 for all processors; the mesh is the same, bit for bit, for any number

    Promised: each vertex lies on a lattice edge with one end inside (f < 0) and one not, within 1e-12 of the size of
    the bounds of a root of f there; the mesh is closed and manifold but for its boundary, which lies on the bounds.
    Space is skipped only where f is proved to have one sign. A surface that misses the bounds gives an empty mesh.
    Where f goes to infinity and changes its sign there is no surface, and no face. A polynomial far from the origin is
    moved there, exactly, before it is meshed. "auto" and "conforming" take factors of a polynomial that occur several
    times once; the others see no factor that occurs an even number of times.
    Not promised: features smaller than a cell are seen by the lattice's signs alone; so are singular points, but by
    "conforming", which promises otherwise what `implicit.polygonizers.conforming.conforming` says.

    Raises ValueError for arguments out of range and where the formula is not finite, MemoryError before a mesh that
    cannot fit is begun. `tolerance` and `certify` raise ValueError: they are not there yet.

    Source: Lorensen and Cline, Marching cubes, 1987, doi:10.1145/37402.37422; the cases are derived, not copied.

    >>> from implicit import Ball, Surface
    >>> mesh = polygonize(Surface("x^2 + y^2 + z^2 = 1"), 1.5, resolution=16)
    >>> print(mesh.report())
    534 vertices, 1596 edges, 1064 faces: closed, manifold, oriented
    1 component, Euler characteristic 2, genus 0
    """
    check_surface(surface)
    domain = to_bounds(bounds)
    _check(resolution, tolerance, method, seeds, certify)
    again = partial(polygonize, resolution=resolution, method=method, progress=progress, workers=workers)
    centre = far_centre(surface, domain)
    if centre is not None:
        near = None if seeds is None else _points(seeds) - centre
        return mesh_at(centre, surface, domain, partial(again, seeds=near))
    singular = method == "conforming" or (method == "auto" and seeds is None and not is_smooth(surface.field, domain))
    if singular and has_multiple_factors(surface):
        return mesh_once(surface, partial(again, bounds=domain))
    if method == "conforming":
        from implicit.polygonizers.conforming import conforming

        return conforming(surface, domain, int(resolution), progress=progress, workers=workers)
    if singular:
        from implicit.polygonizers.conforming import conforming_if_singular

        mesh = conforming_if_singular(surface, domain, int(resolution), progress, workers)
        if mesh is not None:
            return mesh
    lattice = Lattice.over(domain, int(resolution))
    if seeds is None:
        return _mesh(surface, choose_sampler(surface, lattice), domain, None, "cube", progress, workers)
    starts = to_surface(surface.field, _points(seeds), lattice.size / 4)
    sampler = follow(surface.field, lattice, starts, bounded=True)
    return _mesh(surface, sampler, domain, starts, "cube", progress, workers)


def polygonize_from(
    surface: Surface,
    seeds: ArrayLike,
    cell: float,
    *,
    decomposition: str = "cube",
    progress: Progress | None = None,
    workers: int = 1,
) -> Mesh:
    """The pieces of f = 0 that pass near the seeds, followed from there over cells of size `cell`, without bounds.

    seeds          points (n, 3) or (3,), each within 8 cells of the surface along the gradient
    decomposition  "cube", or "tetrahedron" for the six tetrahedra round a diagonal of each cube

    Promised as for `polygonize`. The work is proportional to the surface. Raises ValueError when a seed is too far from
    the surface, and when the surface goes on for more than 2048 cells beyond the seeds along an axis.

    Source: Bloomenthal, Polygonization of implicit surfaces, 1988, doi:10.1016/0167-8396(88)90013-1.

    >>> from implicit import Surface
    >>> torus = Surface("(sqrt(x^2 + y^2) - 2)^2 + z^2 = 0.5^2")
    >>> polygonize_from(torus, (2.4, 0, 0), 0.1).report().genus
    1
    """
    check_surface(surface)
    if not (np.isfinite(cell) and cell > 0):
        raise ValueError(f"cell must be a positive length, got {cell!r}")
    if decomposition not in DECOMPOSITIONS:
        raise ValueError(f"decomposition must be one of {', '.join(DECOMPOSITIONS)}, got {decomposition!r}")
    starts = to_surface(surface.field, _points(seeds), 8 * cell)
    sampler = follow(surface.field, lattice_round(starts, float(cell)), starts, bounded=False)
    return _mesh(surface, sampler, None, starts, decomposition, progress, workers)


def _mesh(
    surface: Surface,
    sampler: Sampler,
    domain: Bounds | None,
    seeds: FloatArray | None,
    decomposition: str,
    progress: Progress | None,
    workers: int,
) -> Mesh:
    """Sweep, join what meets at lattice points, keep what the seeds lie on, cut along the ball."""
    job = Job(len(sampler.bricks), progress, check_workers(workers))
    if decomposition == "cube":
        marched = march(sampler, job)
    else:
        from implicit.polygonizers.tetrahedra import march_tetrahedra

        marched = march_tetrahedra(sampler, job)
    step, flat = sampler.lattice.step, marched.flat
    vertices, normals, faces = weld(marched.vertices, marched.normals, marched.faces, marched.pinned)
    if not np.isfinite(normals.sum()):
        wild = ~np.isfinite(normals).all(axis=1)
        normals[wild], flat = 0.0, flat + int(wild.sum())
    vertices, normals, faces = without_poles(vertices, normals, faces, surface.field, step)
    if seeds is not None:
        drop_pieces(vertices, faces, seeds, 2 * step)
        vertices, normals, faces = squeeze(vertices, normals, faces)
    if isinstance(domain, Ball):
        vertices, normals, faces = clip(vertices, normals, faces, domain, surface.field, step)
        vertices, normals, faces = squeeze(vertices, normals, faces)
    if flat or isinstance(domain, Ball):
        fill_normals(vertices, normals, faces)
    return assemble(vertices, faces, normals)


def _points(seeds: ArrayLike) -> FloatArray:
    points = np.atleast_2d(np.asarray(seeds, dtype=float))
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise ValueError(f"seeds must be finite points (n, 3), got shape {np.shape(seeds)}")
    return points


def _check(resolution: int, tolerance: Any, method: str, seeds: Any, certify: bool) -> None:
    if isinstance(resolution, bool) or not isinstance(resolution, int | np.integer) or resolution < 1:
        raise ValueError(f"resolution must be a positive whole number of cells, got {resolution!r}")
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    if seeds is not None and method not in ("auto", "following"):
        raise ValueError(f'seeds are for method="following", got method={method!r}')
    if tolerance is not None:
        raise ValueError("tolerance= (an adaptive mesh) is not there yet; choose a resolution instead")
    if certify:
        raise ValueError("certify= (a proof of the topology) is not there yet")
