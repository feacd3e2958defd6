"""Cones refined inwards: where the surface is curved towards a special point, spokes get a vertex halfway.

A spoke p-a of a cone gets the vertex a' of the surface that is half as far from p, found on the sphere of that radius
from the middle of the spoke. Spokes to vertices on the singular set stay as they are: they are edges of the set.
"""

#        p                 p
#       / \               / \
#      /   \      ->     a'--b'
#     /     \           / \ / \
#    a ----- b         a --- b

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.facing import turned
from implicit.polygonizers.conforming.local import Local, proper

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]
Mesh = tuple[FloatArray, FloatArray, IntArray]
"""Vertices (v, 3), unit normals (v, 3) and faces (f, 3)."""

_LEVELS = 4
"""Spokes are halved so often at most."""
_STRAIGHT = 0.004
"""Spokes that are nowhere farther from the surface than so many cells are left."""
_STEPS = 8
_EXACT = 1e-11
"""The last step, in cells, towards a vertex that has been found."""


def refine_inwards(local: Local, mesh: Mesh, special: IntArray, fixed: Flags) -> Mesh:
    """The mesh with the cones round special vertices refined; fixed (v,): the vertices on the singular set.

    A cone is left as it is where it is straight, and where it shares faces with another; a spoke where no vertex
    halfway can be found, or would turn a face over or the normal far.
    """
    vertices, normals, faces = mesh
    active, stuck = np.zeros(len(vertices), bool), fixed
    active[special] = True
    crowded = active[faces].sum(axis=1) > 1
    active[faces[crowded]] = False
    for _ in range(_LEVELS):
        if not active.any():
            break
        rows = np.flatnonzero(active[faces].any(axis=1))
        turn = (np.argmax(active[faces[rows]], axis=1)[:, None] + np.arange(3)) % 3
        fans = np.take_along_axis(faces[rows], turn, axis=1)
        spokes, ends = _spokes(fans, stuck)
        halves, shift = _halfway(local, vertices[spokes])
        bent = np.zeros(len(vertices), bool)
        bent[spokes[np.isfinite(shift) & (shift > _STRAIGHT), 0]] = True
        good = np.append(np.isfinite(shift) & bent[spokes[:, 0]], False)
        if not good.any():
            break
        first = len(vertices)
        vertices, normals = (
            np.concatenate(pair) for pair in ((vertices, halves), (normals, unit(local.field.gradients(halves)[1])))
        )
        fixed, stuck, active = (np.append(mask, np.zeros(len(spokes), bool)) for mask in (fixed, stuck, active & bent))
        while True:
            parts = split_fans(fans, np.where(good[ends], first + ends, fans[:, 1:]))
            bad = turned(vertices, normals, fixed, parts.reshape(-1, 3)).reshape(-1, 3).any(axis=1)
            if not good[ends[bad]].any():  # what is left was so before
                break
            good[ends[bad]] = False
        stuck[spokes[~good[:-1], 1]] = True
        faces = np.concatenate([np.delete(faces, rows, axis=0), proper(parts.reshape(-1, 3))])
    return vertices, normals, faces


def _spokes(fans: IntArray, stuck: Flags) -> tuple[IntArray, IntArray]:
    """The different spokes (n, 2) to vertices that are not stuck, and which of them leads to each end (k, 2), or -1."""
    loose = ~stuck[fans[:, 1:]]
    keys = fans[:, :1] * len(stuck) + fans[:, 1:]
    found, inverse = np.unique(keys[loose], return_inverse=True)
    ends = np.full(loose.shape, -1)
    ends[loose] = inverse
    return np.column_stack([found // len(stuck), found % len(stuck)]), ends


def _halfway(local: Local, spokes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The points (n, 3) of the surface halfway along spokes (n, 2, 3), and how many cells they lie beside the middle.

    Steps of Newton's along the sphere round the first end; where they do not end, the distance is infinite.
    """
    center = local.grid.to_units(spokes[:, 0])
    way = (local.grid.to_units(spokes[:, 1]) - center) / 2
    radius = np.linalg.norm(way, axis=1, keepdims=True)
    out = unit(way)
    for _ in range(_STEPS):
        value, slope = local.gradients(center + radius * out)
        along = slope - (slope * out).sum(axis=1, keepdims=True) * out
        with np.errstate(all="ignore"):
            step = np.nan_to_num(value / (along**2).sum(axis=1))[:, None] * along
        length = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1, 0.3 * radius / np.maximum(length, 1e-300))
        out = unit(radius * out - step)
    shift = np.linalg.norm(radius * out - way, axis=1)
    return local.grid.to_points(center + radius * out), np.where(length[:, 0] < _EXACT, shift, np.inf)


def split_fans(fans: IntArray, halves: IntArray) -> IntArray:
    """The three parts (k, 3, 3) of faces p, a, b with halves (k, 2) a', b'; two corners of a part are the same where
    a' is a or b' is b.
    """
    (p, a, b), (near_a, near_b) = fans.T, halves.T
    inner, left, right = (p, near_a, near_b), (near_a, a, b), (near_a, b, near_b)
    return np.stack([np.column_stack(part) for part in (inner, left, right)], axis=1)
