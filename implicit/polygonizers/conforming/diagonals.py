"""Of the two diagonals of four vertices in a cell, the one that keeps the triangles nearer to the surface.

Vertices lie on the surface, so the middle of a triangle is off it by how far the surface sags there. To leading order
that is the sum of (n_b - n_a) . (b - a) over the three sides, by 18, with unit normals n at corners a, b: for
f = z - q(x, y) / 2 every side gives -q(b - a), and q at three corners is more than q at their middle by a ninth of the
sum. Where the surface curves both ways a diagonal lies anywhere between above and below it, so the choice matters.
"""

#     r           r
#    / \         /|\        A diagonal runs through the inside of its cell, not in a face: no coordinate of its ends is
#   p---q  or   p | q       the same, as vertices lie on lattice edges. Neighbours never see it, so the other one leaves
#    \ /         \|/        all edges in faces of cells, and with them the topology, as they are.
#     s           s

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import INNER, OPTIONS
from implicit.polygonizers.conforming.facing import BEND, FACING

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_GAIN = 0.9
"""A diagonal is changed if the distances of both middles add up to less than this share of what they were."""
_SQUARE = FACING**2

_U = np.uint64  # indices of this kind are not tested for being negative


@njit(**INNER)
def _sag(vertices: Any, normals: Any, a: Any, b: Any) -> float:
    """(n_b - n_a) . (b - a)."""
    total = 0.0
    for k in range(3):
        total += (vertices[b, k] - vertices[a, k]) * (normals[b, k] - normals[a, k])
    return total


@njit(**INNER)
def _within(vertices: Any, a: Any, b: Any) -> bool:
    """Whether no coordinate is the same."""
    same = 0
    for k in range(3):
        same += vertices[a, k] == vertices[b, k]
    return same == 0


@njit(**INNER)
def _faces(vertices: Any, normals: Any, a: Any, b: Any, c: Any) -> bool:
    """Whether a triangle faces as the normals at its corners do."""
    at_a = at_b = at_c = square = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        x = (vertices[b, i] - vertices[a, i]) * (vertices[c, j] - vertices[a, j])
        x -= (vertices[b, j] - vertices[a, j]) * (vertices[c, i] - vertices[a, i])
        at_a, at_b, at_c = at_a + x * normals[a, k], at_b + x * normals[b, k], at_c + x * normals[c, k]
        square += x * x
    least = min(at_a, min(at_b, at_c))
    return least > 0.0 and least * least > _SQUARE * square


@njit(**INNER)
def _better(vertices: Any, normals: Any, p: Any, q: Any, r: Any, s: Any) -> bool:
    """Whether r-s is a better diagonal than p-q."""
    pr, rq = _sag(vertices, normals, p, r), _sag(vertices, normals, r, q)
    qs, sp = _sag(vertices, normals, q, s), _sag(vertices, normals, s, p)
    pq, rs = _sag(vertices, normals, p, q), _sag(vertices, normals, r, s)
    if not abs(pr + sp + rs) + abs(rq + qs + rs) < _GAIN * (abs(pr + rq + pq) + abs(qs + sp + pq)):
        return False
    bend = normals[r, 0] * normals[s, 0] + normals[r, 1] * normals[s, 1] + normals[r, 2] * normals[s, 2]
    return bend > BEND and _faces(vertices, normals, p, r, s) and _faces(vertices, normals, r, q, s)


@njit(**OPTIONS)
def _choose(vertices: Any, normals: Any, faces: Any) -> None:
    """A triangle (p, r, q) of a loop has its side q-p in common with one of the two behind, (p, q, s) or (s, p, q)."""
    for row in range(len(faces) - 1):
        one, two = _U(row), _U(row + 1)
        p, r, q = _U(faces[one, 0]), _U(faces[one, 1]), _U(faces[one, 2])
        a, b, c = _U(faces[two, 0]), _U(faces[two, 1]), _U(faces[two, 2])
        left = (a == p) & (b == q)
        if not left | ((b == p) & (c == q)):
            two += _U(row + 2 < len(faces))
            a, b, c = _U(faces[two, 0]), _U(faces[two, 1]), _U(faces[two, 2])
            left = (a == p) & (b == q)
            if not left:
                continue
        s = c if left else a
        if _within(vertices, p, q) and _within(vertices, r, s) and _better(vertices, normals, p, q, r, s):
            faces[one, 0], faces[one, 1], faces[one, 2] = (r, q, s) if left else (s, p, r)
            faces[two, 0], faces[two, 1], faces[two, 2] = (p, r, s) if left else (s, r, q)


def choose_diagonals(vertices: FloatArray, normals: FloatArray, faces: IntArray) -> None:
    """Change diagonals within the cells of a sweep, in `faces` itself, where that brings triangles nearer to f = 0.

    vertices and faces as the sweep leaves them, those of a cell one after the other; normals (v, 3) of length 1 or 0.
    """
    _choose(vertices, normals, faces)
