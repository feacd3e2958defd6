"""The link of a special point: a triangulated sphere round it, fine enough to see where the surface meets it.

The inside of the sphere is filled with the cone from the point over its triangles, so the mesh there is the cone over
the curve that the triangles see. The triangles are refined until it is proved of each edge that it is crossed once at
most, and of each triangle away from the exits that the surface meets it in arcs without a turn.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from implicit.polygonizers.conforming.curves.ring import Circle, beside, crossings, stable
from implicit.polygonizers.conforming.enclose import changes, plain
from implicit.polygonizers.conforming.local import Local, among, frame, merged, pairs_of, spread, unit_rows
from implicit.topology import components

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDS = 20
_BUDGET = 3000
_NARROWEST = 1e-4
"""Exits whose rings would be narrower than this angle are not told apart."""


@dataclass(frozen=True, eq=False)
class Link:
    """A sphere's vertices as directions (n, 3), those of the exits of curves first, and its triangles.

    rims: the radius (angle) of the ring of vertices round each exit. sheets: how many sheets meet at each exit.
    topology: components and Euler characteristic of the curve seen. resolved: whether nothing was left to refine.
    """

    directions: FloatArray
    triangles: IntArray
    rims: FloatArray
    sheets: IntArray
    topology: tuple[int, int]
    resolved: bool


def even(spacing: float, rng: np.random.Generator) -> FloatArray:
    """Directions (n, 3) about so far apart, turned at random."""
    return spread(int(4 * np.pi / (0.8 * spacing**2)), rng)


def find_link(
    local: Local, point: FloatArray, radius: float, exits: FloatArray, points: FloatArray, spacing: float,
    rng: np.random.Generator,
) -> Link:  # fmt: skip
    """The link on the sphere of a radius, refined from directions (n, 3) at most about `spacing` apart; exits (k, 3)
    are directions too.
    """
    circles, narrow = [], False
    for i, exit_ in enumerate(exits):
        others = np.linalg.norm(np.delete(exits, i, axis=0) - exit_, axis=1)
        widest = min(0.5 * spacing, 0.4 * others.min(initial=9.0))
        narrow |= widest <= _NARROWEST
        widest = max(widest, _NARROWEST)
        circles.append(Circle(point + radius * exit_, *frame(exit_), radius * widest, (point, radius)))
    found, sheets = stable(local, circles, 1e-3)
    settled = None not in found and not narrow
    circles = [new or old for new, old in zip(found, circles, strict=True)]
    roots = crossings(local, circles)
    rings = [unit_rows(c.at(beside(r)) - point) for c, r in zip(circles, roots, strict=True)]
    rim = np.array([circle.radius / radius for circle in circles])
    for exit_, reach in zip(exits, rim, strict=True):
        points = points[np.linalg.norm(points - exit_, axis=1) > 1.35 * reach]
    points = np.concatenate([exits.reshape(-1, 3), *rings, points, *_graded(exits, rim, spacing, rng)])
    points, triangles, clean = _refine(local, point, radius, points, exits, rim, spacing, rng)
    topology = _topology(local.signs(point + radius * points), triangles, len(exits))
    return Link(points, triangles, rim, sheets, topology, clean and settled)


def _graded(exits: FloatArray, rims: FloatArray, spacing: float, rng: np.random.Generator) -> list[FloatArray]:
    """Rings of growing radius round the exits, up to the plain spacing."""
    result = []
    for exit_, rim in zip(exits, rims, strict=True):
        reach = 2.0 * rim
        u, v = frame(exit_)
        while reach < 1.2 * spacing:
            turn = 2 * np.pi * (np.arange(9) + rng.random()) / 9
            ring = unit_rows(exit_ + reach * (np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v))
            away = np.linalg.norm(ring[:, None] - exits, axis=2) > 1.35 * rims
            result.append(ring[away.all(axis=1)])
            reach *= 1.8
    return result


def _refine(
    local: Local, point: FloatArray, radius: float, points: FloatArray, exits: FloatArray, rims: FloatArray,
    spacing: float, rng: np.random.Generator,
) -> tuple[FloatArray, IntArray, bool]:  # fmt: skip
    """The directions with more among them until the triangles pass; these; and whether they do within the budget."""
    hull = ConvexHull(points, incremental=True)
    passed = [np.zeros(0, np.int64), np.zeros(0, np.int64)]
    for _ in range(_ROUNDS):
        triangles = np.sort(hull.simplices.astype(np.int64), axis=1)
        parts = []
        for kind, (look, simplices) in enumerate(
            ((_crossed_edges, pairs_of(triangles)), (_turning_triangles, triangles))
        ):
            names = simplices @ (2 * _BUDGET) ** np.arange(simplices.shape[1])
            left = (simplices >= len(exits)).all(axis=1) & ~among(names, passed[kind])
            bad, places = look(local, point + radius * points[simplices[left]])
            passed[kind] = merged(passed[kind], names[left][~bad])
            way = unit_rows(places - point)
            if kind == 1:
                way = way[(np.linalg.norm(way[:, None] - exits, axis=2) > 1.7 * rims).all(axis=1)]
            parts.append(way)
        new = np.concatenate(parts)
        if not len(new):
            return points, triangles, True
        new = unit_rows(new + rng.normal(size=new.shape) * 1e-3 * spacing)
        new = new[(np.linalg.norm(new[:, None] - exits, axis=2) > 1.15 * rims).all(axis=1)]
        gap = cKDTree(points).query(new)[0]
        new = new[gap > 1e-4]
        if len(new):
            close = cKDTree(new).query_pairs(0.35 * float(np.median(gap)), output_type="ndarray")
            new = np.delete(new, np.unique(close[:, 1]), axis=0)
        if not len(new) or len(points) + len(new) > _BUDGET:
            break
        points = np.concatenate([points, new])
        hull.add_points(new)
    return points, hull.simplices.astype(np.int64), False


def _crossed_edges(local: Local, ends: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Which edges with ends (n, 2, 3) are crossed more than once, and a place on each of these in the other sign."""
    found = changes(local, ends[:, 0], ends[:, 1])
    bad = found.counts > 1
    return bad, ends[bad, 0] + found.beyond[bad, None] * (ends[bad, 1] - ends[bad, 0])


def _turning_triangles(local: Local, corners: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Which triangles with corners (n, 3, 3) f = 0 may meet in more than arcs without a turn, and their middles."""
    bad = ~plain(local, corners)
    return bad, corners[bad].mean(axis=1)


def _topology(signs: IntArray, triangles: IntArray, exits: int) -> tuple[int, int]:
    """Components and Euler characteristic of the curve that the triangles see."""
    signs = signs.copy()
    signs[:exits] = 0
    size = len(signs)
    corner, after = triangles, np.roll(triangles, -1, axis=1)
    names = np.concatenate(
        [corner * size + corner, np.minimum(corner, after) * size + np.maximum(corner, after)], axis=1
    )
    met = np.concatenate([signs[corner] == 0, signs[corner] * signs[after] < 0], axis=1)
    segments = names[met.sum(axis=1) == 2][met[met.sum(axis=1) == 2]].reshape(-1, 2)
    if not len(segments):
        return 0, 0
    used, renamed = np.unique(segments, return_inverse=True)
    edges = renamed.reshape(-1, 2)
    return int(components(edges, len(used)).max()) + 1, len(used) - len(edges)
