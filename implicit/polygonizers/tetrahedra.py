"""Marching tetrahedra: each cube is cut into the six tetrahedra round its diagonal from corner 0 to corner 7.

::

    A tetrahedron is a way from corner 0 to corner 7 along three edges of the cube, one in each direction: the six
    orders of the directions give the six tetrahedra. Face diagonals run from the lower to the upper corner in every
    cube, so neighbours agree. An edge is known by its lower corner and its direction, 1 to 7, the bits 4 x + 2 y + z.

A tetrahedron has no ambiguous pattern: one corner of another sign than the rest gives a triangle, two and two give a
quadrilateral.
"""

from itertools import permutations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.cell import CORNERS
from implicit.polygonizers.lattice import CELLS
from implicit.polygonizers.marching import BATCH, Marched, refuse
from implicit.polygonizers.roots import SNAP
from implicit.polygonizers.samples import Sampler
from implicit.work import Job, batches

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
Edge: TypeAlias = tuple[int, int]


def _ways() -> list[tuple[int, int, int, int]]:
    """The corners of the six tetrahedra, each from 0 to 7."""
    return [(0, a, a | b, 7) for a, b, _ in permutations((4, 2, 1))]


def _triangles(corners: tuple[int, ...], pattern: int) -> list[tuple[Edge, Edge, Edge]]:
    """The triangles of a tetrahedron whose corner number i is inside when bit i of `pattern` is set; outward."""
    inside = [c for i, c in enumerate(corners) if pattern >> i & 1]
    outside = [c for i, c in enumerate(corners) if not pattern >> i & 1]
    if not inside or not outside:
        return []
    if len(inside) == 2:
        (a, b), (c, d) = inside, outside
        around = [(a, c), (a, d), (b, d), (b, c)]
        parts = [around[:3], [around[0], *around[2:]]]
    else:
        parts = [[(a, b) for a in inside for b in outside]]
    place = np.array(CORNERS, float)
    away = place[outside].mean(axis=0) - place[inside].mean(axis=0)
    found = []
    for part in parts:
        p, q, r = ((place[a] + place[b]) / 2 for a, b in part)
        ordered = part if np.cross(q - p, r - p) @ away > 0 else part[::-1]
        first, second, third = ((min(edge), max(edge)) for edge in ordered)
        found.append((first, second, third))
    return found


_TABLE = [[_triangles(way, pattern) for pattern in range(16)] for way in _ways()]


def march_tetrahedra(sampler: Sampler, job: Job) -> Marched:
    """The mesh of f = 0 over the sampler's bricks by marching tetrahedra; see `marching.march`."""
    lattice = sampler.lattice
    rows = np.array([len(axis) for axis in lattice.axes])
    stride = np.array([rows[1] * rows[2], rows[2], 1])
    keys = [np.zeros((0, 3), np.int64)]
    for first, last in batches(len(sampler.bricks), BATCH):
        samples = np.empty((last - first, 512))
        sampler.fill(first, last, samples)
        if not np.isfinite(samples).all():
            row = int(np.flatnonzero(~np.isfinite(samples).all(axis=1))[0])
            refuse(lattice.brick_points(sampler.bricks[first + row : first + row + 1])[0], samples[row])
        keys.append(_cells(samples < 0, sampler.bricks[first:last].astype(np.int64), np.array(lattice.cells), stride))
        job.advance(last - first)
    names, faces = np.unique(np.concatenate(keys), return_inverse=True)
    lower, direction = names // 8, names % 8
    index = np.column_stack(np.unravel_index(lower, tuple(rows)))
    start, stop = (
        np.column_stack([axis[index[:, i] + step[:, i]] for i, axis in enumerate(lattice.axes)])
        for step in (np.zeros((8, 3), int)[direction], np.array(CORNERS)[direction])
    )
    vertices, slopes, pinned = _roots(sampler, start, stop, lattice.precision)
    length = np.linalg.norm(slopes, axis=1, keepdims=True)
    normals = np.divide(slopes, length, out=np.zeros_like(slopes), where=length > 0)
    return Marched(vertices, normals, faces.reshape(-1, 3), pinned, int(np.count_nonzero(length == 0)))


def _cells(inside: NDArray[np.bool_], bricks: IntArray, cells: IntArray, stride: IntArray) -> IntArray:
    """The triangles (n, 3) of bricks as names of edges: 8 times the lattice point of the lower corner, + direction."""
    block = inside.reshape(-1, 8, 8, 8)
    corners = np.stack([block[:, i : i + 7, j : j + 7, k : k + 7] for i, j, k in CORNERS], axis=-1)
    mixed = np.argwhere(corners.any(axis=-1) & ~corners.all(axis=-1))
    base = CELLS * bricks[mixed[:, 0]] + mixed[:, 1:]
    within = (base < cells).all(axis=1)
    signs = corners[tuple(mixed[within].T)]
    point = base[within] @ stride
    offset = np.array(CORNERS) @ stride
    found = [np.zeros((0, 3), np.int64)]
    for way, table in zip(_ways(), _TABLE, strict=True):
        pattern = signs[:, way] @ (1 << np.arange(4))
        for number, triangles in enumerate(table):
            here = point[pattern == number]
            found += [
                np.column_stack([8 * (here + offset[a]) + (a ^ b) for a, b in triangle]) for triangle in triangles
            ]
    return np.concatenate(found)


def _roots(
    sampler: Sampler, start: FloatArray, stop: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Roots (n, 3) between points of different sign, gradients there, and which roots lie at an end.

    Newton's steps within the bracket; a step that leaves it or does not shrink by half is replaced by a bisection.
    """
    way = stop - start
    length = np.linalg.norm(way, axis=1)
    low, high = np.zeros(len(start)), np.ones(len(start))
    inside = sampler.anywhere(np.ascontiguousarray(start.T))[0] < 0
    share, last = np.full(len(start), 0.5), np.ones(len(start))
    slopes = np.zeros_like(start)
    left = np.arange(len(start))
    while len(left):
        points = start[left] + share[left, None] * way[left]
        values, part = sampler.anywhere(np.ascontiguousarray(points.T))
        slopes[left] = part.T
        before = (values < 0) == inside[left]
        low[left[before]], high[left[~before]] = share[left[before]], share[left[~before]]
        with np.errstate(all="ignore"):
            target = share[left] - values / (part.T * way[left]).sum(axis=1)
        step = np.abs(target - share[left])
        bad = ~((target >= low[left]) & (target <= high[left]) & (step <= 0.5 * last[left]))
        target[bad] = (0.5 * (low[left] + high[left]))[bad]
        step = np.abs(target - share[left])
        done = (values == 0) | (step * length[left] <= tolerance) | ((high - low)[left] * length[left] <= tolerance)
        share[left] = np.where(values == 0, share[left], target)
        last[left] = step
        left = left[~done]
    pinned = np.flatnonzero(np.minimum(share, 1 - share) * length <= SNAP * tolerance)
    vertices = start + share[:, None] * way
    ends = np.where((share < 0.5)[:, None], start, stop)
    vertices[pinned] = ends[pinned]
    return vertices, slopes, pinned
