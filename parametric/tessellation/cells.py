"""The first triangulation of a shell: the cells between its breaks, with one list of samples on each edge."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from parametric.arcs import Arc
from parametric.edges import Edge
from parametric.parameters import Array
from parametric.shell import Shell
from parametric.surface import ParametricSurface
from parametric.tessellation.fill import Border, Corner, Filler, Pair
from parametric.tessellation.samples import ENDS_AND_BETWEEN


@dataclass
class Cells:
    """Triangles in the making: lists that grow, and become the arrays of a `Triangulation`.

    A line is an edge of the triangulation. Its two ends and their parameters on one surface (the one that draws it)
    are kept; on the edges of the shell also the number of the edge and the parameters along it. A triangle keeps for
    each of its lines the arc that must be asked for parameters on its own surface, -1 where the middle will do.
    """

    shell: Shell
    splits: Sequence[tuple[Array, Array]]
    diagonal: str | None = None
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
            Filler(self, k, surface, self.diagonal).fill()

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


def first_splits(surface: ParametricSurface, tolerance: float) -> tuple[Array, Array]:
    """Grid lines of the first triangulation: the breaks, and between them enough that no bend is overlooked.

    Spans of known degree need one line fewer than the degree; others four, or none where the surface is straight.
    """
    degrees: tuple[int | None, int | None] = getattr(surface, "degrees", (None, None))
    splits = []
    for axis, (degree, breaks) in enumerate(zip(degrees, surface.breaks)):
        if degree is None:
            parts = 1 if _is_straight(surface, axis, tolerance / 16) else 4
        else:
            parts = max(1 + (degree == 2 and len(breaks) == 2), degree - 1)
        fractions = np.arange(parts) / parts
        splits.append(np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * fractions).ravel(), breaks[-1]))
    return splits[0], splits[1]


def _is_straight(surface: ParametricSurface, axis: int, tolerance: float) -> bool:
    """Whether the curves along one axis are straight, and evenly parametrized, between the breaks, at samples."""
    along, (low, high) = surface.breaks[axis], surface.domain[1 - axis]
    t = (along[:-1, None] + np.diff(along)[:, None] * ENDS_AND_BETWEEN).ravel()
    s = low + (high - low) * ENDS_AND_BETWEEN
    points = surface.grid(t, s) if axis == 0 else np.swapaxes(surface.grid(s, t), 0, 1)
    spans = points.reshape(len(along) - 1, 17, 17, 3)
    chords = spans[:, :1] + ENDS_AND_BETWEEN[:, None, None] * (spans[:, -1:] - spans[:, :1])
    return bool(np.abs(spans - chords).max() <= tolerance)
