"""The lattice squares on the six faces of a block of cells, with their edges and corners, as boxes of (t, u, v)."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lattice:
    """The lattice on the faces of some blocks as boxes (n, 4, 2) of t = 1, u, v, and the number of the face.

    Each block has six faces: w[axis] = lower, w[axis] = upper for each axis. Points, edges and ribs with corners
    (`ends`) are boxes without width. beside: the squares on both sides of each edge, and where there is none, as many
    as there are squares and the row of the edge among the ends. corners: the points (n, 4) round each square.
    """

    squares: FloatArray
    edges: FloatArray
    points: FloatArray
    ends: FloatArray
    beside: IntArray
    corners: IntArray

    @classmethod
    def of(cls, lower: FloatArray, upper: FloatArray) -> "Lattice":
        """That of blocks from lower (n, 3) to upper (n, 3)."""
        parts = [_at_origin(*size) for size in np.maximum(np.round(upper - lower), 1).astype(int).tolist()]
        rows = np.arange(len(parts))
        shift = np.zeros((len(parts), 6, 4, 1))
        for number in range(6):
            shift[:, number, 1:3, 0] = lower[:, ((number // 2 + 1) % 3, (number // 2 + 2) % 3)]
        shift[:, :, 3, 0] = 6 * rows[:, None]
        boxes: list[FloatArray] = []
        for some in zip(*((part.squares, part.edges, part.points, part.ends) for part in parts), strict=True):
            block, joined = np.repeat(rows, [len(part) for part in some]), np.concatenate(some)
            boxes.append(joined + shift[block, joined[:, 3, 0].astype(np.int64)])
        before, points, ribs = (
            np.cumsum([0, *map(len, some)])
            for some in zip(*((part.squares, part.points, part.ends) for part in parts), strict=True)
        )
        beside = [
            np.where(part.beside < 0, before[-1] + rib - 1 - part.beside, part.beside + first)
            for part, first, rib in zip(parts, before, ribs, strict=False)
        ]
        corners = [part.corners + first for part, first in zip(parts, points, strict=False)]
        squares, edges, places, ends = boxes
        return cls(squares, edges, places, ends, np.concatenate(beside), np.concatenate(corners))


def blocks_of(boxes: FloatArray) -> IntArray:
    """The number of the block (n,) to whose faces boxes (n, 4, 2) belong."""
    return boxes[:, 3, 0].astype(np.int64) // 6


@lru_cache(maxsize=64)
def _at_origin(*sizes: int) -> Lattice:
    """That of a block of so many cells from the origin on; -1 - row of an edge where no square is beside it."""
    parts: list[tuple[NDArray[np.generic], ...]] = []
    squares = points = ribs = 0
    for number, (axis, _) in enumerate(product(range(3), range(2))):
        p, r = (np.arange(sizes[a % 3] + 1.0) for a in (axis + 1, axis + 2))
        part = _face_boxes(p, r, number)
        beside, corners = _neighbours(len(p) - 1, len(r) - 1)
        parts.append((*part, beside + np.where(beside < 0, -ribs, squares), corners + points))
        squares, points, ribs = squares + len(part[0]), points + len(part[2]), ribs + len(part[3])
    return Lattice(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _face_boxes(p: FloatArray, r: FloatArray, number: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Squares, edges, points, and ribs with corners, of a face with lattice lines u = p and v = r."""
    u, v, ends = np.stack([p[:-1], p[1:]], axis=1), np.stack([r[:-1], r[1:]], axis=1), (0, -1)
    at_p, at_r = np.stack([p, p], axis=1), np.stack([r, r], axis=1)
    edges = [boxes_between(at_p, v, number), boxes_between(u, at_r, number)]
    ribs = [boxes_between(at_p[ends, :], v, number), boxes_between(u, at_r[ends, :], number)]
    ribs.append(boxes_between(at_p[ends, :], at_r[ends, :], number))
    return boxes_between(u, v, number), np.concatenate(edges), boxes_between(at_p, at_r, number), np.concatenate(ribs)


def _neighbours(n: int, m: int) -> tuple[IntArray, IntArray]:
    """For a face of n x m squares: those beside each edge, or -1 - row of a rib, and the points round each square."""
    square = np.zeros((n + 2, m + 2), np.int64)
    square[1:-1, 1:-1] = np.arange(n * m).reshape(n, m)
    square[(0, -1), 1:-1] = -1 - np.arange(2 * m).reshape(2, m)
    square[1:-1, (0, -1)] = -1 - 2 * m - np.arange(2 * n).reshape(n, 2)
    across = np.stack([square[:-1, 1:-1], square[1:, 1:-1]], axis=-1).reshape(-1, 2)
    along = np.stack([square[1:-1, :-1], square[1:-1, 1:]], axis=-1).reshape(-1, 2)
    point = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    corners = np.stack([point[:-1, :-1], point[1:, :-1], point[1:, 1:], point[:-1, 1:]], axis=-1)
    return np.concatenate([across, along]), corners.reshape(-1, 4)


def boxes_between(u: FloatArray, v: FloatArray, number: int) -> FloatArray:
    """Boxes (n, 4, 2) at t = 1 of all pairs of ranges of u and ranges of v on the face of a number."""
    boxes = np.ones((len(u), len(v), 4, 2))
    boxes[:, :, 1], boxes[:, :, 2], boxes[:, :, 3] = u[:, None], v, number
    return boxes.reshape(-1, 4, 2)
