"""The cells of one surface between its grid lines, filled with triangles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from parametric.surface import ParametricSurface
from parametric.tessellation.samples import ALONG

if TYPE_CHECKING:
    from parametric.tessellation.cells import Cells

Pair = tuple[float, float]
NO_AXIS, FREE_U, FREE_V = -1, 0, 1


@dataclass
class Corner:
    """A vertex as one surface sees it: its parameters, and which of them means nothing (at a pole)."""

    vertex: int
    place: Pair
    free: int = NO_AXIS


@dataclass
class Border:
    """A stretch of an edge between two samples, as one surface sees it: along one side, in the side's direction."""

    t: float
    corner: Corner
    line: int
    arc: int


class Filler:
    """Fills the cells of one surface with triangles.

    The outline of a cell runs counter-clockwise. A side of the domain may bring more corners than two to it, where
    the neighbour has grid lines of its own; a pole brings one for both.
    """

    def __init__(self, cells: Cells, k: int, surface: ParametricSurface, diagonal: str | None) -> None:
        self.diagonal = diagonal
        self.cells, self.k, self.surface = cells, k, surface
        self.u, self.v = cells.splits[k]
        self.inner: dict[tuple[int, int], Corner] = {}
        self.lines: dict[object, int] = {}
        self.points = surface.grid(self.u, self.v)
        self.sides = {name: self._side(name) for name in ("u0", "u1", "v0", "v1")}

    def _side(self, name: str) -> list[Border]:
        """The stretches of a side, closed by its end; a pole has one corner for every grid line."""
        axis = 0 if name[0] == "u" else 1
        along = (self.u, self.v)[1 - axis]
        value = (self.u, self.v)[axis][-int(name[1])]
        pole = self.cells.poles.get((self.k, name))
        if pole is not None:
            free = FREE_V if axis == 0 else FREE_U
            if self.cells.homes[pole][0] < 0:
                middle = float(along[len(along) // 2])
                self.cells.homes[pole] = (self.k, float(value), middle) if axis == 0 else (self.k, middle, float(value))
            places = [(float(value), float(t)) if axis == 0 else (float(t), float(value)) for t in along]
            return [Border(float(t), Corner(pole, p, free), -1, -1) for t, p in zip(along, places)]
        borders = self.cells.sides[self.k, name]
        end = (float(value), float(along[-1])) if axis == 0 else (float(along[-1]), float(value))
        return [*borders, Border(float(along[-1]), Corner(self._end_vertex(borders[-1]), end), -1, -1)]

    def _end_vertex(self, last: Border) -> int:
        a, b = self.cells.lines[last.line]
        return b if a == last.corner.vertex else a

    def fill(self) -> None:
        """Triangulate every cell."""
        for i in range(len(self.u) - 1):
            for j in range(len(self.v) - 1):
                self._fill_cell(i, j)

    def _corner(self, i: int, j: int) -> Corner:
        """A grid point inside the domain."""
        if (i, j) not in self.inner:
            place = (float(self.u[i]), float(self.v[j]))
            vertex = self.cells.add_vertex(self.points[i, j], (self.k, *place))
            self.inner[i, j] = Corner(vertex, place)
        return self.inner[i, j]

    def _line(self, key: object, a: Corner, b: Corner) -> int:
        """The line from a to b inside this surface, new if `key` is."""
        if key not in self.lines:
            ends = _meet(a, b)
            self.lines[key] = self.cells.add_line((a.vertex, b.vertex), (self.k, *ends), (-1, 0.0, 0.0))
        return self.lines[key]

    def _stretch(self, name: str, low: float, high: float) -> list[tuple[Corner, Corner, int, int]]:
        """The lines on a side between two parameters, in the side's direction."""
        borders = self.sides[name]
        return [(a.corner, b.corner, a.line, a.arc) for a, b in pairwise(borders) if low <= a.t < high]

    def _outline(self, i: int, j: int) -> list[tuple[Corner, Corner, int, int]]:
        """The lines round a cell, counter-clockwise: (from, to, line, arc)."""
        m, n = len(self.u) - 2, len(self.v) - 2
        u, v = self.u[i : i + 2], self.v[j : j + 2]
        found = []
        for name, on_side, (low, high), forward in (
            ("v0", j == 0, u, True),
            ("u1", i == m, v, True),
            ("v1", j == n, u, False),
            ("u0", i == 0, v, False),
        ):
            if on_side:
                part = self._stretch(name, low, high)
            else:
                ends = ((i, j), (i + 1, j)) if name == "v0" else ((i, j + 1), (i + 1, j + 1))
                if name[0] == "u":
                    ends = ((i, j), (i, j + 1)) if name == "u0" else ((i + 1, j), (i + 1, j + 1))
                a, b = (self._grid_corner(*end) for end in ends)
                part = [(a, b, self._line(ends, a, b), -1)]
            found += part if forward else [(b, a, line, arc) for a, b, line, arc in reversed(part)]
        return [(self._at_pole(a), self._at_pole(b), line, arc) for a, b, line, arc in found if line >= 0]

    def _at_pole(self, corner: Corner) -> Corner:
        """The corner, with its free axis if it lies on a side that is a single point."""
        for axis, grid in enumerate((self.u, self.v)):
            for end in (0, 1):
                if (
                    corner.place[axis] == grid[-end]
                    and self.cells.poles.get((self.k, f"{'uv'[axis]}{end}")) is not None
                ):
                    return Corner(corner.vertex, corner.place, 1 - axis)
        return corner

    def _grid_corner(self, i: int, j: int) -> Corner:
        """The corner at a grid point, inside the domain or on a side."""
        m, n = len(self.u) - 1, len(self.v) - 1
        for name, on_side, t in (
            ("u0", i == 0, self.v[j]),
            ("u1", i == m, self.v[j]),
            ("v0", j == 0, self.u[i]),
            ("v1", j == n, self.u[i]),
        ):
            if on_side:
                return min(self.sides[name], key=lambda border: abs(border.t - t)).corner
        return self._corner(i, j)

    def _fill_cell(self, i: int, j: int) -> None:
        outline = self._outline(i, j)
        if len(outline) == 3:
            self._emit([entry[0] for entry in outline], [entry[2:] for entry in outline])
        elif len(outline) == 4 and all(self._at_corner(entry[0], i, j) for entry in outline):
            self._halve(outline, (i, j))
        elif outline:
            self._fan(outline, (i, j))

    def _at_corner(self, corner: Corner, i: int, j: int) -> bool:
        return corner.place[0] in self.u[i : i + 2] and corner.place[1] in self.v[j : j + 2]

    def _halve(self, outline: list[tuple[Corner, Corner, int, int]], cell: tuple[int, int]) -> None:
        """Two triangles, parted by the diagonal asked for, or the one that is nearer to the surface."""
        corners, rims = [entry[0] for entry in outline], [entry[2:] for entry in outline]
        first = ("rising", "falling").index(self.diagonal) if self.diagonal else self._nearer(corners)
        c = corners[first:] + corners[:first]
        r = rims[first:] + rims[:first]
        diagonal = (self._line(("diagonal", cell), c[0], c[2]), -1)
        self._emit([c[0], c[1], c[2]], [r[0], r[1], diagonal])
        self._emit([c[0], c[2], c[3]], [diagonal, r[2], r[3]])

    def _nearer(self, corners: list[Corner]) -> int:
        """0 if the diagonal from the first corner is nearer to the surface at samples than the other, else 1."""
        off = []
        for a, b in (corners[::2], corners[1::2]):
            t = ALONG[:, None]
            places = (1 - t) * a.place + t * b.place
            ends = [np.asarray(self.cells.vertices[c.vertex]) for c in (a, b)]
            away = self.surface(places[:, 0], places[:, 1]) - ((1 - t) * ends[0] + t * ends[1])
            off.append(np.linalg.norm(away, axis=1).max())
        return 0 if off[0] <= off[1] else 1

    def _fan(self, outline: list[tuple[Corner, Corner, int, int]], cell: tuple[int, int]) -> None:
        """Triangles round a new vertex in the middle of the cell."""
        (i, j) = cell
        place = (float(self.u[i] + self.u[i + 1]) / 2, float(self.v[j] + self.v[j + 1]) / 2)
        vertex = self.cells.add_vertex(self.surface(*place), (self.k, *place))
        middle = Corner(vertex, place)
        for a, b, line, arc in outline:
            spokes = [self._line((cell, corner.vertex), corner, middle) for corner in (b, a)]
            self._emit([a, b, middle], [(line, arc), (spokes[0], -1), (spokes[1], -1)])

    def _emit(self, corners: Sequence[Corner], rims: Iterable[tuple[int, int]]) -> None:
        lines, arcs = zip(*rims)
        self.cells.triangles.append((self.k, tuple(corners), lines, arcs))  # type: ignore[arg-type]


def _meet(a: Corner, b: Corner) -> tuple[Pair, Pair]:
    """The parameters of both ends of a line; a pole takes its meaningless one from the other end."""
    p, q = list(a.place), list(b.place)
    if a.free >= 0:
        p[a.free] = q[a.free]
    if b.free >= 0:
        q[b.free] = p[b.free]
    return (p[0], p[1]), (q[0], q[1])
