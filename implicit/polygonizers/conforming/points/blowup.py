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
from functools import cached_property, lru_cache
from itertools import product
from math import comb

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField
from implicit.polygonizers.conforming.points.hull import Hull

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Test = Callable[[Hull, FloatArray], NDArray[np.bool_]]

_NEGLIGIBLE = 1e-9
"""Coefficients below the multiplicity, as a share of those at it, that stem from rounding the point."""
_DEPTH = 4
"""Boxes of (t, w) are halved so often."""
_AROUND = 4.0
"""The tangent cone is looked at in a block of so many cells."""
_MOST = 20_000
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

    def across(self) -> list["Germ"]:
        """The components of grad f x w, as polynomials with factors t^m like f itself."""
        f = np.pad(self.coefficients, (0, 1))
        powers = np.indices(f.shape)

        def part(slope: int, factor: int) -> FloatArray:
            return np.roll(f * powers[slope], (-1, 1), (slope, factor))

        return [Germ(part(a, b) - part(b, a), self.multiplicity) for a, b in ((1, 2), (2, 0), (0, 1))]

    def face(self, axis: int, height: float) -> FloatArray:
        """Coefficients (s, j, k) of t^s u^j v^k in q on the face w[axis] = height; u, v are the next two axes."""
        powers, coefficients = self._terms
        s = powers.sum(axis=1) - self.multiplicity
        i, j, k = (powers[:, a % 3] for a in (axis, axis + 1, axis + 2))
        size = int(powers.max(initial=0)) + 1
        result = np.zeros((int(s.max(initial=0)) + 1, size, size))
        result[s, j, k] = coefficients * height**i
        return result

    @cached_property
    def _terms(self) -> tuple[IntArray, FloatArray]:
        """The powers (n, 3) and coefficients (n,) that are not 0."""
        powers = np.argwhere(self.coefficients)
        return powers, self.coefficients[tuple(powers.T)]


@dataclass(frozen=True, eq=False)
class _Lattice:
    """The lattice on the six faces of a block as boxes (n, 4, 2) of t = 1, u, v, and the number of the face.

    Points, edges and ribs with corners (`ends`) are boxes without width. beside: the squares on both sides of each
    edge, -1 where there is none. corners: the points (n, 4) round each square.
    """

    squares: FloatArray
    edges: FloatArray
    points: FloatArray
    ends: FloatArray
    beside: IntArray
    corners: IntArray

    @classmethod
    def of(cls, lower: FloatArray, upper: FloatArray) -> "_Lattice":
        """The faces in the order w[axis] = lower, w[axis] = upper for each axis."""
        lattice = _whole_lattice(*(max(round(size), 1) for size in upper - lower))
        shift = np.zeros((6, 4, 1))
        for number in range(6):
            shift[number, (1, 2), 0] = lower[(number // 2 + 1) % 3], lower[(number // 2 + 2) % 3]
        squares, edges, points, ends = (
            part + shift[part[:, 3, 0].astype(np.int64)]
            for part in (lattice.squares, lattice.edges, lattice.points, lattice.ends)
        )
        return cls(squares, edges, points, ends, lattice.beside, lattice.corners)


@lru_cache(maxsize=64)
def _whole_lattice(*sizes: int) -> _Lattice:
    """That of a block of so many cells from the origin on."""
    parts: list[tuple[NDArray[np.generic], ...]] = []
    squares = points = 0
    for number, (axis, _) in enumerate(product(range(3), range(2))):
        p, r = (np.arange(sizes[a % 3] + 1.0) for a in (axis + 1, axis + 2))
        part = _face_boxes(p, r, number)
        beside, corners = _neighbours(len(p) - 1, len(r) - 1)
        parts.append((*part, np.where(beside < 0, -1, beside + squares), corners + points))
        squares, points = squares + len(part[0]), points + len(part[2])
    return _Lattice(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _face_boxes(p: FloatArray, r: FloatArray, number: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Squares, edges, points, and ribs with corners, of a face with lattice lines u = p and v = r."""
    u, v, ends = np.stack([p[:-1], p[1:]], axis=1), np.stack([r[:-1], r[1:]], axis=1), (0, -1)
    at_p, at_r = np.stack([p, p], axis=1), np.stack([r, r], axis=1)
    edges = [boxes_between(at_p, v, number), boxes_between(u, at_r, number)]
    ribs = [boxes_between(at_p[ends, :], v, number), boxes_between(u, at_r[ends, :], number)]
    ribs.append(boxes_between(at_p[ends, :], at_r[ends, :], number))
    return boxes_between(u, v, number), np.concatenate(edges), boxes_between(at_p, at_r, number), np.concatenate(ribs)


def _neighbours(n: int, m: int) -> tuple[IntArray, IntArray]:
    """For a face of n x m squares: those beside each edge, and the points round each square."""
    square = np.full((n + 2, m + 2), -1)
    square[1:-1, 1:-1] = np.arange(n * m).reshape(n, m)
    across = np.stack([square[:-1, 1:-1], square[1:, 1:-1]], axis=-1).reshape(-1, 2)
    along = np.stack([square[1:-1, :-1], square[1:-1, 1:]], axis=-1).reshape(-1, 2)
    point = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    corners = np.stack([point[:-1, :-1], point[1:, :-1], point[1:, 1:], point[:-1, 1:]], axis=-1)
    return np.concatenate([across, along]), corners.reshape(-1, 4)


def has_regular_cone(germ: Germ) -> bool:
    """Whether it is proved that the tangent cone is smooth but for its apex; else no block holds a cone for sure."""
    if germ.multiplicity < 2:
        return False
    lower, upper = np.full(3, -_AROUND / 2), np.full(3, _AROUND / 2)
    faces = [germ.face(axis, float(end[axis]))[:1] for axis in range(3) for end in (lower, upper)]
    return bool(_everywhere(Hull.of(faces), _Lattice.of(lower, upper).squares, _simple).all())


def is_cone(germ: Germ, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether f = 0 is proved to be a cone in the block from p + lower to p + upper, seen rightly by its squares."""
    if germ.multiplicity < 2:
        return False
    faces = Hull.of([germ.face(axis, float(end[axis])) for axis in range(3) for end in (lower, upper)])
    lattice, rim = _Lattice.of(lower, upper), faces.at_end()
    if not (_edges_hold(rim, lattice) and _single(rim, lattice)):
        return False
    whole = np.concatenate([lattice.squares, lattice.ends])
    whole[:, 0, 0] = 0
    return bool(_everywhere(faces, whole, _simple).all())


def _edges_hold(rim: Hull, lattice: _Lattice) -> bool:
    """Whether each lattice edge is crossed once at most, or both its squares let the curve turn by no right angle."""
    once = _crossed_once(rim, lattice.edges)
    if once.all():
        return True
    simple = np.append(_simple(rim, lattice.squares), False)
    return bool(simple[lattice.beside[~once]].all())


def boxes_between(u: FloatArray, v: FloatArray, number: int) -> FloatArray:
    """Boxes (n, 4, 2) at t = 1 of all pairs of ranges of u and ranges of v on the face of a number."""
    boxes = np.ones((len(u), len(v), 4, 2))
    boxes[:, :, 1], boxes[:, :, 2], boxes[:, :, 3] = u[:, None], v, number
    return boxes.reshape(-1, 4, 2)


def halves(boxes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Boxes halved along every axis in which they have width, and the row each part comes from."""
    rows = np.arange(len(boxes))
    for axis in range(3):
        wide = boxes[:, axis, 1] > boxes[:, axis, 0]
        high = boxes[wide]
        middle = (high[:, axis, 0] + high[:, axis, 1]) / 2
        high[:, axis, 0] = middle
        boxes = np.concatenate([boxes, high])
        boxes[np.flatnonzero(wide), axis, 1] = middle
        rows = np.append(rows, rows[wide])
    return boxes, rows


def _everywhere(q: Hull, boxes: FloatArray, test: Test) -> NDArray[np.bool_]:
    """On which boxes (n,) the test holds, on each or on the parts it is halved into."""
    result = np.ones(len(boxes), bool)
    owner = np.arange(len(boxes))
    for _ in range(_DEPTH + 1):
        failed = ~test(q, boxes)
        boxes, owner = boxes[failed], owner[failed]
        if not len(boxes) or len(boxes) > _MOST:
            break
        boxes, rows = halves(boxes)
        owner = owner[rows]
    result[owner] = False
    return result


def _crossed_once(q: Hull, edges: FloatArray) -> NDArray[np.bool_]:
    """Which edges have at most one zero of q: where it may vanish it only rises, or only falls."""
    rises, falls, left = (np.zeros(len(edges), bool) for _ in range(3))
    owner = np.arange(len(edges))
    for _ in range(_DEPTH + 1):
        bounds = q.ranges(edges)
        up, down = (bounds[:, 2::2] > 0).any(axis=1), (bounds[:, 3::2] < 0).any(axis=1)
        free = _one_sign(bounds)
        rises[owner[up & ~free]] = True
        falls[owner[down & ~free]] = True
        rest = ~(free | up | down)
        edges, rows = halves(edges[rest])
        owner = owner[rest][rows]
        if not len(edges):
            break
    left[owner] = True
    return ~left & ~(rises & falls)


def _single(rim: Hull, lattice: _Lattice) -> bool:
    """Whether q = 0 is at most one arc in each square whose edges it crosses at most once.

    It has no oval where q has no critical point, since an oval goes round one, or where q has no zero.
    """
    inside = (rim.ranges(lattice.points)[:, 1] < 0)[lattice.corners]
    changes = (inside != np.roll(inside, 1, axis=1)).sum(axis=1)
    if (changes > 2).any():
        return False
    doubtful = ~_everywhere(rim, lattice.squares, _regular)
    return bool((changes[doubtful] == 0).all() and _everywhere(rim, lattice.squares[doubtful], _free).all())


def _one_sign(bounds: FloatArray) -> NDArray[np.bool_]:
    return np.asarray((bounds[:, 0] > 0) | (bounds[:, 1] < 0))


def _free(q: Hull, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no zero."""
    return _one_sign(q.ranges(boxes))


def _regular(q: Hull, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no critical point in (u, v)."""
    bounds = q.ranges(boxes)
    return np.asarray(((bounds[:, 2::2] > 0) | (bounds[:, 3::2] < 0)).any(axis=1))


def _simple(q: Hull, boxes: FloatArray) -> NDArray[np.bool_]:
    """Where q has no zero, or its gradients in (u, v) at any two points of the box are less than 90 degrees apart."""
    bounds = q.ranges(boxes)
    low, high = bounds[:, 2::2], bounds[:, 3::2]
    least = np.where(low * high < 0, low * high, np.minimum(low * low, high * high)).sum(axis=1)
    return _one_sign(bounds) | (least > 0)
