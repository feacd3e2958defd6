"""Arcs of singular curves: between special points, closed, or out of the bounds."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.conforming.local import Local

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SPACING = 0.2
"""Nodes of an arc are at most so many cells apart."""
_CHORDS = 60
_REACHED = 1e-13
"""A parameter is found when its place is so near to where it should be, in cells."""
_EXACT = 1e-10
"""A gradient that counts as none, as a share of those a cell away."""


@dataclass(frozen=True, eq=False)
class Arc:
    """A curve through `nodes` (n, 3), in lattice units, with a parameter that counts nodes.

    start, end: rows of the special points at its ends, -1 where there is none. curve: the row of the singular curve.
    """

    local: Local
    nodes: FloatArray
    closed: bool
    start: int
    end: int
    curve: int

    @property
    def last(self) -> float:
        """The parameter of the last node."""
        return float(len(self.nodes) - 1)

    @cached_property
    def lengths(self) -> FloatArray:
        """The length (n,) from the start to each node."""
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.nodes, axis=0), axis=1)))

    @cached_property
    def tree(self) -> cKDTree:
        """The nodes, to look for those near a point."""
        return cKDTree(self.nodes, balanced_tree=False, compact_nodes=False)

    def places(self, parameters: FloatArray) -> FloatArray:
        """Points (n, 3) of the singular curve at parameters (n,)."""
        t = parameters % self.last if self.closed else np.clip(parameters, 0, self.last)
        row = np.minimum(t.astype(np.int64), len(self.nodes) - 2)
        a, b = self.nodes[row], self.nodes[row + 1]
        exact = t == row
        chord = np.where(exact[:, None], a, a + (b - a) * (t - row)[:, None])
        result = project(self.local, chord)
        missed = np.isnan(result[:, 0])
        nearest = np.where((t - row < 0.5)[:, None], a, b)
        return np.where(missed[:, None], nearest, result)

    def where(self, height: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
        """The parameters (n,) between `low` and `high` (n,) where a function of places (n, 3), of different sign there,
        vanishes: by the chord between them, with the value at an end halved that stays twice (Illinois).
        """
        at_low, at_high = height(self.places(low)), height(self.places(high))
        for _ in range(_CHORDS if len(low) else 0):
            drop = at_low - at_high
            share = np.divide(at_low, drop, out=np.full(len(low), 0.5), where=drop != 0)
            middle = low + share * (high - low)
            value = height(self.places(middle))
            turn = (value < 0) != (at_high < 0)
            low, at_low = np.where(turn, high, low), np.where(turn, at_high, at_low / 2)
            high, at_high = middle, value
            if (np.abs(value) < _REACHED).all():
                break
        return high

    def tangents(self, parameters: FloatArray) -> FloatArray:
        """Unit tangents (n, 3) at parameters (n,)."""
        t = parameters % self.last if self.closed else np.clip(parameters, 0, self.last - 1e-9)
        row = np.minimum(t.astype(np.int64), len(self.nodes) - 2)
        way = self.nodes[row + 1] - self.nodes[row]
        return np.asarray(way / np.linalg.norm(way, axis=1, keepdims=True))


def project(local: Local, points: FloatArray) -> FloatArray:
    """The points (n, 3) moved to where grad f = 0 by Newton's steps of least length; nan where that does not work."""
    typical = _typical(local, points)
    start = points
    slopes = local.gradients(points)[1]
    for _ in range(30):
        wrong = np.flatnonzero(np.linalg.norm(slopes, axis=1) > 1e-3 * _EXACT * typical)
        if not len(wrong):
            break
        inverse = np.linalg.pinv(local.hessians(points[wrong]), rcond=1e-3)
        moved = points[wrong] - np.einsum("nij,nj->ni", inverse, slopes[wrong])
        fresh = local.gradients(moved)[1]
        better = np.linalg.norm(fresh, axis=1) < np.linalg.norm(slopes[wrong], axis=1)
        if not better.any():
            break
        points, slopes = points.copy(), slopes.copy()
        points[wrong[better]], slopes[wrong[better]] = moved[better], fresh[better]
    bad = (np.linalg.norm(slopes, axis=1) > _EXACT * typical) | (np.linalg.norm(points - start, axis=1) > 0.3)
    return np.where(bad[:, None], np.nan, points)


def _typical(local: Local, points: FloatArray) -> FloatArray:
    """The mean gradient a cell away from each point; most of those may be on singular curves, and have none."""
    around = points[:, None] + np.concatenate([np.eye(3), -np.eye(3)])
    return np.asarray(np.linalg.norm(local.gradients(around)[1], axis=2).mean(axis=1))


def nearest_other(arcs: list[Arc], number: int, places: FloatArray, most: float) -> FloatArray:
    """How far (n,) nodes of other arcs than one of these are from places (n, 3), infinite where that is more."""
    result = np.full(len(places), np.inf)
    for other, arc in enumerate(arcs):
        if other != number:
            result = np.minimum(result, arc.tree.query(places, distance_upper_bound=most)[0])
    return result


def find_arcs(local: Local, polylines: list[tuple[FloatArray, bool]], special: FloatArray, beyond: float) -> list[Arc]:
    """The arcs of curves (nodes, closed) up to so many cells beyond the bounds, split at the special points (k, 3)."""
    arcs: list[Arc] = []
    for number, (nodes, closed) in enumerate(polylines):
        line = nodes
        if closed and np.linalg.norm(line[0] - line[-1]) > 1e-9:
            line = np.concatenate([line, line[:1]])
        line = _dense(local, line)
        stops = np.full(len(line), -1)
        for row, point in enumerate(special):
            stops[np.linalg.norm(line - point, axis=1) < 1e-6] = row
        if closed and (stops >= 0).any():
            turn = int(np.argmax(stops >= 0))
            line = np.concatenate([line[turn:-1], line[: turn + 1]])
            stops = np.concatenate([stops[turn:-1], stops[: turn + 1]])
            closed = False
        inside = local.heights(line) < beyond
        closed = closed and bool(inside.all())
        breaks = np.flatnonzero((stops[1:-1] >= 0) | ~inside[1:-1]) + 1
        cuts = [0, *breaks.tolist(), len(line) - 1]
        for first, last in pairwise(cuts):
            if inside[first : last + 1].any() and last > first + 1:
                piece = line[first : last + 1]
                arcs.append(Arc(local, piece, closed, int(stops[first]), int(stops[last]), number))
    return arcs


def _dense(local: Local, line: FloatArray) -> FloatArray:
    """The polyline without repeated nodes, and with more on the curve between those that are far apart."""
    a, way = line[:-1], np.diff(line, axis=0)
    count = np.ceil(np.linalg.norm(way, axis=1) / _SPACING).astype(np.int64)
    between = np.repeat(np.arange(len(count)), np.maximum(count - 1, 0))
    share = (1 + np.arange(len(between)) - np.searchsorted(between, between)) / count[between]
    moved = project(local, a[between] + share[:, None] * way[between])
    found = ~np.isnan(moved[:, 0])
    nodes = np.append(True, count > 0)
    places = np.append(np.flatnonzero(nodes), (between + share)[found])
    return np.concatenate([line[nodes], moved[found]])[np.argsort(places)]
