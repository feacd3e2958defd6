"""The lattice of the conforming polygonizer: even steps, a margin round the bounds, planes off the symmetric places.

Its cells are cubes of side `step`. It goes `margin` cells beyond the bounds, so that what lies near their boundary is
meshed whole and then cut, and its planes avoid the places where symmetric surfaces vanish along whole planes.
Lengths and places near singular points are told in lattice units: u = (p - origin) / step.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Ball, Bounds, Box
from implicit.polygonizers.lattice import Lattice

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SHIFT = np.array([0.371, 0.417, 0.293])


@dataclass(frozen=True, eq=False)
class Grid:
    """`cells` cubes of side `step` along each axis from `origin` on; those outside the ball `within` are not swept."""

    origin: FloatArray
    step: float
    cells: IntArray
    within: Ball | None = None

    @classmethod
    def over(cls, bounds: Bounds, resolution: int, margin: int) -> "Grid":
        """The grid with `resolution` cells along the longest side of the bounds, and `margin` cells round them."""
        lower, upper = bounds.box.corners
        step = bounds.box.size / resolution
        origin = lower - (margin + _SHIFT) * step
        cells = np.ceil((upper - origin) / step).astype(np.int64) + margin
        within = Ball(bounds.radius + margin * step, bounds.center) if isinstance(bounds, Ball) else None
        return cls(origin, step, cells + (cells % 7 == 0), within)

    @property
    def lattice(self) -> Lattice:
        """The same planes for the sweep."""
        x, y, z = (o + self.step * np.arange(n + 1) for o, n in zip(self.origin, self.cells, strict=True))
        return Lattice((x, y, z), self.within)

    @property
    def box(self) -> Box:
        """The whole grid."""
        return Box(self.origin, self.origin + self.step * self.cells)

    def to_units(self, points: FloatArray) -> FloatArray:
        """Points in lattice units."""
        return (points - self.origin) / self.step

    def to_points(self, units: FloatArray) -> FloatArray:
        """Lattice units as points."""
        return self.origin + self.step * units
