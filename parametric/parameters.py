"""Parameters: float arrays that lie in the domain, and how u and v broadcast."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Interval: TypeAlias = tuple[float, float]


class Value:
    """An object whose attributes are set once and then stay."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in self.__dict__:
            raise AttributeError(f"a {type(self).__name__} cannot be changed")
        object.__setattr__(self, name, value)


def to_interval(domain: ArrayLike, name: str = "domain") -> Interval:
    """`domain` as two finite increasing floats."""
    ends = np.asarray(domain, dtype=float)
    if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] < ends[1]:
        raise ValueError(f"{name} must be two finite increasing numbers, got {domain!r}")
    return float(ends[0]), float(ends[1])


def to_parameters(values: ArrayLike, domain: Interval, name: str) -> Array:
    """`values` as floats in the domain; an excess of a few units in the last place is taken for the end itself."""
    t = np.asarray(values, dtype=float)
    if t.size == 0:
        return t
    low, high = domain
    slack = 8 * np.finfo(float).eps * max(abs(low), abs(high), high - low)
    smallest, largest = t.min(), t.max()
    if not (smallest >= low - slack and largest <= high + slack):
        wrong = smallest if not smallest >= low - slack else largest
        raise ValueError(f"parameter {name} must lie in [{low:g}, {high:g}], got {wrong:.17g}")
    if smallest < low or largest > high:
        return np.clip(t, low, high)
    return t


def check_orders(*orders: object) -> None:
    """Raise a ValueError unless all orders of derivatives are whole numbers from 0."""
    for order in orders:
        if not isinstance(order, int | np.integer) or order < 0:
            raise ValueError(f"the order of a derivative must be a whole number from 0, got {order!r}")


def to_points(values: ArrayLike, name: str, axes: int) -> Array:
    """Read-only finite points with `axes` index axes before the coordinates; plane points get z = 0."""
    points = np.array(values, dtype=float)
    shape = ", ".join("mnk"[:axes])
    if points.ndim != axes + 1 or points.shape[-1] not in (2, 3) or points.size == 0:
        raise ValueError(f"{name} must be points of shape ({shape}, 3) or ({shape}, 2), got shape {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError(f"{name} must be finite")
    if points.shape[-1] == 2:
        points = np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
    points.flags.writeable = False
    return points


def to_vector(values: ArrayLike, name: str) -> Array:
    """Read-only finite point or vector of space; a plane one gets z = 0."""
    return to_points(np.atleast_1d(np.asarray(values, dtype=float)), name, 0)


def to_weights(values: ArrayLike | None, shape: tuple[int, ...]) -> Array | None:
    """Read-only positive weights of the given shape, or None."""
    if values is None:
        return None
    weights = np.array(values, dtype=float)
    if weights.shape != shape:
        raise ValueError(f"weights must have one number for each point, shape {shape}, got shape {weights.shape}")
    if not (np.isfinite(weights).all() and (weights > 0).all()):
        raise ValueError(f"weights must be positive and finite, got {weights.min():g} to {weights.max():g}")
    weights.flags.writeable = False
    return weights


def freeze(array: Any) -> Any:
    """The array itself, read-only from now on."""
    array.flags.writeable = False
    return array


def flatten(values: Array, shape: tuple[int, ...] | None = None) -> Array:
    """Values broadcast to a shape, in one row that kernels take without being compiled anew: contiguous, writable."""
    row = (values if shape in (None, values.shape) else np.broadcast_to(values, shape or ())).reshape(-1)
    return row if row.flags.writeable and row.flags.c_contiguous else row.copy()


def split_axes(u: Array, v: Array) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]] | None:
    """Axes along which only u varies, axes along which only v varies, and the common shape.

    None where u and v vary along one axis together: the points are then scattered and not a grid.
    """
    shape = np.broadcast_shapes(u.shape, v.shape)
    us, vs = ((1,) * (len(shape) - a.ndim) + a.shape for a in (u, v))
    if any(a > 1 and b > 1 for a, b in zip(us, vs)):
        return None
    u_axes = tuple(k for k, a in enumerate(us) if a > 1)
    v_axes = tuple(k for k, b in enumerate(vs) if b > 1)
    return u_axes, v_axes, shape


def from_grid(grid: Array, u_axes: tuple[int, ...], v_axes: tuple[int, ...], shape: tuple[int, ...]) -> Array:
    """Values (m, n, d) at the outer product of u and v, laid out as u and v broadcast: (*shape, d)."""
    if u_axes + v_axes != tuple(sorted(u_axes + v_axes)):
        axes = u_axes + v_axes
        grid = grid.reshape(*(shape[k] for k in axes), grid.shape[-1])
        grid = np.moveaxis(grid, range(len(axes)), np.argsort(np.argsort(axes)))
    return grid.reshape(*shape, grid.shape[-1])
