"""Proof that a surface is a cone inside a block of cells round an isolated singular point.

The block is the union of the segments from the point p to its boundary. On a face of the block, with w the vector from
p to a point of the face and m the multiplicity,

    f(p + t w) = t^m q(t, w),        0 <= t <= 1

and q is a polynomial in t and the two coordinates of the face. If, for every t, the curve q(t, .) = 0 on the boundary
of the block is without singular points, crosses the ribs of the block and misses its corners, then these curves deform
into each other: inside the block f = 0 is a cone with apex p over the curve on the boundary. And if the curve of t = 1
is simple on each lattice square and rib, then marching the squares finds it up to a deformation (Plantinga and Vegter,
2004, doi:10.1145/1057432.1057465). Both are read off the Bernstein coefficients of q on boxes of (t, w).
"""

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField
from implicit.polygonizers.blocks import to_bernstein

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

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
            shift = np.array([[comb(a, i) * point[axis] ** (a - i) if a >= i else 0.0 for a in range(n)] for i in range(n)])
            shift *= float(step) ** np.arange(n)[:, None]
            tensor = np.moveaxis(np.tensordot(shift, tensor, axes=(1, axis)), 0, axis)
        total = np.indices(tensor.shape).sum(axis=0)
        size = np.array([np.abs(tensor[total == d]).max(initial=0.0) for d in range(int(total.max()) + 1)])
        multiplicity = int(np.argmax(size > _NEGLIGIBLE * size.max()))
        return cls(np.where(total < multiplicity, 0.0, tensor), multiplicity)

    def face(self, axis: int, height: float) -> FloatArray:
        """Coefficients (s, j, k) of t^s u^j v^k in q on the face w[axis] = height; u, v are the next two axes."""
        turned = np.moveaxis(self.coefficients, [axis, (axis + 1) % 3, (axis + 2) % 3], [0, 1, 2])
        i, j, k = np.indices(turned.shape)
        s = i + j + k - self.multiplicity
        result = np.zeros((max(int(s.max()), 0) + 1, *turned.shape[1:]))
        used = s >= 0
        np.add.at(result, (s[used], j[used], k[used]), (turned * height**i)[used])
        return result


def is_cone(germ: Germ, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether f = 0 is proved to be a cone in the block of unit squares from p + lower to p + upper, and seen by them."""
    if germ.multiplicity < 2:
        return False
    return all(_face_holds(germ, axis, (lower, upper)[side][axis], lower, upper) for axis in range(3) for side in (0, 1))


def _face_holds(germ: Germ, axis: int, height: float, lower: FloatArray, upper: FloatArray) -> bool:
    q = germ.face(axis, height)
    u, v = ((lower[a], upper[a]) for a in ((axis + 1) % 3, (axis + 2) % 3))
    squares = _boxes((1.0, 1.0), _unit_steps(*u), _unit_steps(*v))
    if not _simple(q, squares, 0).all() or not _holds(q, _boxes((0.0, 1.0), _unit_steps(*u), _unit_steps(*v)), _simple):
        return False
    ribs = [(np.array([a, a]), _unit_steps(*v)) for a in u] + [(_unit_steps(*u), np.array([b, b])) for b in v]
    for p, r in ribs:
        if not _simple(q, _boxes((1.0, 1.0), p, r), 0).all() or not _holds(q, _boxes((0.0, 1.0), p, r), _simple):
            return False
    corners = np.concatenate([_boxes((0.0, 1.0), np.array([a, a]), np.array([b, b])) for a in u for b in v])
    return _holds(q, corners, _misses)


def _unit_steps(low: float, high: float) -> FloatArray:
    return np.linspace(low, high, max(round(high - low), 1) + 1)


def _boxes(t: tuple[float, float], u: FloatArray, v: FloatArray) -> FloatArray:
    """Boxes (n, 3, 2) of (t, u, v) between consecutive values."""
    a, b = np.stack([u[:-1], u[1:]], axis=1), np.stack([v[:-1], v[1:]], axis=1)
    i, j = (index.ravel() for index in np.indices((len(a), len(b))))
    return np.stack([np.tile(t, (len(i), 1)), a[i], b[j]], axis=1)


def _holds(q: FloatArray, boxes: FloatArray, test: object) -> bool:
    """Whether the test holds on all boxes, after halving those where it does not."""
    for depth in range(_DEPTH + 1):
        boxes = boxes[~test(q, boxes, depth)]  # type: ignore[operator]
        if not len(boxes):
            return True
        for axis in range(3):
            wide = boxes[:, axis, 1] > boxes[:, axis, 0]
            low, high = boxes.copy(), boxes[wide].copy()
            low[wide, axis, 1] = boxes[wide, axis].mean(axis=1)
            high[:, axis, 0] = boxes[wide, axis].mean(axis=1)
            boxes = np.concatenate([low, high])
        if len(boxes) > _MOST:
            return False
    return False


def _hull(q: FloatArray, boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bernstein coefficients (n, s, j, k) of q on boxes, and a bound (n,) of their rounding errors."""
    result, size = q[None], np.abs(q)[None]
    far = np.abs(boxes).max(axis=2)
    for axis, n in enumerate(q.shape):
        matrix = to_bernstein(boxes[:, axis, 0], boxes[:, axis, 1], n - 1)
        result = np.moveaxis(np.einsum("nab,n...b->n...a", matrix, np.moveaxis(result, axis + 1, -1)), -1, axis + 1)
        reach = far[:, axis, None] ** np.arange(n)
        size = np.einsum("nb,n...b->n...", reach, np.moveaxis(size, 1, -1))
    return result, 16 * (sum(q.shape) + 4) * np.finfo(float).eps * size


def _misses(q: FloatArray, boxes: FloatArray, depth: int) -> NDArray[np.bool_]:
    hull, slack = _hull(q, boxes)
    return _one_sign(hull, slack)


def _one_sign(hull: FloatArray, slack: FloatArray) -> NDArray[np.bool_]:
    flat = hull.reshape(len(hull), -1)
    return np.asarray((flat.min(axis=1) > slack) | (flat.max(axis=1) < -slack))


def _simple(q: FloatArray, boxes: FloatArray, depth: int) -> NDArray[np.bool_]:
    """Where q has no zero, or its gradients in (u, v) at any two points of the box are less than a right angle apart."""
    hull, slack = _hull(q, boxes)
    least = np.zeros(len(boxes))
    error = np.zeros(len(boxes))
    for axis in (1, 2):
        width = boxes[:, axis, 1] - boxes[:, axis, 0]
        n = hull.shape[axis + 1] - 1
        if n == 0 or not width.any():
            continue
        slopes = np.diff(hull, axis=axis + 1).reshape(len(hull), -1) * (n / width)[:, None]
        low, high = slopes.min(axis=1), slopes.max(axis=1)
        least += np.where(low * high < 0, low * high, np.minimum(low * low, high * high))
        error += 4 * n * slack / width * np.maximum(np.abs(low), np.abs(high))
    return _one_sign(hull, slack) | (least > error)
