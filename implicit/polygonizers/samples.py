"""Where the numbers come from: samples of bricks, values and gradients at points."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField, TapeField
from implicit.polygonizers.lattice import CELLS, Lattice, in_order
from implicit.work import check_memory

if TYPE_CHECKING:
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
_LARGEST = 20_000
"""Coefficients of a polynomial that is worth a dense table."""

_BYTES_PER_BRICK = 40
"""To mark every brick of a lattice while looking for those that may be crossed."""

BrickArray = NDArray[np.int32]


class Sampler(Protocol):
    """Samples of f on the bricks of a lattice that the surface may meet."""

    @property
    def lattice(self) -> Lattice:
        """The lattice."""

    @property
    def bricks(self) -> BrickArray:
        """The bricks (n, 3) in the order of the sweep."""

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""

    def sample(self, bricks: BrickArray, samples: FloatArray) -> None:
        """Write f at the sample points of any bricks (n, 3) into samples (n, 512)."""

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n); those from starts[i] on lie in brick first + i."""

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""


@dataclass(frozen=True, eq=False)
class FieldSampler:
    """Samples every point of the given bricks with `field.values`."""

    field: Field
    lattice: Lattice
    bricks: BrickArray

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""
        self.sample(self.bricks[first:last], samples)

    def sample(self, bricks: BrickArray, samples: FloatArray) -> None:
        """Write f at the sample points of any bricks (n, 3) into samples (n, 512)."""
        points = self.lattice.brick_points(bricks)
        samples[...] = self.field.values(points.reshape(-1, 3)).reshape(-1, 512)

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        return self.anywhere(points)

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        values, gradients = self.field.gradients(np.ascontiguousarray(points.T))
        return values, np.ascontiguousarray(gradients.T)


def choose_sampler(surface: "Surface", lattice: Lattice) -> Sampler:
    """The sampler that knows most about a surface."""
    return sampler_of(surface.field, lattice)


def sampler_of(field: Field, lattice: Lattice, bricks: BrickArray | None = None) -> Sampler:
    """The sampler that knows most about a field: of the given bricks, or of all that it cannot rule out."""
    if bricks is None:
        check_memory(
            _BYTES_PER_BRICK * float(np.prod(np.array(lattice.bricks, float))),
            f"a list of {' x '.join(str(count) for count in lattice.bricks)} bricks of 7 x 7 x 7 cells",
            "lower the resolution or take smaller bounds",
        )
    if isinstance(field, PolynomialField) and np.prod(field.exponents.max(axis=0, initial=0) + 1) <= _LARGEST:
        from implicit.polygonizers.horner import PolynomialSampler

        return PolynomialSampler.over(field, lattice, bricks)
    if isinstance(field, TapeField):
        from implicit.polygonizers.tapes import TapeSampler

        return TapeSampler.over(field, lattice, bricks)
    return FieldSampler(field, lattice, _in_range(field, lattice) if bricks is None else bricks)


def _in_range(field: Field, lattice: Lattice) -> BrickArray:
    """The bricks where the ranges of a field do not have one sign; all of them when the ranges are infinite."""
    whole = np.array([[[axis[0] for axis in lattice.axes], [axis[-1] for axis in lattice.axes]]])
    if not np.isfinite(field.ranges(whole)).all():
        return lattice.all_bricks()
    level = (max(lattice.bricks) - 1).bit_length()
    blocks = np.zeros((1, 3), np.int64)
    halves = np.indices((2, 2, 2)).reshape(3, -1).T
    while True:
        planes = np.minimum(np.stack([blocks, blocks + 1], axis=1) * (CELLS << level), lattice.cells)
        boxes = np.stack([axis[planes[..., i]] for i, axis in enumerate(lattice.axes)], axis=-1)
        ranges = field.ranges(boxes)
        blocks = blocks[~((ranges[:, 0] >= 0) | (ranges[:, 1] < 0))]
        if level == 0:
            return in_order(blocks[lattice.met()[tuple(blocks.T)]].astype(np.int32))
        level -= 1
        blocks = (2 * blocks[:, None] + halves).reshape(-1, 3)
        blocks = blocks[(blocks * (CELLS << level) < lattice.cells).all(axis=1)]
