"""Kernels: how often a Bezier shell winds round a point, counted without a mesh.

A patch whose control net a plane separates from the point may be replaced by the two triangles on its four corners:
within the convex hull of the net no surface passes the point. Any other patch is bisected, with one triangle for each
side that is cut, from its ends to its middle. Whatever is bisected, the triangles for one patch fill the surface
between its four chords, so those of a closed shell are closed, and the crossings of a vertical ray with them, each
+1 or -1, add up to the winding number: an integer, with nothing rounded.

What rounding (or a gap between matched edges, both within `slack`) could change is not guessed: a ray that passes a
side, or a point that lies in the plane of a triangle, within the slack makes the count TIED.

The hierarchy with closing triangles is that of A. Jacobson, L. Kavan, O. Sorkine-Hornung, Robust inside-outside
segmentation using generalized winding numbers (2013), doi 10.1145/2461912.2461916, with patches for meshes.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.sides.planes import KIND, choose_cut, corner, cut, is_away, nearest_corner

Ints = NDArray[np.int64]


DECIDED, ON, TIED, TIED_PAIR = 0, 1, 2, 3
TRIANGLES = np.array([[[0, 1, 4], [2, 3, 5]], [[1, 2, 4], [3, 0, 5]], [[0, 1, 2], [0, 2, 3]]])
"""Corners of the two triangles for a patch cut in u (its sides 0-1 and 2-3), cut in v, and not cut.

     3--5--2      3-----2
     |  |  |      5-----4      corners 0 to 3 of a patch; 4 and 5 are the middles of the sides that are cut
     0--4--1      0-----1
"""
SPLIT = np.array([[0, 3], [1, 0]])
"""Which corners of the second part are the middles 4 and 5."""
WHOLE = 2
DEPTH = 160
_FINE = 0.005
"""A patch smaller than this part of the tolerance, not separated from the point, is within 1.01 tolerances of it."""


@numba.njit("boolean(float64, float64, float64, float64, float64)", no_cpython_wrapper=True, **KIND)
def _passes(ax: float, ay: float, bx: float, by: float, slack: float) -> bool:
    """Whether the segment a-b of the plane comes within the slack of the origin."""
    if (ax > slack and bx > slack) or (ax < -slack and bx < -slack):
        return False
    if (ay > slack and by > slack) or (ay < -slack and by < -slack):
        return False
    dx, dy = bx - ax, by - ay
    return abs(ax * dy - ay * dx) <= 2.0 * slack * (abs(dx) + abs(dy))


@numba.njit("int64(float64, float64, float64, float64)", no_cpython_wrapper=True, **KIND)
def _turn(ax: float, ay: float, bx: float, by: float) -> int:
    """+1 or -1 where a-b crosses the positive x axis upward or downward, else 0."""
    if (ay > 0.0) == (by > 0.0):
        return 0
    side = ax * by - ay * bx
    if by > 0.0:
        return 1 if side > 0.0 else 0
    return -1 if side < 0.0 else 0


@numba.njit("int64(float64[::1], float64[::1], float64[::1], float64)", no_cpython_wrapper=True, **KIND)
def crossing(a: Array, b: Array, c: Array, slack: float) -> int:
    """+1 where triangle a, b, c hangs over the origin and turns counter-clockwise seen from above, -1 clockwise, 0
    elsewhere; TIED where the slack could change that.
    """
    if a[2] < -slack and b[2] < -slack and c[2] < -slack:
        return 0
    if (a[0] > slack and b[0] > slack and c[0] > slack) or (a[0] < -slack and b[0] < -slack and c[0] < -slack):
        return 0
    if (a[1] > slack and b[1] > slack and c[1] > slack) or (a[1] < -slack and b[1] < -slack and c[1] < -slack):
        return 0
    ax, ay, bx, by, cx, cy = a[0], a[1], b[0], b[1], c[0], c[1]
    if _passes(ax, ay, bx, by, slack) or _passes(bx, by, cx, cy, slack) or _passes(cx, cy, ax, ay, slack):
        return TIED
    turn = _turn(ax, ay, bx, by) + _turn(bx, by, cx, cy) + _turn(cx, cy, ax, ay)
    if turn == 0 or (a[2] > slack and b[2] > slack and c[2] > slack):
        return turn
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, b[2] - a[2], cx - ax, cy - ay, c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    height = nx * ax + ny * ay + nz * a[2]
    span = (abs(ux) + abs(uy) + abs(uz)) * (abs(vx) + abs(vy) + abs(vz)) * (abs(ax) + abs(ay) + abs(a[2]))
    if abs(height) <= 2.0 * slack * (abs(nx) + abs(ny) + abs(nz)) + 1e-15 * span:
        return TIED
    return turn if (height > 0.0) == (turn > 0) else 0


@numba.njit("int64(float64[:, ::1], int64, float64)", no_cpython_wrapper=True, **KIND)
def crossings_of(corners: Array, kind: int, slack: float) -> int:
    """Crossings with two triangles on corners 0 to 3 and middles 4 and 5: those of a patch, or of its cut sides."""
    total = 0
    for i in range(2):
        n = crossing(
            corners[TRIANGLES[kind, i, 0]], corners[TRIANGLES[kind, i, 1]], corners[TRIANGLES[kind, i, 2]], slack
        )
        if n == TIED:
            return TIED_PAIR
        total += n
    return total


@numba.njit(
    "UniTuple(int64, 2)(float64[:, ::1], int64, int64, float64, float64, float64[:, ::1])",
    no_cpython_wrapper=True,
    **KIND,
)
def _count_patch(stack: Array, p: int, q: int, margin: float, slack: float, c: Array) -> tuple[int, int]:
    """Crossings and state for the patch stack[0], which is already seen from the point."""
    total, state, top, kind = 0, DECIDED, 1, WHOLE
    while top > 0:
        net = stack[top - 1]
        corner(net, 0, c[0])
        corner(net, (p - 1) * q, c[1])
        corner(net, p * q - 1, c[2])
        corner(net, q - 1, c[3])
        if is_away(net, p, q, c, margin):
            kind = WHOLE
            top -= 1
        else:
            along = across = 0.0
            for k in range(3):
                along += (c[1, k] - c[0, k]) ** 2 + (c[2, k] - c[3, k]) ** 2
                across += (c[3, k] - c[0, k]) ** 2 + (c[2, k] - c[1, k]) ** 2
                diagonal = (c[2, k] - c[0, k]) ** 2
                along, across = along + diagonal, across + diagonal
            if nearest_corner(c) <= margin or top >= stack.shape[0] or along + across < (_FINE * margin) ** 2:
                return total, ON
            kind = 0 if along >= across else 1
            cut(net, stack[top], net, kind, p, q, choose_cut(net, p, q, c, kind, margin))
            # stack[top - 1] now holds the second part; its first row or column ends in the middles of the cut sides.
            corner(net, 0 if kind == 0 else (p - 1) * q, c[4])
            corner(net, q - 1 if kind == 0 else 0, c[5])
            top += 1
        n = crossings_of(c, kind, slack)
        if n == TIED_PAIR:
            state = TIED
        else:
            total += n
    return total, state


@numba.njit("void(float64[::1], float64, float64, float64, float64[::1], int64)", no_cpython_wrapper=True, **KIND)
def _see(source: Array, x: float, y: float, z: float, out: Array, count: int) -> None:
    """The control net as seen from (x, y, z)."""
    for i in range(0, 4 * count, 4):
        w = source[i + 3]
        out[i], out[i + 1], out[i + 2], out[i + 3] = source[i] - w * x, source[i + 1] - w * y, source[i + 2] - w * z, w


@numba.njit(no_cpython_wrapper=True, **KIND)
def count_point(
    x: float, y: float, z: float, margin: float, slack: float,
    boxes: Array, slabs: Array, corners: Array, links: Ints, nets: Array,
    waiting: Ints, stack: Array, c: Array,
) -> tuple[int, int]:  # fmt: skip
    """Crossings and state for one point; `links` is (first child, second child or net, axis, p, q) of each node."""
    total, state, top = 0, DECIDED, 1
    waiting[0] = 0
    while top > 0:
        top -= 1
        k = waiting[top]
        box, link = boxes[k], links[k]
        if x < box[0] - margin or x > box[3] + margin or y < box[1] - margin or y > box[4] + margin:
            continue
        if z > box[5] + margin:
            continue
        if link[2] == 2:
            waiting[top], waiting[top + 1] = link[0], link[1]
            top += 2
            continue
        slab = slabs[k]
        s = slab[0] * x + slab[1] * y + slab[2] * z
        away = z < box[2] - margin or s < slab[3] - margin or s > slab[4] + margin
        if not away and link[0] < 0:
            count = link[3] * link[4]
            _see(nets[link[1] :], x, y, z, stack[0], count)
            first, second = _count_patch(stack, link[3], link[4], margin, slack, c)
            if second == ON:
                return total, ON
            total += first
            state = max(state, second)
            continue
        kind = WHOLE if away else link[2]
        for i in range(4 if away else 6):
            node, place = (k, i) if i < 4 else (link[1], SPLIT[kind, i - 4])
            c[i, 0] = corners[node, place, 0] - x
            c[i, 1] = corners[node, place, 1] - y
            c[i, 2] = corners[node, place, 2] - z
        if not away:
            waiting[top], waiting[top + 1] = link[0], link[1]
            top += 2
        n = crossings_of(c, kind, slack)
        if n == TIED_PAIR:
            state = TIED
        else:
            total += n
    return total, state


@numba.njit(**KIND)
def count_points(
    points: Array, margin: float, slack: float,
    boxes: Array, slabs: Array, corners: Array, links: Ints, nets: Array, width: int,
    totals: Ints, states: Ints,
) -> None:  # fmt: skip
    """Fill crossings (n,) and states (n,) for points (n, 3)."""
    waiting = np.empty(512, np.int64)
    stack, c = np.empty((DEPTH, 4 * width)), np.empty((6, 3))
    for i in range(len(points)):
        totals[i], states[i] = count_point(
            points[i, 0], points[i, 1], points[i, 2], margin, slack,
            boxes, slabs, corners, links, nets, waiting, stack, c,
        )  # fmt: skip
