"""What first and second derivatives say of a level set: normals and curvatures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.errors import SingularPointError

if TYPE_CHECKING:
    from implicit.evaluate import Field

Floats: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Curvature:
    """Curvatures at points (...,), positive where the surface bends away from its normal, as on a sphere.

    `gaussian` and `mean` (...,), `principal` (..., 2) largest first, `directions` (..., 2, 3) unit vectors.
    """

    gaussian: Floats
    mean: Floats
    principal: Floats
    directions: Floats


def unit_gradients(field: Field, points: Floats) -> tuple[Floats, Floats]:
    """Unit normals (n, 3) and gradient lengths (n,) at points (n, 3); SingularPointError where there is none."""
    gradients = field.gradients(points)[1]
    lengths = np.linalg.norm(gradients, axis=1)
    small = ~(lengths > 1e-3)
    if small.any():
        bend = np.abs(field.hessians(points[small])).max(axis=(1, 2), initial=0.0)
        reach = np.maximum(1.0, np.abs(points[small]).max(axis=1))
        bad = ~(lengths[small] > 1e-14 * bend * reach) | ~np.isfinite(lengths[small])
        if bad.any():
            place = tuple(float(c) for c in points[small][bad][0])
            raise SingularPointError(f"a normal was asked for at {place}, where the gradient vanishes")
    return gradients / lengths[:, None], lengths


def curvature(field: Field, points: Floats) -> Curvature:
    """Curvatures at points (n, 3): eigenvalues of the Hessian in the tangent plane over the gradient's length."""
    normals, lengths = unit_gradients(field, points)
    tangents = _tangents(normals)
    forms = tangents @ field.hessians(points) @ tangents.swapaxes(1, 2) / lengths[:, None, None]
    values, vectors = np.linalg.eigh((forms + forms.swapaxes(1, 2)) / 2)
    principal, vectors = values[:, ::-1], vectors[:, :, ::-1].swapaxes(1, 2)
    return Curvature(principal.prod(axis=1), principal.mean(axis=1), principal, vectors @ tangents)


def _tangents(normals: Floats) -> Floats:
    """Two unit vectors (n, 2, 3) across each unit normal (n, 3)."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)
