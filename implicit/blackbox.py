"""Surfaces known only through a function that is called, and what is combined from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds
from implicit.evaluate import Field

Floats: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class CallableField:
    """A vectorised function of points (n, 3); without a `gradient` its derivatives are central differences.

    Within `bounds`, where they are given, and nowhere else is it called. Ranges are finite only with a Lipschitz
    constant.
    """

    function: Callable[[Floats], Floats]
    gradient: Callable[[Floats], Floats] | None = None
    bounds: Bounds | None = None
    lipschitz: float | None = None

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""
        self._check(points)
        result = np.asarray(self.function(np.array(points, dtype=float)), dtype=float)
        if result.shape != (len(points),):
            came = f"shape {result.shape}, wanted ({len(points)},)"
            raise ValueError(f"a function for points of shape {np.shape(points)} returned {came}")
        return result

    def _check(self, points: Floats) -> None:
        if self.bounds is None:
            return
        lower, upper = self.bounds.box.corners
        outside = ~((points >= lower) & (points <= upper)).all(axis=1)
        if outside.any():
            place = tuple(float(c) for c in points[outside][0])
            raise ValueError(f"the function is bounded to {self.bounds}, but was asked for at {place}")

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""
        values = self.values(points)
        if self.gradient is None:
            return values, self._differences(self.values, points, np.finfo(float).eps ** (1 / 3))
        slopes = np.asarray(self.gradient(np.array(points, dtype=float)), dtype=float)
        if slopes.shape != (len(points), 3):
            raise ValueError(f"a gradient for {len(points)} points returned shape {slopes.shape}")
        return values, slopes

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3), by differences of gradients."""
        step = np.finfo(float).eps ** (1 / 3 if self.gradient else 1 / 5)
        raw = self._differences(lambda p: self.gradients(p)[1], points, step)
        return np.asarray((raw + raw.swapaxes(-1, -2)) / 2)

    def ranges(self, boxes: Floats) -> Floats:
        """Bounds (K, 2) around the value at the centre, infinite without a Lipschitz constant."""
        if self.lipschitz is None:
            return np.tile([-np.inf, np.inf], (len(boxes), 1))
        centers = boxes.mean(axis=1)
        radii = np.linalg.norm(np.maximum(boxes[:, 1] - centers, centers - boxes[:, 0]), axis=1)
        values = self.values(centers)
        reach = self.lipschitz * radii * (1 + 1e-12) + 1e-12 * np.abs(values)
        bounds = np.stack([values - reach, values + reach], axis=1)
        return np.where(np.isfinite(bounds), bounds, [-np.inf, np.inf])

    def _differences(self, function: Callable[[Floats], Floats], points: Floats, relative: float) -> Floats:
        """Central differences along x, y, z, stacked last; one-sided where the bounds end."""
        scale = np.maximum(1.0, np.abs(points).max(axis=-1, initial=0.0)) * relative
        corners = self.bounds.box.corners if self.bounds is not None else np.array([[-np.inf] * 3, [np.inf] * 3])
        columns = []
        for axis in range(3):
            high, low = points.copy(), points.copy()
            high[:, axis] = np.minimum(points[:, axis] + scale, corners[1, axis])
            low[:, axis] = np.maximum(points[:, axis] - scale, corners[0, axis])
            change = function(high) - function(low)
            width = high[:, axis] - low[:, axis]
            columns.append(change / width.reshape(-1, *[1] * (change.ndim - 1)))
        return np.stack(columns, axis=-1)


@dataclass(frozen=True)
class BranchField:
    """The least (or largest) of several fields; of equal ones the first counts."""

    fields: tuple[Field, ...]
    least: bool

    def _choose(self, parts: list[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
        value, slope = parts[0]
        for other, other_slope in parts[1:]:
            better = other < value if self.least else other > value
            better |= np.isnan(other)
            value = np.where(better, other, value)
            slope = np.where(better.reshape(-1, *[1] * (slope.ndim - 1)), other_slope, slope)
        return value, slope

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""
        values = [field.values(points) for field in self.fields]
        return self._choose([(v, v) for v in values])[0]

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""
        return self._choose([field.gradients(points) for field in self.fields])

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3)."""
        return self._choose([(field.values(points), field.hessians(points)) for field in self.fields])[1]

    def ranges(self, boxes: Floats) -> Floats:
        """Bounds (K, 2)."""
        bounds = np.stack([field.ranges(boxes) for field in self.fields])
        return np.asarray(bounds.min(axis=0) if self.least else bounds.max(axis=0))


@dataclass(frozen=True)
class MovedField:
    """The field sign f(M p + t): `matrix` (3, 3) and `shift` (3,) as nested tuples, `sign` 1 or -1."""

    field: Field
    matrix: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    shift: tuple[float, ...] = (0.0, 0.0, 0.0)
    sign: float = 1.0

    def _points(self, points: Floats) -> Floats:
        return points @ np.array(self.matrix).T + np.array(self.shift)

    def values(self, points: Floats) -> Floats:
        """The values (n,)."""
        return self.sign * self.field.values(self._points(points))

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """The values (n,) and gradients (n, 3)."""
        values, slopes = self.field.gradients(self._points(points))
        return self.sign * values, self.sign * slopes @ np.array(self.matrix)

    def hessians(self, points: Floats) -> Floats:
        """The second derivatives (n, 3, 3)."""
        matrix = np.array(self.matrix)
        return np.asarray(self.sign * matrix.T @ self.field.hessians(self._points(points)) @ matrix)

    def ranges(self, boxes: Floats) -> Floats:
        """Bounds (K, 2), over the box around the moved box."""
        matrix, middle = np.array(self.matrix), boxes.mean(axis=1)
        half = np.maximum(boxes[:, 1] - middle, middle - boxes[:, 0]) @ np.abs(matrix).T
        center = self._points(middle)
        half += 1e-14 * (half + np.abs(middle) @ np.abs(matrix).T + np.abs(self.shift))
        bounds = self.sign * self.field.ranges(np.stack([center - half, center + half], axis=1))
        return bounds if self.sign > 0 else bounds[:, ::-1]
