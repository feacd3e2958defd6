"""The vertices that make the singular set a part of the tetrahedra: on it, and round it."""

from dataclasses import dataclass, field
from itertools import chain, groupby
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.conforming.curves.tube import Tube
from implicit.polygonizers.conforming.points.ball import Ball

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_OFF_SPHERE = 1e-6
"""Vertices round a ball are moved by so much of its radius: many places on one sphere make Delaunay's work long."""
SHALLOW = 0.999
"""From this share of a ball's radius on, vertices stay where they are: one that splits a short edge between two on the
sphere would, moved onto it, be in none of the spheres of the tetrahedra there.
"""


@dataclass(eq=False)
class Skeleton:
    """`on` (n, 3) vertices of the singular set, the special points first; `around` (m, 3) vertices near it.

    edges (k, 2) of the singular set between vertices `on`, sheets (k,) how many triangles each should have, arc (k,)
    the number of its arc. stations: the vertices along each tube. cleared (n, 4): places and radii where no lattice
    point may stay.
    """

    on: FloatArray
    around: FloatArray
    edges: IntArray
    sheets: IntArray
    arc: IntArray
    cleared: FloatArray
    balls: list[Ball]
    tubes: list[Tube]
    stations: list[IntArray]
    _tree: cKDTree | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        segments = [segment for tube in self.tubes for segment in tube.segments]
        self._middles = np.array([s.circle.center for s in segments]).reshape(-1, 3)
        self._radii = np.array([s.circle.radius for s in segments])
        ways = np.array([s.ends[1] - s.ends[0] for s in segments]).reshape(-1, 3)
        self._halves = np.linalg.norm(ways, axis=1) / 2
        self._ways = ways / np.maximum(2 * self._halves, 1e-300)[:, None]
        self._tree = cKDTree(self._middles) if len(segments) else None

    def free(self, points: FloatArray, beyond_ball: float, beyond_tube: float) -> NDArray[np.bool_]:
        """Which points lie outside all balls and tubes, scaled so."""
        result = np.ones(len(points), bool)
        for ball in self.balls:
            result &= np.linalg.norm(points - ball.center, axis=1) > ball.radius * beyond_ball
        rows = np.flatnonzero(result)
        if self._tree is None or not len(rows):
            return result
        pairs = cKDTree(points[rows]).sparse_distance_matrix(self._tree, 1.8 * self._radii.max(), output_type="ndarray")
        rows, near = rows[pairs["i"]], pairs["j"]
        way = points[rows] - self._middles[near]
        along = np.einsum("ij,ij->i", way, self._ways[near])
        across = np.linalg.norm(way - along[:, None] * self._ways[near], axis=1)
        inside = (np.abs(along) < 1.05 * self._halves[near]) & (across < self._radii[near] * beyond_tube)
        result[rows[inside]] = False
        return result

    def add(self, points: FloatArray) -> None:
        """Take in more vertices, where there is room for them."""
        fixed = np.concatenate([self.on, self.around])
        self.around = np.concatenate([self.around, self.with_room(points, fixed)])

    def with_room(self, points: FloatArray, fixed: FloatArray) -> FloatArray:
        """Those points that lie outside the balls and tubes and not too near to each other and fixed places."""
        points = points[self.free(points, 1.2, 1.5)]
        return points[thin(points, np.full(len(points), 0.5), fixed, 0.6)]

    def onto_spheres(self, points: FloatArray) -> FloatArray:
        """The points, those deep in a ball pushed out to its sphere."""
        for ball in self.balls:
            way = points - ball.center
            distance = np.linalg.norm(way, axis=1)
            inside = distance < SHALLOW * ball.radius
            points[inside] = ball.center + way[inside] * (ball.radius / distance[inside])[:, None]
        return points


def build_skeleton(balls: list[Ball], tubes: list[Tube], rng: np.random.Generator) -> Skeleton:
    """The skeleton of balls and tubes; vertex i of `on` is the centre of ball i."""
    on = [ball.center for ball in balls]
    edges, sheets, arc, around, cleared = [], [], [], [], []
    stations = []
    exits: dict[tuple[int, int], int] = {}
    for row, ball in enumerate(balls):
        for place, leave in enumerate(ball.exits):
            exits[row, place] = len(on)
            edges.append((row, len(on)))
            sheets.append(int(ball.link.sheets[place]))
            arc.append(leave.arc)
            on.append(leave.place)
        shell = ball.radius * ball.link.directions[len(ball.exits) :]
        around.append(ball.center + shell * (1 + _OFF_SPHERE * rng.uniform(-1, 1, (len(shell), 1))))
        cleared.append(np.append(ball.center, ball.radius + 0.35)[None])
    for tube in tubes:
        ids = _number_stations(tube, exits, on)
        stations.append(np.array(ids, np.int64))
        for k, segment in enumerate(tube.segments):
            edges.append((ids[k], ids[k + 1]))
            sheets.append(segment.sheets)
            arc.append(tube.course.number)
            outside = np.ones(len(segment.ring), bool)
            for ball in balls:
                outside &= np.linalg.norm(segment.ring - ball.center, axis=1) > 1.003 * ball.radius
            around.append(segment.ring[outside])
            radius = segment.circle.radius
            places = np.array([segment.ends[0], segment.circle.center, segment.ends[1]])
            cleared.append(np.column_stack([places, np.full(3, radius + 0.3 * min(1, radius))]))
    skeleton = Skeleton(
        np.array(on).reshape(-1, 3),
        np.concatenate([np.zeros((0, 3)), *around]),
        np.array(edges, np.int64).reshape(-1, 2),
        np.array(sheets, np.int64),
        np.array(arc, np.int64),
        np.concatenate([np.zeros((0, 4)), *cleared]),
        balls,
        tubes,
        stations,
    )
    skeleton.around = np.concatenate([skeleton.around, _graded(skeleton, rng)])
    return skeleton


def _number_stations(tube: Tube, exits: dict[tuple[int, int], int], on: list[FloatArray]) -> list[int]:
    """The numbers of a tube's stations; those that are new are appended to `on`."""
    ids = []
    last = len(tube.stations) - 1
    for k, place in enumerate(tube.stations):
        if k == 0 and tube.start is not None:
            ids.append(exits[tube.start])
        elif k == last and tube.end is not None:
            ids.append(exits[tube.end])
        elif k == last and tube.closed:
            ids.append(ids[0])
        else:
            ids.append(len(on))
            on.append(place)
    return ids


def _graded(skeleton: Skeleton, rng: np.random.Generator) -> FloatArray:
    """Vertices in layers outside the balls and tubes whose spacing grows to that of the lattice."""
    places, sizes = [np.zeros((0, 3))], [np.zeros(0)]
    for tube in skeleton.tubes:
        for segment in tube.segments:
            reach = 2.1 * segment.circle.radius
            while reach < 0.9:
                turn = 2 * np.pi * (np.arange(8) + rng.random()) / 8
                places.append(segment.circle.scaled(reach / segment.circle.radius).at(turn))
                sizes.append(np.full(8, 0.55 * reach))
                reach *= 1.8
    for ball in skeleton.balls:
        around, triangles = ball.link.directions, ball.link.triangles
        length, count = np.zeros(len(around)), np.zeros(len(around))
        for i, j in ((0, 1), (1, 2), (2, 0)):
            side = np.linalg.norm(around[triangles[:, i]] - around[triangles[:, j]], axis=1) * ball.radius
            for k in (i, j):
                np.add.at(length, triangles[:, k], side)
                np.add.at(count, triangles[:, k], 1)
        length /= np.maximum(count, 1)
        height = 0.8 * length
        for _ in range(6):
            fine = length < 0.6
            if not fine.any():
                break
            places.append(ball.center + around[fine] * (ball.radius + height[fine])[:, None])
            sizes.append(length[fine])
            length = 1.7 * length
            height = height + 0.8 * length
    points, spacing = np.concatenate(places), np.concatenate(sizes)
    points = points + rng.normal(size=points.shape) * 0.03 * spacing[:, None]
    outside = skeleton.free(points, 1.0, 1.25)
    points, spacing = points[outside], spacing[outside]
    fixed = np.concatenate([skeleton.on, skeleton.around])
    return points[thin(points, spacing, fixed, 0.6)]


def thin(points: FloatArray, sizes: FloatArray, fixed: FloatArray, share: float) -> NDArray[np.bool_]:
    """Which points to keep, small sizes first, so that each is a share of its size away from the others and `fixed`."""
    keep = np.zeros(len(points), bool)
    if not len(points):
        return keep
    rows = np.arange(len(points))
    if len(fixed):
        rows = np.flatnonzero(cKDTree(fixed).query(points)[0] > share * sizes)
    order = rows[np.argsort(sizes[rows], kind="stable")]
    if not len(order):
        return keep
    near = cKDTree(points[order]).query_ball_point(points[order], share * sizes[order])
    after = np.repeat(np.arange(len(order)), [len(others) for others in near])
    before = np.fromiter(chain.from_iterable(near), np.int64, len(after))
    earlier = before < after
    stays = [True] * len(order)
    for i, pairs in groupby(zip(after[earlier].tolist(), before[earlier].tolist(), strict=True), itemgetter(0)):
        stays[i] = not any(stays[j] for _, j in pairs)
    keep[order[stays]] = True
    return keep
