"""Which stretches of singular curves need no tetrahedra: those whose sheets, a few cells from the curve, are so far
apart that the sweep tells them from each other.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.arc import Arc, nearest_other
from implicit.polygonizers.conforming.curves.ring import Circles, Rings, counts, rings
from implicit.polygonizers.conforming.curves.stations import Stations, gaps
from implicit.polygonizers.conforming.curves.zone import Stretch
from implicit.polygonizers.conforming.local import Local, frame, unit_rows
from implicit.polygonizers.conforming.points.ball import Ball

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

_INNER = 1 / 9
"""Nearer to the curve, at this share of the radius, sheets lie at the same angles."""
_STRAIGHT = 0.25
"""Angles that differ by less are nearly the same."""
_SCALES = np.array([1 / 3, 1 / 64])
"""Rings with these shares of the radius are crossed as often as the whole."""
_LEAST_RADIUS = 1.8
"""The radius of a zone, in cells: more than the diagonal of a cell, so that the sweep is not misled outside."""
_GAP = 1.8
"""Sheets are so many cells apart outside the zone: then no cell meets two."""
_NEARLY = 0.97
"""This share of it will do: the diagonal of a cell is shorter yet."""
_WIDEST = 7.0
"""Where a zone would be wider, in cells, there are tetrahedra."""
_TRIES = 3
"""Rings that are tried for a radius."""
_WIDENING = 0.5
"""Radii change by so much per length at most."""
_APART = 1.7
"""So many cells lie between a zone and other curves."""
_CLEAR = 0.5
"""So many cells lie between a zone and a ball, and between an open end and the bounds."""
_BEND = 0.35
"""Over the radius of the zone the curve turns by less."""
_OVERLAP = 0.3
"""At an end that is not open, tetrahedra go on so many cells after the zone has its full radius."""
_LEAST = 2.0
"""A stretch is worth it where it spares tetrahedra over so many cells."""


def find_stretches(local: Local, courses: list[Stations], arcs: list[Arc], balls: list[Ball]) -> list[Stretch]:
    """The stretches of courses, in order. A closed one is taken whole or not at all."""
    if not courses:
        return []
    sheets, radii = _sheets(local, courses)
    ends = np.cumsum([len(course.places) for course in courses])[:-1]
    result = []
    for course, number, radius in zip(courses, np.split(sheets, ends), np.split(radii, ends), strict=True):
        room = _room(course, arcs, balls)
        result += (_round if course.arc.closed else _between)(local, course, number, radius, room)
    return result


def _round(local: Local, course: Stations, sheets: IntArray, radii: FloatArray, room: FloatArray) -> list[Stretch]:
    """The whole of a closed course, if it is a stretch."""
    radii = np.full(len(radii), radii.max())
    if (sheets < 0).any() or (sheets != sheets[0]).any() or (radii > room).any():
        return []
    return [Stretch(course, 0, course.last, int(sheets[0]), radii, (True, True), (0, course.last))]


def _between(local: Local, course: Stations, sheets: IntArray, radii: FloatArray, room: FloatArray) -> list[Stretch]:
    """The stretches of a course that has ends, made shorter until their zones have room."""
    free = local.heights(course.places[[0, -1]]) > radii[[0, -1]] + _CLEAR
    good = (sheets >= 0) & (room > 0)
    while True:
        found = [_stretch(course, first, last, int(sheets[first]), radii, free) for first, last in _runs(good, sheets)]
        tight = [stretch.first + np.flatnonzero(stretch.radii > stretch.within(room)) for stretch in found if stretch]
        if not any(len(rows) for rows in tight):
            return [stretch for stretch in found if stretch]
        good[np.concatenate(tight)] = False


def _ways(course: Stations) -> FloatArray:
    """The tangents (n, 3) at stations, of any length."""
    places = course.places
    before, after = np.roll(places, 1, axis=0), np.roll(places, -1, axis=0)
    if course.arc.closed:  # the last station is the first
        before[0], after[-1] = places[-2], places[1]
    else:
        before[0], after[-1] = places[0], places[-1]
    return after - before


def _sheets(local: Local, courses: list[Stations]) -> tuple[IntArray, FloatArray]:
    """How many sheets (n,) there are round each station of all courses, -1 where they are too near to each other, or
    not the same nearer to the curve; and the radius outside which no cell meets two.
    """
    places = np.concatenate([course.places for course in courses])
    axes = frame(unit_rows(np.concatenate([_ways(course) for course in courses])))
    circles = Circles(places, *axes, np.full(len(places), _LEAST_RADIUS))
    radii, outer, inner = _clear_of_cells(local, circles)
    sheets = np.full(len(places), -1)
    rows = np.flatnonzero(radii < np.inf)
    number, same = _alike(*(Rings(part.number[rows], part.angles[rows]) for part in (outer, inner)))
    factors = radii[rows, None] / _LEAST_RADIUS * _SCALES
    smaller = circles.scaled(np.repeat(rows, len(_SCALES)), factors.ravel())
    crossed, seen = (part.reshape(factors.shape) for part in counts(local, smaller))
    same &= ((crossed == number[:, None]) | ~seen).all(axis=1)
    sheets[rows] = np.where(same, number, -1)
    return sheets, radii


def _clear_of_cells(local: Local, circles: Circles) -> tuple[FloatArray, Rings, Rings]:
    """The least radii (n,) at which sheets are so far apart that no cell meets two, infinite where a zone would be too
    wide, and the angles of the sheets on rings of these radii and on inner ones.

    The distance of two sheets is taken for a power of the radius, as it is of straight sheets and of cusps; where a
    ring does not bear it out, for a multiple.
    """
    radii = circles.radius.copy()
    outer, inner = _rings(local, circles, np.arange(len(radii)), radii)
    gaps, nearer = (np.maximum(np.sin(_least_angles(found)), 1e-9) for found in (outer, inner))
    left = np.flatnonzero(_LEAST_RADIUS * gaps < _GAP)
    power = 1 - np.log(gaps[left] / nearer[left]) / np.log(_INNER)
    radii[left] *= (_GAP / _LEAST_RADIUS / gaps[left]) ** (1 / power.clip(1, None))
    for _ in range(_TRIES):
        left = left[radii[left] <= _WIDEST]
        if not len(left):
            break
        fresh = _rings(local, circles, left, radii[left])
        outer, inner = (known.replaced(left, more) for known, more in zip((outer, inner), fresh, strict=True))
        gap = radii[left] * np.sin(_least_angles(fresh[0]))
        near = gap < _NEARLY * _GAP
        left, gap = left[near], gap[near]
        radii[left] *= _GAP / np.maximum(gap, 1e-9)
    radii[left] = np.inf
    return np.where(radii > _WIDEST, np.inf, radii), outer, inner


def _rings(local: Local, circles: Circles, rows: IntArray, radii: FloatArray) -> tuple[Rings, Rings]:
    """Where some of the circles are crossed, with these radii, and inner ones."""
    factors = radii / circles.radius[rows]
    found = rings(local, circles.scaled(np.tile(rows, 2), np.append(factors, _INNER * factors)))
    outer, inner = slice(0, len(rows)), slice(len(rows), None)
    return Rings(found.number[outer], found.angles[outer]), Rings(found.number[inner], found.angles[inner])


def _least_angles(found: Rings) -> FloatArray:
    """The least angle (n,) between neighbours on each ring, at most a right one."""
    least = np.full(len(found.number), np.pi / 2)
    for sheets in np.unique(found.number[found.number > 0]):
        rows = np.flatnonzero(found.number == sheets)
        angles = found.angles[rows, :sheets]
        least[rows] = np.diff(angles, append=angles[:, :1] + 2 * np.pi).min(axis=1).clip(0, np.pi / 2)
    return least


def _alike(outer: Rings, inner: Rings) -> tuple[IntArray, Mask]:
    """How many angles (n,) there are on each outer ring, and whether they are nearly the same on the inner one."""
    same = outer.number == inner.number
    for sheets in np.unique(outer.number[same & (outer.number > 0)]):
        rows = np.flatnonzero(same & (outer.number == sheets))
        out, near = (found.angles[rows, :sheets] for found in (outer, inner))
        turns = np.array([np.abs((np.roll(near, k, axis=1) - out + np.pi) % (2 * np.pi) - np.pi) for k in (-1, 0, 1)])
        same[rows] = turns.max(axis=2).min(axis=0) < _STRAIGHT
    return outer.number, same


def _room(course: Stations, arcs: list[Arc], balls: list[Ball]) -> FloatArray:
    """The radius (n,) that a zone may have at each station: no other curve is near, no other part of the same, no ball,
    and the curve is nearly straight.
    """
    places, lengths = course.places, course.lengths
    result = gaps(places, lengths, course.arc.closed) - _APART
    result = np.minimum(result, nearest_other(arcs, course.number, places, _WIDEST + _APART) - _APART)
    for ball in balls:
        result = np.minimum(result, np.linalg.norm(places - ball.center, axis=1) - ball.radius - _CLEAR)
    way = unit_rows(np.diff(places, axis=0))
    ahead = np.roll(way, -1, axis=0) if course.arc.closed else np.concatenate([way[1:], way[-1:]])
    straight = _BEND * np.diff(lengths) / np.maximum(np.linalg.norm(ahead - way, axis=1), 1e-9)
    return np.minimum(result, np.minimum(np.append(straight, np.inf), np.insert(straight, 0, np.inf)))


def _runs(good: Mask, sheets: IntArray) -> Iterator[tuple[int, int]]:
    """The first and last rows of runs of good stations with the same number of sheets."""
    name = np.where(good, sheets, -1)
    cuts = np.flatnonzero(np.diff(name)) + 1
    for first, last in zip([0, *cuts], [*(cuts - 1), len(name) - 1], strict=True):
        if name[first] >= 0:
            yield int(first), int(last)


def _stretch(course: Stations, first: int, last: int, sheets: int, radii: FloatArray, free: Mask) -> Stretch | None:
    """The stretch from row `first` to row `last`, if it is worth it; free (2,): which ends of the course are."""
    s = course.lengths[first : last + 1]
    radii = _widened(s, radii[first : last + 1])
    start, end = bool(first == 0 and free[0]), bool(last == course.last and free[1])
    beyond = radii + _OVERLAP if sheets else np.zeros(len(s))  # no sheets, nothing to be cut off
    sparing = np.flatnonzero((start | (s - s[0] >= beyond)) & (end | (s[-1] - s >= beyond)))
    low, high = (int(sparing[0]), int(sparing[-1])) if len(sparing) else (0, 0)
    if s[high] - s[low] < _LEAST:
        return None
    pointed = np.minimum(np.inf if start else s - s[0], np.inf if end else s[-1] - s)
    return Stretch(course, first, last, sheets, np.minimum(radii, pointed), (start, end), (first + low, first + high))


def _widened(s: FloatArray, radii: FloatArray) -> FloatArray:
    """The least radii (n,) above these that change so slowly along lengths s (n,)."""
    up = np.maximum.accumulate(radii + _WIDENING * s) - _WIDENING * s
    down = np.maximum.accumulate((radii - _WIDENING * s)[::-1])[::-1] + _WIDENING * s
    return np.maximum(up, down)
