"""Crossings where f does not vanish but goes to infinity, as 1/x does at x = 0."""

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, TapeField
from implicit.polygonizers.weld import squeeze
from implicit.tape import DIV, POW

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_BESIDE = 1e-6
_LARGER = 10.0
"""Near a root f is smaller than at this share of a cell beside it, near a pole it is so many times larger."""


def without_poles(
    vertices: FloatArray, normals: FloatArray, faces: IntArray, field: Field, cell: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """The mesh without the faces that have a vertex at a pole of f; the arrays are used up."""
    if not isinstance(field, TapeField) or not np.isin(field.tape.code[:, 0], (DIV, POW)).any():
        return vertices, normals, faces
    with np.errstate(all="ignore"):
        here = np.abs(field.values(vertices))
        beside = np.maximum(*(np.abs(field.values(vertices + s * _BESIDE * cell * normals)) for s in (-1, 1)))
    poles = ~np.isfinite(here) | (here > _LARGER * beside)
    if not poles.any():
        return vertices, normals, faces
    return squeeze(vertices, normals, np.ascontiguousarray(faces[~poles[faces].any(axis=1)]))
