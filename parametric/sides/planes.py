"""Kernels: planes between a point and a patch, and where to cut a patch that no plane parts from it.

A control net is p x q rows (x, y, z, w) of weighted points, flat, as seen from the point, which is the origin.
"""

import math

import numba
import numpy as np

from parametric.parameters import Array

KIND = {"cache": True, "error_model": "numpy", "nogil": True}
# Signatures are spelled out, so that each kernel is compiled once and not for every kind of integer it is called with.


@numba.njit("void(float64[::1], int64, float64[::1])", no_cpython_wrapper=True, **KIND)
def corner(net: Array, row: int, out: Array) -> None:
    """The point of a row, its weight divided out."""
    w = net[4 * row + 3]
    for k in range(3):
        out[k] = net[4 * row + k] / w


@numba.njit(
    "boolean(float64[::1], int64, float64, float64, float64, float64, boolean)", no_cpython_wrapper=True, **KIND
)
def _separated(net: Array, count: int, nx: float, ny: float, nz: float, margin: float, both: bool) -> bool:
    """Whether all control points lie farther than the margin on one side of the plane through the origin; on the side
    of the normal, or on either side.
    """
    above = below = True
    for i in range(0, 4 * count, 4):
        s = nx * net[i] + ny * net[i + 1] + nz * net[i + 2]
        gap = margin * net[i + 3]
        above = above and s > gap
        below = below and both and s < -gap
        if not (above or below):
            return False
    return True


@numba.njit("boolean(float64[::1], int64, int64, float64[:, ::1], float64)", no_cpython_wrapper=True, **KIND)
def is_away(net: Array, p: int, q: int, c: Array, margin: float) -> bool:
    """Whether a plane parts the control net from the origin: along the normal, toward the patch, or along an axis."""
    ux, uy, uz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
    vx, vy, vz = c[3, 0] - c[1, 0], c[3, 1] - c[1, 1], c[3, 2] - c[1, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size > 0.0 and _separated(net, p * q, nx / size, ny / size, nz / size, margin, True):
        return True
    nx = c[0, 0] + c[1, 0] + c[2, 0] + c[3, 0]
    ny = c[0, 1] + c[1, 1] + c[2, 1] + c[3, 1]
    nz = c[0, 2] + c[1, 2] + c[2, 2] + c[3, 2]
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size > 0.0 and _separated(net, p * q, nx / size, ny / size, nz / size, margin, False):
        return True
    for i in range(2):
        j = 3 - 2 * i
        nx, ny, nz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
        nx, ny, nz = nx + c[4 - j, 0] - c[j, 0], ny + c[4 - j, 1] - c[j, 1], nz + c[4 - j, 2] - c[j, 2]
        size = math.sqrt(nx * nx + ny * ny + nz * nz)
        if size > 0.0 and _separated(net, p * q, nx / size, ny / size, nz / size, margin, True):
            return True
    return False


@numba.njit("float64(float64[:, ::1])", no_cpython_wrapper=True, **KIND)
def nearest_corner(c: Array) -> float:
    """The distance of the nearest of four corners from the origin."""
    best = np.inf
    for k in range(4):
        best = min(best, c[k, 0] * c[k, 0] + c[k, 1] * c[k, 1] + c[k, 2] * c[k, 2])
    return math.sqrt(best)


@numba.njit("boolean(float64[::1], int64, int64, int64, float64)", no_cpython_wrapper=True, **KIND)
def _is_side_away(net: Array, start: int, step: int, count: int, margin: float) -> bool:
    """Whether the plane across the way to its chord parts a side of the control net from the origin."""
    end = start + (count - 1) * step
    f, g = 1.0 / net[start + 3], 1.0 / net[end + 3]
    x, y, z = f * net[start], f * net[start + 1], f * net[start + 2]
    dx, dy, dz = g * net[end] - x, g * net[end + 1] - y, g * net[end + 2] - z
    squared = dx * dx + dy * dy + dz * dz
    if squared > 0.0:
        s = max(0.0, min(1.0, -(x * dx + y * dy + z * dz) / squared))
        x, y, z = x + s * dx, y + s * dy, z + s * dz
    gap, away = margin * math.sqrt(x * x + y * y + z * z), True
    for i in range(start, end + 1, step):
        away = away and x * net[i] + y * net[i + 1] + z * net[i + 2] > gap * net[i + 3]
    return away


@numba.njit("float64(float64[::1], int64, int64, float64[:, ::1], int64, float64)", no_cpython_wrapper=True, **KIND)
def choose_cut(net: Array, p: int, q: int, c: Array, axis: int, margin: float) -> float:
    """Where to cut a patch: beside the foot of the origin on it, if that is safe, else in the middle.

    The neighbour across a side cuts it in the middle. Any other cut of it fills the region between the side and its
    chord with other triangles, which is all the same to a point outside the convex hull of the side's control points.
    """
    aa = bb = ab = ma = mb = bent = turned = 0.0
    u, v = (p // 2) / (p - 1) - 0.5, (q // 2) / (q - 1) - 0.5
    i = 4 * ((p // 2) * q + q // 2)
    for k in range(3):
        a, b = 0.5 * (c[1, k] - c[0, k] + c[2, k] - c[3, k]), 0.5 * (c[3, k] - c[0, k] + c[2, k] - c[1, k])
        middle = 0.25 * (c[0, k] + c[1, k] + c[2, k] + c[3, k])
        aa, bb, ab, ma, mb = aa + a * a, bb + b * b, ab + a * b, ma + middle * a, mb + middle * b
        bent += (net[i + k] / net[i + 3] - middle - u * a - v * b) ** 2
        turned += (0.25 * (c[0, k] - c[1, k] + c[2, k] - c[3, k])) ** 2
    det = aa * bb - ab * ab
    if not det > 1e-3 * aa * bb:
        return 0.5
    foot = 0.5 + ((mb * ab - ma * bb) if axis == 0 else (ma * ab - mb * aa)) / det
    near = 3.0 * (math.sqrt(bent) + math.sqrt(turned)) / math.sqrt(aa if axis == 0 else bb) + 1e-3
    t = foot + near if 1.0 - foot > foot else foot - near
    if near > 0.2 or not 0.02 < t < 0.98:
        return 0.5
    if axis == 0:
        safe = _is_side_away(net, 0, 4 * q, p, margin) and _is_side_away(net, 4 * (q - 1), 4 * q, p, margin)
    else:
        safe = _is_side_away(net, 0, 4, q, margin) and _is_side_away(net, 4 * q * (p - 1), 4, q, margin)
    return t if safe else 0.5


@numba.njit(
    "void(float64[::1], float64[::1], float64[::1], int64, int64, int64, float64)", no_cpython_wrapper=True, **KIND
)
def cut(source: Array, first: Array, second: Array, axis: int, p: int, q: int, t: float) -> None:
    """Control nets (p x q x 4 numbers) of both parts of a patch, cut at t in u or in v; `second` may be `source`."""
    r = 1.0 - t
    step, lines, n = (4 * q, 1, p) if axis == 0 else (4, p, q)
    for i in range(4 * p * q):
        first[i] = source[i]
    for line in range(lines):
        base = 4 * q * line
        last = base + (n - 1) * step
        for level in range(n):
            end = base + (n - 1 - level) * step
            for k in range(step):
                second[end + k] = first[last + k]
            for i in range(last, base + level * step, -step):
                for k in range(step):
                    first[i + k] = r * first[i - step + k] + t * first[i + k]
