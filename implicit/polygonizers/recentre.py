"""Polynomials far from the origin, meshed near it.

At |p| many times the size of the bounds the terms of a polynomial cancel: of (x - c)^2 = x^2 - 2 c x + c^2 half of the
digits are lost at c = 1e8, all of them in the next power. Moved exactly to the origin it loses nothing.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.domain import Ball, Bounds, Box
from implicit.mesh import Mesh, assemble
from implicit.surface import Surface

FloatArray = NDArray[np.float64]


def far_centre(surface: Surface, bounds: Bounds) -> FloatArray | None:
    """Where to move the origin of a polynomial surface for a mesh in the bounds; None where it may stay.

    The place is a whole multiple of a power of 2 near the size of the bounds, so that coefficients do not grow long.
    """
    if surface.polynomial is None or surface.expression is None:
        return None
    middle = bounds.box.corners.mean(axis=0)
    if np.abs(middle).max() <= bounds.size:
        return None
    unit = 2.0 ** np.floor(np.log2(bounds.size / 2))
    return np.asarray(np.round(middle / unit) * unit)


def mesh_at(centre: FloatArray, surface: Surface, bounds: Bounds, mesh: Callable[[Surface, Bounds], Mesh]) -> Mesh:
    """What `mesh` makes of the surface and the bounds, both moved there by -centre, and the result moved back."""
    made = mesh(surface.translate((-centre).tolist()), _moved(bounds, -centre))
    unresolved = None if made.unresolved is None else made.unresolved + centre
    return assemble(made.vertices + centre, made.faces, made.normals, made.curves, made.points, unresolved)


def _moved(bounds: Bounds, vector: ArrayLike) -> Bounds:
    if isinstance(bounds, Ball):
        return Ball(bounds.radius, np.add(bounds.center, vector))
    return Box(np.add(bounds.lower, vector), np.add(bounds.upper, vector))
