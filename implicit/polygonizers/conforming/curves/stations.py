"""Stations along an arc of a singular curve, as close together as what is round the arc asks for.

The size h of a ring is small where other arcs or other parts of the same arc are near, where the exit of a ball has a
small rim, and where the sheets are counted equally only at small radii; it changes by at most 0.4 per unit of length.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from implicit.polygonizers.conforming.curves.arc import Arc, nearest_other
from implicit.polygonizers.conforming.curves.ring import Circle, stable
from implicit.polygonizers.conforming.local import Local, frame
from implicit.polygonizers.conforming.points.ball import Ball

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_WIDEST = 0.6
_SLOPE = 0.4
_THINNEST = 1e-4
_MOST, _MOST_PER_CELL = 40, 8
"""An arc may have so many stations, and so many more for each cell of its length; if that is too few it is refused."""
FOLLOWED = 1.5
"""Rings are looked at, and tubes go on, up to so many cells beyond the bounds."""
_COINCIDENT = 1e-9
"""Stations so near to the one before are left out. There are some only where the arc is not on the singular set."""


@dataclass(frozen=True, eq=False)
class Stations:
    """Places (n, 3) on an arc, with the sizes (n,) of rings there; start and end are exits (ball, place) or None."""

    number: int
    arc: Arc
    places: FloatArray
    sizes: FloatArray
    start: tuple[int, int] | None
    end: tuple[int, int] | None
    settled: bool

    @property
    def last(self) -> int:
        """The row of the last one."""
        return len(self.places) - 1

    @cached_property
    def lengths(self) -> FloatArray:
        """The length (n,) from the first to each."""
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.places, axis=0), axis=1)))


def find_stations(
    local: Local, number: int, arcs: list[Arc], balls: list[Ball], walls: FloatArray, limits: list[FloatArray]
) -> Stations | None:  # fmt: skip
    """The stations on an arc outside the balls; None where nothing of it is left. walls: parameters that are stations.

    limits: (n, 4) places and sizes that the rings there may not exceed.
    """
    arc = arcs[number]
    start, end = _end_of(number, 0, balls), _end_of(number, 1, balls)
    first = balls[start[0]].exits[start[1]].parameter if start else 0.0
    last = balls[end[0]].exits[end[1]].parameter if end else arc.last
    if last - first < 1e-9:
        return None
    inner = np.arange(np.floor(first) + 1, np.ceil(last))
    t = np.concatenate([[first], inner, [last]])
    q = arc.places(t)
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1)))
    h = _sizes(number, arcs, balls, q, s, start, end, limits)
    h, settled = _stable_sizes(local, arc, t, s, h, start is not None, end is not None)
    pace = _pace(s, h)
    if pace[-1] > _MOST + _MOST_PER_CELL * s[-1]:
        settled = False
        h = np.maximum(h, 1 / _MOST_PER_CELL)
        pace = _pace(s, h)
    chosen = _stations(pace, np.interp(walls[(walls > first) & (walls < last)], t, pace), arc.closed)
    parameters, sizes = np.interp(chosen, pace, t), np.interp(chosen, pace, h)
    stations = arc.places(parameters)
    if start:
        stations[0] = balls[start[0]].exits[start[1]].place
    if end:
        stations[-1] = balls[end[0]].exits[end[1]].place
    apart = np.linalg.norm(np.diff(stations, axis=0), axis=1) > _COINCIDENT
    if not apart.all():
        settled = False
        stations, sizes = (part[np.append(True, apart)] for part in (stations, sizes))
    return Stations(number, arc, stations, sizes, start, end, settled)


def _end_of(number: int, side: int, balls: list[Ball]) -> tuple[int, int] | None:
    for row, ball in enumerate(balls):
        for place, leave in enumerate(ball.exits):
            if leave.arc == number and leave.side == side:
                return row, place
    return None


def _pace(s: FloatArray, h: FloatArray) -> FloatArray:
    """The integral (n,) of 1 / h along lengths s (n,)."""
    return np.append(0.0, np.cumsum(np.diff(s) * 0.5 * (1 / h[1:] + 1 / h[:-1])))


def _stations(pace: FloatArray, walls: FloatArray, closed: bool) -> FloatArray:
    """Values of the pace at stations about 1 apart, with those at walls among them."""
    fixed = np.concatenate([[0.0], np.sort(walls), [pace[-1]]])
    least = 6 if closed else 2
    parts = []
    for a, b in pairwise(fixed):
        count = max(int(np.ceil(b - a)), least if len(fixed) == 2 else 1)
        parts.append(np.linspace(a, b, count + 1)[:-1])
    return np.concatenate([*parts, [pace[-1]]])


def _sizes(
    number: int, arcs: list[Arc], balls: list[Ball], q: FloatArray, s: FloatArray, start: tuple[int, int] | None,
    end: tuple[int, int] | None, limits: list[FloatArray],
) -> FloatArray:  # fmt: skip
    """The size (n,) of the rings at points q (n, 3) with lengths s (n,), from what is near."""
    h = np.full(len(s), _WIDEST)
    h = np.minimum(h, 0.45 * nearest_other(arcs, number, q, _WIDEST / 0.45))
    h = np.minimum(h, 0.45 * gaps(q, s, arcs[number].closed))
    for row, ball in enumerate(balls):
        if row not in [place[0] for place in (start, end) if place]:
            h = np.minimum(h, 0.6 * np.maximum(np.linalg.norm(q - ball.center, axis=1) - ball.radius, 1e-9))
    for place, length in ((start, s), (end, s[-1] - s)):
        if place:
            ball = balls[place[0]]
            h = np.minimum(h, 1.1 * ball.link.rims[place[1]] * ball.radius + 0.35 * length)
    for limit in limits:
        gap, row = cKDTree(limit[:, :3]).query(q)
        h = np.minimum(h, np.maximum(limit[row, 3], 0.5 * (gap - 1)))
    return _smooth(np.maximum(h, _THINNEST), s)


def gaps(q: FloatArray, s: FloatArray, closed: bool) -> FloatArray:
    """How far (n,) other parts of a curve are from its points q (n, 3) with lengths s (n,), about."""
    rows = np.arange(0, len(q), max(1, len(q) // 300))
    apart = cdist(q[rows], q[rows])
    along = np.abs(s[rows, None] - s[rows])
    if closed:
        along = np.minimum(along, s[-1] - along)
    far = np.where(along < 1.5 * apart + 1e-9, np.inf, apart).min(axis=1)
    return np.interp(s, s[rows], np.minimum(far, 1e9))


def _smooth(h: FloatArray, s: FloatArray) -> FloatArray:
    """The largest sizes below h that change by at most 0.4 per length."""
    h = np.minimum.accumulate(h - _SLOPE * s) + _SLOPE * s
    return np.asarray(np.minimum.accumulate((h + _SLOPE * s)[::-1])[::-1] - _SLOPE * s)


def _stable_sizes(
    local: Local, arc: Arc, t: FloatArray, s: FloatArray, h: FloatArray, exit_start: bool, exit_end: bool
) -> tuple[FloatArray, bool]:
    """Sizes at which the sheets are counted as at all smaller ones; whether there are any everywhere."""
    stops = np.linspace(0, s[-1], int(np.clip(s[-1] + 2, 5, 40)))
    if exit_start or exit_end:
        stops = np.unique(np.concatenate([stops, s[-1] * np.array([0.005, 0.02, 0.05, 0.95, 0.98, 0.995])]))
    stops = stops[local.heights(arc.places(np.interp(stops, s, t))) < FOLLOWED]
    if not len(stops):
        return h, True
    parameters, sizes = np.interp(stops, s, t), np.interp(stops, s, h)
    places, tangents = arc.places(parameters), arc.tangents(parameters)
    circles = [Circle(*parts) for parts in zip(places, *frame(tangents), sizes.tolist(), strict=True)]
    found = stable(local, circles, 1e-3)[0]
    radii = [circle.radius if circle else 0.02 * size for circle, size in zip(found, sizes, strict=True)]
    return _smooth(np.minimum(h, np.interp(s, stops, radii)), s), None not in found
