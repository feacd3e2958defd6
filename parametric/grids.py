"""Uniform grids of triangles, and iso-parametric curves as polylines."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parametric.parameters import Array, to_parameters
from parametric.shell import Shell
from parametric.surface import ParametricSurface, check_surface
from parametric.tessellate import SurfaceMesh, to_mesh
from parametric.tessellation.batch import evaluator
from parametric.tessellation.cells import Cells
from parametric.tessellation.triangulation import Triangulation

_DIAGONALS = ("falling", "rising")
_ROUNDS = 24


def grid_mesh(surface: ParametricSurface | Shell, m: int, n: int, *, diagonal: str = "falling") -> SurfaceMesh:
    """The uniform triangulation of m x n cells in the domain of each surface, two triangles to a cell.

    "falling" cuts cell (i, j) from (i+1, j) to (i, j+1) into the triangles (i, j), (i+1, j), (i, j+1) and (i+1, j),
    (i+1, j+1), (i, j+1); "rising" cuts it from (i, j) to (i+1, j+1). Edges that surfaces share, seams and poles have
    one vertex for each point; at a pole a cell is one triangle. Where neighbours divide a common edge differently,
    the cells beside it get more triangles, so that no cracks open.

    Examples
    --------
    >>> from parametric import BezierSurface
    >>> grid_mesh(BezierSurface([[(0, 0, 0), (0, 1, 1)], [(1, 0, 1), (1, 1, 0)]]), 4, 3)
    Mesh(20 vertices, 24 faces)
    """
    if diagonal not in _DIAGONALS:
        raise ValueError(f"diagonal must be one of {', '.join(_DIAGONALS)}, got {diagonal!r}")
    if m < 1 or n < 1:
        raise ValueError(f"a grid needs at least one cell in u and in v, got {m} x {n}")
    shell = surface if isinstance(surface, Shell) else Shell([surface])
    splits = [(np.linspace(*s.domain[0], m + 1), np.linspace(*s.domain[1], n + 1)) for s in shell.surfaces]
    cells = Cells(shell, splits, diagonal)
    cells.build()
    return to_mesh(Triangulation(cells, evaluator(shell)))


def iso_curves(
    surface: ParametricSurface, u: ArrayLike = (), v: ArrayLike = (), *, tolerance: float
) -> tuple[Array, ...]:
    """Polylines (k, 3) of the curves of constant u and of constant v, those of u first.

    The vertices lie on the surface; the chords keep within `tolerance`, a length, of the curves (at samples).

    Examples
    --------
    >>> from parametric import BezierSurface
    >>> saddle = BezierSurface([[(0, 0, 0), (0, 1, 1)], [(1, 0, 1), (1, 1, 0)]])
    >>> [len(curve) for curve in iso_curves(saddle, u=[0.5], v=[0, 1], tolerance=1e-3)]
    [2, 2, 2]
    """
    check_surface(surface)
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance must be a positive length, got {tolerance!r}")
    curves = []
    for axis, values in enumerate((u, v)):
        kept = to_parameters(np.atleast_1d(np.asarray(values, dtype=float)), surface.domain[axis], "uv"[axis])
        curves += [_polyline(surface, axis, float(value), tolerance) for value in kept]
    return tuple(curves)


def _polyline(surface: ParametricSurface, axis: int, value: float, tolerance: float) -> Array:
    """Halve the stretches between samples until three points inside each are near its chord."""

    def at(t: Array) -> Array:
        return surface(value, t) if axis == 0 else surface(t, value)

    t = np.asarray(surface.breaks[1 - axis], dtype=float)
    fresh = np.ones(len(t) - 1, dtype=bool)
    for _ in range(_ROUNDS):
        points = at(t)
        coarse = np.zeros_like(fresh)
        start, step = points[:-1][fresh], np.diff(points, axis=0)[fresh]
        squared = np.maximum(np.einsum("nc,nc->n", step, step), 1e-300)
        for s in (0.23, 0.5, 0.77):
            away = at(t[:-1][fresh] + s * np.diff(t)[fresh]) - start
            along = np.clip(np.einsum("nc,nc->n", away, step) / squared, 0, 1)
            coarse[fresh] |= np.linalg.norm(away - along[:, None] * step, axis=1) > tolerance
        if not coarse.any():
            break
        t, fresh = _halve(t, coarse)
    return at(t)


def _halve(t: Array, marks: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Samples with a new one in the middle of each coarse stretch, and which stretches are new."""
    middles = (t[:-1] + t[1:])[marks] / 2
    order = np.argsort(np.concatenate([t, middles]), kind="stable")
    fresh = np.repeat(marks, np.where(marks, 2, 1))
    return np.concatenate([t, middles])[order], fresh
