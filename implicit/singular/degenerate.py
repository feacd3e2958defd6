"""Degenerate isolated singular points: located, recognised and proved alone, so that boxes around them are settled."""

from dataclasses import dataclass

import numpy as np
from flint import arb, fmpq, fmpq_poly
from numpy.typing import NDArray

from implicit.singular.coincide import coincide
from implicit.singular.exact import BITS, ExactPoint, propose
from implicit.singular.form import Form, precision
from implicit.singular.germ import Germ
from implicit.singular.lonely import lonely_radius
from implicit.singular.proof import Jet, Point, newton_step
from implicit.singular.region import Deadline

Floats = NDArray[np.float64]

_BITS = 1000  # of the arithmetic: at a point where the gradient starts with degree m, a part of m in it is lost
_GOOD = 180  # bits of a coordinate that are enough to recognise it
_STEPS = 250
# Starts beside the middle and jumps that fall short: a coordinate that arrives exactly makes the Hessian singular.
_SHAKE = np.array([0.0137, -0.0061, 0.0023])
_SHORT = 0.998


@dataclass(frozen=True)
class LonelyPoint:
    """A degenerate singular point p without others p + axes y with all |y_i| < radius."""

    germ: Germ
    radius: float
    axes: Floats

    def holds(self, place: Point) -> bool:
        """Whether an enclosure lies in that parallelepiped."""
        with precision(BITS):
            steps = [a - b for a, b in zip(place, self.germ.point.value(BITS), strict=True)]
            rows = np.linalg.inv(self.axes)
            along = [sum((float(c) * s for c, s in zip(row, steps, strict=True)), arb(0)) for row in rows]
            return all(bool(abs(a) < 0.999 * self.radius) for a in along)

    def covers(self, corners: Floats) -> NDArray[np.bool_]:
        """Which boxes (K, 2, 3) lie in that parallelepiped."""
        center = np.array([float(c.mid()) for c in self.germ.point.value(64)])
        inverse = np.linalg.inv(self.axes)
        middle = (corners.mean(axis=1) - center) @ inverse.T
        reach = (corners[:, 1] - corners[:, 0]) / 2 @ np.abs(inverse).T
        return np.asarray((np.abs(middle) + reach).max(axis=1) < 0.999 * self.radius)


def settle(form: Form, corners: Floats, deadline: Deadline) -> tuple[list[LonelyPoint], NDArray[np.bool_]]:
    """Degenerate points in or near the boxes (K, 2, 3), and which boxes stay unsettled."""
    jet, open_ = Jet(form), np.ones(len(corners), bool)
    found: list[LonelyPoint] = []
    for _ in range(40):
        todo = np.flatnonzero(open_)
        if not len(todo) or deadline.passed:
            break
        point = locate(jet, corners[todo[int(np.argmax(_remoteness(corners[todo].mean(axis=1), found)))]])
        germ = Germ(form, point) if point else None
        if germ is None or germ.milnor is None or any(coincide(germ.point, other.germ.point) for other in found):
            break
        lonely = LonelyPoint(germ, *lonely_radius(germ))
        covered = lonely.covers(corners)
        if lonely.radius == 0.0:
            break
        found.append(lonely)
        open_ &= ~covered
    return found, open_


def _remoteness(centers: Floats, found: list[LonelyPoint]) -> Floats:
    """How far points (n, 3) are from all that was found."""
    apart = np.ones(len(centers))
    for lonely in found:
        place = np.array([float(c.mid()) for c in lonely.germ.point.value(64)])
        far = np.linalg.norm(centers - place, axis=1)
        apart = far if lonely is found[0] else np.minimum(apart, far)
    return apart


def locate(jet: Jet, box: Floats) -> ExactPoint | None:
    """An exact singular point in or near a box (2, 3)."""
    for reach in (0.5, 8.0):
        guess = _simplest(box, reach)
        if guess.is_singular(jet.form):
            return guess
    center = _slow_newton(jet, box.mean(axis=0), float((box[1] - box[0]).max()))
    if center is None:
        return None
    point = propose(list(center), jet.form.field, _GOOD - 40)
    return point if point is not None and point.is_singular(jet.form) else None


def _simplest(box: Floats, reach: float) -> ExactPoint:
    """The point with the smallest denominators within `reach` times the size of a box."""
    slack = (box[1] - box[0]) * reach
    coordinates = [_simplest_between(a, b) for a, b in zip(box[0] - slack, box[1] + slack, strict=True)]
    x, y, z = (fmpq_poly([c]) for c in coordinates)
    return ExactPoint(fmpq_poly([0, 1]), arb(0), (x, y, z), fmpq_poly([0]))


def _simplest_between(low: float, high: float) -> fmpq:
    """The rational of smallest denominator in [low, high] (Stern and Brocot's tree)."""
    if low <= 0 <= high:
        return fmpq(0)
    if high < 0:
        return -_simplest_between(-high, -low)
    whole = int(np.ceil(low))
    if whole <= high:
        return fmpq(whole)
    whole -= 1
    return fmpq(whole) + 1 / _simplest_between(1 / (high - whole), 1 / (low - whole))


def _slow_newton(jet: Jet, start: Floats, size: float) -> Point | None:
    """Newton's iteration where it converges only linearly, with Aitken's jumps along the slowest direction."""
    start = start + size * _SHAKE
    with precision(_BITS):
        p: Point = (arb(float(start[0])), arb(float(start[1])), arb(float(start[2])))
        before, ratio = None, 0.0
        for n in range(_STEPS):
            try:
                step = newton_step(jet, p, _BITS)
            except ZeroDivisionError:
                return p
            moved = max(abs(step[a]) for a in range(3))
            if float(moved.upper()) < 2.0**-_GOOD:
                return p
            if float(moved.upper()) > 100 * size + 1:
                return None
            ratio = float((moved / before).mid()) if before is not None else 0.0
            before = moved
            factor = 1.0
            if n % 6 == 5 and 0.2 < ratio < 0.97:
                factor, before = _SHORT / (1.0 - ratio), None
            x, y, z = ((p[a] - step[a] * factor).mid() for a in range(3))
            p = x, y, z
    return None
