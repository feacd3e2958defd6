"""Inside, on or outside of a shell, and its winding number, without a mesh."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import OpenSurfaceError, UndecidedError
from parametric.parameters import Array
from parametric.sides.chain import DECIDED, ON, TIED, count_points
from parametric.sides.hierarchy import Hierarchy, build_hierarchy
from parametric.sides.pieces import Pieces, cut_into_pieces, pack

if TYPE_CHECKING:
    from parametric.shell import Shell

Ints = NDArray[np.int64]

_UNIT = 2.0**-53
_ROUNDING = 8
"""Rounding moves the points of a patch, seen from a point, by less than this many units of the largest coordinate."""
_CLEAR = 6
"""From this many times the slack on, a ray without ties is found (never missed in a million points)."""
_NUDGES = 64
_TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
_LISTED = 6


class Solid:
    """What a shell answers about points; its patches are prepared on first use.

    floor : the distance from the surface below which rounding, gaps between matched edges and the error of fitted
    patches can hide the side. Patches of Bezier and B-spline surfaces are exact; other surfaces are fitted by patches
    of degree 8, whose error is measured between their nodes, not proved, and added to the floor four times over.
    """

    def __init__(self, shell: Shell) -> None:
        self.shell = shell

    @cached_property
    def pieces(self) -> Pieces:
        """The patches, turned to agree, and the rim."""
        return cut_into_pieces(self.shell)

    @cached_property
    def slack(self) -> float:
        """How far rounding and gaps may move a point of a patch."""
        scale = max(float(np.abs(net[..., :3] / net[..., 3:]).max()) for net in self.pieces.nets)
        return _ROUNDING * _UNIT * scale + self.pieces.gap

    @cached_property
    def floor(self) -> float:
        """The certified floor, a distance."""
        return (_CLEAR + 1) * self.slack

    @cached_property
    def frames(self) -> list[_Frame]:
        """The shell as it is, and turned: a ray that meets an edge in one of them passes it in another."""
        rotations = [np.eye(3), _TURN, _TURN @ _TURN, _TURN.T]
        return [_Frame(self.pieces, rotation, self.slack) for rotation in rotations]

    def classify(self, points: ArrayLike, tolerance: float | None, rule: str) -> NDArray[np.int8]:
        """-1 inside, 0 on, 1 outside for points (..., 3)."""
        self._check_closed()
        places = np.ascontiguousarray(points, dtype=float).reshape(-1, 3)
        distance = _CLEAR * self.slack if tolerance is None else float(tolerance)
        numbers, states = self._wind(places, distance)
        codes = np.where(_is_inside(numbers, rule), -1, 1)
        codes[states == ON] = 0
        unsure = states == TIED
        if tolerance is not None and tolerance < self.floor:
            unsure |= (states == ON) & ~self._at_corners(places)
        if unsure.any():
            indices = np.flatnonzero(unsure)
            raise UndecidedError(
                f"{indices.size} points lie so near the surface that rounding hides the side, the first is "
                f"{indices[0]}; the certified floor of this shell is {self.floor:.3g}",
                indices,
            )
        return codes.astype(np.int8).reshape(np.shape(points)[:-1])

    def winding_numbers(self, points: ArrayLike) -> Array:
        """Winding numbers of points (..., 3): whole for closed shells, nan on the surface, where there is none."""
        places = np.ascontiguousarray(points, dtype=float).reshape(-1, 3)
        numbers, states = self._wind(places, 0.0)
        numbers[states != DECIDED] = np.nan
        return numbers.reshape(np.shape(points)[:-1])

    def _check_closed(self) -> None:
        if self.shell.closed:
            return
        if not self.shell.orientable:
            raise OpenSurfaceError("inside and outside need a shell with two sides, and this one has only one")
        naked = self.shell.boundary
        crowded = [edge for edge in self.shell.edges if edge.kind == "crowded" and self.shell.balance(edge)]
        causes = [f"{len(naked)} naked edges"] if naked else []
        if crowded:
            causes.append(f"{len(crowded)} edges of more than two surfaces, not as many to the left as to the right")
        edges = [*naked, *crowded]
        listed = "; ".join(repr(edge) for edge in edges[:_LISTED]) + ("; ..." if len(edges) > _LISTED else "")
        raise OpenSurfaceError(
            f"inside and outside need a closed shell, got one with {' and '.join(causes)}: {listed}. "
            f"Its winding_number is a fraction"
        )

    def _at_corners(self, places: Array) -> NDArray[np.bool_]:
        """Which points are corners of patches, exactly."""
        corners = np.concatenate([net[[0, 0, -1, -1], [0, -1, 0, -1]] for net in self.pieces.nets])
        known = {tuple(row) for row in (corners[:, :3] / corners[:, 3:]).tolist()}
        return np.array([tuple(row) in known for row in places.tolist()], dtype=bool)

    def _wind(self, places: Array, distance: float) -> tuple[Array, Ints]:
        """Winding numbers and states; a point within `distance` is ON."""
        numbers, states = self.frames[0].wind(places, distance)
        tied = np.flatnonzero(states == TIED)
        if tied.size and self.pieces.rim:
            for frame in self.frames[1:]:
                numbers[tied], states[tied] = frame.wind(places[tied], distance)
                tied = tied[states[tied] == TIED]
        if tied.size:
            numbers[tied], states[tied] = self._nudge(places[tied], distance)
        if self.shell.closed and self.pieces.rim:
            numbers = np.where(states == DECIDED, np.round(numbers), numbers)
        return numbers, states

    def _nudge(self, places: Array, distance: float) -> tuple[Array, Ints]:
        """Numbers for points whose ray meets an edge, from points near them, on the same side of the surface.

        A point may be moved by less than its distance from the surface. Where there is a rim, its part of the number
        is taken at the point itself, and only the integer that is left from the point nearby.
        """
        frame = self.frames[0]
        clearance = np.maximum(self._clear(places), distance)
        numbers, states = np.zeros(len(places)), np.full(len(places), TIED)
        here = np.zeros(len(places))
        if self.pieces.rim:
            here = frame.rim(places, np.zeros(len(places), np.int64))
        todo = np.flatnonzero(clearance > 0)
        for k in range(_NUDGES):
            angle, height = 2.4 * k + 0.3, 1 - (2 * k + 1) / _NUDGES
            across = np.sqrt(1 - height * height)
            step = 0.9 * np.array([across * np.cos(angle), across * np.sin(angle), height])
            moved = places[todo] + (0.3 if k % 4 == 0 else 1.0) * clearance[todo, None] * step
            near, state = frame.wind(moved, 0.0)
            sure = state == DECIDED
            done = todo[sure]
            numbers[done] = here[done] + np.round(near[sure] - here[done])
            states[done] = DECIDED
            todo = todo[~sure]
            if not todo.size:
                break
        return numbers, states

    def _clear(self, places: Array) -> Array:
        """A distance for each point within which no surface is, 0 where none was found."""
        frame = self.frames[0]
        clearance = np.zeros(len(places))
        todo = np.arange(len(places))
        distance = 0.1 * self.shell.size
        while todo.size and distance > 2 * self.slack:
            states = frame.count(places[todo], distance)[1]
            clearance[todo[states != ON]] = distance
            todo = todo[states == ON]
            distance *= 0.5
        return clearance


class _Frame:
    """The patches and the rim in one position, with rays along its z axis."""

    def __init__(self, pieces: Pieces, rotation: Array, slack: float) -> None:
        self.pieces, self.rotation = pieces, rotation
        self.turned = bool((rotation != np.eye(3)).any())
        self.slack = 2 * slack if self.turned else slack

    def _place(self, net: Array) -> Array:
        if not self.turned:
            return net
        return np.ascontiguousarray(np.concatenate([net[..., :3] @ self.rotation.T, net[..., 3:]], axis=-1))

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """The tree over the patches."""
        return build_hierarchy([self._place(net) for net in self.pieces.nets])

    @cached_property
    def _rim(self) -> tuple[Array, Ints]:
        return pack([self._place(curve) for curve in self.pieces.rim])

    def count(self, places: Array, distance: float) -> tuple[Ints, Ints]:
        """Crossings of the rays from points of this frame, and states."""
        tree = self.hierarchy
        totals, states = np.zeros(len(places), np.int64), np.zeros(len(places), np.int64)
        count_points(
            places, distance + self.slack, self.slack, tree.boxes, tree.slabs, tree.corners, tree.links, tree.nets,
            tree.width, totals, states,
        )  # fmt: skip
        return totals, states

    def rim(self, places: Array, states: Ints) -> Array:
        """The rim's part of the winding number at points of this frame."""
        from parametric.sides.rim import rim_points  # compiled only where there is a rim

        out = np.zeros(len(places))
        curves, starts = self._rim
        rim_points(places, self.slack, curves, starts, out, states)
        return out

    def wind(self, places: Array, distance: float) -> tuple[Array, Ints]:
        """Winding numbers and states of points of the shell."""
        moved = places @ self.rotation.T if self.turned else places
        moved = np.ascontiguousarray(moved)
        totals, states = self.count(moved, distance)
        numbers = totals.astype(float)
        if self.pieces.rim:
            fine = states == DECIDED
            rest = states[fine]
            numbers[fine] += self.rim(moved[fine], rest)
            states[fine] = rest
        return numbers, states


def _is_inside(numbers: Array, rule: str) -> NDArray[np.bool_]:
    whole = np.rint(numbers).astype(np.int64)
    if rule == "positive":
        return np.asarray(whole > 0)
    return np.asarray(whole % 2 != 0 if rule == "evenodd" else whole != 0)
