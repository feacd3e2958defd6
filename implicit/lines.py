"""f along rays: what it may be on a part of each.

A place on a ray is u in [0, 1), at the distance s = size u / (1 - u) from the origin. f times (1 - u)^degree is a
polynomial in u, if f is one; its Bernstein coefficients are those of the powers of s / size over binomials.

    origin                   s = size                         infinity
    |---------------------------x-------------------------------->
    u = 0     [a, a + h]     u = 1/2                           u = 1
                a part
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import comb
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.bernstein import power_tensor
from implicit.evaluate import Field, PolynomialField, TapeField
from implicit.language.trees import is_branching, x, y, z
from implicit.tape import make_tape

if TYPE_CHECKING:
    from implicit.surface import Surface

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

NOTHING, CROSSING, UNKNOWN, HERE = 0, 1, 2, 3
"""No zero in a part; one, with a change of sign; perhaps some; and one at its beginning, as far as floats can tell."""
_SURE = 24
"""Ranges do not tell one crossing from three: in parts this many halvings small there is one if there is any."""
_FADED = 4.0
"""Coefficients so many times their rounding at most say nothing."""
_TINY = 45
"""Where ranges are not finite in parts this many halvings small, there is a pole."""


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays from origins (n, 3) along unit directions (n, 3), as far as a limit."""

    origins: Floats
    directions: Floats
    limit: float

    @cached_property
    def sizes(self) -> Floats:
        """Lengths (n,) to go by: how far origins are from 0, or 1 where they are there, but not more than the limit."""
        far = np.linalg.norm(self.origins, axis=1)
        return np.minimum(np.where(far > 0, far, 1.0), self.limit if self.limit > 0 else 1.0)

    @cached_property
    def ends(self) -> Floats:
        """The places (n,) of the limit."""
        return self.limit / (self.limit + self.sizes) if np.isfinite(self.limit) else np.ones(len(self.origins))

    def distances(self, u: Floats) -> Floats:
        """Places u (n,) or (k, n) as distances from the origins."""
        return np.divide(self.sizes * u, 1 - u, out=np.full(u.shape, np.inf), where=u < 1)

    def points(self, s: Floats) -> Floats:
        """The points (..., n, 3) at distances s (..., n)."""
        with np.errstate(invalid="ignore"):
            steps = np.where(self.directions == 0, 0.0, s[..., None] * self.directions)
        return np.asarray(self.origins + steps)

    def take(self, rows: Ints) -> "Rays":
        """Some of the rays."""
        return Rays(self.origins[rows], self.directions[rows], self.limit)


class Lines(Protocol):
    """f on rays."""

    def look(self, rows: Ints, a: Floats, h: Floats) -> NDArray[np.int8]:
        """NOTHING, CROSSING, UNKNOWN or HERE for the parts [a, a + h] (m,) of the rays `rows` (m,)."""

    def fades(self, rows: Ints, a: Floats) -> NDArray[np.bool_]:
        """Whether f is nothing but rounding from a (m,) on to infinity, as along an asymptote."""


def lines_of(surface: "Surface") -> Callable[[Rays], Lines]:
    """What is known best of a surface along rays, for any rays: derivatives are found once."""
    field, formula = surface.field, surface.expression
    if isinstance(field, PolynomialField) and field.degree > 0:
        return partial(PolynomialLines.over, field)
    if not isinstance(field, TapeField) or formula is None or is_branching(formula):
        return partial(RangeLines, field, ())
    return partial(RangeLines, field, tuple(TapeField(make_tape(formula.diff(s))) for s in (x, y, z)))


@dataclass(frozen=True, eq=False)
class PolynomialLines:
    """Polynomials in u by Bernstein coefficients (degree + 1, n), and how far rounding may have moved each."""

    coefficients: Floats
    noise: Floats

    @classmethod
    def over(cls, field: PolynomialField, rays: Rays) -> "PolynomialLines":
        """The polynomials on rays, and the same with all that is rounded in them."""
        degree, steps = field.degree, rays.sizes * rays.directions.T
        shares = np.array([[float(comb(degree, k))] for k in range(degree + 1)])
        noise = field.noise
        values = _along(field.exponents, field.coefficients, rays.origins.T, steps)
        lost = _along(noise.exponents, noise.coefficients, np.abs(rays.origins.T), np.abs(steps))
        return cls(values / shares, 2 * lost / shares)

    def look(self, rows: Ints, a: Floats, h: Floats) -> NDArray[np.int8]:
        """What the coefficients on the parts say: all f lies between them, and f' between their differences."""
        c, e = self._on(rows, a, h)
        above, below = (c > e).all(axis=0), (c < -e).all(axis=0)
        steps, lost = np.diff(c, axis=0), e[1:] + e[:-1]
        rising = ((steps > lost).all(axis=0) & (c[0] < -e[0]) & (c[-1] > e[-1])) | (
            (steps < -lost).all(axis=0) & (c[0] > e[0]) & (c[-1] < -e[-1])
        )
        here = np.abs(c[0]) <= e[0]
        return np.select([above | below, here, rising], [NOTHING, HERE, CROSSING], UNKNOWN).astype(np.int8)

    def fades(self, rows: Ints, a: Floats) -> NDArray[np.bool_]:
        """Whether no coefficient from a (m,) on is more than its rounding, give or take."""
        c, e = self._on(rows, a, 1 - a)
        return np.asarray((np.abs(c) <= _FADED * e).all(axis=0))

    def _on(self, rows: Ints, a: Floats, h: Floats) -> tuple[Floats, Floats]:
        """The coefficients on parts, and what rounding may have done to them."""
        return _part(self.coefficients[:, rows], a, h), _part(self.noise[:, rows], a, h)


@dataclass(frozen=True, eq=False)
class RangeLines:
    """Any field by its ranges on the boxes round parts of rays; slopes: its derivatives, if they are known."""

    field: Field
    slopes: tuple[Field, ...]
    rays: Rays

    def look(self, rows: Ints, a: Floats, h: Floats) -> NDArray[np.int8]:
        """What the ranges say, and in small parts the signs at both ends."""
        rays, b = self.rays.take(rows), a + h
        ends = rays.points(np.minimum(rays.distances(np.stack([a, b])), rays.limit))
        boxes = np.stack([ends.min(axis=0), ends.max(axis=0)], axis=1)
        with np.errstate(all="ignore"):
            ranges = self.field.ranges(boxes)
        result = np.where((ranges[:, 0] > 0) | (ranges[:, 1] < 0), NOTHING, UNKNOWN).astype(np.int8)
        left = np.flatnonzero((result == UNKNOWN) & np.isfinite(ends).all(axis=(0, 2)))
        with np.errstate(all="ignore"):
            first, last = (self.field.values(end) for end in ends[:, left])
            rising = self._rising(rays.take(left), boxes[left])
            product = first * last
        known, tiny = np.asarray(np.isfinite(ranges).all(axis=1)), h <= 0.5**_TINY
        opposite = (product < 0) & known[left]
        result[~known & tiny] = NOTHING  # a pole
        result[left[rising & (product > 0)]] = NOTHING
        result[left[opposite & (rising | (h[left] <= 0.5**_SURE))]] = CROSSING
        result[left[first == 0]] = HERE
        return result

    def fades(self, rows: Ints, a: Floats) -> NDArray[np.bool_]:
        """No: of ranges it is not known."""
        return np.zeros(len(rows), np.bool_)

    def _rising(self, rays: Rays, boxes: Floats) -> NDArray[np.bool_]:
        """Where f rises or falls along the rays everywhere in boxes (n, 2, 3)."""
        if not self.slopes:
            return np.zeros(len(boxes), np.bool_)
        low, high = np.zeros(len(boxes)), np.zeros(len(boxes))
        for slope, way in zip(self.slopes, rays.directions.T, strict=True):
            ends = slope.ranges(boxes) * way[:, None]
            ends = np.where(way[:, None] == 0, 0.0, ends)
            low, high = low + ends.min(axis=1), high + ends.max(axis=1)
        slack = 1e-12 * (np.abs(low) + np.abs(high))
        return (low > slack) | (high < -slack)


def _along(exponents: Ints, coefficients: Floats, origins: Floats, steps: Floats) -> Floats:
    """The coefficients (degree + 1, n) of powers of t of a polynomial at origins + t steps, (3, n) both: Horner's rule
    in z, y and x.
    """
    table = power_tensor(exponents, coefficients)
    shape = (int(exponents.sum(axis=1).max(initial=0)) + 1, origins.shape[1])

    def gather(part: Floats, axis: int) -> Floats:
        """The sum over the powers of the coordinates from an axis on."""
        total = np.zeros(shape)
        used = np.flatnonzero(part.reshape(len(part), -1).any(axis=1))
        for power in range(used.max(initial=0), -1, -1):
            ahead = total[:-1] * steps[axis]
            total *= origins[axis]
            total[1:] += ahead
            if axis == 2:
                total[0] += part[power]
            elif power in used:
                total += gather(part[power], axis + 1)
        return total

    return gather(table, 0)


def _part(table: Floats, a: Floats, h: Floats) -> Floats:
    """Bernstein coefficients (k, m) of polynomials given by theirs on [0, 1], on [a, a + h] (m,): de Casteljau."""
    work = table.copy()
    for last in range(len(table) - 1, 0, -1):  # what is right of a
        work[:last] += a * (work[1 : last + 1] - work[:last])
    share = np.divide(h, 1 - a, out=np.ones_like(h), where=a < 1)
    for first in range(1, len(table)):  # and of that what is left of a + h
        work[first:] = work[first - 1 : -1] + share * (work[first:] - work[first - 1 : -1])
    return work
