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

from implicit.exact import to_fmpq
from implicit.kernels.filter import UNSURE
from implicit.sign import Sign, Signs

Floats: TypeAlias = NDArray[np.float64]

SLACK = 1.01  # on promises a distance of at most this many tolerances
_DEPTH = 12  # halvings of the box round the ball
_TOGETHER = 512  # points whose boxes are kept at a time
_MOST_BOXES = 2_000_000
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
            codes[left] = self._closely(np.ascontiguousarray(points[left]))
        return codes

    def _closely(self, points: Floats) -> Signs:
        own = self.sign.signs(points)
        codes = np.full(len(points), UNSURE, dtype=np.int8)
        codes[own == 0] = 0
        unknown = np.flatnonzero(own == UNSURE)
        codes[unknown[self._crosses(points[unknown])]] = 0
        open_ = np.flatnonzero((own != 0) & (own != UNSURE))
        gradients = self.sign.surface.field.gradients(points[open_])[1]
        for step in (-1.005, 1.005):  # towards smaller |f| first
            changes = self._changes(points[open_], own[open_], gradients * own[open_, None], step)
            codes[open_[changes]] = 0
        open_ = open_[codes[open_] == UNSURE]
        for start in range(0, len(open_), _TOGETHER):
            part = open_[start : start + _TOGETHER]
            codes[part] = self._cover(points[part], own[part])
        for i in np.flatnonzero((codes == UNSURE) & (own != UNSURE)):
            if self._vanishes_near(points[i]):
                codes[i] = 0
        return codes

    def _crosses(self, points: Floats) -> NDArray[np.bool_]:
        """Whether f has opposite signs a tolerance before and behind a point, along the gradient."""
        gradients = self.sign.surface.field.gradients(points)[1]
        with np.errstate(all="ignore"):
            step = self.tolerance * np.nan_to_num(gradients / np.linalg.norm(gradients, axis=1)[:, None])
        ahead, behind = (self.sign.signs(np.ascontiguousarray(points + w * step)) for w in (1, -1))
        return np.asarray((ahead == -behind) & (ahead != UNSURE))

    def _changes(self, points: Floats, own: Signs, directions: Floats, step: float) -> NDArray[np.bool_]:
        """Whether f has another sign, or is zero, a step of so many tolerances along a direction."""
        with np.errstate(all="ignore"):
            unit = np.nan_to_num(directions / np.linalg.norm(directions, axis=1)[:, None])
        probes = points + step * self.tolerance * unit
        return self._other(points, own, probes)

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
        owner, centers, half = np.arange(len(points)), points.copy(), self.tolerance
        for _ in range(_DEPTH):
            half /= 2
            centers = (centers[:, None, :] + 2 * half * _CORNERS).reshape(-1, 3)
            owner = np.repeat(owner, 8)
            gap = np.maximum(np.abs(centers - points[owner]) - half * (1 + 1e-9), 0)
            touching = np.linalg.norm(gap, axis=1) <= self.tolerance * (1 + 1e-9)
            owner, centers = owner[touching], np.ascontiguousarray(centers[touching])
            signs = self.sign.around(centers, np.full(len(centers), half * (1 + 1e-6)))
            at_center = np.where(signs == UNSURE, self.sign.around(centers), signs)
            found = (at_center == -own[owner]) & self._within(centers, points[owner])
            codes[owner[found]] = 0
            keep = (signs != own[owner]) & (codes[owner] == UNSURE)
            pending = np.zeros(len(points), dtype=bool)
            pending[owner[keep]] = True
            proved = ~pending & (codes == UNSURE)
            codes[proved] = own[proved]
            owner, centers = owner[keep], centers[keep]
            if not len(owner) or len(owner) > _MOST_BOXES:
                break
        return codes

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
