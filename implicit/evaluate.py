"""Fast numbers: values, derivatives and guaranteed ranges, from coefficients or from a tape."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.kernels.elementary import Rows
from implicit.kernels.horner import LANES, evaluate_terms
from implicit.kernels.sweep import Pool
from implicit.second import hessians_of
from implicit.tape import Tape

Floats: TypeAlias = NDArray[np.float64]


class Field(Protocol):
    """The numeric side of a surface. Points are (n, 3), boxes (K, 2, 3); nothing is checked here."""

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3)."""

    def ranges(self, boxes: Floats) -> Floats:
        """Lower and upper bounds (K, 2) of f on closed boxes, proven for f and for its computed values."""


@dataclass(frozen=True, eq=False)
class PolynomialField:
    """A polynomial sum of c x^i y^j z^k, with `errors` bounding how far each float c is off."""

    exponents: NDArray[np.int64]
    coefficients: Floats
    errors: Floats

    @cached_property
    def degree(self) -> int:
        """The total degree."""
        return int(self.exponents.sum(axis=1).max(initial=0))

    @cached_property
    def noise(self) -> PolynomialField:
        """How far computed values may be off, where coordinates are at most as large as those of the place."""
        from implicit.bernstein import rounding

        sizes = np.abs(self.coefficients) * rounding(self.exponents) + self.errors
        return PolynomialField(self.exponents, sizes, np.zeros_like(sizes))

    @cached_property
    def _rows(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Floats]:
        order = np.lexsort(self.exponents.T[::-1])
        sorted_exponents = self.exponents[order]
        fresh = (np.diff(sorted_exponents[:, :2], axis=0, prepend=-1) != 0).any(axis=1)
        starts = np.flatnonzero(fresh)
        return (
            sorted_exponents[starts, :2],
            np.append(starts, len(order)),
            np.ascontiguousarray(sorted_exponents[:, 2]),
            np.ascontiguousarray(self.coefficients[order]),
        )

    def _evaluate(self, points: Floats, gradients: Floats) -> Floats:
        values = np.empty(len(points))
        size = (3, int(self.exponents.max(initial=0)) + 1, LANES)
        evaluate_terms(
            *self._rows, _plain(points), values, gradients, np.ones(size), np.zeros(size), np.empty((6, LANES))
        )
        return values

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""
        return self._evaluate(points, np.empty((0, 0)))

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""
        gradients = np.empty((len(points), 3))
        return self._evaluate(points, gradients), gradients

    def derivative(self, axis: int) -> PolynomialField:
        """The partial derivative."""
        keep = self.exponents[:, axis] > 0
        factor = self.exponents[keep, axis]
        lowered = self.exponents[keep] - np.eye(3, dtype=np.int64)[axis]
        off = self.errors[keep] * factor + np.spacing(np.abs(self.coefficients[keep] * factor))
        return PolynomialField(lowered, self.coefficients[keep] * factor, off)

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3)."""
        return np.stack([self.derivative(axis).gradients(points)[1] for axis in range(3)], axis=1)

    def ranges(self, boxes: Floats) -> Floats:
        """Bounds (K, 2) from Bernstein coefficients, rounding included."""
        from implicit.bernstein import polynomial_ranges

        return polynomial_ranges(self.exponents, self.coefficients, self.errors, boxes)


@dataclass(frozen=True, eq=False)
class TapeField:
    """An expression as a tape of registers."""

    tape: Tape

    @property
    def _whole(self) -> Rows:
        return np.array([[0, 0, 0, 0, len(self.tape)]], np.int32)

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""
        return Pool.of(self.tape).values(self._whole, np.array([0, len(points)]), points.T)

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""
        values, gradients = Pool.of(self.tape).gradients(self._whole, np.array([0, len(points)]), points.T)
        return values, np.ascontiguousarray(gradients.T)

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3)."""
        return hessians_of(self.tape, points)

    def ranges(self, boxes: Floats) -> Floats:
        """Bounds (K, 2) by interval arithmetic, rounded outward."""
        from implicit.interval import tape_ranges

        return tape_ranges(self.tape, boxes)


def _plain(points: Floats) -> Floats:
    return np.ascontiguousarray(points, dtype=float)
