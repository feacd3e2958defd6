"""Kernel: distances of points from triangles."""

import numba
import numpy as np

from parametric.parameters import Array


@numba.njit("float64(float64[::1], float64[:, ::1])", cache=True, error_model="numpy", no_cpython_wrapper=True)
def _squared_distance(p: Array, t: Array) -> float:
    """The squared distance of a point from a triangle: from its plane, or from the nearest side."""
    best, inside = np.inf, True
    nx = (t[1, 1] - t[0, 1]) * (t[2, 2] - t[0, 2]) - (t[1, 2] - t[0, 2]) * (t[2, 1] - t[0, 1])
    ny = (t[1, 2] - t[0, 2]) * (t[2, 0] - t[0, 0]) - (t[1, 0] - t[0, 0]) * (t[2, 2] - t[0, 2])
    nz = (t[1, 0] - t[0, 0]) * (t[2, 1] - t[0, 1]) - (t[1, 1] - t[0, 1]) * (t[2, 0] - t[0, 0])
    for k in range(3):
        a, b = t[k], t[(k + 1) % 3]
        x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
        dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        squared = dx * dx + dy * dy + dz * dz
        s = 0.0 if squared == 0.0 else max(0.0, min(1.0, (x * dx + y * dy + z * dz) / squared))
        best = min(best, (x - s * dx) ** 2 + (y - s * dy) ** 2 + (z - s * dz) ** 2)
        inside = inside and nx * (dy * z - dz * y) + ny * (dz * x - dx * z) + nz * (dx * y - dy * x) >= 0.0
    size = nx * nx + ny * ny + nz * nz
    if inside and size > 0.0:
        height = nx * (p[0] - t[0, 0]) + ny * (p[1] - t[0, 1]) + nz * (p[2] - t[0, 2])
        return min(best, height * height / size)
    return best


@numba.njit("float64[::1](float64[:, :, ::1], float64[:, :, ::1])", cache=True, error_model="numpy", nogil=True)
def farthest(corners: Array, control: Array) -> Array:
    """The largest distance of control points (n, k, 3), or (n, k, 4) with weights, from triangles (n, 3, 3)."""
    out = np.zeros(len(corners))
    p = np.empty(3)
    for i in range(len(corners)):
        t = corners[i]
        worst = 0.0
        for j in range(control.shape[1]):
            w = control[i, j, 3] if control.shape[2] == 4 else 1.0
            if w <= 0.0:
                worst = np.inf
                break
            for c in range(3):
                p[c] = control[i, j, c] / w
            worst = max(worst, _squared_distance(p, t))
        out[i] = np.sqrt(worst)
    return out
