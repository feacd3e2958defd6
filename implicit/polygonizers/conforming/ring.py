"""Where a surface crosses a small circle, and where to put vertices on it so that every sector has its own.

A circle round a point m of a singular curve, in the plane across the curve, meets the surface in as many points as
sheets meet there, once it is small enough. Thin sectors are found by zooming in where |f| is least without a change of
sign; the vertices stand beside each crossing, as near as the sector on its other side is wide.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import Local, unit_rows

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SAMPLES = 192
_ZOOMS = 4
_SCALES = (1.0, 0.5, 0.25, 1 / 16, 1 / 64)
"""A ring is stable when it is crossed equally often at these shares of its radius."""
_SHARES = np.arange(17) / 16
"""Where there are samples in a zoom."""
_GAP = 0.8
"""The largest angle between vertices."""


@dataclass(frozen=True, eq=False)
class Circle:
    """The points center + radius (cos a, sin a) in the plane of u, v, pushed onto a sphere if there is one."""

    center: FloatArray
    u: FloatArray
    v: FloatArray
    radius: float
    sphere: tuple[FloatArray, float] | None = None

    def at(self, angles: FloatArray) -> FloatArray:
        """The points (n, 3) at angles (n,)."""
        cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
        points = self.center + self.radius * (cosine * self.u + sine * self.v)
        if self.sphere is None:
            return np.asarray(points)
        middle, radius = self.sphere
        return middle + radius * unit_rows(points - middle)

    def scaled(self, factor: float) -> "Circle":
        """The circle with another radius."""
        return Circle(self.center, self.u, self.v, self.radius * factor, self.sphere)


@dataclass(frozen=True, eq=False)
class _Many:
    """Several circles, looked at together: places (n, 3), axes (n, 3), radii (n,)."""

    circles: list[Circle]
    center: FloatArray
    u: FloatArray
    v: FloatArray
    radius: FloatArray

    @classmethod
    def of(cls, circles: list[Circle]) -> "_Many":
        center, u, v = (np.array([getattr(c, name) for c in circles]).reshape(-1, 3) for name in ("center", "u", "v"))
        return cls(circles, center, u, v, np.array([circle.radius for circle in circles]))

    def at(self, rows: IntArray, angles: FloatArray) -> FloatArray:
        """The points (..., 3) at angles (...,) of circles (...,), all in space or all on one sphere."""
        cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
        across = cosine * self.u[rows] + sine * self.v[rows]
        points = self.center[rows] + self.radius[rows][..., None] * across
        sphere = self.circles[0].sphere
        return np.asarray(points if sphere is None else sphere[0] + sphere[1] * unit_rows(points - sphere[0]))


def crossings(local: Local, circles: list[Circle]) -> list[FloatArray]:
    """For each circle the angles (n,) in [0, 2 pi) where f changes sign on it, ascending."""
    if not circles:
        return []
    many = _Many.of(circles)
    owner, low, high, inside = (np.concatenate(part) for part in zip(*_changes(local, many), strict=True))
    found = bisect(lambda angles: (local.values(many.at(owner, angles)) < 0) == inside, low, high) % (2 * np.pi)
    order = np.lexsort((found, owner))
    return np.split(found[order], np.cumsum(np.bincount(owner, minlength=len(circles)))[:-1])


def counts(local: Local, circles: list[Circle]) -> IntArray:
    """How often (n,) circles are crossed."""
    many = _Many.of(circles)
    return np.bincount(np.concatenate([part[0] for part in _changes(local, many)]), minlength=len(circles))


_Changes = tuple[IntArray, FloatArray, FloatArray, NDArray[np.bool_]]


def _changes(local: Local, many: _Many) -> list[_Changes]:
    """Where f changes sign: the number of the circle, angles before and after, whether f < 0 before.

    Where two crossings may hide between samples, there are more of these, in a zoom of a few steps.
    """
    count = len(many.circles)
    angles = np.tile(2 * np.pi * np.arange(_SAMPLES + 2) / _SAMPLES + 0.0123, (count, 1))
    owner = np.arange(count)
    values = local.values(many.at(owner[:, None], angles[0, :-2]))
    values = np.concatenate([values, values[:, :2]], axis=1)
    most = np.abs(values).max(axis=1)
    result = [_signs(owner, angles[:, :-1], values[:, :-1])]
    added = np.zeros(count, np.int64)
    for _ in range(_ZOOMS):
        row, k = _hidden(values, most[owner])
        fine = added[owner[row]] <= 4 * _SAMPLES
        row, k = row[fine], k[fine]
        if not len(row):
            break
        owner, low, high = owner[row], angles[row, k], angles[row, k + 2]
        ends = values[row, k], values[row, k + 2]
        angles = low[:, None] + (high - low)[:, None] * _SHARES
        values = np.column_stack([ends[0], local.values(many.at(owner[:, None], angles[:, 1:-1])), ends[1]])
        result.append(_signs(owner, angles, values))
        added += (len(_SHARES) - 2) * np.bincount(owner, minlength=count)
    return result


def _signs(owner: IntArray, angles: FloatArray, values: FloatArray) -> _Changes:
    inside = values < 0
    row, k = np.nonzero(inside[:, 1:] != inside[:, :-1])
    return owner[row], angles[row, k], angles[row, k + 1], inside[row, k]


def bisect(same: Callable[[FloatArray], NDArray[np.bool_]], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where `same`, true at `low` and false at `high`, changes."""
    for _ in range(36 if len(low) else 0):
        middle = (low + high) / 2
        below = same(middle)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def _hidden(values: FloatArray, most: FloatArray) -> tuple[IntArray, IntArray]:
    """Rows of values (n, k), and places in them before the least |f| of one sign, if low enough to hide two zeros."""
    size, inside = np.abs(values), values < 0
    behind, here, ahead = size[:, :-2], size[:, 1:-1], size[:, 2:]
    least = (here <= ahead) & (here <= behind)
    least &= (inside[:, 1:-1] == inside[:, 2:]) & (inside[:, 1:-1] == inside[:, :-2])
    row, place = np.nonzero(least & (here < 0.5 * np.minimum(ahead, behind) + 0.02 * most[:, None]))
    return np.asarray(row, np.int64), np.asarray(place, np.int64)


def stable(local: Local, circles: list[Circle], least: float) -> tuple[list[Circle | None], IntArray]:
    """The largest circles, of radii falling by sqrt 2 to a least share, crossed as often at all smaller scales; None
    where there is none. And how often each is crossed.
    """
    found: list[Circle | None] = [None] * len(circles)
    number = np.zeros(len(circles), np.int64)
    left = list(range(len(circles)))
    factor = 1.0
    while left and factor > least:
        tried = [circles[row].scaled(factor * scale) for row in left for scale in _SCALES]
        crossed = counts(local, tried).reshape(-1, len(_SCALES))
        same = (crossed == crossed[:, :1]).all(axis=1)
        if factor == 1.0:
            number[:] = crossed[:, 0]
        for place in np.flatnonzero(same):
            found[left[place]], number[left[place]] = circles[left[place]].scaled(factor), crossed[place, 0]
        left = [row for row, done in zip(left, same, strict=True) if not done]
        factor /= 2**0.5
    return found, number


def beside(roots: FloatArray) -> FloatArray:
    """Angles of vertices beside the crossings, at most so far apart that every sector is seen."""
    if not len(roots):
        return np.arange(8) * np.pi / 4 + 0.1
    widths = np.diff(roots, append=roots[0] + 2 * np.pi)
    result = []
    for i, (root, width) in enumerate(zip(roots, widths, strict=True)):
        after = min(0.5 * width, widths[i - 1], 0.35)
        before = min(0.5 * width, widths[(i + 1) % len(roots)], 0.35)
        if width <= after + before + 1e-9:
            result.append(np.array([root + 0.5 * width]))
            continue
        span = width - before - after
        result.append(root + after + np.linspace(0, span, int(np.ceil(span / _GAP)) + 1))
    return np.concatenate(result)
