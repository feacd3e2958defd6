"""Bernstein bounds of the polynomials q(t, u, v) on the faces of a block, and of their derivatives along the faces."""

from dataclasses import dataclass
from functools import cache
from math import prod
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.bernstein import polar_weights
from implicit.kernels.elementary import INNER, OPTIONS

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hull:
    """Coefficients (faces, s, j, k) of t^s u^j v^k, and what may be lost in them by rounding is a share of `sizes`."""

    coefficients: FloatArray
    sizes: FloatArray

    @classmethod
    def of(cls, q: FloatArray) -> "Hull":
        """The polynomials of several faces, given by their coefficients (faces, s, j, k)."""
        return cls(q, np.abs(q))

    def at_end(self) -> "Hull":
        """The polynomials at t = 1, which are the same for all t."""
        q, sizes = (part.sum(axis=1, keepdims=True) for part in (self.coefficients, self.sizes))
        return Hull(q, sizes)

    def ranges(self, boxes: FloatArray, everywhere: bool = False) -> FloatArray:
        """Bounds (n, 6) of q and its derivatives in u and v on boxes (n, 4, 2), rounding included.

        Boxes are ranges of t, u and v, and the number of the face, twice. Where a box has no width along an axis, the
        derivative along it is given as 0; and where q has no zero, unless they are wanted everywhere.
        """
        result = np.empty((len(boxes), 6))
        faces, *shape = self.coefficients.shape
        error = 32 * (sum(shape) + 16) * float(np.finfo(float).eps)
        matrices, powers = np.empty((3, max(shape), max(shape))), np.empty((5, max(shape)))
        room = np.empty((3, prod(shape)))
        _find_ranges(
            self.coefficients.reshape(faces, -1), self.sizes, np.ascontiguousarray(boxes), _weights(tuple(shape)),
            error, everywhere, result, matrices, powers, room, room[2].reshape(shape),
        )  # fmt: skip
        return result


@cache
def _weights(shape: tuple[int, ...]) -> FloatArray:
    """The weights of Bernstein coefficients of all axes in one array."""
    table = np.zeros((3, max(shape), max(shape), max(shape)))
    for part, n in zip(table, shape, strict=True):
        part[:n, :n, :n] = polar_weights(n - 1)
    return table


@njit(**INNER)
def _fill_matrix(low: float, high: float, weights: Any, n: int, powers: Any, matrix: Any) -> None:
    """Row m, column i: the mean of the products of m ends out of i upper and degree - i lower ones."""
    powers[0, 0] = powers[1, 0] = 1.0
    for m in range(1, n):
        powers[0, m], powers[1, m] = low * powers[0, m - 1], high * powers[1, m - 1]
    for m in range(n):
        for i in range(n):
            total = 0.0
            for s in range(m + 1):
                total += weights[i, m, s] * powers[1, s] * powers[0, m - s]
            matrix[m, i] = total


@njit(**INNER)
def _contract(matrix: Any, n: int, source: Any, target: Any) -> None:
    """Row r, column m of the target: sum over i of matrix[i, m] source[i, r]. The first axis becomes the last."""
    rest = len(source) // n
    for r in range(rest):
        for m in range(n):
            total = 0.0
            for i in range(n):
                total += matrix[i, m] * source[i * rest + r]
            target[r * n + m] = total


@njit(**INNER)
def _size_of(sizes: Any, powers: Any) -> float:
    """The sum of sizes (a, b, c) times powers of the farthest t, u and v."""
    size = 0.0
    for k in range(sizes.shape[2]):
        total = 0.0
        for i in range(sizes.shape[0]):
            for j in range(sizes.shape[1]):
                total += sizes[i, j, k] * powers[0, i] * powers[1, j]
        size += total * powers[2, k]
    return size


@njit(**INNER)
def _extremes(hull: Any, axis: int) -> tuple[float, float]:
    """The least and the largest coefficient, or step from one to the next along u (axis 1) or v (axis 2)."""
    low, high, u, v = np.inf, -np.inf, int(axis == 1), int(axis == 2)
    for i in range(hull.shape[0]):
        for j in range(hull.shape[1] - u):
            for k in range(hull.shape[2] - v):
                step = hull[i, j + u, k + v]
                if axis > 0:
                    step -= hull[i, j, k]
                low = step if step < low else low
                high = step if step > high else high
    return low, high


@njit(**OPTIONS)
def _find_ranges(
    faces: Any, sizes: Any, boxes: Any, weights: Any, error: float, everywhere: bool, result: Any, matrices: Any,
    powers: Any, room: Any, hull: Any,
) -> None:  # fmt: skip
    for index in range(len(boxes)):
        box = boxes[index]
        face = int(box[3, 0])
        first = 0  # the first axis along which the box is not that before: what it shares with it is kept
        if index > 0 and boxes[index - 1, 3, 0] == box[3, 0]:
            while (
                first < 2
                and boxes[index - 1, first, 0] == box[first, 0]
                and boxes[index - 1, first, 1] == box[first, 1]
            ):
                first += 1
        for axis in range(first, 3):
            n = hull.shape[axis]
            _fill_matrix(box[axis, 0], box[axis, 1], weights[axis], n, powers[3:], matrices[axis])
            for m in range(n):
                low, high = abs(powers[3, m]), abs(powers[4, m])
                powers[axis, m] = low if low > high else high
            source = faces[face] if axis == 0 else room[axis - 1]
            _contract(matrices[axis], n, source, room[axis])
        slack = error * _size_of(sizes[face], powers)
        for axis in range(3):  # the values, then the steps along u and v
            n, width = hull.shape[axis] - 1, box[axis, 1] - box[axis, 0]
            result[index, 2 * axis] = result[index, 2 * axis + 1] = 0.0
            if axis > 0 and (n == 0 or not width > 0.0):
                continue
            if axis > 0 and not everywhere and (result[index, 0] > 0.0 or result[index, 1] < 0.0):
                continue
            low, high = _extremes(hull, axis)
            factor = n / width if axis > 0 else 1.0
            lost = 2 * slack if axis > 0 else slack
            result[index, 2 * axis] = (low - lost) * factor
            result[index, 2 * axis + 1] = (high + lost) * factor
