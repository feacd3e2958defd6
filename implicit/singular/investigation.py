"""The search of one region for everything singular, step by step in the order of cost."""

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.domain import Bounds
from implicit.singular.chains import within
from implicit.singular.coincide import coincide
from implicit.singular.curves import Curves, find_curves
from implicit.singular.degenerate import LonelyPoint, settle
from implicit.singular.exact import BITS, MAX_DEGREE, ExactPoint
from implicit.singular.form import Form
from implicit.singular.germ import Germ
from implicit.singular.kinds import SingularCurve, SingularLocus, SingularPoint
from implicit.singular.points import search_nodes
from implicit.singular.proof import CriticalPoint, Point
from implicit.singular.region import WHOLE, Deadline, Region
from implicit.singular.twist import Twist

Floats = NDArray[np.float64]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]

_NEAR = 0.02  # of the size of the bounds: boxes stay open that near to cuspidal edges


class Investigation:
    """The steps of one search, in the order of their cost."""

    def __init__(self, form: Form, bounds: Bounds, deadline: Deadline) -> None:
        self.form, self.bounds, self.deadline = form, bounds, deadline
        self.points: list[SingularPoint] = []
        self.alone: list[CriticalPoint | LonelyPoint] = []  # what was found, each with a region where it is alone
        self.curves: list[SingularCurve] = []
        self.doubtful = np.zeros((0, 2, 3))  # boxes round points on curves that could not be told apart

    def locus(self) -> SingularLocus:
        """Everything that was found."""
        search = search_nodes(self.form, self.bounds.box.corners, self.deadline)
        for node in search.nodes:
            self.alone.append(node.point)
            self._add(node.point.position, node.exact, "A1", 1)
        boxes = search.open_boxes()
        if len(boxes) and not self.deadline.passed:
            boxes = np.concatenate([self._explain(boxes), self.doubtful])
        boxes.flags.writeable = False
        complete = len(boxes) == 0
        return SingularLocus(tuple(self.points), tuple(self.curves), boxes, complete)

    def _explain(self, boxes: Floats) -> Floats:
        """What the open boxes hold: curves, then degenerate points; returns the boxes that stay open."""
        try:
            curves = find_curves(self.form, self.bounds, self.deadline)
        except ArithmeticError:  # the projection was not general enough: the boxes stay open
            curves = None
        if curves is None or not curves.shapes:
            lonely, open_ = settle(self.form, boxes, self.deadline)
            for point in lonely:
                self._add_lonely(point)
            boxes = boxes[open_]
        if curves is None or not len(boxes) or self.deadline.passed:
            return boxes
        self._add_curves(curves)
        others = curves.other_points(self.deadline)
        if others is None:
            return boxes
        for n, other in enumerate(others):
            if not any(coincide(other, earlier) for earlier in others[:n]):
                self._add_exact(other, curves.twist)
        return boxes[:0] if not self._astray(boxes, curves.lines) else boxes

    def _add(self, position: Floats, exact: Triple | None, kind: str | None, milnor: int | None) -> None:
        """A point that was not found before, if it is in the bounds."""
        if not within(position[None], self.bounds, 1e-12 * self.bounds.size)[0]:
            return
        position = np.where(np.abs(position) < 1e-20 * self.bounds.size, 0.0, position)
        position.flags.writeable = False
        self.points.append(SingularPoint(position, exact, kind, milnor))

    def _known(self, place: Point) -> bool:
        """Whether a singular point, given by an enclosure, is one that was found: it lies where that is alone."""
        return any(found.holds(place) for found in self.alone)

    def _add_lonely(self, lonely: LonelyPoint) -> None:
        germ = lonely.germ
        place = germ.point.value(BITS)
        if not self._known(place):
            self.alone.append(lonely)
            self._add(_floats(place), germ.point.symbols, germ.type, germ.milnor)

    def _add_curves(self, curves: Curves) -> None:
        for c in curves.curves:
            for array in (c.polyline, c.special, c.leaves):
                array.flags.writeable = False
            self.curves.append(SingularCurve(c.polyline, c.closed, c.expression, c.special, c.leaves))
        lone, unknown = curves.lone_points(self.deadline)
        for p in lone:
            self._add(p, None, None, None)
        reach = np.array([[-curves.reach], [curves.reach]])
        self.doubtful = np.array([p + reach for p in unknown]).reshape(-1, 2, 3)

    def _add_exact(self, point: ExactPoint, twist: Twist) -> None:
        """An isolated point that algebra has found; its type does not depend on coordinates."""
        place = twist.place(point, BITS)
        if self._known(place):
            return
        position = _floats(place)
        if point.degree > MAX_DEGREE:
            self._add(position, None, None, None)
            return
        germ = Germ(twist.form, point)
        self._add(position, twist.expression(point.symbols), germ.type, germ.milnor)

    def _astray(self, boxes: Floats, lines: list[Floats]) -> bool:
        """Whether boxes stay open far from everything that was found, after they were searched once more on their own.

        There should be none, as algebra predicts.
        """
        reach = _NEAR * self.bounds.size
        for _ in range(3):
            boxes = boxes[self._stray(boxes, lines, reach)]
            if not len(boxes) or self.deadline.passed:
                break
            keys = np.unique(np.floor(boxes.mean(axis=1) / reach).astype(np.int64), axis=0, return_inverse=True)[1]
            left = []
            for n in range(int(keys.max()) + 1):
                cluster = boxes[keys.ravel() == n]
                region = Region(self.form, np.stack([cluster[:, 0].min(axis=0), cluster[:, 1].max(axis=0)]))
                found, _, rest, late = region.search(WHOLE, 18, self.deadline)
                left.append(region.corners(np.concatenate([found, rest, late])))
            boxes = np.concatenate(left)
        return bool(len(boxes))

    def _stray(self, boxes: Floats, lines: list[Floats], reach: float) -> NDArray[np.bool_]:
        """Which boxes are far from everything that was found, or wide."""
        middle = boxes.mean(axis=1)
        stray = np.ones(len(boxes), bool)
        for line in lines:
            stray &= cKDTree(_densified(line, reach / 2)).query(middle)[0] > reach
        for p in self.points:
            stray &= np.linalg.norm(middle - p.position, axis=1) > 2 * reach
        return stray | (np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1) > reach)


def _floats(place: Point) -> Floats:
    return np.array([float(c.mid()) for c in place])


def _densified(line: Floats, step: float) -> Floats:
    """Points along a polyline, none further than `step` from the next."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.union1d(length, np.arange(0, length[-1], step))
    return np.stack([np.interp(at, length, line[:, a]) for a in range(3)], axis=1)
