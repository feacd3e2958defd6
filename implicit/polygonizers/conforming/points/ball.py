"""Balls round special points: as small as their link can be seen, below the critical radius."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.arc import Arc
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.points.critical import critical_radius
from implicit.polygonizers.conforming.points.link import Link, even, find_link

FloatArray = NDArray[np.float64]

_SMALLEST = 1.6
"""The radius of the first trial, in cells."""
_LARGEST = 8.0
_SMALLER = (0.5, 0.7, 0.85)
"""Links must be the same at the first of these shares of the radius at which they can be resolved."""
_ENOUGH = 500
"""A link with more vertices than these is tried on a larger sphere."""


@dataclass(frozen=True, eq=False)
class Exit:
    """Where an arc leaves a ball: the row of the arc, which of its ends (0 or 1) is inside, parameter and place."""

    arc: int
    side: int
    parameter: float
    place: FloatArray


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball in lattice units, filled with the cone over its link; whether the link is the same on a smaller sphere."""

    row: int
    center: FloatArray
    radius: float
    exits: tuple[Exit, ...]
    link: Link
    stable: bool


def find_ball(
    local: Local, row: int, points: FloatArray, arcs: list[Arc], room: float, rng: np.random.Generator
) -> Ball | None:
    """The ball round a special point, or None where the arcs do not leave any sphere of a size that can be handled."""
    center = points[row]
    most = min(room, _LARGEST, 0.42 * np.linalg.norm(np.delete(points, row, axis=0) - center, axis=1).min(initial=1e9))
    for arc in arcs:
        most = min(most, _arc_room(arc, row, center))
    nodes = np.concatenate([np.zeros((0, 3)), *(arc.nodes for arc in arcs)])
    most = min(most, 0.75 * critical_radius(local, center, most, nodes))
    best: tuple[tuple[bool, float], float, tuple[Exit, ...], Link] | None = None
    radius = min(_SMALLEST, most)
    while True:
        exits = _exits(arcs, row, center, radius)
        directions = np.array([(e.place - center) / radius for e in exits]).reshape(-1, 3)
        spacing = float(np.clip(0.8 / radius, 0.12, 0.45))
        plain = even(spacing, rng)
        link = find_link(local, center, radius, directions, plain, spacing, rng)
        score = (not link.resolved, len(link.directions) / len(plain))
        if best is None or score < best[0]:
            best = (score, radius, exits, link)
        if (link.resolved and len(link.directions) <= _ENOUGH) or radius >= 0.999 * most:
            break
        radius = min(1.5 * radius, most)
    _, radius, exits, link = best
    for share in _SMALLER:
        inside = radius * share
        directions = np.array([(e.place - center) / inside for e in _exits(arcs, row, center, inside)]).reshape(-1, 3)
        inner = find_link(local, center, inside, directions, link.directions[len(exits) :], spacing, rng)
        if inner.resolved:
            break
    return Ball(row, center, radius, exits, link, link.resolved and inner.topology == link.topology)


def _arc_room(arc: Arc, row: int, center: FloatArray) -> float:
    """How large the ball may be for an arc: it leaves the ball once from each end, and otherwise stays away."""
    distance = np.linalg.norm(arc.nodes - center, axis=1)
    if row not in (arc.start, arc.end):
        return float(0.6 * distance.min())
    room = np.inf
    for own, other, way in ((arc.start, arc.end, distance), (arc.end, arc.start, distance[::-1])):
        if own != row:
            continue
        falls = np.flatnonzero(np.diff(way) < -1e-12)
        peak = int(falls[0]) if len(falls) else len(way) - 1
        room = min(room, 0.8 * way[peak])
        if other != row and peak < len(way) - 1:
            room = min(room, 0.8 * way[peak:].min())
    return float(room)


def _exits(arcs: list[Arc], row: int, center: FloatArray, radius: float) -> tuple[Exit, ...]:
    """Where the arcs that end at a point leave the sphere."""
    result = []
    for number, arc in enumerate(arcs):
        distance = np.linalg.norm(arc.nodes - center, axis=1)
        for side, own in ((0, arc.start), (1, arc.end)):
            if own != row:
                continue
            order = np.arange(len(distance)) if side == 0 else np.arange(len(distance))[::-1]
            out = np.flatnonzero(distance[order] >= radius)
            if not len(out):
                continue
            ends = order[[out[0] - 1, out[0]]].astype(float)
            at = arc.where(lambda places: np.linalg.norm(places - center, axis=1) - radius, ends[:1], ends[1:])
            result.append(Exit(number, side, float(at[0]), arc.places(at)[0]))
    return tuple(result)
