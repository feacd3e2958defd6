"""The neighbourhood of the singular points and curves that no block of cells serves: balls, tubes, tetrahedra."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import Rim
from implicit.polygonizers.conforming.arc import Arc, find_arcs
from implicit.polygonizers.conforming.ball import Ball, find_ball
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.refine import Patch, mesh_region
from implicit.polygonizers.conforming.repeats import CLOSE, apart, beside_arcs, without_repeats
from implicit.polygonizers.conforming.skeleton import Skeleton, build_skeleton
from implicit.polygonizers.conforming.tube import find_tube

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_RETRIES = 3


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
    """A patch with its skeleton; doubtful (n, 3) places in lattice units, of the patch and of the skeleton.

    limits: places (n, 4) where tubes had to be thinner, with their radius.
    """

    patch: Patch
    skeleton: Skeleton
    frame: Frame
    limits: list[FloatArray]
    doubtful: FloatArray


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
    local: Local,
    special: FloatArray,
    polylines: list[tuple[FloatArray, bool]],
    beyond: float,
    seeds: FloatArray,
    before: Neighbourhood | None,
) -> Neighbourhood:
    """The mesh round special points (k, 3), curves and seeds (n, 3), in lattice units.

    Curves go on `beyond` cells past the walls; seeds are further vertices. What was found `before` with fewer seeds
    is where the search for more vertices starts, if the special points are the same.
    """
    rng = np.random.default_rng(5)
    same = before is not None and np.array_equal(before.frame.special, special)
    frame = before.frame if before is not None and same else find_frame(local, special, polylines, beyond, rng)
    limits = list(before.limits) if before is not None and same else []
    if before is not None and same:
        skeleton = replace(before.skeleton, around=before.patch.around)
        skeleton.add(seeds)
        patch = mesh_region(local, skeleton, local.grid.cells, rng, before.patch)
        if not len(patch.doubtful):
            return _conclude(patch, skeleton, frame, limits)
    for turn in range(_RETRIES + 1):
        skeleton = _build(local, frame, limits, rng)
        skeleton.add(seeds)
        patch = mesh_region(local, skeleton, local.grid.cells, rng)
        hopeless = bool(frame.doubtful) or not all(tube.settled for tube in skeleton.tubes)
        if not len(patch.doubtful) or not len(patch.blocked) or not frame.arcs or hopeless or turn == _RETRIES:
            break
        size = np.full((len(patch.blocked), 1), 0.3 * 0.5**turn)
        limits.append(np.concatenate([patch.blocked, size], axis=1))
    return _conclude(patch, skeleton, frame, limits)


def _conclude(patch: Patch, skeleton: Skeleton, frame: Frame, limits: list[FloatArray]) -> Neighbourhood:
    """All that was found, with every place that is doubtful."""
    unsettled = [place for tube in skeleton.tubes if not tube.settled for place in tube.stations]
    doubtful = np.array(frame.doubtful + unsettled).reshape(-1, 3)
    places = np.concatenate([doubtful, patch.doubtful, _uneven(skeleton)])
    return Neighbourhood(patch, skeleton, frame, limits, places)


def _build(local: Local, frame: Frame, limits: list[FloatArray], rng: np.random.Generator) -> Skeleton:
    """The skeleton of the balls of a frame and of tubes along its arcs, within the limits."""
    arcs = frame.arcs
    tubes = [find_tube(local, k, arcs, frame.balls, frame.stops[k], limits, rng) for k in range(len(arcs))]
    return build_skeleton(frame.balls, [tube for tube in tubes if tube is not None], rng)


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
    return np.concatenate(found)


def _cells_beyond(local: Local, wall: Rim, units: FloatArray) -> FloatArray:
    return wall.heights(local.grid.to_points(units)) / local.grid.step


def _uneven(skeleton: Skeleton) -> FloatArray:
    """The vertices between two special points of an arc at which the number of sheets changes."""
    where: dict[int, set[int]] = {}
    for (a, b), sheets in zip(skeleton.edges.tolist(), skeleton.sheets.tolist(), strict=True):
        for end in (a, b):
            where.setdefault(end, set()).add(sheets)
    return skeleton.on[[end for end, found in where.items() if len(found) > 1 and end >= len(skeleton.balls)]]
