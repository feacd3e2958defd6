"""Where to look: a box or a ball."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector: TypeAlias = tuple[float, float, float]


def _vector(values: ArrayLike, name: str) -> Vector:
    array = np.asarray(values, dtype=float)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be three finite numbers, got {values!r}")
    return float(array[0]), float(array[1]), float(array[2])


@dataclass(frozen=True, init=False)
class Box:
    """The points between two opposite corners, in lengths: lower <= p <= upper in every coordinate."""

    lower: Vector
    upper: Vector

    def __init__(self, lower: ArrayLike, upper: ArrayLike) -> None:
        low, high = _vector(lower, "lower"), _vector(upper, "upper")
        if not all(a < b for a, b in zip(low, high, strict=True)):
            raise ValueError(f"a Box needs lower < upper in every coordinate, got lower {low}, upper {high}")
        object.__setattr__(self, "lower", low)
        object.__setattr__(self, "upper", high)

    @property
    def box(self) -> "Box":
        """The box itself."""
        return self

    @property
    def corners(self) -> NDArray[np.float64]:
        """Lower and upper corner, (2, 3)."""
        return np.array([self.lower, self.upper])

    @property
    def size(self) -> float:
        """The longest side."""
        return float(np.max(self.corners[1] - self.corners[0]))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Which points (..., 3) lie in the closed box, (...,)."""
        p = np.asarray(points, dtype=float)
        return np.asarray(np.all((p >= self.corners[0]) & (p <= self.corners[1]), axis=-1))


@dataclass(frozen=True, init=False)
class Ball:
    """The points within `radius` of `center`."""

    radius: float
    center: Vector

    def __init__(self, radius: float, center: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        if not (np.isfinite(radius) and radius > 0):
            raise ValueError(f"a Ball needs a positive finite radius, got {radius!r}")
        object.__setattr__(self, "radius", float(radius))
        object.__setattr__(self, "center", _vector(center, "center"))

    @property
    def box(self) -> Box:
        """The smallest box around the ball."""
        center = np.array(self.center)
        return Box(center - self.radius, center + self.radius)

    @property
    def size(self) -> float:
        """The diameter."""
        return 2 * self.radius

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Which points (..., 3) lie in the closed ball, (...,)."""
        p = np.asarray(points, dtype=float) - self.center
        return np.asarray(np.sum(p * p, axis=-1) <= self.radius**2)


Bounds: TypeAlias = Box | Ball


def to_bounds(bounds: Bounds | float) -> Bounds:
    """`bounds` as a Box or Ball; a number r means Box((-r,)*3, (r,)*3)."""
    if isinstance(bounds, Box | Ball):
        return bounds
    if isinstance(bounds, int | float | np.integer | np.floating) and not isinstance(bounds, bool):
        if not (np.isfinite(bounds) and bounds > 0):
            raise ValueError(f"bounds as a number must be positive and finite, got {bounds!r}")
        r = float(bounds)
        return Box((-r, -r, -r), (r, r, r))
    raise TypeError(f"bounds must be a Box, a Ball or a number, got {type(bounds).__name__}")
