"""How faces look: by which angles they turn from the normals at their corners, and those from each other."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import OPTIONS
from implicit.polygonizers.conforming.check import TURN

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

FACING = 0.8
"""Triangles should not turn by more than this cosine from a normal at a corner."""
BEND = 0.7
"""Nor should normals at the ends of a side."""


@njit(**OPTIONS)
def _measure(vertices: Any, normals: Any, fixed: Any, faces: Any, bends: Any, facing: Any) -> None:
    for row in range(len(faces)):
        a, b, c = vertices[faces[row, 0]], vertices[faces[row, 1]], vertices[faces[row, 2]]
        u, v, w = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        r, s, t = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = v * t - w * s, w * r - u * t, u * s - v * r
        length = max(math.sqrt(x * x + y * y + z * z), 1e-300)
        x, y, z = x / length, y / length, z / length
        least = 1.0
        for k in range(3):
            p, q = faces[row, k], faces[row, (k + 1) % 3]
            m, n = normals[p], normals[q]
            bends[row, k] = 1.0 if fixed[p] or fixed[q] else m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
            cosine = x * m[0] + z * m[2] + y * m[1]
            if not fixed[p] and cosine < least:
                least = cosine
        facing[row] = least


def measure(vertices: FloatArray, normals: FloatArray, fixed: Flags, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Of faces (n, 3) the cosine (n, 3) between the normals at the ends of the side that begins at each corner, 1 at
    fixed ends; and the least cosine (n,) between the face and the normals at its corners that are not fixed, at most 1.
    """
    bends, facing = np.empty(faces.shape), np.empty(len(faces))
    _measure(vertices, normals, fixed, np.ascontiguousarray(faces), bends, facing)
    return bends, facing


def turned(vertices: FloatArray, normals: FloatArray, fixed: Flags, faces: IntArray) -> Flags:
    """Which faces (n, 3) look away from the normal at a corner that is not fixed, or have normals far apart."""
    bends, facing = measure(vertices, normals, fixed, faces)
    a, b, c = faces.T
    return np.asarray(((facing <= 0) | (bends < TURN).any(axis=1)) & (a != b) & (b != c))
