"""The singular curves inside the bounds: exact projection, arcs, polylines, special points, leaves."""

from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.domain import Bounds
from implicit.singular.arcs import Arc, Part, breaks_of, plane_range, trace
from implicit.singular.chains import Chain, clip, distance, join, within
from implicit.singular.conic import shape_of, t
from implicit.singular.derivatives import Values
from implicit.singular.exact import ExactPoint
from implicit.singular.form import Form
from implicit.singular.intersection import Shape, containing
from implicit.singular.leaves import count_leaves, leaf_changes, turning_points
from implicit.singular.lone import Branch, sort_lone
from implicit.singular.projection import project
from implicit.singular.region import Deadline
from implicit.singular.rest import real_points
from implicit.singular.transversal import kind_changes
from implicit.singular.twist import Twist, untwist

Floats = NDArray[np.float64]
Place = tuple[int, Floats]
"""The vertex of a chain before a point, and the point."""
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]

_CHORD = 8e-7  # of the size of the bounds
_JOIN = 1e-7
_BESIDE = 1e-5  # special points found in different ways are the same


@dataclass(frozen=True)
class Curve:
    """A singular curve in the bounds, the vertices where it is special, and the leaves at each segment."""

    polyline: Floats
    closed: bool
    expression: Triple | None
    special: Floats
    leaves: NDArray[np.int64]


@dataclass(frozen=True)
class Curves:
    """All singular curves in the bounds, and all complex ones with their equations and lone real points.

    `branches` hold the real curves beyond the bounds too; `touching` are points where curves touch the boundary from
    outside.
    """

    curves: list[Curve]
    branches: list[Branch]
    touching: list[Floats]
    twist: Twist
    reach: float  # nearer to a line a point may be on it

    @property
    def shapes(self) -> list[Shape]:
        """The equations of each complex curve."""
        return [branch.shape for branch in self.branches]

    @property
    def lines(self) -> list[Floats]:
        """The real curves."""
        return [line for branch in self.branches for line in branch.lines]

    def lone_points(self, deadline: Deadline) -> tuple[list[Floats], list[Floats]]:
        """The lone points that are on no real curve, and places that could not be decided."""
        clear, unknown = sort_lone(self.branches, self.twist, self.reach, deadline)
        lines = [c.polyline for c in self.curves]
        return clear + [p for p in self.touching if all(distance(p, line) > self.reach for line in lines)], unknown

    def other_points(self, deadline: Deadline) -> list[ExactPoint] | None:
        """All real singular points off the curves, in the coordinates of `twist`, if they could be found exactly."""
        around = self.branches[0].around if self.branches else []
        found = real_points(self.twist.form, deadline, [shape.equations for shape in self.shapes], around)
        for branch in self.branches:
            if branch.shape.upright and found is not None:
                over = branch.over
                found = None if over is None else [*found, *(p for p in over if not self._on_curves(p))]
        return found

    def _on_curves(self, point: ExactPoint) -> bool:
        place = self.twist.outside(np.array(point.position))
        near = any(b.near(place, self.reach) for b in self.branches) or any(
            float(np.linalg.norm(place - p)) < self.reach for b in self.branches for p in b.lone
        )
        return near and any(b.carries(point) for b in self.branches)


def find_curves(form: Form, bounds: Bounds, deadline: Deadline) -> Curves | None:
    """All curves of singular points in the bounds; None where they could not be found exactly or in time."""
    twist = untwist(form)
    projection = project(twist.form, deadline)
    if projection is None:
        return None
    box, size = bounds.box.corners, bounds.size
    turn = twist.matrix @ np.array(projection.turn)
    parts = [Part(p, twist.form.field, turn, twist.shift) for p in projection.parts]
    whole = Part(projection, twist.form.field, turn, twist.shift)
    degree = projection.plane.total_degree()
    around = next(filter(None, (containing(whole, n) for n in range(1, degree + 1))), [])
    branches = [Branch(part, shape_of(part), twist.form, around) for part in parts]
    arcs: list[Arc] = []
    for part, branch in zip(parts, branches, strict=True):
        breaks = breaks_of(part, parts, plane_range(turn, box - twist.shift))
        found = trace(part, breaks, _CHORD * size, size / 32, deadline)
        if found is None:
            return None
        arcs.extend(found)
        branch.lone.extend(p for p in part.solitary(breaks) if bounds.contains(p))
    chains, crossings = join(arcs, _JOIN * size)
    values = Values(form)
    special = [*crossings]
    for chain in chains:
        turning = _turning(chain, special, form, values, box)
        chain.insert(turning, 1e-9 * size)
        special.extend(p for _, p in turning)
    curves = []
    for chain in chains:
        for piece in clip(chain, bounds, np.array(special).reshape(-1, 3)):
            if piece.closed and np.ptp(piece.polyline, axis=0).max() < _JOIN * size:
                continue  # arcs between nodes of one special point
            shape = branches[parts.index(chain.part)].shape
            expression = _nearest([twist.expression(e) for e in shape.expressions], piece.polyline)
            curves.append(_curve(piece, expression, form, size))
    for chain in chains:
        branches[parts.index(chain.part)].lines.append(_cycle(chain.polyline, chain.closed))
    return Curves(curves, branches, _touching(chains, curves, bounds), twist, 2e-6 * size)


def _turning(chain: Chain, special: list[Floats], form: Form, values: Values, box: Floats) -> list[Place]:
    """The special points of a chain besides those that are known: (vertex before it, point)."""
    size = float((box[1] - box[0]).max())
    found = [(n, p) for n, p in turning_points(chain, values, box) if _apart(p, special, _JOIN * size)]
    known = np.array([*special, *(p for _, p in found)]).reshape(-1, 3)
    found += _others(kind_changes(chain, values, box, known), special, found, size)
    marks = [n for n, p in enumerate(chain.polyline) if not _apart(p, special, _JOIN * size)]
    return found + _others(leaf_changes(chain, [*marks, *(n for n, _ in found)], form, box), special, found, size)


def _others(places: list[Place], special: list[Floats], found: list[Place], size: float) -> list[Place]:
    return [(n, p) for n, p in places if _apart(p, [*special, *(q for _, q in found)], _BESIDE * size)]


def _cycle(line: Floats, closed: bool) -> Floats:
    return np.concatenate([line, line[:1]]) if closed else line


def _touching(chains: list[Chain], curves: list[Curve], bounds: Bounds) -> list[Floats]:
    """Special points of curves that have nothing else in the bounds near them: they touch the boundary from outside."""
    tolerance = _JOIN * bounds.size
    inside = [chain.polyline[within(chain.polyline, bounds, 1e-12 * bounds.size)] for chain in chains]
    points = np.concatenate([np.zeros((0, 3)), *inside])
    if curves and len(points):
        known = cKDTree(np.concatenate([c.polyline for c in curves]))
        points = points[known.query(points)[0] > tolerance]
    out: list[Floats] = []
    for p in points:
        if _apart(p, out, tolerance):
            out.append(p)
    return out


def _apart(point: Floats, others: list[Floats], tolerance: float) -> bool:
    return all(float(np.abs(point - other).max()) > tolerance for other in others)


def _nearest(expressions: list[Triple], line: Floats) -> Triple | None:
    """Which of several straight lines a polyline lies on."""
    if len(expressions) < 2:
        return expressions[0] if expressions else None

    def distance(expression: Triple) -> float:
        start, end = (np.array([float(sympy.sympify(c).subs(t, at)) for c in expression]) for at in (0, 1))
        away, along = line - start, (end - start) / np.linalg.norm(end - start)
        return float(np.linalg.norm(away - (away @ along)[:, None] * along))

    return min(expressions, key=distance)


def _curve(piece: Chain, expression: Triple | None, form: Form, size: float) -> Curve:
    marks = piece.polyline[sorted(piece.special)].reshape(-1, 3)
    special = marks[np.sort(np.unique(marks, axis=0, return_index=True)[1])]
    return Curve(piece.polyline, piece.closed, expression, special, count_leaves(piece, form, size))
