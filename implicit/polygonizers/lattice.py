"""The lattice of sample points and its bricks.

A brick is 7 x 7 x 7 cells, that is 8 x 8 x 8 samples: one bit for each sample makes one 64-bit word for each plane of
constant x. Neighbouring bricks share the samples on their common face. Lattice planes are numbered 0 to `cells` along
each axis; samples of a brick beyond the last plane repeat it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds

CELLS = 7
"""Cells along the side of a brick."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Planes of constant x, y and z over a box; the step along each axis is at most the longest side / resolution."""

    axes: tuple[FloatArray, FloatArray, FloatArray]

    @classmethod
    def over(cls, bounds: Bounds, resolution: int) -> "Lattice":
        """The lattice over the box of `bounds`, with `resolution` cells along the longest side."""
        lower, upper = bounds.box.corners
        sides = upper - lower
        counts = np.maximum(np.ceil(sides / (sides.max() / resolution) * (1 - 1e-12)), 1).astype(int)
        x, y, z = (np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, counts))
        return cls((x, y, z))

    @cached_property
    def cells(self) -> tuple[int, int, int]:
        """The number of cells along each axis."""
        x, y, z = self.axes
        return len(x) - 1, len(y) - 1, len(z) - 1

    @cached_property
    def bricks(self) -> tuple[int, int, int]:
        """The number of bricks along each axis."""
        x, y, z = self.cells
        return -(-x // CELLS), -(-y // CELLS), -(-z // CELLS)

    @cached_property
    def size(self) -> float:
        """The longest side."""
        return float(max(axis[-1] - axis[0] for axis in self.axes))

    @cached_property
    def step(self) -> float:
        """The longest step between planes."""
        return float(max((axis[-1] - axis[0]) / (len(axis) - 1) for axis in self.axes))

    @cached_property
    def precision(self) -> float:
        """How exactly a point can be placed: 1e-13 of the size, or what rounding of the coordinates leaves."""
        far = max(float(np.max(np.abs(axis[[0, -1]]))) for axis in self.axes)
        return max(1e-13 * self.size, 2**-50 * far)

    @cached_property
    def padded(self) -> FloatArray:
        """(3, longest) coordinates of all planes, the last one repeated to fill the last brick."""
        planes = np.empty((3, CELLS * max(self.bricks) + 1))
        for row, axis in zip(planes, self.axes, strict=True):
            row[: len(axis)], row[len(axis) :] = axis, axis[-1]
        return planes

    def all_bricks(self) -> NDArray[np.int32]:
        """(n, 3) every brick, in the order of the sweep."""
        return np.ascontiguousarray(np.indices(self.bricks, np.int32).reshape(3, -1).T[::-1])

    def brick_points(self, bricks: NDArray[np.int32]) -> FloatArray:
        """(n, 512, 3) the sample points of bricks (n, 3)."""
        planes = bricks[:, :, None] * CELLS + np.arange(CELLS + 1)
        x, y, z = (self.padded[axis][planes[:, axis]] for axis in range(3))
        points = np.empty((len(bricks), 8, 8, 8, 3))
        points[..., 0] = x[:, :, None, None]
        points[..., 1] = y[:, None, :, None]
        points[..., 2] = z[:, None, None, :]
        return points.reshape(len(bricks), 512, 3)


def in_order(bricks: NDArray[np.int32]) -> NDArray[np.int32]:
    """Bricks (n, 3) from the last to the first by x, y, z: a brick comes after the neighbours above it."""
    return np.ascontiguousarray(bricks[np.lexsort((bricks[:, 2], bricks[:, 1], bricks[:, 0]))[::-1]])
