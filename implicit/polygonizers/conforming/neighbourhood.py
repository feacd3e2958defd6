"""The neighbourhood of the singular points and curves that no block of cells serves: balls, tubes, tetrahedra."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.clip import Rim
from implicit.polygonizers.conforming.check import hidden
from implicit.polygonizers.conforming.curves.arc import Arc, find_arcs
from implicit.polygonizers.conforming.curves.repeats import CLOSE, apart, beside_arcs, without_repeats
from implicit.polygonizers.conforming.curves.stations import FOLLOWED, Stations, find_stations
from implicit.polygonizers.conforming.curves.stretch import find_stretches
from implicit.polygonizers.conforming.curves.tube import Tube, surround
from implicit.polygonizers.conforming.curves.zone import Zones
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.points.ball import Ball, find_ball
from implicit.polygonizers.conforming.tetrahedra.patch import Patch
from implicit.polygonizers.conforming.tetrahedra.refine import mesh_region
from implicit.polygonizers.conforming.tetrahedra.region import Region
from implicit.polygonizers.conforming.tetrahedra.skeleton import Skeleton, build_skeleton

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_RETRIES = 3
_THINNER = 0.5
"""Tubes become thinner by so much where they are in the way."""
_WORSE = 3
"""Where thinner tubes leave so many times as much in doubt, still thinner ones are not tried."""
_MOST_SEEDS = 300
"""If the sweep is too coarse in more places than these, nothing is tried."""
_HALF = 3**0.5 / 2
"""Half the diagonal of a cell."""
_ONCE = 1e-6
"""Walls that are passed so near to each other, as a share of a step between nodes, are passed together."""


@dataclass(frozen=True, eq=False)
class Frame:
    """What does not depend on seeds: arcs with the parameters `stops` of the walls, and balls round special points.

    doubtful: the special points whose ball is uncertain.
    """

    special: FloatArray
    arcs: list[Arc]
    stops: list[FloatArray]
    balls: list[Ball]
    doubtful: list[FloatArray]


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """A patch of tetrahedra with its skeleton, and zones for ribbons; courses: the stations of all arcs.

    limits: places (n, 4) where tubes had to be thinner, with their radius. doubtful (n, 3): places in lattice units, of
    the patch and of the skeleton. There is no patch where zones are enough.
    """

    patch: Patch | None
    skeleton: Skeleton
    frame: Frame
    courses: list[Stations]
    zones: Zones
    limits: list[FloatArray]
    doubtful: FloatArray

    def holds(self, cells: IntArray) -> NDArray[np.bool_]:
        """Which cells (n, 3) belong to the patch, or lie in a zone; those with a curve of a zone do."""
        deep = self.zones.depth(np.asarray(cells + 0.5)) > _HALF
        return np.asarray(deep | self.patch.region.holds(cells)) if self.patch else deep

    def takes(self, places: FloatArray) -> NDArray[np.bool_]:
        """Which places (n, 3) the patch or a zone takes in."""
        return self.holds(np.floor(places).astype(np.int64)) | (self.zones.depth(places) > 0)

    @property
    def cells(self) -> IntArray:
        """The cells (n, 3) of the patch."""
        return self.patch.region.cells if self.patch else np.zeros((0, 3), np.int64)

    def threads(self, first: int) -> tuple[list[IntArray], FloatArray]:
        """The numbers of the stations of each course, where those of the skeleton begin at `first`; and the places of
        those that come after the skeleton's.
        """
        more: list[FloatArray] = [np.zeros((0, 3))]
        numbers = []
        fresh = first + len(self.skeleton.on)
        for course in self.courses:
            number = np.full(len(course.places), -1)
            for tube, stations in zip(self.skeleton.tubes, self.skeleton.stations, strict=True):
                if tube.course is course:
                    number[tube.first : tube.last + 1] = first + stations
            last = len(number) - course.arc.closed
            bare = np.flatnonzero(number[:last] < 0)
            number[bare] = fresh + np.arange(len(bare))
            fresh += len(bare)
            more.append(course.places[bare])
            number[last:] = number[0]
            numbers.append(number)
        return numbers, np.concatenate(more)


def find_frame(
    local: Local,
    special: FloatArray,
    polylines: list[tuple[FloatArray, bool]],
    beyond: float,
    rng: np.random.Generator,
) -> Frame:
    """The arcs and balls of special points (k, 3) and curves; curves go on `beyond` cells past the walls."""
    alone = apart(special, CLOSE)
    points = special[alone]
    arcs, repeated = without_repeats(find_arcs(local, polylines, points, beyond))
    doubtful = [*special[~alone], *repeated]
    balls = []
    for row, beside in enumerate(beside_arcs(points, arcs)):
        ball = None if beside else find_ball(local, row, points, arcs, _room(local, points[row]), rng)
        if ball is None or not ball.stable:
            doubtful.append(points[row])
        if ball is not None:
            balls.append(ball)
    return Frame(special, arcs, [_wall_parameters(local, arc) for arc in arcs], balls, doubtful)


def mesh_neighbourhood(
    local: Local, special: FloatArray, polylines: list[tuple[FloatArray, bool]], beyond: float, seeds: FloatArray,
    coarse: FloatArray, before: Neighbourhood | None, whole: frozenset[int],
) -> Neighbourhood:  # fmt: skip
    """The mesh round special points (k, 3), curves and seeds (n, 3), in lattice units.

    Curves go on `beyond` cells past the walls; seeds are further vertices. What was found `before` with fewer seeds
    is where the search for more vertices starts, if the special points are the same. whole: arcs without zones.
    coarse (n, 3): places that are seeds too, if all that matters else is refined and they are not taken in.
    """
    rng = np.random.default_rng(5)
    same = before is not None and np.array_equal(before.frame.special, special)
    frame = before.frame if before is not None and same else find_frame(local, special, polylines, beyond, rng)
    limits = list(before.limits) if before is not None and same else []
    if before is not None and same and before.patch:
        skeleton = replace(before.skeleton, around=before.patch.around)
        skeleton.add(seeds)
        further = partial(_lacking, local, before.zones, coarse)
        again = mesh_region(local, skeleton, before.zones, rng, further, before.patch)
        if not len(again.doubtful):
            return _conclude(again, skeleton, frame, before.courses, before.zones, limits)
    best: Neighbourhood | None = None
    for turn in range(_RETRIES + 1):
        courses, zones, tubes = _surroundings(local, frame, limits, whole, rng)
        skeleton = build_skeleton(frame.balls, tubes, rng)
        skeleton.add(seeds[zones.depth(seeds) <= 0])
        patch, further = None, partial(_lacking, local, zones, coarse)
        if len(skeleton.on) + len(skeleton.around):
            patch = mesh_region(local, skeleton, zones, rng, further)
        found = _conclude(patch, skeleton, frame, courses, zones, list(limits))
        best = found if best is None or len(found.doubtful) < len(best.doubtful) else best
        hopeless = bool(frame.doubtful) or not all(course.settled for course in courses)
        hopeless |= len(found.doubtful) > _WORSE * len(best.doubtful)
        if not patch or not len(patch.doubtful) or not len(patch.blocked) or not courses or hopeless:
            break
        sizes = np.minimum(0.3 * 0.5**turn, _THINNER * _sizes_at(courses, patch.blocked))
        limits.append(np.column_stack([patch.blocked, sizes]))
    assert best is not None
    return best


def _sizes_at(courses: list[Stations], places: FloatArray) -> FloatArray:
    """The sizes (n,) of rings at the stations nearest to places (n, 3)."""
    stations = np.concatenate([course.places for course in courses])
    return np.concatenate([course.sizes for course in courses])[cKDTree(stations).query(places)[1]]


def can_be_tried(local: Local, seeds: FloatArray) -> bool:
    """Whether there are few places, and it is proved that nothing is singular in their cells."""
    few = len(seeds) <= _MOST_SEEDS
    return few and not len(hidden(local.field, local.grid, np.unique(np.floor(seeds).astype(np.int64), axis=0)))


def _lacking(local: Local, zones: Zones, coarse: FloatArray, region: Region) -> FloatArray:
    """The places (n, 3) that neither a region nor a zone takes in, if they can be tried."""
    beyond = coarse[~region.holds(np.floor(coarse).astype(np.int64))]
    beyond = beyond[zones.depth(beyond) <= 0]
    return beyond if can_be_tried(local, beyond) else beyond[:0]


def _conclude(
    patch: Patch | None, skeleton: Skeleton, frame: Frame, courses: list[Stations], zones: Zones,
    limits: list[FloatArray],
) -> Neighbourhood:  # fmt: skip
    """All that was found, with every place that is doubtful."""
    unsettled = [place for course in courses if not course.settled for place in course.places]
    doubtful = np.array(frame.doubtful + unsettled).reshape(-1, 3)
    places = np.concatenate([doubtful, patch.doubtful if patch else doubtful[:0], _uneven(skeleton, zones)])
    return Neighbourhood(patch, skeleton, frame, courses, zones, limits, places)


def _surroundings(
    local: Local, frame: Frame, limits: list[FloatArray], whole: frozenset[int], rng: np.random.Generator
) -> tuple[list[Stations], Zones, list[Tube]]:
    """The stations of all arcs, zones along them, and tubes where zones do not do, within the limits."""
    arcs = frame.arcs
    found = [find_stations(local, k, arcs, frame.balls, frame.stops[k], limits) for k in range(len(arcs))]
    courses = [course for course in found if course]
    stretches = find_stretches(local, [course for course in courses if course.number not in whole], arcs, frame.balls)
    parts = []
    for course in courses:
        near = np.flatnonzero(local.heights(course.places) < FOLLOWED)
        if not len(near):
            continue
        bare = [stretch.bare for stretch in stretches if stretch.course is course]
        reach = max(int(near[0]) - 1, 0), min(int(near[-1]) + 1, course.last)
        ranges = zip([reach[0], *(end for _, end in bare)], [*(start for start, _ in bare), reach[1]], strict=True)
        parts += [(course, first, last) for first, last in ranges if last > first]
    return courses, Zones(stretches), surround(local, parts, rng)


def _room(local: Local, point: FloatArray) -> float:
    """How large a ball may be: within the grid, and not across a wall unless its centre is on it."""
    room = 0.9 * float(np.minimum(point, local.grid.cells - point).min()) - 3
    for wall in local.walls:
        height = float(abs(wall.heights(local.grid.to_points(point[None]))[0])) / local.grid.step
        if height > 1e-6:
            room = min(room, 0.9 * height)
    return max(room, 0.05)


def _wall_parameters(local: Local, arc: Arc) -> FloatArray:
    """The parameters at which an arc passes a wall."""
    found = []
    t = np.arange(len(arc.nodes), dtype=float)
    for wall in local.walls:
        height = wall.heights(local.grid.to_points(arc.nodes))
        k = np.flatnonzero((height[:-1] < 0) != (height[1:] < 0))
        found.append(arc.where(partial(_cells_beyond, local, wall), t[k], t[k + 1]))
    passed = np.sort(np.concatenate(found))
    return passed[np.diff(passed, prepend=-np.inf) > _ONCE]  # an edge of a box is passed once


def _cells_beyond(local: Local, wall: Rim, units: FloatArray) -> FloatArray:
    return wall.heights(local.grid.to_points(units)) / local.grid.step


def _uneven(skeleton: Skeleton, zones: Zones) -> FloatArray:
    """The vertices between two special points of an arc at which the number of sheets changes."""
    where: dict[int, set[int]] = {}
    for (a, b), sheets in zip(skeleton.edges.tolist(), skeleton.sheets.tolist(), strict=True):
        for end in (a, b):
            where.setdefault(end, set()).add(sheets)
    for tube, stations in zip(skeleton.tubes, skeleton.stations, strict=True):
        for stretch in zones.stretches:
            for row in stretch.bare if stretch.course is tube.course else ():
                if tube.first <= row <= tube.last:
                    where[int(stations[row - tube.first])].add(stretch.sheets)
    return skeleton.on[[end for end, found in where.items() if len(found) > 1 and end >= len(skeleton.balls)]]
