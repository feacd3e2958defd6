"""Where the numbers come from: samples of bricks, values and gradients at points."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField, TapeField
from implicit.polygonizers.lattice import Lattice

if TYPE_CHECKING:
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
_LARGEST = 20_000
"""Coefficients of a polynomial that is worth a dense table."""

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
        points = self.lattice.brick_points(self.bricks[first:last])
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
    field = surface.field
    if isinstance(field, PolynomialField) and np.prod(field.exponents.max(axis=0, initial=0) + 1) <= _LARGEST:
        from implicit.polygonizers.horner import PolynomialSampler

        return PolynomialSampler.over(field, lattice)
    if isinstance(field, TapeField):
        from implicit.polygonizers.tapes import TapeSampler

        return TapeSampler.over(field, lattice)
    return FieldSampler(field, lattice, lattice.all_bricks())
