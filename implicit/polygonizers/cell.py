"""The cube: its corners, its edges, and how a surface passes between corners inside and outside.

::

           1 ----- 5 ----- 3        corner 4 dx + 2 dy + dz: 0 is the origin, 4 is +x (towards the
          /|              /|        reader), 2 is +y (right), 1 is +z (up)
         1 |             3 |
        /  8            /  9        edges 0-3 run along x, 4-7 along y, 8-11 along z; among those of
       5 ----- 7 ----- 7   |        one direction the two other coordinates count up:
       |   |           |   |          0: 0-4   1: 1-5   2: 2-6   3: 3-7
       |   0 ----- 4 --|-- 2          4: 0-2   5: 1-3   6: 4-6   7: 5-7
      10  /           11  /           8: 0-1   9: 2-3  10: 4-5  11: 6-7
       | 0             | 2
       |/              |/           A pattern has bit c set when corner c is inside (f < 0).
       4 ----- 6 ----- 6

The surface crosses every edge with one end inside. On each face the crossings are joined so that inside corners are
cut off one by one; this uses nothing but the face's own four signs, so two neighbours always agree. The segments of
the six faces close up to loops, and every loop bounds a patch. Triangles come from the loops (`TRIANGLES`); a dual
mesh, with one vertex per loop and a quadrilateral per crossed edge, can come from the same loops.
"""

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

Loop = tuple[int, ...]
Triangle = tuple[int, int, int]

CORNERS = tuple(product((0, 1), repeat=3))
"""(dx, dy, dz) of each corner."""

EDGES = tuple((corner, corner | 4 >> axis) for axis in range(3) for corner in range(8) if not CORNERS[corner][axis])
"""The two corners of each edge, lower first."""


def _face(axis: int, side: int) -> tuple[int, ...]:
    """The corners of a face, counter-clockwise seen from outside."""
    u, v = 4 >> (axis + 1) % 3, 4 >> (axis + 2) % 3
    around = (0, u, u | v, v)
    return tuple(side * (4 >> axis) | corner for corner in (around if side else around[::-1]))


FACES = tuple(_face(axis, side) for axis in range(3) for side in (0, 1))
"""The corners of each face, counter-clockwise seen from outside."""

_EDGE = {frozenset(ends): number for number, ends in enumerate(EDGES)}
_EDGE_FACES = tuple(frozenset(i for i, face in enumerate(FACES) if set(ends) <= set(face)) for ends in EDGES)


def _segments(pattern: int) -> dict[int, int]:
    """Which crossing follows which, over all faces: round each run of inside corners, keeping them on the left."""
    follow = {}
    for face in FACES:
        inside = [pattern >> corner & 1 for corner in face]
        for last in range(4):
            if inside[last] and not inside[(last + 1) % 4]:
                first = last
                while inside[(first - 1) % 4]:
                    first -= 1
                leave = _EDGE[frozenset((face[last], face[(last + 1) % 4]))]
                enter = _EDGE[frozenset((face[(first - 1) % 4], face[first % 4]))]
                follow[enter] = leave
    return follow


def find_loops(pattern: int) -> tuple[Loop, ...]:
    """The closed loops of crossed edges of a corner pattern, counter-clockwise seen from outside (f > 0)."""
    follow = _segments(pattern)
    loops = []
    while follow:
        start = min(follow)
        loop = [start]
        while (edge := follow.pop(loop[-1])) != start:
            loop.append(edge)
        loops.append(tuple(loop))
    return tuple(loops)


@cache
def _price(a: int, b: int) -> float:
    """The distance of the midpoints of two edges, or far too much when they share a face."""
    if _EDGE_FACES[a] & _EDGE_FACES[b]:
        return 100.0
    ends = [[CORNERS[corner] for corner in EDGES[edge]] for edge in (a, b)]
    middle = [[(p[i] + q[i]) / 2 for i in range(3)] for p, q in ends]
    return float(sum((s - t) ** 2 for s, t in zip(*middle, strict=True)) ** 0.5)


@cache  # most loops occur in several patterns
def triangulate(loop: Loop) -> tuple[Triangle, ...]:
    """The triangles of a loop with the shortest diagonals, none of which lies in a face of the cube.

    A diagonal in a face could coincide with a side of the neighbour's patch, and that edge would have four faces.
    """

    @cache
    def best(i: int, j: int) -> tuple[float, tuple[Triangle, ...]]:
        if j - i < 2:
            return 0.0, ()
        options = []
        for k in range(i + 1, j):
            (cost_left, left), (cost_right, right) = best(i, k), best(k, j)
            cost = cost_left + cost_right + sum(diagonal(a, b) for a, b in ((i, k), (k, j)))
            options.append((cost, (*left, *right, (loop[i], loop[k], loop[j]))))
        return min(options)

    def diagonal(a: int, b: int) -> float:
        return 0.0 if b - a in (1, len(loop) - 1) else _price(loop[a], loop[b])

    return best(0, len(loop) - 1)[1]


def _tables() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cells = [sum((triangulate(loop) for loop in LOOPS[pattern]), ()) for pattern in range(256)]
    count = np.array([len(cell) for cell in cells])
    table = np.zeros((256, 3 * int(count.max())), np.int64)
    for pattern, cell in enumerate(cells):
        table[pattern, : 3 * len(cell)] = np.ravel(cell)
    return count, table


LOOPS = tuple(find_loops(pattern) for pattern in range(256))
"""The loops of each pattern."""

TRIANGLE_COUNT, TRIANGLES = _tables()
"""How many triangles each pattern has (256,), and three edges for each of them (256, 15)."""
