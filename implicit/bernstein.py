"""Bernstein coefficients: a polynomial on a box lies between its least and its largest coefficient.

On [a, b] with t = (x - a)/(b - a) a polynomial of degree n is the sum of c_k C(n, k) t^k (1 - t)^(n - k). The c_k on a
smaller box are the values of the polar form at k times b and n - k times a. Tensors have one axis per variable behind
any leading axes; degrees are those of the tensor, shape minus one.
"""

from functools import cache
from math import comb
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]

_ROOM = 2_000_000  # numbers handled at once
_TINY = 1e-290  # covers every underflow


def power_tensor(exponents: NDArray[np.int64], coefficients: Floats) -> Floats:
    """Coefficients as a full table: entry (i, j, k) belongs to x^i y^j z^k."""
    table = np.zeros(tuple(exponents.max(axis=0, initial=0) + 1))
    table[tuple(exponents.T)] = coefficients
    return table


@cache
def polar_weights(degree: int) -> Floats:
    """Entry (k, i, j) is C(k, j) C(n - k, i - j) / C(n, i): how b^j a^(i - j) enters coefficient k from x^i.

    It is the share of the products with j ends b among those of i ends out of k ends b and n - k ends a.
    """
    n = degree
    table = np.zeros((n + 1, n + 1, n + 1))
    for k in range(n + 1):
        for i in range(n + 1):
            for j in range(max(0, i + k - n), min(i, k) + 1):
                table[k, i, j] = comb(k, j) * comb(n - k, i - j) / comb(n, i)
    return table


def interval_matrices(low: Floats, high: Floats, degree: int) -> Floats:
    """Matrices (K, n + 1, n + 1) from powers of x to Bernstein coefficients on the intervals [low, high] (K,)."""
    powers = np.arange(degree + 1)
    a, b = low[:, None] ** powers, high[:, None] ** powers
    difference = np.subtract.outer(powers, powers).clip(0)
    mixed = a[:, difference] * b[:, None, :]
    return np.einsum("kij,nij->nki", polar_weights(degree), mixed, optimize=True)


def contract(tensors: Floats, matrices: Floats, axis: int) -> Floats:
    """Apply matrices (K, m, n) to one of the last three axes of tensors (K or 1, n0, n1, n2)."""
    moved = np.moveaxis(tensors, 1 + axis, -2)
    return np.moveaxis(matrices[:, None] @ moved, -2, 1 + axis)


def on_boxes(table: Floats, boxes: Floats) -> Floats:
    """Bernstein coefficients (K, n0+1, n1+1, n2+1) on boxes (K, 2, 3) of a polynomial given by its power tensor."""
    result = table[None]
    for axis in range(3):
        result = contract(result, interval_matrices(boxes[:, 0, axis], boxes[:, 1, axis], table.shape[axis] - 1), axis)
    return result


def split(tensor: Floats, axis: int, t: float = 0.5) -> tuple[Floats, Floats]:
    """Bernstein coefficients on both sides of the parameter t along an axis (de Casteljau)."""
    work = np.moveaxis(tensor, axis, 0)
    left, right = [work[0]], [work[-1]]
    while len(work) > 1:
        work = (1 - t) * work[:-1] + t * work[1:]
        left.append(work[0])
        right.append(work[-1])
    return np.moveaxis(np.stack(left), 0, axis), np.moveaxis(np.stack(right[::-1]), 0, axis)


def derivative(tensor: Floats, axis: int, width: float = 1.0) -> Floats:
    """Bernstein coefficients of the partial derivative along an axis over which the box has the given width."""
    degree = tensor.shape[axis] - 1
    if degree == 0:
        return np.zeros_like(tensor)
    return np.asarray(degree / width * np.diff(tensor, axis=axis))


def hull(tensors: Floats) -> Floats:
    """The least and the largest coefficient (..., 2) over the last three axes."""
    return np.stack([tensors.min(axis=(-3, -2, -1)), tensors.max(axis=(-3, -2, -1))], axis=-1)


def magnitude(exponents: NDArray[np.int64], sizes: Floats, boxes: Floats) -> Floats:
    """The sum of sizes |x|^i |y|^j |z|^k over the terms, at the farthest corner of each box: (K,)."""
    far = np.abs(boxes).max(axis=1)
    total = np.zeros(len(boxes))
    for (i, j, k), size in zip(exponents.tolist(), sizes.tolist(), strict=True):
        total += size * far[:, 0] ** i * far[:, 1] ** j * far[:, 2] ** k
    return total


def rounding(exponents: NDArray[np.int64]) -> float:
    """How much of `magnitude` rounding may change, in Bernstein coefficients and in values computed by any order of
    additions and multiplications: at most one unit of rounding for each, counted twice.
    """
    return float((6 * exponents.max(axis=0, initial=0).sum() + len(exponents) + 64) * 2.0**-52)


def polynomial_ranges(exponents: NDArray[np.int64], coefficients: Floats, errors: Floats, boxes: Floats) -> Floats:
    """Bounds (K, 2) of a polynomial and of its computed values on closed boxes (K, 2, 3).

    `errors` bound how far each coefficient is off. Where numbers overflow the bounds are infinite.
    """
    table = power_tensor(exponents, coefficients)
    sizes = np.abs(coefficients) * rounding(exponents) + errors * (1 + 1e-9)
    step = max(1, _ROOM // (table.size + sum(n**3 for n in table.shape)))
    result = np.empty((len(boxes), 2))
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, len(boxes), step):
            some = boxes[start : start + step]
            slack = magnitude(exponents, sizes, some) + _TINY
            bounds = hull(on_boxes(table, some))
            result[start : start + step] = np.stack([bounds[:, 0] - slack, bounds[:, 1] + slack], axis=1)
    wild = ~np.isfinite(result).all(axis=1)
    result[wild] = -np.inf, np.inf
    return result
