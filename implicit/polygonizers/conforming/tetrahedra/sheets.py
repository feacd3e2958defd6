"""Triangles of f = 0 in tetrahedra whose vertices are inside, outside or on the singular set, and in pyramids.

A vertex of the mesh is named by the two ends of the edge it lies on, or twice by a vertex of the singular set.
"""

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import Local, at_some

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Corners sorted by sign; (inside, on, outside) -> triangles of edges (i, j), or vertices (i, i).
_PATTERNS = {
    (1, 0, 3): (((0, 1), (0, 2), (0, 3)),),
    (3, 0, 1): (((0, 3), (1, 3), (2, 3)),),
    (2, 0, 2): (((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))),
    (1, 1, 2): (((1, 1), (0, 2), (0, 3)),),
    (2, 1, 1): (((2, 2), (0, 3), (1, 3)),),
    (1, 2, 1): (((1, 1), (2, 2), (0, 3)),),
}
_PLACE_VALUES = 3 ** np.arange(4)
_PYRAMID = ((1, 2, 3, 4), (2, 1, 0), (3, 2, 0), (4, 3, 0), (1, 4, 0))
"""The faces of a pyramid with apex 0, counter-clockwise seen from outside."""

_FOUND = 1e-10
"""The next of Newton's steps would be the square of this one, as a share of the edge."""
_ROUNDED = 1e-12
"""Steps that are shorter, and not half as long as the one before, show the rounding of f alone."""


def met(signs: IntArray, tetrahedra: IntArray) -> NDArray[np.bool_]:
    """Which tetrahedra have a vertex inside and one outside."""
    return at_some(signs < 0, tetrahedra) & at_some(signs > 0, tetrahedra)


def in_tetrahedra(places: FloatArray, signs: IntArray, tetrahedra: IntArray) -> IntArray:
    """Oriented triangles (n, 3, 2) of named vertices in tetrahedra with signs -1, 0, 1."""
    mixed = tetrahedra[met(signs, tetrahedra)]
    table, counts = _cuts()
    code = (signs[mixed] + 1) @ _PLACE_VALUES
    a, b, c = (places[mixed[:, k]] - places[mixed[:, 0]] for k in (1, 2, 3))
    turned = np.einsum("ij,ij->i", np.cross(a, b), c) < 0
    named = mixed[np.arange(len(mixed))[:, None, None, None], table[turned.astype(np.int64), code]]
    return np.asarray(named[np.arange(2) < counts[code][:, None]])


@cache
def _cuts() -> tuple[IntArray, IntArray]:
    """The triangles (2, 81, 2, 3, 2) of corners in a tetrahedron for each combination of signs, and how many they are.

    First for tetrahedra like that of the origin and the unit vectors, then for those turned inside out.
    """
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    table, counts = np.zeros((81, 2, 3, 2), np.int64), np.zeros(81, np.int64)
    for signs in product((-1, 0, 1), repeat=4):
        code = (np.array(signs) + 1) @ _PLACE_VALUES
        order = np.argsort(signs, kind="stable")
        for triangle in _PATTERNS.get((signs.count(-1), signs.count(0), signs.count(1)), ()):
            named = order[np.array(triangle)]
            a, b, c = corners[named].sum(axis=1)
            outwards = np.cross(b - a, c - a) @ (corners[order[-1]] - corners[order[0]]) > 0
            table[code, counts[code]] = named if outwards else named[::-1]
            counts[code] += 1
    return np.stack([table, table[:, :, ::-1]]), counts


def flat_tetrahedra(signs: IntArray, tetrahedra: IntArray) -> int:
    """How many tetrahedra have a whole face on the singular set."""
    on = (signs == 0).astype(np.int8)
    return int(np.count_nonzero(sum(on[corner] for corner in tetrahedra.T) > 2))


@cache
def _pyramid_triangles(pattern: int) -> tuple[tuple[tuple[int, int], ...], ...]:
    """Triangles of edges for a pyramid whose corners with their bit set are inside, joined as the sweep joins them."""
    follow = {}
    for face in _PYRAMID:
        inside = [pattern >> corner & 1 for corner in face]
        count = len(face)
        for last in range(count):
            if inside[last] and not inside[(last + 1) % count]:
                first = last
                while inside[(first - 1) % count]:
                    first -= 1
                enter = frozenset((face[(first - 1) % count], face[first % count]))
                follow[enter] = frozenset((face[last], face[(last + 1) % count]))
    triangles = []
    while follow:
        loop = [min(follow, key=sorted)]
        while (edge := follow.pop(loop[-1])) != loop[0]:
            loop.append(edge)
        names = [(min(edge), max(edge)) for edge in loop]
        triangles += [(names[0], names[k], names[k + 1]) for k in range(1, len(names) - 1)]
    return tuple(triangles)


def in_pyramids(signs: IntArray, pyramids: IntArray) -> IntArray:
    """Oriented triangles (n, 3, 2) of named vertices in pyramids without a vertex on the singular set."""
    pattern = ((signs[pyramids] < 0) << np.arange(5)).sum(axis=1)
    result = [np.zeros((0, 3, 2), np.int64)]
    for number in np.unique(pattern):
        rows = pyramids[pattern == number]
        result += [rows[:, np.array(triangle)] for triangle in _pyramid_triangles(int(number))]
    return np.concatenate(result)


def find_roots(local: Local, a: FloatArray, b: FloatArray, found: float = _FOUND) -> FloatArray:
    """Points of f = 0 between places a and b (n, 3) of different sign: Newton's steps that never leave the bracket,
    until one is less than the share `found` of the way.
    """
    way = b - a
    at_a, at_b = local.values(a), local.values(b)
    low, high = np.zeros(len(a)), np.ones(len(a))
    with np.errstate(all="ignore"):
        t = np.nan_to_num(at_a / (at_a - at_b), nan=0.5).clip(0.02, 0.98)
    last = np.ones(len(a))
    rows = np.arange(len(a))
    for _ in range(90):
        if not len(rows):
            break
        x = a[rows] + t[rows, None] * way[rows]
        value, slope = local.gradients(x)
        same = (value < 0) == (at_a[rows] < 0)
        low[rows], high[rows] = np.where(same, t[rows], low[rows]), np.where(same, high[rows], t[rows])
        along = np.einsum("ij,ij->i", slope, way[rows])
        with np.errstate(all="ignore"):
            step = np.nan_to_num(value / along, nan=np.inf)
        target = t[rows] - step
        poor = ~np.isfinite(step) | (target <= low[rows]) | (target >= high[rows]) | (np.abs(step) > 0.5 * last[rows])
        width = high[rows] - low[rows]
        lost = (last[rows] < _ROUNDED) & (np.abs(step) >= 0.5 * last[rows])
        done = (width < 2e-16) | (value == 0) | lost | (~poor & (np.abs(step) < found))
        last[rows] = np.where(poor, width, np.abs(step))
        middle = 0.5 * (low[rows] + high[rows])
        t[rows] = np.where((value == 0) | lost, t[rows], np.where(poor, middle, target))
        rows = rows[~done]
    return np.asarray(a + t[:, None] * way)
