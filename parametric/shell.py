"""Shell: many parametric surfaces, with their edges matched."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parametric.edges import Edge, match_edges, sides_of
from parametric.parameters import Array
from parametric.surface import ParametricSurface

if TYPE_CHECKING:
    from parametric.sides.winding import Solid

MATCHING = 1e-6
"""Sides within this part of the size of a shell are one edge, unless a tolerance is given."""


@dataclass(frozen=True)
class EdgeReport:
    """How the sides of a shell meet: numbers of edges of each kind, and the distances behind it.

    shared: two arcs. naked: one. crowded: more than two. degenerate: a side that is a single point. `tolerance` is
    the distance within which arcs were matched, `gap` the largest one found between matched arcs.
    """

    shared: int
    naked: int
    crowded: int
    degenerate: int
    gap: float
    tolerance: float

    def __str__(self) -> str:
        """One readable line."""
        return (
            f"{self.shared} shared edges, {self.naked} naked, {self.crowded} crowded, {self.degenerate} degenerate; "
            f"largest gap {self.gap:.3g} (matched within {self.tolerance:.3g})"
        )


class Shell:
    """Several parametric surfaces that meet along edges; immutable.

    Sides are matched by geometry: two run along one edge where they stay within `tolerance` of each other, whatever
    their directions and parametrizations; one long side may meet several short ones; a side may meet the opposite one
    of its own surface (a seam) or be a single point (a pole).

    Parameters
    ----------
    surfaces : sequence of ParametricSurface
    tolerance : float, optional
        The largest distance between matched sides, a length; a millionth of the size if not given.

    Attributes
    ----------
    edges : tuple of Edge
        All edges; `edge.kind` is "shared", "naked", "crowded" or "degenerate".
    boundary : tuple of Edge
        The naked edges.
    size : float
        The longest side of the box round all sides.
    closed : bool
        Whether the surfaces bound a solid: along every edge as many of them lie to the left as to the right, once
        they are turned to agree. A surface taken twice is closed as well.

    Examples
    --------
    >>> from parametric import BezierSurface
    >>> flat = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    >>> steep = BezierSurface([[(1, 0, 0), (1, 1, 0)], [(1, 0, 1), (1, 1, 1)]])
    >>> print(Shell([flat, steep]).report())
    1 shared edges, 6 naked, 0 crowded, 0 degenerate; largest gap 0 (matched within 1e-06)
    """

    surfaces: tuple[ParametricSurface, ...]
    tolerance: float
    edges: tuple[Edge, ...]
    corners: Array
    size: float

    def __init__(self, surfaces: Iterable[ParametricSurface], *, tolerance: float | None = None) -> None:
        kept = tuple(surfaces)
        if not kept:
            raise ValueError("a Shell needs at least one surface, got none")
        for k, surface in enumerate(kept):
            if not isinstance(surface, ParametricSurface):
                raise ValueError(f"a Shell is made of parametric surfaces, got a {type(surface).__name__} at place {k}")
        sides = sides_of(kept)
        lines = [side.polyline for side in sides]
        for side, line in zip(sides, lines):
            if not np.isfinite(line).all():
                raise ValueError(f"surface {side.surface_index} is not finite on its side {side.name}")
        size = float(np.ptp(np.concatenate(lines), axis=0).max()) or 1.0
        if tolerance is None:
            tolerance = MATCHING * size
        if not (np.isfinite(tolerance) and tolerance > 0):
            raise ValueError(f"tolerance must be a positive length, got {tolerance!r}")
        edges, corners = match_edges(sides, float(tolerance))
        corners.flags.writeable = False
        self.__dict__.update(surfaces=kept, tolerance=float(tolerance), edges=edges, corners=corners, size=size)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Shell cannot be changed")

    def __repr__(self) -> str:
        """The number of surfaces and whether the shell is closed."""
        return f"Shell({len(self.surfaces)} surfaces, {'closed' if self.closed else 'open'})"

    @property
    def boundary(self) -> tuple[Edge, ...]:
        """The naked edges."""
        return tuple(edge for edge in self.edges if edge.kind == "naked")

    def report(self) -> EdgeReport:
        """Numbers of edges of each kind, and the distances behind the matching."""
        count = {kind: sum(e.kind == kind for e in self.edges) for kind in ("shared", "naked", "crowded", "degenerate")}
        gap = max((e.gap for e in self.edges), default=0.0)
        return EdgeReport(count["shared"], count["naked"], count["crowded"], count["degenerate"], gap, self.tolerance)

    @cached_property
    def components(self) -> NDArray[np.int64]:
        """A number for each surface, equal for surfaces joined by shared edges."""
        return self._walk[0]

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """+1 for each surface whose normal p_u x p_v is taken as it is, -1 for each that is turned round.

        Where all surfaces of a connected part agree, none is turned. Where they disagree, they are turned to agree,
        and outward if the part is closed.
        """
        return self._walk[1]

    @cached_property
    def orientable(self) -> bool:
        """Whether the surfaces can be turned to agree across every shared edge (a Moebius strip cannot)."""
        return self._walk[2]

    @cached_property
    def closed(self) -> bool:
        """Whether the surfaces bound a solid."""
        return self.orientable and all(self.balance(edge) == 0 for edge in self.edges if edge.kind != "degenerate")

    def balance(self, edge: Edge) -> int:
        """How many more surfaces, turned to agree, lie to the left of an edge than to the right."""
        return int(sum(self.turns[arc.side.surface_index] * (1 if arc.inside_left else -1) for arc in edge.arcs))

    @cached_property
    def _walk(self) -> tuple[NDArray[np.int64], NDArray[np.int64], bool]:
        """Components, turns and orientability, by walking over the shared edges from surface to surface."""
        neighbours: list[list[tuple[int, int]]] = [[] for _ in self.surfaces]
        orientable = True
        for edge in self.edges:
            if edge.kind == "shared":
                (a, left_a), (b, left_b) = ((arc.side.surface_index, arc.inside_left) for arc in edge.arcs)
                turn = -1 if left_a == left_b else 1
                neighbours[a].append((b, turn))
                neighbours[b].append((a, turn))
        part = np.full(len(self.surfaces), -1)
        turns = np.ones(len(self.surfaces), np.int64)
        for first in range(len(self.surfaces)):
            if part[first] >= 0:
                continue
            part[first] = first
            queue = [first]
            for k in queue:
                for other, turn in neighbours[k]:
                    if part[other] < 0:
                        part[other], turns[other] = first, turn * turns[k]
                        queue.append(other)
                    orientable &= bool(turns[other] == turn * turns[k])
            if (turns[queue] != turns[first]).any():
                turns[queue] *= self._outward(queue, turns)
        return part, turns, orientable

    def _outward(self, part: list[int], turns: NDArray[np.int64]) -> int:
        """-1 if the connected surfaces `part`, turned by `turns`, enclose a negative volume, else 1."""
        middle = np.mean([self.surfaces[k].grid(*self.surfaces[k].breaks).reshape(-1, 3).mean(axis=0) for k in part], 0)
        return -1 if sum(turns[k] * _flux(self.surfaces[k], middle) for k in part) < 0 else 1

    @cached_property
    def solid(self) -> Solid:
        """What answers inside and outside; made on first use."""
        from parametric.sides.winding import Solid

        return Solid(self)

    def classify_points(
        self, points: ArrayLike, tolerance: float | None = None, rule: str = "nonzero"
    ) -> NDArray[np.int8]:
        """-1 inside, 0 on, +1 outside, for points (..., 3); see `implicit.classify`.

        The distance below which answers are 0 unless a tolerance is given is `shell.solid.floor`: some units in the
        last place for Bezier and B-spline surfaces, more where edges have gaps or surfaces had to be fitted.
        """
        return self.solid.classify(points, tolerance, rule)

    def winding_numbers(self, points: ArrayLike) -> Array:
        """How often the shell winds round points (..., 3), nan on it; see `implicit.winding_number`."""
        return self.solid.winding_numbers(points)

    @property
    def certified_floor(self) -> float:
        """The distance within which answers without a tolerance may be "on"; see `implicit.certified_floor`."""
        return self.solid.floor


def _flux(surface: ParametricSurface, middle: Array) -> float:
    """The sum of det(p - middle, p_u, p_v), up to a positive factor the volume of the cone from `middle`."""
    total = 0.0
    for u0, u1 in zip(surface.breaks[0], surface.breaks[0][1:]):
        for v0, v1 in zip(surface.breaks[1], surface.breaks[1][1:]):
            u, v = (a + (b - a) * (np.arange(8) + 0.5) / 8 for a, b in ((u0, u1), (v0, v1)))
            away = surface.grid(u, v) - middle
            area = np.cross(
                surface.derivative(u[:, None], v[None, :], 1, 0), surface.derivative(u[:, None], v[None, :], 0, 1)
            )
            total += float(np.einsum("uvc,uvc->", away, area)) * (u1 - u0) * (v1 - v0)
    return total
