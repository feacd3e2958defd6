"""Zones round stretches of singular curves, in which no triangle of the sweep or of tetrahedra stays.

A zone has the radius r(s) at length s along its curve: so many cells that outside no cell meets two sheets, and less
towards an end where tetrahedra go on, so that it begins in a station of the curve.
"""

#          ________________________
#         /                        \         r
#   -----*--------------------------*-----   the curve, and tetrahedra round it beyond both ends of the zone
#         \________________________/

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.curves.stations import Stations
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.tetrahedra.region import cells_round
from implicit.polygonizers.steps import step_onto

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BEYOND = 1.0
"""So many cells outside zones it is known how far a place is."""
RIM = 0.3
"""The rims of a mesh that was cut are less than so many cells away from the boundary of the zone."""
_ASIDE = 0.4
"""A place is at most so much farther from a station than from the curve, and radii differ by less on the way."""
_STEPS = 8
_EXACT = 1e-9
"""The last step across a curve, in cells."""
_FARTHEST = 0.3
"""The longest step across a curve, in cells."""
_NEIGHBOURS = 4
"""The nearest edge of a curve is among so many with the nearest middles."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """The stations from row `first` to row `last` of an arc, between which so many sheets are apart outside a zone.

    radii (n,): of the zone at each. open: whether nothing goes on beyond each end. bare: the rows between which no
    tetrahedra are needed.
    """

    course: Stations
    first: int
    last: int
    sheets: int
    radii: FloatArray
    open: tuple[bool, bool]
    bare: tuple[int, int]

    @property
    def closed(self) -> bool:
        """Whether it goes round."""
        return self.course.arc.closed

    def within(self, rows: NDArray[Any]) -> NDArray[Any]:
        """What belongs to its stations of something that all those of the arc have."""
        return rows[self.first : self.last + 1]

    @property
    def places(self) -> FloatArray:
        """Its stations (n, 3)."""
        return self.within(self.course.places)

    @property
    def lengths(self) -> FloatArray:
        """The length along the arc at each of them."""
        return self.within(self.course.lengths)


@dataclass(frozen=True, eq=False)
class Zones:
    """The zones of several stretches."""

    stretches: Sequence[Stretch]

    @cached_property
    def _edges(self) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
        """Of all edges of the curves where they begin and lead to (n, 3), whose they are, and lengths and radii
        (n, 2, 2) at their ends.
        """
        parts = self.stretches
        owner = np.repeat(np.arange(len(parts)), [part.last - part.first for part in parts])
        starts = np.concatenate([part.places[:-1] for part in parts])
        ways = np.concatenate([np.diff(part.places, axis=0) for part in parts])
        ends = [np.stack([part.lengths, part.radii], axis=1) for part in parts]
        return starts, ways, np.concatenate([np.stack([end[:-1], end[1:]], axis=1) for end in ends]), owner

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._edges[0] + self._edges[1] / 2)

    def cells(self, size: IntArray) -> IntArray:
        """The cells (n, 3) of a lattice round the zones: those and the ones beside them hold all rims."""
        found = [np.zeros((0, 3), np.int64)]
        for part in self.stretches:
            reach = np.ceil(part.radii + RIM + _ASIDE).astype(np.int64) - 1
            found += [cells_round(part.places[reach == cells], int(cells), size) for cells in np.unique(reach)]
        return np.concatenate(found)

    def measure(self, places: FloatArray) -> "Feet":
        """The feet of places (n, 3) on the curves."""
        count = len(places)
        owner, along, depth = np.full(count, -1), np.zeros(count), np.full(count, -_BEYOND)
        foot, way = places.copy(), np.zeros((count, 3))
        if not self.stretches or not count:
            return Feet(owner, along, depth, foot, way)
        starts, ways, ends, whose = self._edges
        farthest = float(ends[..., 1].max() + np.linalg.norm(ways, axis=1).max() / 2) + _BEYOND
        edges = self._tree.query(places, k=list(range(1, _NEIGHBOURS + 1)), distance_upper_bound=farthest)[1]
        near = np.flatnonzero(edges[:, 0] < len(starts))
        edge, share, away = self._nearest(places[near], edges[near])
        share = share[:, None]
        owner[near], way[near], foot[near] = whose[edge], unit(ways)[edge], starts[edge] + share * ways[edge]
        along[near], radius = ((1 - share) * ends[edge, 0] + share * ends[edge, 1]).T
        depth[near] = np.maximum(radius - away, -_BEYOND)
        return Feet(owner, along, depth, foot, way)

    def _nearest(self, places: FloatArray, edges: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Which of some edges (n, k) is nearest to each place (n, 3), the share of it before the foot, and how far away
        that is. Edges that do not exist come last, and never first.
        """
        starts, ways, _, _ = self._edges
        square = np.einsum("ij,ij->i", ways, ways)
        best, share, away = edges[:, 0], np.zeros(len(places)), np.full(len(places), np.inf)
        for column in edges.T:  # a few long arrays are several times as fast as many short rows
            edge = np.where(column < len(starts), column, edges[:, 0])
            rest, way = (places - starts[edge]).T, ways[edge].T
            part = ((rest[0] * way[0] + rest[1] * way[1] + rest[2] * way[2]) / square[edge]).clip(0, 1)
            rest -= part * way
            distance = np.sqrt(rest[0] ** 2 + rest[1] ** 2 + rest[2] ** 2)
            nearer = distance < away
            best, share, away = (np.where(nearer, *p) for p in ((edge, best), (part, share), (distance, away)))
        return best, share, away

    def depth(self, places: FloatArray) -> FloatArray:
        """How deep (n,) places (n, 3) are inside, in cells, negative outside."""
        return self.measure(places).depth


@dataclass(frozen=True, eq=False)
class Feet:
    """The nearest points of stretches to some places: which stretch, -1 where none is near; the length along it; how
    deep the place is inside the zone, negative outside; the foot (n, 3) itself, and the unit tangent (n, 3) there.
    """

    owner: IntArray
    along: FloatArray
    depth: FloatArray
    foot: FloatArray
    way: FloatArray


@dataclass(frozen=True, eq=False)
class ZoneRim:
    """The curves where f = 0 leaves the zones. What lies in them counts as outside, and is cut off."""

    zones: Zones
    local: Local

    @property
    def cell(self) -> float:
        """The length of the cells."""
        return self.local.grid.step

    def heights(self, points: FloatArray) -> FloatArray:
        """How deep (n,) points (n, 3) are inside."""
        return self.cell * self.zones.depth(self.local.grid.to_units(points))

    def reach(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points moved to where f = 0 leaves the zone, by Newton's steps across the curve, and unit normals."""
        units = self.local.grid.to_units(points)
        feet = self.zones.measure(units)
        away = np.linalg.norm(units - feet.foot, axis=1)
        radius = np.where(away + feet.depth > 0, away + feet.depth, away)  # places behind a pointed end stay there
        for _ in range(_STEPS):
            out = unit(units - feet.foot)
            aside = np.cross(feet.way, out)
            on = feet.foot + radius[:, None] * out
            value, slope = self.local.gradients(on)
            with np.errstate(all="ignore"):
                step = np.nan_to_num(-value / np.einsum("ij,ij->i", slope, aside))
            step = step.clip(-_FARTHEST, _FARTHEST)
            units = on + step[:, None] * aside
            if (np.abs(step) < _EXACT).all():
                break
        return self.onto(self.local.grid.to_points(units))

    def onto(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points (n, 3) moved to f = 0 along the gradient, and unit normals there."""
        points = step_onto(self.local.field, points, self.cell)
        return points, unit(self.local.field.gradients(points)[1])
