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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField
from implicit.polygonizers.conforming.points.hull import Hull
from implicit.polygonizers.conforming.points.squares import Lattice, blocks_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

Test = Callable[[Hull, FloatArray], Flags]

_NEGLIGIBLE = 1e-9
"""Coefficients below the multiplicity, as a share of those at it, that stem from rounding the point."""
_DEPTH = 4
"""Boxes of (t, w) are halved so often."""
_AROUND = 4.0
"""The tangent cone is looked at in a block of so many cells."""
_MOST = 20_000
"""Boxes of a block that are looked at together; more mean no answer."""


@dataclass(frozen=True, eq=False)
class Germ:
    """f(p + step w) as coefficients (i, j, k) of the powers of w, and the multiplicity of f at p."""

    coefficients: FloatArray
    multiplicity: int

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

    def faces(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Coefficients (6, s, j, k) of t^s u^j v^k in q on the faces w[axis] = lower, w[axis] = upper for each axis.

        u and v are the next two axes.
        """
        heights, entries, shape = self._terms
        result = np.zeros((3, 2, int(np.prod(shape))))
        values = self.coefficients[self.coefficients != 0] * np.column_stack([lower, upper])[:, :, None] ** heights
        np.put_along_axis(result, entries, values, axis=2)
        return result.reshape(6, *shape)

    @cached_property
    def _terms(self) -> tuple[IntArray, IntArray, tuple[int, int, int]]:
        """Of terms that are not 0, on faces across each axis, the power (3, 1, n) of the height and the entry (3, 2, n)
        in a table of powers of t, u and v, which has this shape.
        """
        powers = np.argwhere(self.coefficients)
        s = powers.sum(axis=1) - self.multiplicity
        size = int(powers.max(initial=0)) + 1
        ahead = (np.arange(3)[:, None] + np.arange(3)) % 3
        i, j, k = (powers.T[axis] for axis in ahead.T)
        entries = np.repeat(((s * size + j) * size + k)[:, None], 2, axis=1)
        return i[:, None], entries, (int(s.max(initial=0)) + 1, size, size)


def germs_at(field: PolynomialField, points: FloatArray, step: float) -> list[Germ]:
    """The germs of a polynomial at singular points (n, 3), with lengths in units of `step`."""
    tensor = np.zeros(tuple(field.exponents.max(axis=0, initial=0) + 1))
    np.add.at(tensor, tuple(field.exponents.T), field.coefficients)
    total = np.indices(tensor.shape).sum(axis=0)
    tensors = tensor[None]
    for axis in range(3):
        rows = np.moveaxis(tensors, 1 + axis, 1)
        moved = _shifts(points[:, axis], step, rows.shape[1]) @ rows.reshape(*rows.shape[:2], -1)
        tensors = np.moveaxis(moved.reshape(-1, *rows.shape[1:]), 1, 1 + axis)
    degrees = range(int(total.max()) + 1)
    size = np.stack([np.abs(tensors[:, total == d]).max(axis=1, initial=0.0) for d in degrees], axis=1)
    multiplicity = np.argmax(size > _NEGLIGIBLE * size.max(axis=1, keepdims=True), axis=1)
    return [Germ(np.where(total < m, 0.0, part), int(m)) for part, m in zip(tensors, multiplicity, strict=True)]


def _shifts(places: FloatArray, step: float, size: int) -> FloatArray:
    """Matrices (n, i, a) from powers a of x to powers i of w, where x = place + step w."""
    gap = np.arange(size) - np.arange(size)[:, None]
    binomial = np.array([[comb(a, i) for a in range(size)] for i in range(size)], float)
    return np.asarray(binomial * (places[:, None, None] ** gap.clip(0)) * step ** np.arange(size)[:, None])


def regular_cones(germs: Sequence[Germ]) -> Flags:
    """Of which germs (n,) it is proved that the tangent cone is smooth but for its apex; else no block holds a cone for
    sure.
    """
    ends = np.full((len(germs), 3), _AROUND / 2)

    def smooth(cone: Hull, lattice: Lattice) -> Flags:
        return _without(len(cone.coefficients) // 6, lattice.squares[~_everywhere(cone, lattice.squares, _simple)])

    return _alike(germs, -ends, ends, lambda faces, lattice: smooth(Hull.of(faces[:, :1].copy()), lattice))


def are_cones(germs: Sequence[Germ], lower: FloatArray, upper: FloatArray) -> Flags:
    """For which germs (n,) f = 0 is proved to be a cone in the block from p + lower to p + upper, seen rightly by its
    squares.
    """
    return _alike(germs, lower, upper, lambda faces, lattice: _hold_cones(Hull.of(faces), lattice))


def _alike(
    germs: Sequence[Germ], lower: FloatArray, upper: FloatArray, test: Callable[[FloatArray, Lattice], Flags]
) -> Flags:
    """Where a test of the polynomials on the faces of blocks holds, made for all those at once that have the same
    degrees.
    """
    result = np.zeros(len(germs), bool)
    faces = [germ.faces(*ends) for germ, *ends in zip(germs, lower, upper, strict=True)]
    for shape in {part.shape for part in faces}:
        rows = [row for row, part in enumerate(faces) if part.shape == shape and germs[row].multiplicity > 1]
        if rows:
            result[rows] = test(np.concatenate([faces[row] for row in rows]), Lattice.of(lower[rows], upper[rows]))
    return result


def _without(count: int, *bad: FloatArray) -> Flags:
    """Which of so many blocks have none of the bad boxes."""
    result = np.ones(count, bool)
    for boxes in bad:
        result[blocks_of(boxes)] = False
    return result


def _hold_cones(faces: Hull, lattice: Lattice) -> Flags:
    """Which blocks hold cones.

    A square or rib on which q is simple for all t at once is so for t = 1. Then it is crossed as it should be: where q
    has zeros, a derivative has none, so there is no critical point, and along a rib q has one zero at most.
    """
    count = len(faces.coefficients) // 6
    squares, ends = lattice.squares.copy(), lattice.ends.copy()
    squares[:, 0, 0] = ends[:, 0, 0] = 0
    simple, clear = _simple(faces, squares), _simple(faces, ends)
    left, rim, known = np.flatnonzero(~simple), faces.at_end(), np.append(simple, clear)
    squares, ends = squares[left], ends[~clear]
    return _without(
        count,
        ends[~_everywhere(faces, ends, _simple)],
        _wrong_edges(rim, lattice, known),
        _several(rim, lattice, left),
        squares[~_everywhere(faces, squares, _simple)],
    )


def _wrong_edges(rim: Hull, lattice: Lattice, known: Flags) -> FloatArray:
    """The edges that may be crossed more than once, with a square beside in which the curve may turn by a right angle.

    known: the squares where it is known that it does not, and, last, the ribs known to be crossed once at most.
    """
    left = np.flatnonzero(~known[lattice.beside].all(axis=1))
    left = left[~_crossed_once(rim, lattice.edges[left])]
    size, beside = len(lattice.squares), lattice.beside[left]
    simple = _simple(rim, lattice.squares[np.minimum(beside, size - 1).ravel()]).reshape(-1, 2) & (beside < size)
    return lattice.edges[left[~simple.all(axis=1)]]


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


def _everywhere(q: Hull, boxes: FloatArray, test: Test) -> Flags:
    """On which boxes (n,) the test holds, on each or on the parts it is halved into."""
    result = np.ones(len(boxes), bool)
    owner = np.arange(len(boxes))
    for _ in range(_DEPTH + 1):
        failed = ~test(q, boxes)
        boxes, owner = boxes[failed], owner[failed]
        if len(boxes) > _MOST:
            block = blocks_of(boxes)
            many = np.bincount(block)[block] > _MOST
            result[owner[many]] = False
            boxes, owner = boxes[~many], owner[~many]
        if not len(boxes):
            break
        boxes, rows = halves(boxes)
        owner = owner[rows]
    result[owner] = False
    return result


def _crossed_once(q: Hull, edges: FloatArray) -> Flags:
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


def _several(rim: Hull, lattice: Lattice, rows: IntArray) -> FloatArray:
    """Those of some squares in which q = 0 may be more than an arc, if it crosses their edges at most once.

    It has no oval where q has no critical point, since an oval goes round one, or where q has no zero.
    """
    squares = lattice.squares[rows]
    inside = (rim.ranges(lattice.points[lattice.corners[rows].ravel()])[:, 1] < 0).reshape(-1, 4)
    changes = (inside != np.roll(inside, 1, axis=1)).sum(axis=1)
    doubtful = ~_everywhere(rim, squares, _regular)
    doubtful[doubtful] = (changes[doubtful] > 0) | ~_everywhere(rim, squares[doubtful], _free)
    return squares[doubtful | (changes > 2)]


def _one_sign(bounds: FloatArray) -> Flags:
    return np.asarray((bounds[:, 0] > 0) | (bounds[:, 1] < 0))


def _free(q: Hull, boxes: FloatArray) -> Flags:
    """Where q has no zero."""
    return _one_sign(q.ranges(boxes))


def _regular(q: Hull, boxes: FloatArray) -> Flags:
    """Where q has no critical point in (u, v)."""
    bounds = q.ranges(boxes, everywhere=True)
    return np.asarray(((bounds[:, 2::2] > 0) | (bounds[:, 3::2] < 0)).any(axis=1))


def _simple(q: Hull, boxes: FloatArray) -> Flags:
    """Where q has no zero, or its gradients in (u, v) at any two points of the box are less than 90 degrees apart."""
    bounds = q.ranges(boxes)
    low, high = bounds[:, 2::2], bounds[:, 3::2]
    least = np.where(low * high < 0, low * high, np.minimum(low * low, high * high)).sum(axis=1)
    return _one_sign(bounds) | (least > 0)
