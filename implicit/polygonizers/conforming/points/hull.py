"""Bernstein bounds of the polynomials q(t, u, v) on the faces of a block, and of their derivatives along the faces."""

from dataclasses import dataclass
from functools import cache
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
        shape = self.coefficients.shape[1:]
        error = 32 * (sum(shape) + 16) * float(np.finfo(float).eps)
        weights = _weights(shape)
        matrices, powers = np.empty((3, max(shape), max(shape))), np.empty((5, max(shape)))
        _find_ranges(
            self.coefficients, self.sizes, np.ascontiguousarray(boxes), weights, error, result, matrices, powers,
            np.empty((3, *shape)), np.empty(shape[2]), everywhere,
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


@njit(**OPTIONS)
def _find_ranges(
    faces: Any, abs_faces: Any, boxes: Any, weights: Any, error: float, result: Any, matrices: Any, powers: Any,
    room: Any, sizes: Any, everywhere: bool,
) -> None:  # fmt: skip
    _, a, b, c = room.shape
    one, two, hull = room[0], room[1], room[2]
    for index in range(len(boxes)):
        box = boxes[index]
        face = int(box[3, 0])
        q, weight = faces[face], abs_faces[face]
        first = 0  # the first axis along which the box is not that before: what it shares with it is kept
        if index > 0 and boxes[index - 1, 3, 0] == box[3, 0]:
            while (
                first < 2
                and boxes[index - 1, first, 0] == box[first, 0]
                and boxes[index - 1, first, 1] == box[first, 1]
            ):
                first += 1
        for axis in range(first, 3):
            n = room.shape[1 + axis]
            _fill_matrix(box[axis, 0], box[axis, 1], weights[axis], n, powers[3:], matrices[axis])
            for m in range(n):
                low, high = abs(powers[3, m]), abs(powers[4, m])
                powers[axis, m] = low if low > high else high
        if first == 0:
            for m in range(a):
                for j in range(b):
                    for k in range(c):
                        total = 0.0
                        for i in range(a):
                            total += matrices[0, i, m] * q[i, j, k]
                        one[m, j, k] = total
        if first < 2:
            for k in range(c):
                sizes[k] = 0.0
                for i in range(a):
                    for m in range(b):
                        total = 0.0
                        for j in range(b):
                            total += matrices[1, j, m] * one[i, j, k]
                        two[i, m, k] = total
                        sizes[k] += weight[i, m, k] * powers[0, i] * powers[1, m]
        size = 0.0
        for k in range(c):
            size += sizes[k] * powers[2, k]
        for i in range(a):
            for j in range(b):
                for m in range(c):
                    total = 0.0
                    for k in range(c):
                        total += matrices[2, k, m] * two[i, j, k]
                    hull[i, j, m] = total
        slack = error * size
        for axis in range(3):  # the values, then the steps along u and v
            low, high, u, v = np.inf, -np.inf, int(axis == 1), int(axis == 2)
            if axis > 0 and not everywhere and (result[index, 0] > 0.0 or result[index, 1] < 0.0):
                result[index, 2 * axis] = result[index, 2 * axis + 1] = 0.0
                continue
            for i in range(a):
                for j in range(b - u):
                    for k in range(c - v):
                        step = hull[i, j + u, k + v]
                        if axis > 0:
                            step -= hull[i, j, k]
                        low = step if step < low else low
                        high = step if step > high else high
            factor = 1.0
            if axis > 0:
                n, width = room.shape[1 + axis] - 1, box[axis, 1] - box[axis, 0]
                factor = n / width if n > 0 and width > 0.0 else 0.0
                slack = 2 * slack if axis == 1 else slack
            if factor == 0.0:
                low, high = 0.0, 0.0
            result[index, 2 * axis] = (low - slack) * factor
            result[index, 2 * axis + 1] = (high + slack) * factor
