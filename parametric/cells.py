"""The first triangulation of a shell: the cells between its breaks, with one list of samples on each edge."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from parametric.arcs import Arc
from parametric.edges import Edge
from parametric.parameters import Array
from parametric.shell import Shell
from parametric.surface import ParametricSurface

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


@dataclass
class Cells:
    """Triangles in the making: lists that grow, and become the arrays of a `Triangulation`.

    A line is an edge of the triangulation. Its two ends and their parameters on one surface (the one that draws it)
    are kept; on the edges of the shell also the number of the edge and the parameters along it. A triangle keeps for
    each of its lines the arc that must be asked for parameters on its own surface, -1 where the middle will do.
    """

    shell: Shell
    splits: Sequence[tuple[Array, Array]]
    vertices: list[Array] = field(default_factory=list)
    homes: list[tuple[int, float, float]] = field(default_factory=list)
    lines: list[tuple[int, int]] = field(default_factory=list)
    line_homes: list[tuple[int, Pair, Pair]] = field(default_factory=list)
    line_edges: list[tuple[int, float, float]] = field(default_factory=list)
    arcs: list[Arc] = field(default_factory=list)
    triangles: list[tuple[int, tuple[Corner, Corner, Corner], tuple[int, int, int], tuple[int, int, int]]] = field(
        default_factory=list
    )
    sides: dict[tuple[int, str], list[Border]] = field(default_factory=lambda: defaultdict(list))
    poles: dict[tuple[int, str], int] = field(default_factory=dict)

    def build(self) -> None:
        """Sample the edges, then fill the cells of every surface."""
        self.vertices = list(self.shell.corners)
        self.homes = [(-1, 0.0, 0.0)] * len(self.vertices)
        for number, edge in enumerate(self.shell.edges):
            if edge.kind == "degenerate":
                side = edge.arcs[0].side
                self.poles[side.surface_index, side.name] = edge.ends[0]
            else:
                self._sample(number, edge)
        for borders in self.sides.values():
            borders.sort(key=lambda border: border.t)
        for k, surface in enumerate(self.shell.surfaces):
            _Filler(self, k, surface).fill()

    def add_vertex(self, point: Array, home: tuple[int, float, float]) -> int:
        """The number of a new vertex."""
        self.vertices.append(point)
        self.homes.append(home)
        return len(self.vertices) - 1

    def add_line(self, ends: tuple[int, int], home: tuple[int, Pair, Pair], edge: tuple[int, float, float]) -> int:
        """The number of a new line."""
        self.lines.append(ends)
        self.line_homes.append(home)
        self.line_edges.append(edge)
        return len(self.lines) - 1

    def _sample(self, number: int, edge: Edge) -> None:
        """Vertices on an edge where any of its surfaces has a grid line, and the lines between them."""
        s = np.concatenate([[0.0, 1.0]] + [self._grid_lines(arc) for arc in edge.arcs])
        s = np.unique(np.clip(s, 0, 1))
        s = s[np.concatenate([[True], np.diff(s) > 1e-9])]
        s[-1] = 1.0
        if edge.ends[0] == edge.ends[1] and len(s) == 2:
            s = np.array([0.0, 0.5, 1.0])
        drawn = edge.arcs[0]
        parameters = [arc.parameter(s) for arc in edge.arcs]
        for arc, t in zip(edge.arcs, parameters):
            _snap(t, self.splits[arc.side.surface_index][1 - arc.side.axis])
        u, v = drawn.side.parameters(parameters[0])
        k = drawn.side.surface_index
        inner = [self.add_vertex(p, (k, a, b)) for p, a, b in zip(edge.points(s[1:-1]), u[1:-1], v[1:-1])]
        vertices = [edge.ends[0], *inner, edge.ends[1]]
        for end, place in ((0, 0), (-1, len(s) - 1)):
            if self.homes[edge.ends[end]][0] < 0:
                self.homes[edge.ends[end]] = (k, float(u[place]), float(v[place]))
        lines = [
            self.add_line(
                (vertices[i], vertices[i + 1]),
                (k, (float(u[i]), float(v[i])), (float(u[i + 1]), float(v[i + 1]))),
                (number, float(s[i]), float(s[i + 1])),
            )
            for i in range(len(s) - 1)
        ]
        for arc, t in zip(edge.arcs, parameters):
            self._enter(arc, t, vertices, lines)

    def _grid_lines(self, arc: Arc) -> Array:
        """Parameters s at which grid lines of the arc's surface meet the edge."""
        low, high = arc.span
        t = self.splits[arc.side.surface_index][1 - arc.side.axis]
        return arc.locate(t[(t > low) & (t < high)])

    def _enter(self, arc: Arc, t: Array, vertices: list[int], lines: list[int]) -> None:
        """Note the stretches of an edge on the side of one surface, in the side's direction."""
        number = -1
        if not arc.proportional:
            self.arcs.append(arc)
            number = len(self.arcs) - 1
        u, v = arc.side.parameters(t)
        borders = self.sides[arc.side.surface_index, arc.side.name]
        step = 1 if arc.end > arc.start else 0
        for i, line in enumerate(lines):
            begin = i + 1 - step
            corner = Corner(vertices[begin], (float(u[begin]), float(v[begin])))
            borders.append(Border(float(t[begin]), corner, line, number))


def _snap(t: Array, grid: Array) -> None:
    """Let parameters that are grid lines but for rounding be those grid lines."""
    nearest = grid[np.abs(t[:, None] - grid).argmin(axis=1)]
    close = np.abs(t - nearest) <= 1e-9 * (grid[-1] - grid[0])
    t[close] = nearest[close]


class _Filler:
    """Fills the cells of one surface with triangles.

    The outline of a cell runs counter-clockwise. A side of the domain may bring more corners than two to it, where
    the neighbour has grid lines of its own; a pole brings one for both.
    """

    def __init__(self, cells: Cells, k: int, surface: ParametricSurface) -> None:
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
        """Two triangles, parted by the diagonal that is nearer to the surface."""
        corners, rims = [entry[0] for entry in outline], [entry[2:] for entry in outline]
        middles = np.array([[c.place for c in corners[::2]], [c.place for c in corners[1::2]]]).mean(axis=1)
        places = self.surface(middles[:, 0], middles[:, 1])
        vertices = [np.asarray(self.cells.vertices[c.vertex]) for c in corners]
        off = [np.linalg.norm(places[d] - (vertices[d] + vertices[d + 2]) / 2) for d in (0, 1)]
        first = 0 if off[0] <= off[1] else 1
        c = corners[first:] + corners[:first]
        r = rims[first:] + rims[:first]
        diagonal = (self._line(("diagonal", cell), c[0], c[2]), -1)
        self._emit([c[0], c[1], c[2]], [r[0], r[1], diagonal])
        self._emit([c[0], c[2], c[3]], [diagonal, r[2], r[3]])

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


def first_splits(surface: ParametricSurface) -> tuple[Array, Array]:
    """Grid lines of the first triangulation: the breaks, and between them enough that no bend is overlooked."""
    degrees: tuple[int | None, int | None] = getattr(surface, "degrees", (None, None))
    splits = []
    for degree, breaks in zip(degrees, surface.breaks):
        parts = 8 if degree is None else max(1 + (degree == 2 and len(breaks) == 2), degree - 1)
        fractions = np.arange(parts) / parts
        splits.append(np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * fractions).ravel(), breaks[-1]))
    return splits[0], splits[1]
