"""The lattice of sample points and its bricks.

A brick is 7 x 7 x 7 cells, that is 8 x 8 x 8 samples: one bit for each sample makes one 64-bit word for each plane of
constant x. Neighbouring bricks share the samples on their common face. Lattice planes are numbered 0 to `cells` along
each axis; samples of a brick beyond the last plane repeat it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Ball, Bounds

CELLS = 7
"""Cells along the side of a brick."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Planes of constant x, y and z over a box; the step along each axis is at most the longest side / resolution.

    Bricks more than two cells outside the ball `within` are not swept.
    """

    axes: tuple[FloatArray, FloatArray, FloatArray]
    within: Ball | None = None

    @classmethod
    def over(cls, bounds: Bounds, resolution: int) -> "Lattice":
        """The lattice over the box of `bounds`, with `resolution` cells along the longest side."""
        lower, upper = bounds.box.corners
        sides = upper - lower
        counts = np.maximum(np.ceil(sides / (sides.max() / resolution) * (1 - 1e-12)), 1).astype(int)
        x, y, z = (np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, counts))
        return cls((x, y, z), bounds if isinstance(bounds, Ball) else None)

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

    def edges(self, axis: int, bricks: int) -> FloatArray:
        """Where blocks of so many bricks begin along an axis, and where the last one ends."""
        planes = self.axes[axis]
        return np.append(planes[: -1 : CELLS * bricks], planes[-1])

    def met(self, bricks: int = 1) -> NDArray[np.bool_]:
        """Which blocks of so many bricks along each axis are to be swept, (blocks along x, y, z)."""
        x, y, z = (self._gaps(axis, bricks) for axis in range(3))
        return self._near(x[:, None, None], y[:, None], z)

    def ends(self, bricks: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Which bricks (n, 3) are the last to be swept along each axis, (n, 3)."""
        last = (bricks + 1) * CELLS >= np.array(self.cells)
        if self.within:
            gaps = [np.append(self._gaps(axis, 1), np.inf) for axis in range(3)]
            for axis in range(3):
                x, y, z = (gap[bricks[:, i] + (i == axis)] for i, gap in enumerate(gaps))
                last[:, axis] |= ~self._near(x, y, z)
        return last

    def _gaps(self, axis: int, bricks: int) -> FloatArray:
        """How far the blocks of so many bricks are from the middle of the ball along an axis, 0 without a ball."""
        edges, middle = self.edges(axis, bricks), self.within.center[axis] if self.within else 0.0
        far = np.maximum(np.maximum(edges[:-1] - middle, middle - edges[1:]), 0.0)
        return far if self.within else np.zeros_like(far)

    def _near(self, x: FloatArray, y: FloatArray, z: FloatArray) -> NDArray[np.bool_]:
        """Whether what is so far from the middle of the ball along each axis is to be swept.

        Where three of the four bricks at an edge are swept, the vertices on it come twice. So it is a cell's diagonal
        away from the ball, and triangles that meet the ball have none of them.
        """
        reach = self.within.radius + 2 * self.step if self.within else np.inf
        return np.asarray(x * x + y * y + z * z <= reach * reach)

    def all_bricks(self) -> NDArray[np.int32]:
        """(n, 3) every brick to be swept, in the order of the sweep."""
        return to_bricks(self.met())

    def brick_points(self, bricks: NDArray[np.int32]) -> FloatArray:
        """(n, 512, 3) the sample points of bricks (n, 3)."""
        planes = bricks[:, :, None] * CELLS + np.arange(CELLS + 1)
        x, y, z = (self.padded[axis][planes[:, axis]] for axis in range(3))
        points = np.empty((len(bricks), 8, 8, 8, 3))
        points[..., 0] = x[:, :, None, None]
        points[..., 1] = y[:, None, :, None]
        points[..., 2] = z[:, None, None, :]
        return points.reshape(len(bricks), 512, 3)


def to_bricks(marked: NDArray[np.bool_]) -> NDArray[np.int32]:
    """(n, 3) the bricks marked in an array (bricks along x, y, z), in the order of the sweep."""
    return np.ascontiguousarray(np.argwhere(marked)[::-1].astype(np.int32))


def in_order(bricks: NDArray[np.int32]) -> NDArray[np.int32]:
    """Bricks (n, 3) from the last to the first by x, y, z: a brick comes after the neighbours above it."""
    return np.ascontiguousarray(bricks[np.lexsort((bricks[:, 2], bricks[:, 1], bricks[:, 0]))[::-1]])
