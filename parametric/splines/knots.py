"""Knot vectors: where the polynomial pieces of a B-spline meet."""

from collections.abc import Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parametric.parameters import Array, Interval, Value, flatten, freeze
from parametric.splines.basis import weigh

Knots: TypeAlias = "str | ArrayLike | KnotVector"
KINDS = ("clamped", "closed", "open")


class KnotVector(Value):
    """Knots u_0 <= ... <= u_h of B-splines of one degree p; immutable.

    The basis functions N_i are defined for i = 0 ... h - p - 1 and sum to one on the domain [u_p, u_(h-p)].
    On a closed knot vector the last p functions belong to the first p control points once more, so there are
    p control points fewer than functions and the curve closes with C^(p-1).

    Examples
    --------
    >>> KnotVector([0, 0, 0, 0.5, 1, 1, 1], 2).count
    4
    """

    values: Array
    degree: int
    closed: bool

    def __init__(self, values: ArrayLike, degree: int, closed: bool = False) -> None:
        knots = np.array(values, dtype=float)
        check_degree(degree)
        _check_knots(knots, degree)
        if closed:
            _check_period(knots, degree)
        knots.flags.writeable = False
        self.values, self.degree, self.closed = knots, int(degree), bool(closed)

    def __repr__(self) -> str:
        return f"KnotVector({self.values.tolist()}, degree={self.degree}, closed={self.closed})"

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, KnotVector)
            and (self.degree, self.closed) == (other.degree, other.closed)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        return hash((self.degree, self.closed, self.values.tobytes()))

    @property
    def functions(self) -> int:
        """How many basis functions."""
        return self.values.size - self.degree - 1

    @property
    def count(self) -> int:
        """How many control points."""
        return self.functions - (self.degree if self.closed else 0)

    @property
    def domain(self) -> Interval:
        """Where the basis functions sum to one."""
        return float(self.values[self.degree]), float(self.values[self.functions])

    @cached_property
    def ends(self) -> Array:
        """`breaks` as the kernels take them, writable: not to be written to."""
        return np.unique(self.values[self.degree : self.functions + 1])

    @cached_property
    def breaks(self) -> Array:
        """The distinct knots of the domain: ends of the polynomial pieces."""
        return np.asarray(freeze(self.ends.copy()))

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """The first of the p+1 functions that live on each span, (spans,)."""
        return np.asarray(freeze(np.searchsorted(self.values, self.breaks[:-1], side="right") - 1 - self.degree))

    @cached_property
    def extraction(self) -> Array:
        """Bezier points of each span as combinations of its control points, (spans, p+1, p+1).

        The Bezier point a of [s, e] is the blossom (polar form) at p - a times s and a times e.
        """
        p, start, end = self.degree, self.breaks[:-1, None], self.breaks[1:, None]
        spans = np.arange(self.first.size)
        return np.stack([self.blossom(np.hstack([start] * (p - a) + [end] * a), spans) for a in range(p + 1)], axis=1)

    def blossom(self, arguments: Array, spans: NDArray[np.int64]) -> Array:
        """Polar form of the piece on each of the spans (k,) at arguments (k, p): weights (k, p+1) of its points."""
        p, first = self.degree, self.first[spans][:, None]
        weights = np.broadcast_to(np.eye(p + 1), (spans.size, p + 1, p + 1))
        for r in range(1, p + 1):
            low = self.values[first + np.arange(r, p + 1)]
            high = self.values[first + np.arange(p + 1, 2 * p + 2 - r)]
            ratio = ((arguments[:, r - 1, None] - low) / (high - low))[:, :, None]
            weights = (1 - ratio) * weights[:, :-1] + ratio * weights[:, 1:]
        return weights[:, 0]

    def table(self, order: int = 0) -> Array:
        """Bernstein coefficients of the functions' derivatives on each span, (spans, p-order+1, p+1)."""
        tables: dict[int, Array] = self.__dict__.setdefault("_tables", {})
        if order not in tables:
            p, table, width = self.degree, self.extraction, np.diff(self.breaks)[:, None, None]
            for r in range(min(order, p)):
                table = (p - r) / width * np.diff(table, axis=1)
            tables[order] = np.ascontiguousarray(table if order <= p else np.zeros((width.size, 1, p + 1)))
        return tables[order]

    def weights(self, t: Array, order: int = 0) -> tuple[NDArray[np.int64], Array]:
        """First function (n,) and the p+1 values or derivatives (n, p+1) at parameters t (n,) in the domain."""
        spans, weights = weigh(flatten(t), self.ends, self.table(order))
        return self.first[spans], weights

    def design(self, t: ArrayLike, order: int = 0) -> Array:
        """Matrix (n, count) that takes control points to points, or derivatives, at parameters t (n,)."""
        first, weights = self.weights(np.asarray(t, dtype=float).ravel(), order)
        matrix = np.zeros((first.size, self.count))
        columns = (first[:, None] + np.arange(self.degree + 1)) % self.count
        matrix[np.arange(first.size)[:, None], columns] = weights
        return matrix

    def unwrap(self, points: Array, axis: int = 0) -> Array:
        """One control point for each function: on a closed vector the first p points follow the last again."""
        return np.take(points, np.arange(self.functions) % self.count, axis=axis) if self.closed else points


def check_degree(degree: int) -> None:
    """Degrees are integers from one on."""
    if isinstance(degree, bool) or not isinstance(degree, int | np.integer) or degree < 1:
        raise ValueError(f"degree must be an integer of at least 1, got {degree!r}")


def _check_knots(knots: Array, degree: int) -> None:
    if knots.ndim != 1 or knots.size < 2 * degree + 2:
        raise ValueError(f"degree {degree} needs at least {2 * degree + 2} knots in a row, got shape {knots.shape}")
    if not np.isfinite(knots).all():
        raise ValueError("knots must be finite")
    drops = np.flatnonzero(np.diff(knots) < 0)
    if drops.size:
        k = int(drops[0])
        raise ValueError(f"knots must not decrease: number {k} is {knots[k]:g}, number {k + 1} is {knots[k + 1]:g}")
    low, high = knots[degree], knots[-degree - 1]
    if not low < high:
        raise ValueError(f"knots of degree {degree} leave the domain [{low:g}, {high:g}] without inside")
    values, counts = multiplicities(knots)
    if counts.max() > degree + 1:
        k = int(counts.argmax())
        raise ValueError(f"knot {values[k]:g} occurs {counts[k]} times, more than degree + 1 = {degree + 1}")


def _check_period(knots: Array, degree: int) -> None:
    count = knots.size - 2 * degree - 1
    if count <= degree:
        raise ValueError(f"a closed B-spline of degree {degree} needs more than {degree} control points, got {count}")
    steps = np.diff(knots)
    if not np.allclose(steps[count:], steps[: 2 * degree], rtol=0, atol=1e-12 * (knots[-1] - knots[0])):
        raise ValueError(f"closed knots must repeat their steps after {count} knots")


def to_knots(knots: Knots, degree: int, count: int, name: str = "knots") -> KnotVector:
    """Knot vector for `count` control points from a kind, an array or a KnotVector.

    "clamped" repeats both ends degree + 1 times, "open" and "closed" are uniform; all three have the domain [0, 1]
    and knots that divide it evenly. An array is taken as it stands.
    """
    if isinstance(knots, KnotVector):
        result = knots
        if result.degree != degree:
            raise ValueError(f"{name} are of degree {result.degree}, but the degree asked for is {degree}")
    elif isinstance(knots, str):
        result = _of_kind(knots, degree, count, name)
    else:
        result = KnotVector(knots, degree)
    if result.count != count:
        wanted = result.values.size - result.count + count
        raise ValueError(f"{count} control points of degree {degree} need {wanted} {name}, got {result.values.size}")
    return result


def _of_kind(kind: str, degree: int, count: int, name: str) -> KnotVector:
    check_degree(degree)
    if kind not in KINDS:
        raise ValueError(f"{name} must be one of {', '.join(KINDS)} or an array, got {kind!r}")
    if count <= degree:
        raise ValueError(f"degree {degree} needs at least {degree + 1} control points, got {count}")
    if kind == "closed":
        return KnotVector(np.arange(-degree, count + degree + 1) / count, degree, closed=True)
    spans = count - degree
    inner = np.arange(-degree, spans + degree + 1) / spans
    return KnotVector(np.clip(inner, 0, 1) if kind == "clamped" else inner, degree)


def multiplicities(knots: Sequence[float] | Array) -> tuple[Array, NDArray[np.int64]]:
    """Distinct knots and how often each occurs."""
    values, counts = np.unique(np.asarray(knots, dtype=float), return_counts=True)
    return values, counts.astype(np.int64)
