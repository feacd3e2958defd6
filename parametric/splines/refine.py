"""Other control points for the same spline: as matrices, so that one function serves curves, rows and columns.

The control point i of a spline of degree p over knots u is its polar form at u_(i+1) ... u_(i+p). New control
points over other knots are therefore polar forms of the old pieces (Ramshaw 1989, doi:10.1016/0167-8396(89)90032-0).
"""

import numpy as np

from parametric.parameters import Array, to_parameters
from parametric.splines.knots import KnotVector, multiplicities


def change_knots(old: KnotVector, new: KnotVector) -> Array:
    """Matrix (new.count, old.count) from control points over `old` to those over finer knots `new`."""
    shift = int(np.searchsorted(new.values, new.domain[0])) if new.closed else 0
    index = shift + np.arange(new.count)
    p = old.degree
    spans = np.clip(np.searchsorted(old.breaks, new.values[index], side="right") - 1, 0, old.first.size - 1)
    arguments = new.values[index[:, None] + np.arange(1, new.degree + 1)]
    if new.degree == p:
        weights = old.blossom(arguments, spans)
    else:  # polar form of degree p + 1: the mean over the arguments left out
        rest = [np.delete(arguments, k, axis=1) for k in range(p + 1)]
        weights = np.mean([old.blossom(a, spans) for a in rest], axis=0)
    matrix = np.zeros((new.count, old.count))
    columns = (old.first[spans][:, None] + np.arange(p + 1)) % old.count
    matrix[index[:, None] % new.count, columns] = weights
    return matrix


def insert(old: KnotVector, t: float, times: int = 1) -> tuple[KnotVector, Array]:
    """Knots with t `times` more, and the matrix to their control points."""
    low, high = old.domain
    value = float(to_parameters(t, old.domain, "t"))
    if times < 1:
        raise ValueError(f"a knot is inserted at least once, got {times}")
    present = int(np.count_nonzero(old.values == value))
    if present + times > old.degree + (0 if low < value < high or old.closed else 1):
        raise ValueError(f"knot {value:g} has multiplicity {present} and cannot be inserted {times} times more")
    new = _with_inner(old, np.sort(np.concatenate([_inner(old), [value] * times])), old.degree)
    return new, change_knots(old, new)


def elevate(old: KnotVector) -> tuple[KnotVector, Array]:
    """Knots of one degree more, each with one more repetition, and the matrix to their control points."""
    values, counts = multiplicities(_inner(old))
    new = _with_inner(old, np.repeat(values, counts + 1), old.degree + 1)
    return new, change_knots(old, new)


def restrict(old: KnotVector, start: float, end: float) -> tuple[KnotVector, Array]:
    """Clamped knots on [start, end] within the domain, and the matrix to their control points."""
    p = old.degree
    inside = old.values[(old.values > start) & (old.values < end)]
    new = KnotVector(np.concatenate([[start] * (p + 1), inside, [end] * (p + 1)]), p)
    return new, change_knots(old, new)


def remove(old: KnotVector, t: float) -> tuple[KnotVector, Array, Array]:
    """Knots with t once less, the matrix to their control points (least squares) and the matrix back."""
    low, high = old.domain
    if not (low < t < high and t in old.values):
        raise ValueError(f"{t:g} is no inner knot; inner knots are {old.breaks[1:-1].tolist()}")
    inner = _inner(old)
    new = _with_inner(old, np.delete(inner, int(np.searchsorted(inner, t))), old.degree)
    back = change_knots(new, old)
    return new, np.asarray(np.linalg.pinv(back), dtype=float), back


def derive(old: KnotVector) -> tuple[KnotVector, Array]:
    """Knots of the derivative, and the matrix to its control points p (P_(i+1) - P_i) / (u_(i+p+1) - u_(i+1))."""
    p = old.degree
    if p < 2:
        raise ValueError("the derivative of a polyline is no spline of degree one or more")
    new = KnotVector(old.values[1:-1], p - 1, old.closed)
    width = old.values[p + 1 : old.functions + p] - old.values[1 : old.functions]
    rate = np.divide(p, width, out=np.zeros_like(width), where=width > 0)[: new.count]
    matrix = np.zeros((new.count, old.count))
    rows = np.arange(new.count)
    matrix[rows, rows], matrix[rows, (rows + 1) % old.count] = -rate, rate
    return new, matrix


def derive_patches(nets: Array, knots: KnotVector, order: int, axis: int, along: int) -> Array:
    """Bezier nets of a derivative: spans of `knots` on `axis`, control points of each on the axis `along`."""
    width = np.diff(knots.breaks).reshape([-1 if k == axis else 1 for k in range(nets.ndim)])
    for _ in range(order):
        degree = nets.shape[along] - 1
        nets = degree * np.diff(nets, axis=along) / width if degree else np.zeros_like(nets)
    return np.ascontiguousarray(nets)


def _inner(knots: KnotVector) -> Array:
    """The knots that belong to the spline: all of them, or those of one period without its end."""
    if not knots.closed:
        return knots.values
    return knots.values[(knots.values >= knots.domain[0]) & (knots.values < knots.domain[1])]


def _with_inner(old: KnotVector, inner: Array, degree: int) -> KnotVector:
    """Knots of the same domain and kind, of the given degree, from what `_inner` returns."""
    low, high = old.domain
    if old.closed:
        period = high - low
        repeated = np.concatenate([inner + k * period for k in range(-degree - 1, degree + 2)])
        start = int(np.searchsorted(repeated, low, side="right")) - 1
        return KnotVector(repeated[start - degree : start + inner.size + degree + 1], degree, closed=True)
    before = int(np.searchsorted(inner, low, side="right"))
    after = int(np.searchsorted(inner, high, side="left"))
    return KnotVector(inner[before - degree - 1 : after + degree + 1], degree)
