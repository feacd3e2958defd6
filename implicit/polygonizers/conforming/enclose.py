"""f along straight segments and over flat triangles, decided by Bernstein coefficients.

There f is a polynomial of the surface's degree, found from as many values as it has coefficients. It changes sign at
most as often as the coefficients do, and all its values lie between the least and the largest of them. Of a surface
that is no polynomial samples have to tell.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import Local, unit_rows

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

_HALVINGS = 10
"""What is not decided on this part of a segment is as good as undecided."""
_SAMPLES = np.arange(17) / 16
_PLACES = np.array([(6, 0, 0), (0, 6, 0), (0, 0, 6), (3, 3, 0), (0, 3, 3), (3, 0, 3), (2, 2, 2)]) / 6
_ROOM = 4000
"""Values found at once."""
_NOISE = 8.0
"""Where f is so many times its rounding at most, there is nothing to decide."""


@dataclass(frozen=True, eq=False)
class _Form:
    """Values at `nodes` (k, 2 or 3), shares of the corners of a segment or a triangle, times `matrix` are Bernstein
    coefficients.

    growth: how many times larger errors of the values may be in the coefficients.
    """

    nodes: FloatArray
    matrix: FloatArray
    growth: float


@dataclass(frozen=True, eq=False)
class Changes:
    """Parts [low, high] (n,) of segments in which f changes sign once, or, where not `sure`, perhaps several times.

    owner (n,): the segment of each part; they come in order along it. loud (count,): the segments of which no part
    was found on which f is nothing but rounding. Proved, up to the rounding of the values.
    """

    count: int
    owner: IntArray
    low: FloatArray
    high: FloatArray
    sure: Flags
    loud: Flags

    @property
    def counts(self) -> IntArray:
        """How often (count,) f changes sign; what is not sure counts twice."""
        return np.bincount(self.owner, np.where(self.sure, 1, 2), minlength=self.count).astype(np.int64)

    @property
    def beyond(self) -> FloatArray:
        """Shares (count,) of the way to a place between the first change and the second, or in a part that is not sure.

        Without meaning where f changes sign once or never.
        """
        shares = np.zeros(self.count)
        begins = np.append(True, self.owner[1:] != self.owner[:-1])[: len(self.owner)]
        first = np.flatnonzero(begins)
        shares[self.owner[first]] = (self.low[first] + self.high[first]) / 2
        pair = first[np.append(~begins[1:], False)[first]] if len(first) else first
        shares[self.owner[pair]] = (self.high[pair] + self.low[pair + 1]) / 2
        return shares


def changes(local: Local, a: FloatArray, b: FloatArray) -> Changes:
    """Where f changes sign on the segments from a to b (n, 3); of what is no polynomial, as far as samples show it."""
    if local.degree is None:
        return _sampled(local, a, b)
    form = _on_segments(max(local.degree, 1))
    coefficients, noise = _coefficients(local, form, a, b)
    left, right = _halves(len(coefficients) - 1)
    owner, low, high, found = np.arange(len(a)), np.zeros(len(a)), np.ones(len(a)), []
    heard = np.ones(len(a), bool)
    for depth in range(_HALVINGS + 1):
        least, most = coefficients.min(axis=0), coefficients.max(axis=0)
        loud = np.maximum(-least, most) > _NOISE * noise
        heard[owner[~loud]] = False
        known = (least > noise) | (most < -noise) | ~loud
        known[~known] = _most_changes(coefficients[:, ~known], noise[~known]) <= 1
        once = known & ((coefficients[0] < 0) != (coefficients[-1] < 0))
        shown = once | (~known & (depth == _HALVINGS))
        found.append((owner[shown], low[shown], high[shown], once[shown]))
        if known.all():
            break
        owner, low, high, coefficients = owner[~known], low[~known], high[~known], coefficients[:, ~known]
        noise = np.tile(noise[~known], 2)
        middle = (low + high) / 2
        coefficients = np.concatenate([left @ coefficients, right @ coefficients], axis=1)
        owner, low, high = np.tile(owner, 2), np.append(low, middle), np.append(middle, high)
    owner, low, high, sure = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((low, owner))
    return Changes(len(a), owner[order], low[order], high[order], sure[order], heard)


def _coefficients(local: Local, form: _Form, *corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The Bernstein coefficients (k, n) of f on simplices with corners (n, 3) each, and the errors (n,) of these."""
    ends = [local.grid.to_points(places) for places in corners]
    values = np.empty((len(form.nodes), len(ends[0])))
    count = max(_ROOM // len(form.nodes), 1)  # what stays in the cache takes a third of the time
    for start in range(0, len(ends[0]), count):
        part = slice(start, start + count)
        places = sum(share[:, None, None] * end[part] for share, end in zip(form.nodes.T, ends, strict=True))
        values[:, part] = local.field.values(places.reshape(-1, 3)).reshape(len(form.nodes), -1)
    return form.matrix @ values, form.growth * local.noise(*ends)


def _sampled(local: Local, a: FloatArray, b: FloatArray) -> Changes:
    inside = local.values(a[:, None] + _SAMPLES[:, None] * (b - a)[:, None]) < 0
    owner, place = np.nonzero(inside[:, 1:] != inside[:, :-1])
    sure = np.ones(len(owner), bool)
    return Changes(len(a), owner, _SAMPLES[place], _SAMPLES[place + 1], sure, np.ones(len(a), bool))


def plain(local: Local, corners: FloatArray) -> Flags:
    """Which triangles (n, 3, 3) f = 0 meets, if at all, in arcs without a turn: f rises along some direction.

    Proved, up to the rounding of the values; with edges on which f changes sign once at most, there is one arc at most.
    What is no polynomial has to rise at samples.
    """
    if local.degree is None:
        return _rising(local, corners)
    degree = max(local.degree, 1)
    form, steps = _on_triangles(degree), _steps(degree)
    coefficients, noise = _coefficients(local, form, *corners.transpose(1, 0, 2))
    away = (coefficients.min(axis=0, initial=np.inf) > noise) | (coefficients.max(axis=0, initial=-np.inf) < -noise)
    rises = degree * (coefficients[steps[:, 1:]] - coefficients[steps[:, :1]])
    sides = corners[:, 1:] - corners[:, :1]
    metric = np.einsum("nic,njc->ijn", sides, sides)
    mean = rises.mean(axis=0)
    determinant = metric[0, 0] * metric[1, 1] - metric[0, 1] * metric[1, 0]
    with np.errstate(all="ignore"):
        way = np.stack([metric[1, 1], -metric[0, 1]]) * mean[0] + np.stack([-metric[1, 0], metric[0, 0]]) * mean[1]
        way /= determinant
    rise = (rises * way).sum(axis=1)
    return np.asarray(away | (rise.min(axis=0, initial=np.inf) > 4 * degree * noise * np.abs(way).sum(axis=0)))


def _rising(local: Local, corners: FloatArray) -> Flags:
    """Which triangles have samples of one sign, or gradients in their plane that turn little."""
    values, slopes = local.gradients(np.einsum("kb,nbc->nkc", _PLACES, corners))
    normal = unit_rows(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[:, None]
    slopes = slopes - (slopes * normal).sum(axis=-1, keepdims=True) * normal
    wide = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    away = np.abs(values).min(axis=1) > 0.75 * np.linalg.norm(slopes, axis=-1).max(axis=1) * wide
    ways = unit_rows(slopes)
    turn = np.einsum("nkc,nlc->nkl", ways, ways).min(axis=(1, 2))
    return np.asarray((away & ((values < 0).all(axis=1) | (values >= 0).all(axis=1))) | (turn > 0.1))


def _most_changes(coefficients: FloatArray, noise: FloatArray) -> IntArray:
    """The most changes of sign in each column, where what is not above the noise may have either."""
    plus, minus = coefficients >= -noise, coefficients <= noise
    never = -len(coefficients)
    above, below = np.where(plus[0], 0, never), np.where(minus[0], 0, never)
    for k in range(1, len(coefficients)):
        above, below = (
            np.where(plus[k], np.maximum(above, below + 1), never),
            np.where(minus[k], np.maximum(below, above + 1), never),
        )
    return np.asarray(np.maximum(above, below))


def _inverse(rows: list[list[Fraction]]) -> FloatArray:
    """The inverse of an exact matrix, each entry rounded once."""
    from flint import fmpq, fmpq_mat

    size = len(rows)
    entries = [fmpq(entry.numerator, entry.denominator) for row in rows for entry in row]
    inverse = fmpq_mat(size, size, entries).inv()
    return np.array([[float(Fraction(int(e.p), int(e.q))) for e in row] for row in inverse.tolist()])


def _form(nodes: FloatArray, rows: list[list[Fraction]]) -> _Form:
    matrix = _inverse(rows)
    return _Form(nodes, matrix, 2.0 * float(np.abs(matrix).sum(axis=1).max()))


@cache
def _on_segments(degree: int) -> _Form:
    """Nodes (d + 1, 2) that lie closer at the ends."""
    shares = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    numbers = range(degree + 1)
    rows = [[comb(degree, j) * t**j * (1 - t) ** (degree - j) for j in numbers] for t in map(Fraction, shares.tolist())]
    return _form(np.column_stack([1 - shares, shares]), rows)


@cache
def _halves(degree: int) -> tuple[FloatArray, FloatArray]:
    """Matrices from coefficients on a segment to those on its halves."""
    left = np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
    return left, left[::-1, ::-1].copy()


def _shares(degree: int) -> list[tuple[int, int, int]]:
    """Triples of whole numbers that add up to the degree."""
    return [(degree - j - k, j, k) for j in range(degree + 1) for k in range(degree + 1 - j)]


@cache
def _on_triangles(degree: int) -> _Form:
    """Nodes (n, 3): shares of the corners in steps of 1 / degree."""
    triples = _shares(degree)
    rows = []
    for node in triples:
        row = []
        for i, j, k in triples:
            weight = Fraction(factorial(degree), factorial(i) * factorial(j) * factorial(k))
            row.append(weight * Fraction(node[0] ** i * node[1] ** j * node[2] ** k, degree**degree))
        rows.append(row)
    return _form(np.array(triples) / degree, rows)


@cache
def _steps(degree: int) -> IntArray:
    """For each coefficient of a derivative the three of f with one more step to each corner: (n, 3) places."""
    place = {triple: row for row, triple in enumerate(_shares(degree))}
    return np.array([[place[i + 1, j, k], place[i, j + 1, k], place[i, j, k + 1]] for i, j, k in _shares(degree - 1)])
