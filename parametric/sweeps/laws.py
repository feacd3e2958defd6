"""Laws of twist and scale along a path: a number reached linearly, or a function of the fraction run."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from parametric.differences import differentiate
from parametric.parameters import Array

LawLike: TypeAlias = "float | Callable[[float], float]"


class Law:
    """A function of s in [0, 1]: from `first` linearly to a number, or any callable."""

    def __init__(self, value: LawLike, first: float, name: str) -> None:
        self.function = value if callable(value) else None
        self.first, self.last = (first, first) if callable(value) else (first, float(value))
        ends = self(0.0), self(1.0)
        if not np.isfinite(ends).all():
            raise ValueError(f"{name} must be finite, got {ends[0]} to {ends[1]}")

    def __call__(self, s: float) -> float:
        """The value at s."""
        return self.first + (self.last - self.first) * s if self.function is None else float(self.function(s))

    def _sample(self, s: Array) -> Array:
        return np.array([self(float(x)) for x in s.ravel()]).reshape(*s.shape, 1)

    def derivatives(self, s: Array, order: int) -> list[Array]:
        """Values and derivatives up to the order, each (..., 1)."""
        if self.function is not None:
            return [differentiate(self._sample, s, k, (0.0, 1.0)) for k in range(order + 1)]
        slope = np.full((*s.shape, 1), self.last - self.first)
        return [self.first + slope * s[..., None], slope, *[np.zeros_like(slope)] * (order - 1)][: order + 1]
