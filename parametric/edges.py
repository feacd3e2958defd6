"""Edges: the sides of many surfaces, matched where they run along the same curve of space."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from parametric.arcs import SIDES, Arc, Side
from parametric.parameters import Array

_PLACES = np.array([0.0, 0.11, 0.23, 0.37, 0.5, 0.61, 0.74, 0.89, 1.0])
"""Where along an arc its distance from another one is measured; the middle shows the direction of closed arcs."""
_EXACT = 1e-6
"""Arcs closer than this part of the tolerance at every common parameter are in proportion, whatever else they are."""


@dataclass(frozen=True, eq=False)
class Edge:
    """A curve of space with the arcs of all surfaces that run along it; the first arc draws the curve.

    kind       "naked" (one arc), "shared" (two), "crowded" (more), or "degenerate" (a side that is a single point)
    ends       numbers of the corners at which it starts and ends
    gap        the largest distance found between its arcs, a length
    """

    kind: str
    arcs: tuple[Arc, ...]
    ends: tuple[int, int]
    gap: float

    def points(self, s: Array) -> Array:
        """Points of the edge at 0 <= s <= 1, along its first arc."""
        arc = self.arcs[0]
        return arc.side.points(arc.parameter(s))

    def __repr__(self) -> str:
        """The kind and the sides, with the numbers of their surfaces."""
        sides = ", ".join(f"surface {arc.side.surface_index} {arc.side.name}" for arc in self.arcs)
        return f"Edge({self.kind}: {sides})"


@dataclass
class _Piece:
    """An arc on its way to an edge: the corners at its ends and where it passes."""

    arc: Arc
    ends: tuple[int, int]
    points: Array = field(repr=False)


def match_edges(sides: Sequence[Side], tolerance: float) -> tuple[tuple[Edge, ...], Array]:
    """The edges along which `sides` run, and the corners (n, 3) they join.

    Sides are cut where a corner of another one lies on them, so that one long side may meet several short ones. Arcs
    that stay within `tolerance` of each other everywhere are one edge, whatever their parametrizations.
    """
    points = [side.polyline for side in sides]
    flat = np.array([np.ptp(p, axis=0).max() <= tolerance for p in points], dtype=bool)
    ends, corners = _weld(np.array([p[[0, -1]] for p in points]).reshape(-1, 3), tolerance)
    ends = ends.reshape(-1, 2)
    edges = [
        Edge("degenerate", (Arc(side, *side.interval),), (int(e[0]), int(e[1])), float(np.ptp(p, axis=0).max()))
        for side, e, p, collapsed in zip(sides, ends, points, flat)
        if collapsed
    ]
    groups: dict[tuple[int, int], list[_Piece]] = defaultdict(list)
    for side, e, collapsed in zip(sides, ends, flat):
        if not collapsed:
            for piece in _cut(side, (int(e[0]), int(e[1])), corners, tolerance):
                groups[min(piece.ends), max(piece.ends)].append(piece)
    for group in groups.values():
        for alike in _sort_alike(group, tolerance):
            edges += _make_edges(alike)
    return _part_corners(edges, corners)


def _part_corners(edges: list[Edge], corners: Array) -> tuple[tuple[Edge, ...], Array]:
    """One corner for each fan of surfaces round it: surfaces that touch at a point, and share no edge there, part."""
    leader: dict[object, object] = {}

    def find(key: object) -> object:
        while leader.setdefault(key, key) != key:
            key = leader[key]
        return key

    for edge in edges:
        for end in (0, 1):
            keys = [arc.end_key(end) for arc in edge.arcs]
            if edge.kind == "degenerate":
                keys.append(edge.arcs[0].end_key(1 - end))
            for key in keys[1:]:
                leader[find(key)] = find(keys[0])
    numbers: dict[object, int] = {}
    places: list[int] = []
    parted = []
    for edge in edges:
        ends = []
        for end in (0, 1):
            number = numbers.setdefault(find(edge.arcs[0].end_key(end)), len(places))
            if number == len(places):
                places.append(edge.ends[end])
            ends.append(number)
        parted.append(replace(edge, ends=(ends[0], ends[1])))
    return tuple(parted), corners[places]


def _weld(points: Array, tolerance: float) -> tuple[NDArray[np.int64], Array]:
    """A number for each point, equal for points within tolerance (and chains of them), and a point for each number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    near = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    labels = connected_components(near, directed=False)[1].astype(np.int64)
    _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
    return numbers, points[first]


def _cut(side: Side, ends: tuple[int, int], corners: Array, tolerance: float) -> Iterable[_Piece]:
    """The arcs of a side between the corners that lie on it."""
    inside = np.setdiff1d(side.near(corners, tolerance), ends)
    stops = [(side.interval[0], ends[0]), (side.interval[1], ends[1])]
    for corner in inside:
        t, distance = side.project(corners[corner][None], side.nearest(corners[corner][None]))
        if distance[0] <= tolerance:
            stops.append((float(t[0]), int(corner)))
    stops.sort()
    for (a, start), (b, end) in pairwise(stops):
        arc = Arc(side, a, b)
        yield _Piece(arc, (start, end), side.points(arc.parameter(_PLACES)))


def _sort_alike(group: list[_Piece], tolerance: float) -> list[list[tuple[_Piece, float]]]:
    """Pieces that run along one curve, turned to the direction of the first, with their distances from it."""
    result: list[list[tuple[_Piece, float]]] = []
    for piece in group:
        for alike in result:
            match = _match(alike[0][0], piece, tolerance)
            if match is not None:
                alike.append(match)
                break
        else:
            result.append([(piece, 0.0)])
    return result


def _match(first: _Piece, other: _Piece, tolerance: float) -> tuple[_Piece, float] | None:
    """`other` along the curve of `first`, and the largest distance between them; None where they part."""
    turned = _Piece(other.arc.turned(), other.ends[::-1], other.points[::-1])
    candidates = [p for p in (other, turned) if p.ends == first.ends]
    for candidate in candidates:
        there = candidate.arc.side.points(candidate.arc.parameter(_PLACES))
        gap = float(np.linalg.norm(there - first.points, axis=1).max())
        if gap <= tolerance:
            # Nearly in proportion is not in proportion: what looks like a gap may be a difference of speed.
            fitted = candidate.arc.along(first.arc, tolerance) if gap > _EXACT * tolerance else None
            if fitted is not None and fitted[1] < 0.1 * gap:
                return _Piece(fitted[0], candidate.ends, candidate.points), fitted[1]
            return _Piece(candidate.arc, candidate.ends, there), gap
    for candidate in candidates:
        fitted = candidate.arc.along(first.arc, tolerance)
        if fitted is not None:
            return _Piece(fitted[0], candidate.ends, candidate.points), fitted[1]
    return None


def _make_edges(alike: list[tuple[_Piece, float]]) -> list[Edge]:
    """One edge; or several, where as many arcs keep their surface on the left as on the right: they pair."""
    ends = alike[0][0].ends
    arcs = [(piece.arc, gap) for piece, gap in alike]
    left = [entry for entry in arcs if entry[0].inside_left]
    right = [entry for entry in arcs if not entry[0].inside_left]
    balanced = len(arcs) > 2 and len(left) == len(right)
    pairs = [[a, b] for a, b in zip(left, right)] if balanced else [arcs]
    kinds = {1: "naked", 2: "shared"}
    return [
        Edge(kinds.get(len(p), "crowded"), tuple(arc for arc, _ in p), ends, max(gap for _, gap in p)) for p in pairs
    ]


def sides_of(surfaces: Sequence[object]) -> list[Side]:
    """The four sides of every surface, in the order "u0", "u1", "v0", "v1"."""
    return [Side(surface, k, name) for k, surface in enumerate(surfaces) for name in SIDES]  # type: ignore[arg-type]
