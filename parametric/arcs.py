"""Sides of surfaces as curves, and the arcs of them that run along one edge."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array, Interval
from parametric.surface import ParametricSurface

SIDES = ("u0", "u1", "v0", "v1")
_SAMPLES = 33
_STEPS = 12


@dataclass(frozen=True, eq=False)
class Side:
    """The boundary u = u0, u = u1, v = v0 or v = v1 of a surface, as a curve of the other parameter.

    "u0" and "u1" run in the direction of growing v, "v0" and "v1" in that of growing u.

         v ^  +--v1->-+
           |  ^       ^
           |  u0      u1
           |  +--v0->-+
           +------------> u
    """

    surface: ParametricSurface
    surface_index: int
    name: str

    @property
    def axis(self) -> int:
        """0 where u is constant, 1 where v is."""
        return 0 if self.name[0] == "u" else 1

    @property
    def value(self) -> float:
        """The constant parameter."""
        return self.surface.domain[self.axis][int(self.name[1])]

    @property
    def interval(self) -> Interval:
        """The range of the running parameter."""
        return self.surface.domain[1 - self.axis]

    @property
    def inside_left(self) -> bool:
        """Whether the domain, u to the right and v upward, lies to the left of the running direction."""
        return self.name in ("u1", "v0")

    def parameters(self, t: Array) -> tuple[Array, Array]:
        """The pairs (u, v) at t."""
        constant = np.full_like(t, self.value)
        return (constant, t) if self.axis == 0 else (t, constant)

    def points(self, t: Array) -> Array:
        """Points (n, 3) at t (n,)."""
        return self.surface(*self.parameters(t)) if t.size else np.zeros((0, 3))

    @cached_property
    def samples(self) -> Array:
        """Parameters spread over the side, its breaks among them."""
        evenly = np.linspace(*self.interval, _SAMPLES)
        return np.unique(np.concatenate([evenly, self.surface.breaks[1 - self.axis]]))

    @cached_property
    def polyline(self) -> Array:
        """Points at `samples`."""
        return self.points(self.samples)

    def near(self, places: Array, tolerance: float) -> NDArray[np.int64]:
        """Indices of places that may lie within tolerance of the side."""
        line = self.polyline
        bow = np.linalg.norm(line[1:-1] - (line[:-2] + line[2:]) / 2, axis=1).max(initial=0.0)
        slack = tolerance + 2 * bow
        low, high = line.min(axis=0) - slack, line.max(axis=0) + slack
        boxed = np.flatnonzero(np.all((places >= low) & (places <= high), axis=1))
        return boxed[self._distances(places[boxed]).min(axis=1, initial=np.inf) <= slack]

    def _distances(self, places: Array) -> Array:
        """Distances (n, k) of places from the segments of the polyline."""
        a, step = self.polyline[:-1], np.diff(self.polyline, axis=0)
        squared = np.maximum(np.einsum("kc,kc->k", step, step), 1e-300)
        away = places[:, None, :] - a
        s = np.clip(np.einsum("nkc,kc->nk", away, step) / squared, 0, 1)
        return np.asarray(np.linalg.norm(away - s[..., None] * step, axis=2))

    def nearest(self, places: Array, span: Interval | None = None) -> Array:
        """Parameters of the points of the polyline, within a span, that are nearest to places (n, 3)."""
        low, high = sorted(span or self.interval)
        t = np.linspace(low, high, 2 * _SAMPLES)
        gaps = np.linalg.norm(places[:, None, :] - self.points(t), axis=2)
        return np.asarray(t[gaps.argmin(axis=1)])

    def project(self, places: Array, start: Array, span: Interval | None = None) -> tuple[Array, Array]:
        """Parameters of nearest points of the curve to places (n, 3), by Newton's method, and the distances."""
        low, high = sorted(span or self.interval)
        order = (1, 0) if self.axis else (0, 1)
        second = (2, 0) if self.axis else (0, 2)
        t = np.clip(start, low, high)
        for _ in range(_STEPS):
            where = self.parameters(t)
            away = self.surface(*where) - places
            tangent = self.surface.derivative(*where, *order)
            slope = np.einsum("nc,nc->n", away, tangent)
            speed = np.einsum("nc,nc->n", tangent, tangent)
            bend = speed + np.einsum("nc,nc->n", away, self.surface.derivative(*where, *second))
            bend = np.where(bend > 0.1 * speed, bend, speed)
            step = np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0)
            moved = np.clip(t - step, low, high)
            if np.abs(moved - t).max(initial=0.0) <= 4e-16 * (high - low):
                break
            t = moved
        return t, np.linalg.norm(self.points(t) - places, axis=1)


@dataclass(frozen=True, eq=False)
class Arc:
    """A part of a side, from parameter `start` to `end` in the direction of its edge.

    The parameter s of the edge, 0 to 1, goes with the parameter of the side in proportion, or through the table
    (s, t) where two surfaces run along their common edge at different speeds.
    """

    side: Side
    start: float
    end: float
    table: tuple[Array, Array] | None = None
    guide: "Arc | None" = None

    @property
    def proportional(self) -> bool:
        """Whether the parameter of the side grows in proportion to that of the edge."""
        return self.table is None

    @property
    def inside_left(self) -> bool:
        """Whether the domain, u to the right and v upward, lies to the left of the edge's direction."""
        return self.side.inside_left == (self.end > self.start)

    @property
    def span(self) -> Interval:
        """The ends in increasing order."""
        return min(self.start, self.end), max(self.start, self.end)

    def parameter(self, s: Array) -> Array:
        """Parameters of the side at 0 <= s <= 1 of the edge."""
        if self.table is None or self.guide is None:
            # Both ends exactly, and dyadic s of a turned arc the very parameters of the straight one.
            return np.asarray((1 - s) * self.start + s * self.end)
        t = np.interp(s, *self.table)
        places = self.guide.side.points(self.guide.parameter(s))
        t = self.side.project(places, t, self.span)[0]
        return np.where(s <= 0, self.start, np.where(s >= 1, self.end, t))

    def locate(self, t: Array) -> Array:
        """The parameters s of the edge at parameters t of the side: the inverse of `parameter`."""
        if self.table is None or self.guide is None:
            return np.asarray((t - self.start) / (self.end - self.start))
        s_table, t_table = self.table if self.end > self.start else (self.table[0][::-1], self.table[1][::-1])
        start = self.guide.parameter(np.interp(t, t_table, s_table))
        there = self.guide.side.project(self.side.points(t), start, self.guide.span)[0]
        return self.guide.locate(there)

    def end_key(self, end: int) -> tuple[object, ...]:
        """A name for the first or last point of the arc: a corner of the domain, or a place inside its side."""
        t, (low, high) = (self.start, self.end)[end], self.side.interval
        if t not in (low, high):
            return self.side.surface_index, self.side.name, t
        place = (int(self.side.name[1]), int(t == high))
        return self.side.surface_index, *(place if self.side.axis == 0 else place[::-1])

    def turned(self) -> "Arc":
        """The arc run in the other direction."""
        return Arc(self.side, self.end, self.start)

    def along(self, first: "Arc", tolerance: float) -> "tuple[Arc, float] | None":
        """The arc with the parameters of `first`, and their largest distance; None where they part or fold."""
        s = np.linspace(0, 1, 2 * _SAMPLES + 1)
        places = first.side.points(first.parameter(s))
        t, gaps = self.side.project(places, self.side.nearest(places, self.span), self.span)
        t[0], t[-1] = self.start, self.end
        forward = np.sign(self.end - self.start) * np.diff(t) > 0
        if gaps.max() > tolerance or not forward.all():
            return None
        return Arc(self.side, self.start, self.end, (s, t), first), float(gaps.max())
