"""Arcs joined to polylines where they meet, cut at the bounds; the points where more than two meet are special."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Ball, Bounds
from implicit.singular.arcs import Arc, Part

Floats = NDArray[np.float64]
End = tuple[int, int]  # arc, 0 at its start or 1 at its end

_STILL = 1e-10
"""A segment runs along a plane if it leaves it by this share of its length at most."""


@dataclass
class Chain:
    """A polyline (n, 3) of one part; vertex n comes from arc `sources[n][0]` at parameter `sources[n][1]`."""

    part: Part
    polyline: Floats
    closed: bool
    sources: list[tuple[Arc, float]] = field(default_factory=list)
    special: set[int] = field(default_factory=set)

    def insert(self, points: Sequence[tuple[int, Floats]], tolerance: float) -> None:
        """Put points behind the vertices with these numbers, or in place of one that is as good as there."""
        for n, point in sorted(points, key=lambda item: -item[0]):
            beside = np.array([n, (n + 1) % len(self.polyline)])
            gaps = np.abs(self.polyline[beside] - point).max(axis=1)
            if gaps.min() < tolerance:
                self.polyline[beside[gaps.argmin()]] = point
            else:
                self.polyline = np.insert(self.polyline, n + 1, point, axis=0)

    @property
    def segments(self) -> int:
        """How many segments there are between vertices that come from arcs, that back to the start included."""
        return len(self.sources) - 1

    def at(self, place: float) -> Floats:
        """The exact point at a place along the chain: 2.5 is in the middle between vertices 2 and 3; a closed one goes
        on at its start.
        """
        place = place % self.segments if self.closed else place
        n = min(int(place), self.segments - 1)
        share = place - n
        if share in (0.0, 1.0):
            return self.polyline[(n + int(share)) % len(self.polyline)]
        (a, s), (b, u) = self.sources[n], self.sources[n + 1]
        if a is not b:
            s, a = (1.0 if b.ends_at(self.polyline[n]) else 0.0), b
        point = a.at(s + share * (u - s))
        end = self.polyline[(n + 1) % len(self.polyline)]
        return self.polyline[n] + share * (end - self.polyline[n]) if point is None else point


def join(arcs: Sequence[Arc], tolerance: float) -> tuple[list[Chain], Floats]:
    """Polylines through all arcs, and the special points where they were joined."""
    ends: list[End] = [(a, e) for a in range(len(arcs)) for e in (0, 1)]
    places = np.array([arcs[a].points[-e] for a, e in ends]).reshape(-1, 3)
    partner: dict[End, End] = {}
    special: list[Floats] = []
    corner: dict[End, Floats] = {}
    left = list(range(len(ends)))
    while left:
        group = [n for n in left if np.abs(places[n] - places[left[0]]).max() < tolerance]
        left = [n for n in left if n not in group]
        center = places[group].mean(axis=0)
        mates = _match([ends[n] for n in group], arcs)
        partner.update(mates)
        for n in group:
            corner[ends[n]] = center
        if len(group) > 2 or any(_sharp(arcs, a, b, center) for a, b in mates.items()):
            special.append(center)
    chains = _walk(arcs, partner, corner)
    return chains, np.array(special).reshape(-1, 3)


def _direction(arcs: Sequence[Arc], end: End) -> Floats:
    points = arcs[end[0]].points
    line = points if end[1] == 0 else points[::-1]
    away = np.linalg.norm(line - line[0], axis=1)
    far = line[int(np.argmax(away > 0.02 * away.max()))] - line[0]
    return far / max(float(np.linalg.norm(far)), 1e-300)


def _match(group: list[End], arcs: Sequence[Arc]) -> dict[End, End]:
    """Pairs of ends that continue each other: of one part, as straight as possible."""
    pairs: dict[End, End] = {}
    scores = sorted(
        (float(_direction(arcs, a) @ _direction(arcs, b)), a, b)
        for n, a in enumerate(group)
        for b in group[n + 1 :]
        if arcs[a[0]].part is arcs[b[0]].part
    )
    for _, a, b in scores:
        if a not in pairs and b not in pairs:
            pairs[a], pairs[b] = b, a
    return pairs


def _sharp(arcs: Sequence[Arc], a: End, b: End, corner: Floats) -> bool:
    """Whether two arcs leave the point where they meet in one direction, the more so the nearer: a cusp, not a bend."""
    if _direction(arcs, a) @ _direction(arcs, b) < 0:
        return False
    turns = []
    for s in (0.03, 0.003):
        here, there = (arcs[n].at(s if end == 0 else 1 - s) for n, end in (a, b))
        if here is None or there is None:
            return False
        u, v = here - corner, there - corner
        turns.append(float(u @ v) / max(float(np.linalg.norm(u) * np.linalg.norm(v)), 1e-300))
    return turns[1] > 0.9 and turns[1] > turns[0] - 1e-6


def _walk(arcs: Sequence[Arc], partner: dict[End, End], corner: dict[End, Floats]) -> list[Chain]:
    unused = set(range(len(arcs)))
    chains = []
    starts = [(a, e) for a in range(len(arcs)) for e in (0, 1) if (a, e) not in partner]
    for start in starts + [(a, 0) for a in range(len(arcs))]:
        if start[0] not in unused:
            continue
        pieces: list[Floats] = []
        sources: list[tuple[Arc, float]] = []
        here, closed = start, False
        while here[0] in unused:
            unused.discard(here[0])
            points = arcs[here[0]].points.copy()
            points[0], points[-1] = corner[here[0], 0], corner[here[0], 1]
            steps = arcs[here[0]].parameters
            pieces.append(points if here[1] == 0 else points[::-1])
            sources += [(arcs[here[0]], float(u)) for u in (steps if here[1] == 0 else steps[::-1])[bool(sources) :]]
            onward = partner.get((here[0], 1 - here[1]))
            if onward is None:
                break
            closed = onward == start
            here = onward
        line = np.concatenate([pieces[0], *(p[1:] for p in pieces[1:])])
        chains.append(Chain(arcs[start[0]].part, line[:-1] if closed else line, closed, sources))
    return chains


def clip(chain: Chain, bounds: Bounds, special: Floats) -> list[Chain]:
    """The pieces of a chain inside the bounds, cut on their boundary, with the special points among their vertices."""
    line = np.concatenate([chain.polyline, chain.polyline[:1]]) if chain.closed else chain.polyline
    spans = [_inside(a, b, bounds) for a, b in pairwise(line)]
    pieces: list[list[Floats]] = []
    for (a, b), span in zip(pairwise(line), spans, strict=True):
        if span is None:
            continue
        first, last = a + span[0] * (b - a), a + span[1] * (b - a)
        if pieces and span[0] == 0.0 and np.array_equal(pieces[-1][-1], a):
            pieces[-1].append(b if span[1] == 1.0 else last)
        else:
            pieces.append([a if span[0] == 0.0 else first, b if span[1] == 1.0 else last])
    whole = chain.closed and all(s == (0.0, 1.0) for s in spans)
    if chain.closed and not whole and len(pieces) > 1 and np.array_equal(pieces[0][0], pieces[-1][-1]):
        pieces[0] = [*pieces.pop()[:-1], *pieces[0]]
    out = []
    for piece in pieces:
        points = np.array(piece[:-1] if whole else piece)
        if len(points) > 1 and np.ptp(points, axis=0).max() > 0:
            marks = {int(n) for s in special for n in np.flatnonzero((points == s).all(axis=1))}
            out.append(Chain(chain.part, points, whole, special=marks))
    return out


def _inside(a: Floats, b: Floats, bounds: Bounds) -> tuple[float, float] | None:
    """The part of the segment a + s (b - a), 0 <= s <= 1, in the bounds."""
    if isinstance(bounds, Ball):
        start, step = a - np.array(bounds.center), b - a
        p, q, r = step @ step, start @ step, start @ start - bounds.radius**2
        root = q * q - p * r
        if root <= 0 or p == 0:
            return None
        low, high = (-q - np.sqrt(root)) / p, (-q + np.sqrt(root)) / p
    else:
        box, step = bounds.corners, b - a
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (box - a) / step
        t = np.sort(t, axis=0)
        still = np.abs(step) <= _STILL * np.abs(step).max()
        slack = _STILL * (box[1] - box[0]).max()  # so that a line in a face of the box is in the box
        if np.any(still & ((a < box[0] - slack) | (a > box[1] + slack))):
            return None
        low, high = float(t[0][~still].max(initial=-np.inf)), float(t[1][~still].min(initial=np.inf))
    low, high = max(low, 0.0), min(high, 1.0)
    return (float(low), float(high)) if low < high else None


def within(points: Floats, bounds: Bounds, margin: float) -> NDArray[np.bool_]:
    """Which points (n, 3) are in the bounds or at most `margin` outside."""
    if isinstance(bounds, Ball):
        return np.asarray(np.linalg.norm(points - bounds.center, axis=1) <= bounds.radius + margin)
    low, high = bounds.corners
    return np.asarray(np.all((points >= low - margin) & (points <= high + margin), axis=1))


def distance(point: Floats, line: Floats) -> float:
    """The distance of a point from a polyline."""
    step = np.diff(line, axis=0)
    share = np.clip(np.sum((point - line[:-1]) * step, axis=1) / np.maximum(np.sum(step**2, axis=1), 1e-300), 0, 1)
    return float(np.linalg.norm(point - line[:-1] - share[:, None] * step, axis=1).min())
