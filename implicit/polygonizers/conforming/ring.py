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
_SCALES = np.array([1, 0.5, 0.25, 1 / 16, 1 / 64])
"""A ring is stable when it is crossed equally often at these shares of its radius."""
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


def crossings(local: Local, circle: Circle) -> FloatArray:
    """The angles (n,) in [0, 2 pi) where f changes sign on the circle, ascending."""
    angles = _angles()
    angles, values = _zoomed(local, circle, angles, local.values(circle.at(angles)))
    signs = np.where(values < 0, -1, 1)
    k = np.flatnonzero(signs != np.roll(signs, -1))
    low, high = angles[k], np.roll(angles, -1)[k]
    high = np.where(high < low, high + 2 * np.pi, high)
    return np.sort(bisect(lambda a: local.signs(circle.at(a)) == signs[k], low, high) % (2 * np.pi))


def counts(local: Local, circle: Circle, scales: FloatArray) -> IntArray:
    """How often (n,) circles with these shares of the radius are crossed."""
    angles = _angles()
    points = np.stack([circle.scaled(float(scale)).at(angles) for scale in scales])
    result = []
    for scale, row in zip(scales, local.values(points), strict=True):
        inside = _zoomed(local, circle.scaled(float(scale)), angles, row)[1] < 0
        result.append(np.count_nonzero(inside != np.roll(inside, 1)))
    return np.array(result)


def _angles() -> FloatArray:
    return 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES + 0.0123


def _zoomed(local: Local, circle: Circle, angles: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The samples with more among them where two crossings may hide."""
    for _ in range(_ZOOMS):
        finer = _hidden(angles, values)
        if not len(finer) or len(angles) > 5 * _SAMPLES:
            break
        angles, values = np.concatenate([angles, finer]), np.concatenate([values, local.values(circle.at(finer))])
        order = np.argsort(angles)
        angles, values = angles[order], values[order]
    return angles, values


def bisect(same: Callable[[FloatArray], NDArray[np.bool_]], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where `same`, true at `low` and false at `high`, changes."""
    for _ in range(36 if len(low) else 0):
        middle = (low + high) / 2
        below = same(middle)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def _hidden(angles: FloatArray, values: FloatArray) -> FloatArray:
    """Angles to look at: round the least |f| among neighbours of one sign, where it is low enough to hide two zeros."""
    size, signs = np.abs(values), values < 0
    ahead, behind = np.roll(size, -1), np.roll(size, 1)
    least = (size <= ahead) & (size <= behind) & (signs == np.roll(signs, -1)) & (signs == np.roll(signs, 1))
    k = np.flatnonzero(least & (size < 0.5 * np.minimum(ahead, behind) + 0.02 * size.max()))
    low, high = np.roll(angles, 1)[k], np.roll(angles, -1)[k]
    low = np.where(low > angles[k], low - 2 * np.pi, low)
    high = np.where(high < angles[k], high + 2 * np.pi, high)
    shares = np.arange(1, 16) / 16
    return np.asarray((low[:, None] + (high - low)[:, None] * shares).ravel() % (2 * np.pi))


def stable(local: Local, circle: Circle, least: float) -> tuple[Circle | None, int]:
    """The largest circle, of radii falling by sqrt 2, crossed as often at all smaller scales, and how often."""
    factor = 1.0
    while circle.radius * factor > least:
        found = counts(local, circle, factor * _SCALES)
        if (found == found[0]).all():
            return circle.scaled(factor), int(found[0])
        factor /= 2**0.5
    return None, int(counts(local, circle, _SCALES[:1])[0])


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
