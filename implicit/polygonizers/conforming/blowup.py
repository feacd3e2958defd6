"""Proof that a surface is a cone inside a block of cells round an isolated singular point.

The block is the union of the segments from the point p to its boundary. On a face of the block, with w the vector from
p to a point of the face and m the multiplicity,

    f(p + t w) = t^m q(t, w),        0 <= t <= 1

and q is a polynomial in t and the two coordinates of the face. If, for every t, the curve q(t, .) = 0 on the boundary
of the block is without singular points, crosses the ribs of the block and misses its corners, then these curves deform
into each other: inside the block f = 0 is a cone with apex p over the curve on the boundary. And if the curve of t = 1
crosses each lattice edge at most once, or turns by less than a right angle in the squares beside, and is at most one
arc in each square, then marching the squares finds it up to a deformation. All this is read off the Bernstein
coefficients of q on boxes of (t, w), halved where need be, as proposed for curves and surfaces by
Plantinga and Vegter, 2004, doi:10.1145/1057432.1057465).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from math import comb
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Test = Callable[[FloatArray, FloatArray], NDArray[np.bool_]]

_NEGLIGIBLE = 1e-9
"""Coefficients below the multiplicity, as a share of those at it, that stem from rounding the point."""
_DEPTH = 4
"""Boxes of (t, w) are halved so often."""
_MOST = 4000
"""Boxes that are looked at together; more mean no answer."""


@dataclass(frozen=True, eq=False)
class Germ:
    """f(p + step w) as coefficients (i, j, k) of the powers of w, and the multiplicity of f at p."""

    coefficients: FloatArray
    multiplicity: int

    @classmethod
    def at(cls, field: PolynomialField, point: FloatArray, step: float) -> "Germ":
        """The germ of a polynomial at a singular point, with lengths in units of `step`."""
        tensor = np.zeros(tuple(field.exponents.max(axis=0, initial=0) + 1))
        np.add.at(tensor, tuple(field.exponents.T), field.coefficients)
        for axis in range(3):
            n = tensor.shape[axis]
            shift = np.array(
                [[comb(a, i) * point[axis] ** (a - i) if a >= i else 0.0 for a in range(n)] for i in range(n)]
            )
            shift *= float(step) ** np.arange(n)[:, None]
            tensor = np.moveaxis(np.tensordot(shift, tensor, axes=(1, axis)), 0, axis)
        total = np.indices(tensor.shape).sum(axis=0)
        size = np.array([np.abs(tensor[total == d]).max(initial=0.0) for d in range(int(total.max()) + 1)])
        multiplicity = int(np.argmax(size > _NEGLIGIBLE * size.max()))
        return cls(np.where(total < multiplicity, 0.0, tensor), multiplicity)

    @cached_property
    def _cone(self) -> PolynomialField:
        total = np.indices(self.coefficients.shape).sum(axis=0)
        exponents = np.argwhere((total == self.multiplicity) & (self.coefficients != 0))
        return PolynomialField(exponents, self.coefficients[tuple(exponents.T)], np.zeros(len(exponents)))

    def tangent_cone(self, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (n, 3) of the terms of lowest degree at vectors w (n, 3)."""
        return self._cone.gradients(w)

    def face(self, axis: int, height: float) -> FloatArray:
        """Coefficients (s, j, k) of t^s u^j v^k in q on the face w[axis] = height; u, v are the next two axes."""
        turned = np.moveaxis(self.coefficients, [axis, (axis + 1) % 3, (axis + 2) % 3], [0, 1, 2])
        i, j, k = (np.asarray(index) for index in np.indices(turned.shape))
        s: IntArray = i + j + k - self.multiplicity
        result = np.zeros((max(int(s.max()), 0) + 1, *turned.shape[1:]))
        used = s >= 0
        np.add.at(result, (s[used], j[used], k[used]), (turned * height**i)[used])
        return result


def is_cone(germ: Germ, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether f = 0 is proved to be a cone in the block from p + lower to p + upper, seen rightly by its squares."""
    if germ.multiplicity < 2:
        return False
    heights = [(axis, float(end[axis])) for axis in range(3) for end in (lower, upper)]
    return all(_face_holds(germ, axis, height, lower, upper) for axis, height in heights)


def _face_holds(germ: Germ, axis: int, height: float, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether a face, its ribs and its corners pass; ribs, corners and lattice edges are boxes without width."""
    q = germ.face(axis, height)
    u, v = ((lower[a], upper[a]) for a in ((axis + 1) % 3, (axis + 2) % 3))
    p, r = _unit_steps(*u), _unit_steps(*v)
    across = np.stack([_boxes(np.array([a, a]), r) for a in p])
    along = np.stack([_boxes(p, np.array([b, b])) for b in r], axis=1)
    ribs = np.concatenate([across[0], across[-1], along[:, 0], along[:, -1]])
    corners = np.concatenate([_boxes(np.array([a, a]), np.array([b, b])) for a in u for b in v])
    squares = _boxes(p, r)
    return (
        _edges_hold(q, across, along, squares)
        and _single(q, _at(1.0, squares))
        and bool(_everywhere(q, _at(0.0, np.concatenate([squares, ribs, corners])), _simple).all())
    )


def _edges_hold(q: FloatArray, across: FloatArray, along: FloatArray, squares: FloatArray) -> bool:
    """Whether each lattice edge is crossed once at most, or both its squares let the curve turn by no right angle."""
    once = _crossed_once(q, _at(1.0, np.concatenate([across.reshape(-1, 2, 2), along.reshape(-1, 2, 2)])))
    if once.all():
        return True
    simple = np.zeros((across.shape[0] + 1, along.shape[1] + 1), bool)
    simple[1:-1, 1:-1] = _simple(q, _at(1.0, squares)).reshape(across.shape[0] - 1, along.shape[1] - 1)
    beside = (simple[:-1, 1:-1] & simple[1:, 1:-1], simple[1:-1, :-1] & simple[1:-1, 1:])
    return bool((once | np.concatenate([beside[0].ravel(), beside[1].ravel()])).all())


def _unit_steps(low: float, high: float) -> FloatArray:
    return np.linspace(low, high, max(round(high - low), 1) + 1)


def _boxes(u: FloatArray, v: FloatArray) -> FloatArray:
    """Boxes (n, 2, 2) of (u, v) between consecutive values."""
    a, b = np.stack([u[:-1], u[1:]], axis=1), np.stack([v[:-1], v[1:]], axis=1)
    i, j = (index.ravel() for index in np.indices((len(a), len(b))))
    return np.stack([a[i], b[j]], axis=1)


def _at(t: float, boxes: FloatArray) -> FloatArray:
    """Boxes (n, 3, 2) of (t, u, v) from t to 1."""
    return np.concatenate([np.broadcast_to([t, 1.0], (len(boxes), 1, 2)), boxes], axis=1)


def _halves(boxes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Boxes halved along every axis in which they have width, and the row each part comes from."""
    rows = np.arange(len(boxes))
    for axis in range(3):
        wide = np.flatnonzero(boxes[:, axis, 1] > boxes[:, axis, 0])
        low, high = boxes.copy(), boxes[wide].copy()
        low[wide, axis, 1] = boxes[wide, axis].mean(axis=1)
        high[:, axis, 0] = boxes[wide, axis].mean(axis=1)
        boxes, rows = np.concatenate([low, high]), np.concatenate([rows, rows[wide]])
    return boxes, rows


def _everywhere(q: FloatArray, boxes: FloatArray, test: Test) -> NDArray[np.bool_]:
    """On which boxes (n,) the test holds, on each or on the parts it is halved into."""
    result = np.ones(len(boxes), bool)
    owner = np.arange(len(boxes))
    for _ in range(_DEPTH + 1):
        failed = ~test(q, boxes)
        boxes, owner = boxes[failed], owner[failed]
        if not len(boxes) or len(boxes) > _MOST:
            break
        boxes, rows = _halves(boxes)
        owner = owner[rows]
    result[owner] = False
    return result


def _crossed_once(q: FloatArray, edges: FloatArray) -> NDArray[np.bool_]:
    """Which edges have at most one zero of q: where it may vanish it only rises, or only falls."""
    rises, falls, left = (np.zeros(len(edges), bool) for _ in range(3))
    owner = np.arange(len(edges))
    for _ in range(_DEPTH + 1):
        bounds = ranges(q, edges)
        up, down = (bounds[:, 2::2] > 0).any(axis=1), (bounds[:, 3::2] < 0).any(axis=1)
        free = _one_sign(bounds)
        rises[owner[up & ~free]] = True
        falls[owner[down & ~free]] = True
        rest = ~(free | up | down)
        edges, rows = _halves(edges[rest])
        owner = owner[rest][rows]
        if not len(edges):
            break
    left[owner] = True
    return ~left & ~(rises & falls)


def _single(q: FloatArray, squares: FloatArray) -> bool:
    """Whether q = 0 is at most one arc in each square whose edges it crosses at most once.

    It has no oval where q has no critical point, since an oval goes round one, or where q has no zero.
    """
    places = [np.stack([squares[:, 1, i], squares[:, 2, j]], axis=1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    points = np.repeat(np.stack(places, axis=1).reshape(-1, 2, 1), 2, axis=2)
    inside = (ranges(q, _at(1.0, points))[:, 1] < 0).reshape(-1, 4)
    changes = (inside != np.roll(inside, 1, axis=1)).sum(axis=1)
    if (changes > 2).any():
        return False
    doubtful = ~_everywhere(q, squares, _regular)
    return bool((changes[doubtful] == 0).all() and _everywhere(q, squares[doubtful], _free).all())


def _one_sign(bounds: FloatArray) -> NDArray[np.bool_]:
    return np.asarray((bounds[:, 0] > 0) | (bounds[:, 1] < 0))


def _free(q: FloatArray, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no zero."""
    return _one_sign(ranges(q, boxes))


def _regular(q: FloatArray, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no critical point in (u, v)."""
    bounds = ranges(q, boxes)
    return np.asarray(((bounds[:, 2::2] > 0) | (bounds[:, 3::2] < 0)).any(axis=1))


def _simple(q: FloatArray, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no zero, or its gradients in (u, v) at any two points of the box are less than 90 degrees apart."""
    bounds = ranges(q, boxes)
    low, high = bounds[:, 2::2], bounds[:, 3::2]
    least = np.where(low * high < 0, low * high, np.minimum(low * low, high * high)).sum(axis=1)
    return _one_sign(bounds) | (least > 0)


def ranges(q: FloatArray, boxes: FloatArray) -> FloatArray:
    """Bounds (n, 6) of q and its derivatives in u and v on boxes (n, 3, 2) of (t, u, v), rounding included.

    Where a box has no width along an axis, the derivative along it is given as 0.
    """
    result = np.empty((len(boxes), 6))
    error = 32 * (sum(q.shape) + 4) * float(np.finfo(float).eps)
    _find_ranges(q, np.ascontiguousarray(boxes), *(_weights(n - 1) for n in q.shape), error, result)
    return result


@cache
def _weights(degree: int) -> FloatArray:
    """(i, m, s): the share of the products with s upper ends among those of m ends out of i upper, degree - i lower."""
    result = np.zeros((degree + 1,) * 3)
    for i in range(degree + 1):
        for m in range(degree + 1):
            for s in range(m + 1):
                result[i, m, s] = comb(i, s) * comb(degree - i, m - s) / comb(degree, m)
    return result


@njit(cache=True, nogil=True)
def _bernstein_matrix(low: float, high: float, weights: Any, matrix: Any) -> None:
    """Row i, column m: the mean of the products of m out of i upper and degree - i lower ends."""
    n = len(weights)
    for i in range(n):
        for m in range(n):
            total = 0.0
            for s in range(m + 1):
                total += weights[i, m, s] * high**s * low ** (m - s)
            matrix[i, m] = total


@njit(cache=True, nogil=True)
def _find_ranges(q: Any, boxes: Any, wt: Any, wu: Any, wv: Any, error: float, result: Any) -> None:
    a, b, c = q.shape
    mt, mu, mv = np.empty((a, a)), np.empty((b, b)), np.empty((c, c))
    sizes = np.empty(3)
    for index in range(len(boxes)):
        box = boxes[index]
        _bernstein_matrix(box[0, 0], box[0, 1], wt, mt)
        _bernstein_matrix(box[1, 0], box[1, 1], wu, mu)
        _bernstein_matrix(box[2, 0], box[2, 1], wv, mv)
        one = np.zeros((a, b, c))
        two = np.zeros((a, b, c))
        hull = np.zeros((a, b, c))
        for axis in range(3):
            sizes[axis] = max(abs(box[axis, 0]), abs(box[axis, 1]))
        size = 0.0
        for i in range(a):
            for j in range(b):
                for k in range(c):
                    value = q[i, j, k]
                    if value != 0.0:
                        size += abs(value) * sizes[0] ** i * sizes[1] ** j * sizes[2] ** k
                        for m in range(c):
                            one[i, j, m] += mv[m, k] * value
        for i in range(a):
            for j in range(b):
                for m in range(b):
                    for k in range(c):
                        two[i, m, k] += mu[m, j] * one[i, j, k]
        for i in range(a):
            for m in range(a):
                for j in range(b):
                    for k in range(c):
                        hull[m, j, k] += mt[m, i] * two[i, j, k]
        slack = error * size
        result[index, 0], result[index, 1] = hull.min() - slack, hull.max() + slack
        for axis in range(1, 3):
            width = box[axis, 1] - box[axis, 0]
            n = hull.shape[axis] - 1
            low, high = np.inf, -np.inf
            for i in range(a):
                for j in range(b - (axis == 1)):
                    for k in range(c - (axis == 2)):
                        step = hull[i, j + (axis == 1), k + (axis == 2)] - hull[i, j, k]
                        low, high = min(low, step), max(high, step)
            if n == 0 or width <= 0.0:
                result[index, 2 * axis], result[index, 2 * axis + 1] = 0.0, 0.0
            else:
                result[index, 2 * axis] = (low - 2 * slack) * n / width
                result[index, 2 * axis + 1] = (high + 2 * slack) * n / width
