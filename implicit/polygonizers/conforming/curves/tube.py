"""Tubes round parts of singular curves: a ring of vertices round each edge between two stations."""

from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.ring import Circle, beside, crossings
from implicit.polygonizers.conforming.curves.stations import Stations
from implicit.polygonizers.conforming.local import Local, frame

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Segment:
    """An edge of the singular set with its ring: the circle round its middle, vertices on it, and its sheets."""

    ends: FloatArray
    circle: Circle
    ring: FloatArray
    sheets: int


@dataclass(frozen=True, eq=False)
class Tube:
    """The stations of an arc from row `first` to row `last`, with a segment between each two."""

    course: Stations
    first: int
    last: int
    segments: tuple[Segment, ...]

    @property
    def stations(self) -> FloatArray:
        """Their places (n, 3)."""
        return self.course.places[self.first : self.last + 1]

    @property
    def start(self) -> tuple[int, int] | None:
        """The exit (ball, place) at which it begins, if it does."""
        return None if self.first else self.course.start

    @property
    def end(self) -> tuple[int, int] | None:
        """The exit (ball, place) at which it ends, if it does."""
        return self.course.end if self.last == self.course.last else None

    @property
    def closed(self) -> bool:
        """Whether its last station is its first."""
        return self.course.arc.closed and self.last - self.first == self.course.last


def surround(local: Local, parts: list[tuple[Stations, int, int]], rng: np.random.Generator) -> list[Tube]:
    """The tubes round courses from one row of stations to another."""
    circles: list[Circle] = []
    ends: list[FloatArray] = []
    for course, first, last in parts:
        stations, sizes = course.places[first : last + 1], course.sizes[first : last + 1]
        way = np.diff(stations, axis=0)
        length = np.linalg.norm(way, axis=1)
        radii = np.maximum(0.5 * (sizes[1:] + sizes[:-1]), 0.62 * length)
        middles, axes = (stations[1:] + stations[:-1]) / 2, frame(way / length[:, None])
        circles += [Circle(*four) for four in zip(middles, *axes, radii.tolist(), strict=True)]
        ends += [stations[row : row + 2] for row in range(last - first)]
    segments = iter([_segment(*three, rng) for three in zip(ends, circles, crossings(local, circles), strict=True)])
    return [Tube(course, first, last, tuple(islice(segments, last - first))) for course, first, last in parts]


def _segment(ends: FloatArray, circle: Circle, roots: FloatArray, rng: np.random.Generator) -> Segment:
    """The edge between two places, and a ring on the circle, which the surface crosses at these angles."""
    ring = circle.at(beside(roots))
    return Segment(ends, circle, ring + rng.normal(size=ring.shape) * 1e-4 * circle.radius, len(roots))
