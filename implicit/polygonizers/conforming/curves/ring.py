"""Where a surface crosses a small circle, and where to put vertices on it so that every sector has its own.

A circle round a point m of a singular curve, in the plane across the curve, meets the surface in as many points as
sheets meet there, once it is small enough. They are counted on the sides of a polygon, where it is proved that none is
missed, however thin a sector is; the vertices stand beside each crossing, as near as the sector on its other side is
wide.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.enclose import changes
from implicit.polygonizers.conforming.local import Local, unit_rows
from implicit.polygonizers.conforming.tetrahedra.sheets import find_roots

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SIDES = 12
"""Of the regular polygon that stands for a circle."""
_SCALES = (1.0, 0.5, 0.25, 1 / 16, 1 / 64)
"""A ring is stable when it is crossed equally often at these shares of its radius."""
_NEARLY = 1e-3
"""Newton's last step to a crossing, as a share of a side at most: it makes the error about its square."""
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
class Circles:
    """Circles looked at together: places (n, 3), axes (n, 3), radii (n,); all in space or all on one sphere."""

    center: FloatArray
    u: FloatArray
    v: FloatArray
    radius: FloatArray
    sphere: tuple[FloatArray, float] | None = None

    @classmethod
    def of(cls, circles: list[Circle]) -> "Circles":
        """Those of a list."""
        center, u, v = (np.array([getattr(c, name) for c in circles]).reshape(-1, 3) for name in ("center", "u", "v"))
        radius = np.array([circle.radius for circle in circles])
        return cls(center, u, v, radius, circles[0].sphere if circles else None)

    def scaled(self, rows: IntArray, factors: FloatArray) -> "Circles":
        """Circles `rows` (k,) with their radii times factors, (k,) or one."""
        center, u, v, radius = (part[rows] for part in (self.center, self.u, self.v, self.radius))
        return Circles(center, u, v, radius * factors, self.sphere)

    @property
    def sides(self) -> tuple[FloatArray, FloatArray]:
        """The ends (n sides, 3) of the sides of regular polygons."""
        turn = 2 * np.pi * np.arange(_SIDES) / _SIDES + 0.0123
        across = np.cos(turn)[:, None] * self.u[:, None] + np.sin(turn)[:, None] * self.v[:, None]
        points = self.center[:, None] + self.radius[:, None, None] * across
        if self.sphere is not None:
            points = self.sphere[0] + self.sphere[1] * unit_rows(points - self.sphere[0])
        return points.reshape(-1, 3), np.roll(points, -1, axis=1).reshape(-1, 3)

    def angles(self, rows: IntArray, points: FloatArray) -> FloatArray:
        """The angles (k,) in [0, 2 pi) at which circles (k,) of these see points (k, 3)."""
        way = points - self.center[rows]
        x, y = (np.einsum("ij,ij->i", way, axis[rows]) for axis in (self.u, self.v))
        return np.asarray(np.arctan2(y, x) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class Rings:
    """How often (n,) circles are crossed, and at which angles (n, k): so many ascending ones, then infinite ones."""

    number: IntArray
    angles: FloatArray

    def replaced(self, rows: IntArray, fresh: "Rings") -> "Rings":
        """These, with fresh ones in some rows."""
        number = self.number.copy()
        angles = np.full((len(number), max(self.angles.shape[1], fresh.angles.shape[1])), np.inf)
        angles[:, : self.angles.shape[1]] = self.angles
        angles[rows] = np.inf
        number[rows], angles[rows, : fresh.angles.shape[1]] = fresh.number, fresh.angles
        return Rings(number, angles)


def rings(local: Local, circles: Circles) -> Rings:
    """The angles in [0, 2 pi) where f changes sign on the polygon of each circle."""
    a, b = circles.sides
    found = changes(local, a, b)
    unsure = np.flatnonzero(~found.sure)  # two changes, one at each end
    side = np.concatenate([found.owner[found.sure], found.owner[unsure], found.owner[unsure]])
    low, high = (part[found.sure, None] for part in (found.low, found.high))
    way = b[side] - a[side]
    sure = slice(0, len(low))
    roots = find_roots(local, a[side][sure] + low * way[sure], a[side][sure] + high * way[sure], _NEARLY)
    shares = np.concatenate([found.low[unsure], found.high[unsure]])[:, None]
    places = np.concatenate([roots, a[side][len(low) :] + shares * way[len(low) :]])
    owner = side // _SIDES
    angles = circles.angles(owner, places)
    order = np.lexsort((angles, owner))
    number = np.bincount(owner, minlength=len(circles.radius))
    result = np.full((len(number), int(number.max(initial=0))), np.inf)
    owner = owner[order]
    result[owner, np.arange(len(owner)) - (np.cumsum(number) - number)[owner]] = angles[order]
    return Rings(number, result)


def crossings(local: Local, circles: list[Circle]) -> list[FloatArray]:
    """For each circle the angles (n,) in [0, 2 pi) where f changes sign on its polygon, ascending."""
    if not circles:
        return []
    found = rings(local, Circles.of(circles))
    return [angles[:number] for number, angles in zip(found.number, found.angles, strict=True)]


def counts(local: Local, circles: Circles) -> tuple[IntArray, NDArray[np.bool_]]:
    """How often (n,) the polygons of circles are crossed, and of which that can be seen, not lost in rounding."""
    found = changes(local, *circles.sides)
    return found.counts.reshape(-1, _SIDES).sum(axis=1), np.asarray(found.loud.reshape(-1, _SIDES).all(axis=1))


def stable(local: Local, circles: list[Circle], least: float) -> tuple[list[Circle | None], IntArray]:
    """The largest circles, of radii falling by sqrt 2 to a least share, crossed as often at all smaller scales at
    which that can be seen; None where there is none. And how often each is crossed.
    """
    found: list[Circle | None] = [None] * len(circles)
    number = np.zeros(len(circles), np.int64)
    many, left = Circles.of(circles), np.arange(len(circles))
    factor = 1.0
    while len(left) and factor > least:
        tried = many.scaled(np.repeat(left, len(_SCALES)), factor * np.tile(_SCALES, len(left)))
        crossed, seen = (part.reshape(-1, len(_SCALES)) for part in counts(local, tried))
        same = ((crossed == crossed[:, :1]) | ~seen).all(axis=1) & seen[:, 0]
        if factor == 1.0:
            number[:] = crossed[:, 0]
        number[left[same]] = crossed[same, 0]
        for row in left[same].tolist():
            found[row] = circles[row].scaled(factor)
        left = left[~same]
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
