"""Kernels: the part of an open shell's winding number that its rim decides.

The triangles that `chain` counts for a patch fill it up to the chords of its sides. A curtain that falls from each
chord to infinity closes them; the ray does not meet it, and its solid angle has a closed form. The sliver between a
chord and its side is cut into triangles until the point is far from what is left, which is integrated.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.sides.chain import DECIDED, DEPTH, ON, TIED
from parametric.sides.planes import KIND

Ints = NDArray[np.int64]

NODES, WEIGHTS = (np.ascontiguousarray(a) for a in np.polynomial.legendre.leggauss(12))


@numba.njit("float64(float64[::1], float64[::1])", no_cpython_wrapper=True, **KIND)
def _curtain(a: Array, b: Array) -> float:
    """Solid angle of the strip below the chord a-b, looked at from the origin; positive where it turns b to a."""
    la, lb = math.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2), math.sqrt(b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return 2.0 * math.atan2(b[1] * a[0] - b[0] * a[1], la * lb + dot - a[2] * lb - b[2] * la)


@numba.njit("UniTuple(float64, 2)(float64[::1], float64[::1], float64[::1])", no_cpython_wrapper=True, **KIND)
def _triangle(a: Array, b: Array, c: Array) -> tuple[float, float]:
    """Solid angle of a triangle, and a number that is 0 where the origin is in it but for rounding."""
    la, lb = math.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2), math.sqrt(b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    lc = math.sqrt(c[0] ** 2 + c[1] ** 2 + c[2] ** 2)
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    bc = b[0] * c[0] + b[1] * c[1] + b[2] * c[2]
    ca = c[0] * a[0] + c[1] * a[1] + c[2] * a[2]
    base = la * lb * lc + ab * lc + bc * la + ca * lb
    sure = 1.0 if base > 1e-12 * la * lb * lc or abs(volume) > 1e-12 * la * lb * lc else 0.0
    return 2.0 * math.atan2(volume, base), sure


@numba.njit("float64(float64[::1], int64)", no_cpython_wrapper=True, **KIND)
def _cone(net: Array, n: int) -> float:
    """Solid angle of the cone from the first point of a rational curve over the rest of it."""
    a = net[:3] / net[3]
    la = math.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
    total = 0.0
    rows = np.empty((n, 4))
    for node in range(len(NODES)):
        t = 0.5 + 0.5 * NODES[node]
        for i in range(n):
            for k in range(4):
                rows[i, k] = net[4 * i + k]
        for level in range(1, n - 1):
            for i in range(n - level):
                for k in range(4):
                    rows[i, k] += t * (rows[i + 1, k] - rows[i, k])
        # Two points are left: the curve's point and tangent follow from them.
        w0, w1 = rows[0, 3], rows[1, 3]
        w = w0 + t * (w1 - w0)
        x, y, z = (
            (1 - t) * rows[0, 0] + t * rows[1, 0],
            (1 - t) * rows[0, 1] + t * rows[1, 1],
            (1 - t) * rows[0, 2] + t * rows[1, 2],
        )
        f = (n - 1) * w0 * w1 / (w * w)
        dx, dy, dz = (
            f * (rows[1, 0] / w1 - rows[0, 0] / w0),
            f * (rows[1, 1] / w1 - rows[0, 1] / w0),
            f * (rows[1, 2] / w1 - rows[0, 2] / w0),
        )
        x, y, z = x / w, y / w, z / w
        lc = math.sqrt(x * x + y * y + z * z)
        volume = a[0] * (y * dz - z * dy) + a[1] * (z * dx - x * dz) + a[2] * (x * dy - y * dx)
        total += 0.5 * WEIGHTS[node] * volume / (lc * (la * lc + a[0] * x + a[1] * y + a[2] * z))
    return total


@numba.njit("void(float64[::1], float64[::1], int64)", no_cpython_wrapper=True, **KIND)
def _halve(source: Array, first: Array, n: int) -> None:
    """Cut a curve in the middle: its first half, and in `source` its second."""
    for i in range(4 * n):
        first[i] = source[i]
    for level in range(n):
        for k in range(4):
            source[4 * (n - 1 - level) + k] = first[4 * (n - 1) + k]
        for i in range(4 * n - 1, 4 * level + 3, -1):
            first[i] = 0.5 * (first[i - 4] + first[i])


@numba.njit("Tuple((float64, int64))(float64[:, ::1], int64, float64)", no_cpython_wrapper=True, **KIND)
def _sliver(stack: Array, n: int, margin: float) -> tuple[float, int]:
    """Solid angle between the curve stack[0] and its chord."""
    total, state, top = 0.0, DECIDED, 1
    a, b, m = np.empty(3), np.empty(3), np.empty(3)
    while top > 0:
        net = stack[top - 1]
        for k in range(3):
            a[k], b[k] = net[k] / net[3], net[4 * n - 4 + k] / net[4 * n - 1]
            m[k] = 0.5 * (a[k] + b[k])
        radius = 0.0
        for i in range(n):
            w = net[4 * i + 3]
            gap = (net[4 * i] / w - m[0]) ** 2 + (net[4 * i + 1] / w - m[1]) ** 2 + (net[4 * i + 2] / w - m[2]) ** 2
            radius = max(radius, gap)
        far = m[0] ** 2 + m[1] ** 2 + m[2] ** 2
        if far > 9.0 * radius:
            total += _cone(net, n)
            top -= 1
            continue
        if top >= len(stack) or radius <= 1e-6 * margin * margin:
            return total, ON
        _halve(net, stack[top], n)
        for k in range(3):
            m[k] = net[k] / net[3]
        angle, sure = _triangle(a, m, b)
        total += angle
        if sure == 0.0:
            state = TIED
        top += 1
    return total, state


@numba.njit(**KIND)
def rim_points(points: Array, margin: float, curves: Array, places: Ints, out: Array, states: Ints) -> None:
    """Add the rim's part of the winding number at points (n, 3) to `out`; note in `states` where it is not certain."""
    width = 4
    for k in range(len(places)):
        width = max(width, 4 * places[k, 1])
    stack = np.empty((DEPTH, width))
    for j in range(len(points)):
        x, y, z = points[j, 0], points[j, 1], points[j, 2]
        total = 0.0
        for k in range(len(places)):
            start, n = places[k, 0], places[k, 1]
            for i in range(0, 4 * n, 4):
                w = curves[start + i + 3]
                stack[0, i], stack[0, i + 1] = curves[start + i] - w * x, curves[start + i + 1] - w * y
                stack[0, i + 2], stack[0, i + 3] = curves[start + i + 2] - w * z, w
            a, b = stack[0, :3] / stack[0, 3], stack[0, 4 * n - 4 : 4 * n - 1] / stack[0, 4 * n - 1]
            total -= _curtain(a, b)
            if n > 2:
                angle, state = _sliver(stack, n, margin)
                total += angle
                if state != DECIDED:
                    states[j] = state
        out[j] += total / (4.0 * math.pi)
