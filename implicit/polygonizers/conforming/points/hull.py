"""Bernstein bounds of the polynomials q(t, u, v) on the faces of a block, and of their derivatives along the faces."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.bernstein import polar_weights

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hull:
    """Coefficients (faces, s, j, k) of t^s u^j v^k, and what may be lost in them by rounding is a share of `sizes`."""

    coefficients: FloatArray
    sizes: FloatArray

    @classmethod
    def of(cls, faces: list[FloatArray]) -> "Hull":
        """The polynomials of several faces, each given by its coefficients (s, j, k)."""
        q = np.stack(faces)
        return cls(q, np.abs(q))

    def at_end(self) -> "Hull":
        """The polynomials at t = 1, which are the same for all t."""
        q, sizes = (part.sum(axis=1, keepdims=True) for part in (self.coefficients, self.sizes))
        return Hull(q, sizes)

    def ranges(self, boxes: FloatArray) -> FloatArray:
        """Bounds (n, 6) of q and its derivatives in u and v on boxes (n, 4, 2), rounding included.

        Boxes are ranges of t, u and v, and the number of the face, twice. Where a box has no width along an axis, the
        derivative along it is given as 0.
        """
        result = np.empty((len(boxes), 6))
        shape = self.coefficients.shape[1:]
        error = 32 * (sum(shape) + 16) * float(np.finfo(float).eps)
        weights = (polar_weights(n - 1) for n in shape)
        _find_ranges(self.coefficients, self.sizes, np.ascontiguousarray(boxes), *weights, error, result)
        return result


@njit(cache=True, nogil=True)
def _fill_matrix(low: float, high: float, weights: Any, powers: Any, matrix: Any) -> None:
    """Row m, column i: the mean of the products of m ends out of i upper and degree - i lower ones."""
    n = len(weights)
    powers[0, 0] = powers[1, 0] = 1.0
    for m in range(1, n):
        powers[0, m], powers[1, m] = low * powers[0, m - 1], high * powers[1, m - 1]
    for m in range(n):
        for i in range(n):
            total = 0.0
            for s in range(m + 1):
                total += weights[i, m, s] * powers[1, s] * powers[0, m - s]
            matrix[m, i] = total


@njit(cache=True, nogil=True)
def _find_ranges(faces: Any, abs_faces: Any, boxes: Any, wt: Any, wu: Any, wv: Any, error: float, result: Any) -> None:
    a, b, c = faces.shape[1:]
    matrices = np.empty((3, max(a, b, c), max(a, b, c)))
    powers = np.empty((5, max(a, b, c)))
    one, two, hull = np.empty((a, b, c)), np.empty((a, b, c)), np.empty((a, b, c))
    for index in range(len(boxes)):
        box = boxes[index]
        q, weight = faces[int(box[3, 0])], abs_faces[int(box[3, 0])]
        for axis in range(3):
            weights = wt if axis == 0 else wu if axis == 1 else wv
            _fill_matrix(box[axis, 0], box[axis, 1], weights, powers[3:], matrices[axis])
            for m in range(len(weights)):
                powers[axis, m] = max(abs(powers[3, m]), abs(powers[4, m]))
        one[:], two[:], hull[:] = 0.0, 0.0, 0.0
        size = 0.0
        for i in range(a):
            for j in range(b):
                for k in range(c):
                    value = q[i, j, k]
                    if weight[i, j, k] != 0.0:
                        size += weight[i, j, k] * powers[0, i] * powers[1, j] * powers[2, k]
                        for m in range(c):
                            one[i, j, m] += matrices[2, k, m] * value
        for i in range(a):
            for j in range(b):
                for m in range(b):
                    for k in range(c):
                        two[i, m, k] += matrices[1, j, m] * one[i, j, k]
        for i in range(a):
            for m in range(a):
                for j in range(b):
                    for k in range(c):
                        hull[m, j, k] += matrices[0, i, m] * two[i, j, k]
        slack = error * size
        result[index, 0], result[index, 1] = hull.min() - slack, hull.max() + slack
        for axis in range(1, 3):
            width = box[axis, 1] - box[axis, 0]
            n = hull.shape[axis] - 1
            if n == 0 or width <= 0.0:
                result[index, 2 * axis], result[index, 2 * axis + 1] = 0.0, 0.0
                continue
            low, high = np.inf, -np.inf
            for i in range(a):
                for j in range(b - (axis == 1)):
                    for k in range(c - (axis == 2)):
                        step = hull[i, j + (axis == 1), k + (axis == 2)] - hull[i, j, k]
                        low, high = min(low, step), max(high, step)
            result[index, 2 * axis] = (low - 2 * slack) * n / width
            result[index, 2 * axis + 1] = (high + 2 * slack) * n / width
