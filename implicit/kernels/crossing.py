"""Rays and distances in a tree of boxes round triangles.

node i has the children 2 i + 1 and 2 i + 2; the last 2^k nodes are leaves with `LEAF` triangles each.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

LEAF = 4
ROUNDING = 2.0**-53
UNSURE = -(1 << 30)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True)
def _side(ax: float, ay: float, bx: float, by: float) -> float:
    """Twice the area of (0, a, b) in the plane; 0 where its sign is not certain."""
    left, right = ax * by, ay * bx
    area = left - right
    return area if abs(area) > 4 * ROUNDING * (abs(left) + abs(right)) else 0.0


@njit(cache=True)
def crossings(points: Floats, corners: Floats, ranks: Ints, boxes: Floats, out: Ints) -> None:
    """Faces that each point (n, 3) sees above it, +1 from behind and -1 from the front, or UNSURE.

    corners (F, 3, 3) and ranks (F, 3), the vertex numbers: an edge is judged in the same order for both of its faces.
    """
    leaves = (len(boxes) + 1) // 2
    stack = np.empty(64, np.int64)
    d = np.empty((3, 3))
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        count, top = 0, 1
        stack[0] = 0
        while top > 0:
            top -= 1
            i = stack[top]
            if x < boxes[i, 0] or x > boxes[i, 3] or y < boxes[i, 1] or y > boxes[i, 4] or z > boxes[i, 5]:
                continue
            if i < leaves - 1:
                stack[top], stack[top + 1] = 2 * i + 1, 2 * i + 2
                top += 2
                continue
            for f in range(LEAF * (i - leaves + 1), min(LEAF * (i - leaves + 2), len(corners))):
                for c in range(3):
                    d[c, 0], d[c, 1], d[c, 2] = corners[f, c, 0] - x, corners[f, c, 1] - y, corners[f, c, 2] - z
                seen = _face(d, ranks[f])
                if seen == UNSURE:
                    count, top = UNSURE, 0
                    break
                count += seen
        out[n] = count


@njit(cache=True)
def _face(d: Floats, rank: Ints) -> int:
    """How the upward ray from the origin meets one face."""
    sides = np.empty(3)
    positive = negative = unsure = 0
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        if rank[a] < rank[b]:
            sides[c] = _side(d[a, 0], d[a, 1], d[b, 0], d[b, 1])
        else:
            sides[c] = -_side(d[b, 0], d[b, 1], d[a, 0], d[a, 1])
        positive += sides[c] > 0
        negative += sides[c] < 0
        unsure += sides[c] == 0
    if positive > 0 and negative > 0:
        return 0
    lowest, highest = min(d[0, 2], d[1, 2], d[2, 2]), max(d[0, 2], d[1, 2], d[2, 2])
    if highest < 0:
        return 0
    if unsure > 0:
        return UNSURE
    if lowest <= 0:
        height, bound = 0.0, 0.0
        for c in range(3):
            height += sides[c] * d[c, 2]
            a, b = (c + 1) % 3, (c + 2) % 3
            bound += (abs(d[a, 0] * d[b, 1]) + abs(d[a, 1] * d[b, 0])) * abs(d[c, 2])
        if abs(height) <= 12 * ROUNDING * bound:
            return UNSURE
        if (height > 0) != (positive > 0):
            return 0
    return 1 if positive > 0 else -1


@njit(cache=True)
def nearest(points: Floats, corners: Floats, boxes: Floats, limit: float, out: Floats) -> None:
    """Squared distance from each point to the nearest triangle; inf where it exceeds the square of the limit."""
    leaves = (len(boxes) + 1) // 2
    stack = np.empty(64, np.int64)
    for n in range(len(points)):
        p = points[n]
        best, top = limit * limit, 1
        found = np.inf
        stack[0] = 0
        while top > 0:
            top -= 1
            i = stack[top]
            gap = 0.0
            for k in range(3):
                e = max(boxes[i, k] - p[k], p[k] - boxes[i, k + 3], 0.0)
                gap += e * e
            if not gap <= best:
                continue
            if i < leaves - 1:
                stack[top], stack[top + 1] = 2 * i + 1, 2 * i + 2
                top += 2
                continue
            for f in range(LEAF * (i - leaves + 1), min(LEAF * (i - leaves + 2), len(corners))):
                square = _to_triangle(p, corners[f])
                if square <= best:
                    best = found = square
        out[n] = found


@njit(cache=True)
def _to_triangle(p: Floats, t: Floats) -> float:
    """Squared distance from a point to a triangle: to its plane if the foot lies inside, else to the nearest edge."""
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    wx, wy, wz = p[0] - t[0, 0], p[1] - t[0, 1], p[2] - t[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    if nn > 0:
        b = (uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz
        a = (wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz
        if a >= 0 and b >= 0 and a + b <= nn:
            h = wx * nx + wy * ny + wz * nz
            return h * h / nn
    best = np.inf
    for c in range(3):
        e = (c + 1) % 3
        dx, dy, dz = t[e, 0] - t[c, 0], t[e, 1] - t[c, 1], t[e, 2] - t[c, 2]
        qx, qy, qz = p[0] - t[c, 0], p[1] - t[c, 1], p[2] - t[c, 2]
        length = dx * dx + dy * dy + dz * dz
        s = (qx * dx + qy * dy + qz * dz) / length if length > 0 else 0.0
        s = min(max(s, 0.0), 1.0)
        rx, ry, rz = qx - s * dx, qy - s * dy, qz - s * dz
        best = min(best, rx * rx + ry * ry + rz * rz)
    return best
