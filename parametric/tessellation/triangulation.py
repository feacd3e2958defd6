"""A triangulation of a shell that stays conforming while it is refined.

Lines, not points, are split: a line has one middle for all triangles beside it, so no refinement can open a crack or
leave a vertex in the middle of somebody's line. Each line and each triangle is measured once, when it is new.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from parametric.arcs import Arc
from parametric.parameters import Array
from parametric.tessellation.cells import Cells

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Rows:
    """Arrays of one length that are picked and joined together."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def pick(self, which: Ints | Bools) -> Self:
        """The rows `which`, by index or mask."""
        return type(self)(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """The rows of all parts, in order."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__dataclass_fields__))


@dataclass
class Lines(Rows):
    """Edges of the triangulation: ends, the surface that draws them, parameters of the ends, place on a shell edge."""

    ends: Ints
    home: Ints
    places: Array
    edge: Ints
    stretch: Array


@dataclass
class Triangles(Rows):
    """Corners (n, 3), surface (n,), parameters of the corners (n, 3, 2), free axes at poles, lines and arcs.

    Line k runs from corner k to corner k + 1; the arc tells parameters along it where halving would not do, or is -1.
    """

    corners: Ints
    home: Ints
    places: Array
    free: Ints
    lines: Ints
    arcs: Ints


Evaluate = Callable[[Ints, Array], Array]
Numbered = Ints | tuple[Ints, Ints]


class Triangulation:
    """Vertices, lines and triangles over the surfaces of a shell, from its first cells."""

    def __init__(self, cells: Cells, evaluate: Evaluate) -> None:
        self.evaluate = evaluate
        self.shell = cells.shell
        self.side_arcs: list[Arc] = cells.arcs
        self.vertices = np.array(cells.vertices)
        homes = np.array(cells.homes)
        self.vertex_home, self.vertex_place = homes[:, 0].astype(np.int64), homes[:, 1:]
        line_edges = np.array(cells.line_edges)
        self.lines = Lines(
            np.array(cells.lines),
            np.array([home for home, _, _ in cells.line_homes]),
            np.array([ends for _, *ends in cells.line_homes]),
            line_edges[:, 0].astype(np.int64),
            line_edges[:, 1:],
        )
        home, corners, lines, arcs = (list(part) for part in zip(*cells.triangles))
        self.triangles = Triangles(
            np.array([[c.vertex for c in t] for t in corners]),
            np.array(home),
            np.array([[c.place for c in t] for t in corners]),
            np.array([[c.free for c in t] for t in corners]),
            np.array(lines),
            np.array(arcs),
        )

    def split(self, marked: Bools) -> tuple[Ints, Ints]:
        """Split every marked line and the triangles beside it; the indices of the new lines and triangles."""
        cut = np.flatnonzero(marked)
        old = self.lines.pick(cut)
        middles = np.full(marked.size, -1)
        middles[cut] = len(self.vertices) + np.arange(cut.size)
        self._add_middles(old)
        halves = np.full(marked.size, -1)
        halves[cut] = marked.size + 2 * np.arange(cut.size)
        first_new = marked.size
        parts = self._halve(old, middles[cut])
        beside: Bools = np.any(marked[self.triangles.lines], axis=1)
        kept = self.triangles.pick(~beside)
        split = self.triangles.pick(beside)
        cutter = _Cutter(self, split, middles[split.lines], halves[split.lines], first_new + 2 * cut.size)
        new = cutter.cut()
        self.lines = Lines.join([self.lines, parts, *cutter.new_lines])
        self.triangles = Triangles.join([kept, *new])
        new_triangles = np.arange(len(kept.home), len(self.triangles.home))
        return np.arange(first_new, len(self.lines.home)), new_triangles

    def _add_middles(self, old: Lines) -> None:
        """The vertices in the middle of lines."""
        place = old.places.mean(axis=1)
        curved = np.flatnonzero(old.edge >= 0)
        if curved.size:  # on a shared edge: exactly where the arcs of the other surfaces will look for it
            for number in np.unique(old.edge[curved]):
                here = curved[old.edge[curved] == number]
                arc = self.shell.edges[number].arcs[0]
                place[here] = np.stack(arc.side.parameters(arc.parameter(old.stretch[here].mean(axis=1))), axis=1)
        self.vertices = np.concatenate([self.vertices, self.evaluate(old.home, place)])
        self.vertex_home = np.concatenate([self.vertex_home, old.home])
        self.vertex_place = np.concatenate([self.vertex_place, place])

    def _halve(self, old: Lines, middles: Ints) -> Lines:
        """Two lines for each line cut: from its first end to the middle, and on to its second end."""
        place = self.vertex_place[middles]
        s = old.stretch.mean(axis=1)
        parts = []
        for end in (0, 1):
            ends, places, stretch = old.ends.copy(), old.places.copy(), old.stretch.copy()
            ends[:, 1 - end], places[:, 1 - end], stretch[:, 1 - end] = middles, place, s
            parts.append(Lines(ends, old.home, places, old.edge, stretch))
        both = Lines.join(parts)
        order = np.arange(2 * len(middles)).reshape(2, -1).T.ravel()
        return both.pick(order)

    def middle_places(self, t: Triangles, k: int, which: Ints, lines: Ints) -> Array:
        """Parameters, on each triangle's own surface, of the middle of its line k."""
        a, b = ends_of_side(t, k)
        place = (a + b) / 2
        arcs = t.arcs[which, k]
        for number in np.unique(arcs[arcs >= 0]):
            here = arcs == number
            arc = self.side_arcs[number]
            s = self.lines.stretch[lines[here]].mean(axis=1)
            place[which[here]] = np.stack(arc.side.parameters(arc.parameter(s)), axis=1)
        return place


def ends_of_side(t: Triangles, k: int) -> tuple[Array, Array]:
    """Parameters of both ends of side k; a pole takes the one that means nothing there from the other end."""
    j = (k + 1) % 3
    a, b = t.places[:, k].copy(), t.places[:, j].copy()
    for axis in (0, 1):
        at_a, at_b = t.free[:, k] == axis, t.free[:, j] == axis
        a[at_a, axis] = b[at_a, axis]
        b[at_b, axis] = a[at_b, axis]
    return a, b


class _Cutter:
    r"""Cuts triangles along the middles of their lines.

    Places in a triangle are numbered 0, 1, 2 for its corners and 3, 4, 5 for the middles of its lines:

              2
             / \
            5   4       one line cut: two triangles; two lines: three, by the better diagonal; three lines: four
           /     \
          0 - 3 - 1
    """

    def __init__(self, owner: Triangulation, old: Triangles, middles: Ints, halves: Ints, count: int) -> None:
        self.owner, self.old, self.halves = owner, old, halves
        self.new_lines: list[Lines] = []
        self.count = count
        everything = np.arange(len(old.home))
        sides = [owner.middle_places(old, k, everything, old.lines[:, k]) for k in range(3)]
        self.vertex = np.concatenate([old.corners, middles], axis=1)
        self.place = np.concatenate([old.places, np.stack(sides, axis=1)], axis=1)
        self.free = np.concatenate([old.free, np.full_like(old.free, -1)], axis=1)
        self.code = (middles >= 0) @ np.array([1, 2, 4])
        self.parts: list[Triangles] = []

    def cut(self) -> list[Triangles]:
        """All new triangles; the lines inside them are in `new_lines`, numbered from `count`."""
        for k in range(3):
            a, b, c = k, (k + 1) % 3, (k + 2) % 3
            self._cut_one(np.flatnonzero(self.code == 1 << k), a, b, c)
            self._cut_two(np.flatnonzero(self.code == 7 ^ (1 << c)), a, b, c)
        self._cut_three(np.flatnonzero(self.code == 7))
        return self.parts

    def _cut_one(self, t: Ints, a: int, b: int, c: int) -> None:
        """Side a-b is cut in the middle m: triangles a m c and m b c."""
        m = a + 3
        inner = self._add_lines(t, m, c)
        self._emit(t, (a, m, c), (self._half(t, a, a), inner, self._whole(t, c)))
        self._emit(t, (m, b, c), (self._half(t, a, b), self._whole(t, b), inner))

    def _cut_two(self, t: Ints, a: int, b: int, c: int) -> None:
        """Sides a-b and b-c are cut in m and n: the corner m b n, and a quadrilateral a m n c with two diagonals."""
        m, n = a + 3, b + 3
        bridge = self._add_lines(t, m, n)
        self._emit(t, (m, b, n), (self._half(t, a, b), self._half(t, b, b), bridge))
        first = self._off(t, a, n) <= self._off(t, m, c)
        q, link = t[first], bridge[first]
        diagonal = self._add_lines(q, a, n)
        self._emit(q, (a, m, n), (self._half(q, a, a), link, diagonal))
        self._emit(q, (a, n, c), (diagonal, self._half(q, b, c), self._whole(q, c)))
        q, link = t[~first], bridge[~first]
        diagonal = self._add_lines(q, m, c)
        self._emit(q, (a, m, c), (self._half(q, a, a), diagonal, self._whole(q, c)))
        self._emit(q, (m, n, c), (link, self._half(q, b, c), diagonal))

    def _cut_three(self, t: Ints) -> None:
        inner = [self._add_lines(t, 3 + k, 3 + (k + 1) % 3) for k in range(3)]
        for k in range(3):
            before = (k + 2) % 3
            self._emit(t, (k, 3 + k, 3 + before), (self._half(t, k, k), inner[before], self._half(t, before, k)))
        self._emit(t, (3, 4, 5), (inner[0], inner[1], inner[2]))

    def _off(self, t: Ints, a: int, b: int) -> Array:
        """The length of a diagonal: the shorter one is the better."""
        ends = self.owner.vertices[self.vertex[t, a]], self.owner.vertices[self.vertex[t, b]]
        return np.asarray(np.linalg.norm(ends[1] - ends[0], axis=1))

    def _whole(self, t: Ints, k: int) -> tuple[Ints, Ints]:
        return self.old.lines[t, k], self.old.arcs[t, k]

    def _half(self, t: Ints, k: int, end: int) -> tuple[Ints, Ints]:
        """The half of line k that ends at corner `end`."""
        line = self.old.lines[t, k]
        at_first = self.owner.lines.ends[line, 0] == self.old.corners[t, end]
        return self.halves[t, k] + np.where(at_first, 0, 1), self.old.arcs[t, k]

    def _add_lines(self, t: Ints, a: int, b: int) -> Ints:
        """New lines inside triangles t, between places a and b."""
        p, q = self.place[t, a].copy(), self.place[t, b].copy()
        for axis in (0, 1):
            at_a, at_b = self.free[t, a] == axis, self.free[t, b] == axis
            p[at_a, axis], q[at_b, axis] = q[at_a, axis], p[at_b, axis]
        n = len(t)
        ends = np.stack([self.vertex[t, a], self.vertex[t, b]], axis=1)
        places = np.stack([p, q], axis=1)
        self.new_lines.append(Lines(ends, self.old.home[t], places, np.full(n, -1), np.zeros((n, 2))))
        self.count += n
        return np.arange(self.count - n, self.count)

    def _emit(self, t: Ints, corners: tuple[int, int, int], lines: tuple[Numbered, Numbered, Numbered]) -> None:
        """Triangles with the given corners, and lines from each corner to the next, with arcs where they have one."""
        if not t.size:
            return
        pairs = [line if isinstance(line, tuple) else (line, np.full(t.size, -1)) for line in lines]
        c = list(corners)
        self.parts.append(
            Triangles(
                self.vertex[t][:, c],
                self.old.home[t],
                self.place[t][:, c],
                self.free[t][:, c],
                np.stack([pair[0] for pair in pairs], axis=1),
                np.stack([pair[1] for pair in pairs], axis=1),
            )
        )
