"""Zones round stretches of singular curves, in which no triangle of the sweep or of tetrahedra stays.

A zone has the radius r(s) at length s along its curve: so many cells that outside no cell meets two sheets, and less
towards an end where tetrahedra go on, so that it begins in a station of the curve.
"""

#          ________________________
#         /                        \         r
#   -----*--------------------------*-----   the curve, and tetrahedra round it beyond both ends of the zone
#         \________________________/

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.evaluate import Field
from implicit.kernels.elementary import OPTIONS
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
    def _edges(self) -> tuple[FloatArray, IntArray]:
        """Of all edges of the curves where they begin, the way to their ends and its direction, the square of its
        length, and lengths and radii at both ends (n, 14); and whose they are.
        """
        parts = self.stretches
        owner = np.repeat(np.arange(len(parts)), [part.last - part.first for part in parts])
        starts = np.concatenate([part.places[:-1] for part in parts])
        ways = np.concatenate([np.diff(part.places, axis=0) for part in parts])
        ends = [np.stack([part.lengths, part.radii], axis=1) for part in parts]
        before, after = (np.concatenate([end[some] for end in ends]) for some in (slice(-1), slice(1, None)))
        return np.column_stack([starts, ways, unit(ways), np.einsum("ij,ij->i", ways, ways), before, after]), owner

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._edges[0][:, :3] + self._edges[0][:, 3:6] / 2)

    def cells(self, size: IntArray) -> IntArray:
        """The cells (n, 3) of a lattice round the zones: those and the ones beside them hold all rims."""
        places = np.concatenate([np.zeros((0, 3)), *(part.places for part in self.stretches)])
        radii = np.concatenate([np.zeros(0), *(part.radii for part in self.stretches)])
        reach = np.ceil(radii + RIM + _ASIDE).astype(np.int64) - 1
        found = [cells_round(places[reach == cells], int(cells), size) for cells in np.unique(reach)]
        return np.concatenate([np.zeros((0, 3), np.int64), *found])

    def measure(self, places: FloatArray) -> "Feet":
        """The feet of places (n, 3) on the curves."""
        owner = np.full(len(places), -1)
        found = np.column_stack([np.zeros(len(places)), np.full(len(places), -_BEYOND), places, np.zeros(places.shape)])
        if self.stretches and len(places):
            edges, whose = self._edges
            farthest = float(edges[:, (11, 13)].max() + np.sqrt(edges[:, 9].max()) / 2) + _BEYOND
            near = self._tree.query(places, k=list(range(1, _NEIGHBOURS + 1)), distance_upper_bound=farthest)[1]
            _find_feet(near, edges, whose, owner, found)
        return Feet(owner, found[:, 0], found[:, 1], found[:, 2:5], found[:, 5:])

    def depth(self, places: FloatArray) -> FloatArray:
        """How deep (n,) places (n, 3) are inside, in cells, negative outside."""
        return self.measure(places).depth


@njit(**OPTIONS)
def _find_feet(near: Any, edges: Any, whose: Any, owner: Any, found: Any) -> None:
    """The nearest of some edges to each place, of which those that do not exist come last, and never first.

    found (n, 8): the length along the curve, how deep the place is, the place itself, which its foot replaces, and the
    direction there.
    """
    for row in range(len(near)):
        best, least, part, place = -1, np.inf, 0.0, found[row]
        for k in range(near.shape[1]):
            if near[row, k] < len(edges):
                edge = edges[near[row, k]]
                x, y, z = place[2] - edge[0], place[3] - edge[1], place[4] - edge[2]
                share = min(max((x * edge[3] + y * edge[4] + z * edge[5]) / edge[9], 0.0), 1.0)
                x, y, z = x - share * edge[3], y - share * edge[4], z - share * edge[5]
                away = math.sqrt(x * x + y * y + z * z)
                if away < least:
                    best, least, part = near[row, k], away, share
        if best >= 0:
            edge = edges[best]
            owner[row] = whose[best]
            place[0] = (1 - part) * edge[10] + part * edge[12]
            place[1] = max((1 - part) * edge[11] + part * edge[13] - least, place[1])
            for axis in range(3):
                place[2 + axis] = edge[axis] + part * edge[3 + axis]
                place[5 + axis] = edge[6 + axis]


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
    def field(self) -> Field:
        """The field of f."""
        return self.local.field

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
