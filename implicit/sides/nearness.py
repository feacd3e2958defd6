"""On, within a tolerance: proofs that f vanishes within a distance of a point, or nowhere within it.

On is proved by a point nearby where f has the other sign, or is exactly zero. Not on is proved by boxes that cover the
ball round the point, on each of which floats with an error bound show that f keeps its sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.algebra.exact import to_fmpq
from implicit.kernels.filter import UNSURE
from implicit.sides.sign import Sign, Signs

Floats: TypeAlias = NDArray[np.float64]

SLACK = 1.01  # on promises a distance of at most this many tolerances
_DEPTH = 12  # halvings of the box round the ball
_TOGETHER = 64  # points whose boxes are kept at a time
_MOST_BOXES = 10_000  # of one point; it stays undecided if it needs more
_MOST_FEET = 100  # points where an exact zero is looked for
_CORNERS = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Nearness:
    """Inside, on or outside up to a tolerance, for one surface."""

    sign: Sign
    tolerance: float

    def decide(self, points: Floats) -> Signs:
        """-1 or 1 if the surface is farther than the tolerance from a point (n, 3), 0 if it is within 1.01 of it.

        UNSURE where neither was proved.
        """
        codes = self.sign.around(points, self.tolerance * (1 + 1e-12))
        left = np.flatnonzero(codes == UNSURE)
        if len(left):
            codes[left] = self.sign.clear(np.ascontiguousarray(points[left]), self.tolerance * (1 + 1e-12), ball=True)
        left = left[codes[left] == UNSURE]
        if len(left):
            codes[left] = self._closely(np.ascontiguousarray(points[left]))
        return codes

    def _closely(self, points: Floats) -> Signs:
        own = self.sign.signs(points)
        codes = np.full(len(points), UNSURE, dtype=np.int8)
        codes[own == 0] = 0
        unknown = np.flatnonzero(own == UNSURE)
        codes[unknown[self._crosses(points[unknown])]] = 0
        open_ = np.flatnonzero((own != 0) & (own != UNSURE))
        for probe in (self._beyond, self._beyond_foot):
            probes = probe(points[open_], own[open_])
            codes[open_[self._other(points[open_], own[open_], probes)]] = 0
            open_ = open_[codes[open_] == UNSURE]
        open_ = open_[codes[open_] == UNSURE]
        for start in range(0, len(open_), _TOGETHER):
            part = open_[start : start + _TOGETHER]
            codes[part] = self._cover(points[part], own[part])
        for i in np.flatnonzero((codes == UNSURE) & (own != UNSURE))[:_MOST_FEET]:
            if self._vanishes_near(points[i]):
                codes[i] = 0
        return codes

    def _crosses(self, points: Floats) -> NDArray[np.bool_]:
        """Whether f has opposite signs a tolerance before and behind a point, along the gradient."""
        step = self.tolerance * self._unit(points)
        ahead, behind = (self.sign.signs(np.ascontiguousarray(points + w * step)) for w in (1, -1))
        return np.asarray((ahead == -behind) & (ahead != UNSURE))

    def _beyond(self, points: Floats, own: Signs) -> Floats:
        """Just over a tolerance from the points, towards smaller |f|."""
        return points - 1.005 * self.tolerance * own[:, None] * self._unit(points)

    def _beyond_foot(self, points: Floats, own: Signs, feet: Floats | None = None) -> Floats:
        """Just behind the nearest points of the surface, as tangent planes find them."""
        feet = points if feet is None else feet
        for _ in range(8):
            values, gradients = self.sign.surface.field.gradients(feet)
            with np.errstate(all="ignore"):
                ahead = values + (gradients * (points - feet)).sum(axis=1)
                step = np.nan_to_num(ahead / (gradients * gradients).sum(axis=1))[:, None] * gradients
            length = np.linalg.norm(step, axis=1, keepdims=True)
            feet = np.ascontiguousarray(points - step * np.minimum(1, 2 * self.tolerance / np.maximum(length, 1e-300)))
        return feet - 0.004 * self.tolerance * own[:, None] * self._unit(feet)

    def _unit(self, points: Floats) -> Floats:
        gradients = self.sign.surface.field.gradients(points)[1]
        with np.errstate(all="ignore"):
            return np.nan_to_num(gradients / np.linalg.norm(gradients, axis=1)[:, None])

    def _other(self, points: Floats, own: Signs, probes: Floats) -> NDArray[np.bool_]:
        """Whether a probe close enough to its point has another sign than that point; differences are nearly exact."""
        close = np.linalg.norm(probes - points, axis=1) <= self.tolerance * SLACK * (1 - 1e-12)
        out = np.zeros(len(points), dtype=bool)
        some = np.flatnonzero(close)
        if len(some):
            signs = self.sign.signs(np.ascontiguousarray(probes[some]))
            out[some] = (signs != own[some]) & (signs != UNSURE)
        return out

    def _cover(self, points: Floats, own: Signs) -> Signs:
        """Halve boxes round the balls until f keeps its sign on all that touch the ball, or changes it in one."""
        codes = np.full(len(points), UNSURE, dtype=np.int8)
        if not self.sign.provable:
            return codes
        alive = np.ones(len(points), dtype=bool)  # not given up
        owner, centers, half = np.arange(len(points)), points.copy(), self.tolerance
        spare = 2e-15 * np.abs(points).max()  # centers are rounded
        for _ in range(_DEPTH):
            half /= 2
            centers = (centers[:, None, :] + 2 * half * _CORNERS).reshape(-1, 3)
            owner = np.repeat(owner, 8)
            gap = np.maximum(np.abs(centers - points[owner]) - half * (1 + 1e-9) - spare, 0)
            touching = np.linalg.norm(gap, axis=1) <= self.tolerance * (1 + 1e-9)
            owner, centers = owner[touching], np.ascontiguousarray(centers[touching])
            signs = self._box_signs(centers, half * (1 + 1e-6) + spare)
            at_center = np.where(signs == UNSURE, self.sign.around(centers), signs)
            found = (at_center == -own[owner]) & self._within(centers, points[owner])
            codes[owner[found]] = 0
            keep = (signs != own[owner]) & (codes[owner] == UNSURE)
            first = self._nearest_boxes(owner[keep], centers[keep], points)
            who, near = owner[keep][first], centers[keep][first]
            ahead = self._behind(near, own[who])
            codes[who[self._other(points[who], own[who], ahead)]] = 0
            keep &= codes[owner] == UNSURE
            pending = np.zeros(len(points), dtype=bool)
            pending[owner[keep]] = True
            proved = alive & ~pending & (codes == UNSURE)
            codes[proved] = own[proved]
            alive &= np.bincount(owner[keep], minlength=len(points)) <= _MOST_BOXES
            keep &= alive[owner]
            owner, centers = owner[keep], centers[keep]
            if not len(owner):
                break
        return codes

    def _box_signs(self, centers: Floats, half: float) -> Signs:
        """-1 or 1 where f keeps that sign on the cube round a center, else UNSURE."""
        signs = self.sign.around(centers, half)
        left = np.flatnonzero(signs == UNSURE)
        if len(left):
            signs[left] = self.sign.clear(np.ascontiguousarray(centers[left]), half, ball=False)
        return signs

    @staticmethod
    def _nearest_boxes(owner: NDArray[np.int64], centers: Floats, points: Floats) -> NDArray[np.int64]:
        """For each owner the two of its boxes whose centers are nearest to its point."""
        order = np.lexsort([np.linalg.norm(centers - points[owner], axis=1), owner])
        ranked = owner[order]
        rank = np.arange(len(ranked)) - np.searchsorted(ranked, ranked)
        return order[rank < 2]

    def _behind(self, starts: Floats, own: Signs) -> Floats:
        """Just behind the surface, by Newton steps from nearby."""
        feet = starts
        for _ in range(3):
            values, gradients = self.sign.surface.field.gradients(feet)
            with np.errstate(all="ignore"):
                feet = feet - np.nan_to_num(values / (gradients * gradients).sum(axis=1))[:, None] * gradients
        return np.ascontiguousarray(feet - 0.003 * self.tolerance * own[:, None] * self._unit(feet))

    def _within(self, centers: Floats, points: Floats) -> NDArray[np.bool_]:
        return np.asarray(np.linalg.norm(centers - points, axis=1) <= self.tolerance * SLACK * (1 - 1e-12))

    def _vanishes_near(self, point: Floats) -> bool:
        """Whether f is exactly zero at a simple point nearby, found by Newton steps: where f touches zero only."""
        from implicit.implicitize.homogeneous import simplest

        foot = point.copy()
        field = self.sign.surface.field
        for _ in range(60):
            value, gradient = field.gradients(foot[None])
            square = float((gradient**2).sum())
            if not np.isfinite(square) or square < 1e-280:
                break
            foot = foot - value[0] / square * gradient[0]
        if not np.isfinite(foot).all():
            return False
        for share in (1e-9, 1e-6, 1e-3):
            radius = Fraction(self.tolerance * share)
            a, b, c = (simplest(Fraction(w) - radius, Fraction(w) + radius) for w in foot.tolist())
            square_gap = sum((w - Fraction(p)) ** 2 for w, p in zip((a, b, c), point.tolist(), strict=True))
            if square_gap <= Fraction(self.tolerance) ** 2 and self.sign.exactly([to_fmpq(w) for w in (a, b, c)]) == 0:
                return True
        return False
