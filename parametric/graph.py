"""Surfaces z = g(x, y): from a formula, or through a grid of heights."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.function import FunctionSurface
from parametric.parameters import Array
from parametric.splines.knots import KnotVector
from parametric.splines.tensor import BSplineSurface
from parametric.surface import ParametricSurface
from parametric.transfinite.blend import greville

PIECES = ("one", "C0", "C1")


def graph(z: Any, x: ArrayLike, y: ArrayLike, *, pieces: str = "one") -> ParametricSurface:
    """Surface z = g(x, y), with u = x and v = y as parameters.

    Parameters
    ----------
    z : heights (p+1, q+1) at the grid, a sympy expression in x and y, or a callable z(x, y)
    x, y : increasing coordinates (p+1,) and (q+1,) of the grid; otherwise the intervals (x0, x1), (y0, y1)
    pieces : how heights are joined
        "one": the one polynomial sum b_mn x^m y^n of degree (p, q) through all of them. Its degree grows with the
        grid, and on an even grid it may swing far beyond the heights near the edges (Runge 1901): for
        1 / (1 + 25 x^2) on 21 even points it is off by about 60. "C0": bilinear patches. "C1": bicubic patches,
        with slopes from the parabola through three neighbours.

    Examples
    --------
    >>> heights = [[0, 0, 0], [0, 1, 2], [0, 2, 4]]
    >>> graph(heights, [0, 1, 2], [0, 1, 2])(1.5, 0.5).round(12)
    array([1.5 , 0.5 , 0.75])
    """
    if pieces not in PIECES:
        raise ValueError(f"pieces must be one of {', '.join(PIECES)}, got {pieces!r}")
    if hasattr(z, "free_symbols"):
        return _of_expression(z, x, y)
    if callable(z):
        return FunctionSurface(lambda a, b: (a, b, z(a, b)), np.array([x, y], dtype=float))
    heights, places = np.array(z, dtype=float), (_increasing(x, "x"), _increasing(y, "y"))
    sizes = tuple(p.size for p in places)
    if heights.shape != sizes or not np.isfinite(heights).all():
        raise ValueError(f"heights must be finite, of shape {sizes} to match x and y, got shape {heights.shape}")
    knots, matrices = zip(*(_pieces(p, pieces) for p in places))
    coefficients = matrices[0] @ heights @ matrices[1].T
    across = np.broadcast_arrays(greville(knots[0])[:, None], greville(knots[1])[None, :])
    net = np.stack([*across, coefficients], axis=-1)
    return BSplineSurface(net, (knots[0].degree, knots[1].degree), knots)


def polynomial_coefficients(z: ArrayLike, x: ArrayLike, y: ArrayLike) -> Array:
    """Coefficients b_mn of the one polynomial z = sum b_mn x^m y^n through a grid of heights (p+1, q+1).

    Examples
    --------
    >>> polynomial_coefficients([[1, 3], [2, 8]], [0, 1], [0, 1]).tolist()
    [[1.0, 2.0], [1.0, 4.0]]
    """
    a, b = (np.vander(_increasing(p, name), increasing=True) for p, name in ((x, "x"), (y, "y")))
    rows = np.linalg.solve(a, np.asarray(z, dtype=float))
    return np.asarray(np.linalg.solve(b, rows.T).T, dtype=float)


def _of_expression(z: Any, x: ArrayLike, y: ArrayLike) -> ParametricSurface:
    from parametric.formula import FormulaSurface, u, v

    names = {"x": u, "y": v, "u": u, "v": v}
    foreign = sorted(s.name for s in z.free_symbols if s.name not in names)
    if foreign:
        raise ValueError(f"z may only depend on x and y, but contains {', '.join(foreign)}")
    height = z.xreplace({s: names[s.name] for s in z.free_symbols})
    return FormulaSurface((u, v, height), np.array([x, y], dtype=float))


def _increasing(values: ArrayLike, name: str) -> Array:
    places = np.array(values, dtype=float)
    if places.ndim != 1 or places.size < 2 or not (np.diff(places) > 0).all():
        raise ValueError(f"{name} must be two or more increasing numbers, got {places.tolist()}")
    return places


def _pieces(places: Array, pieces: str) -> tuple[KnotVector, Array]:
    """Knots along one axis, and the matrix from heights at the places to control points."""
    n, ends = places.size, (places[0], places[-1])
    if pieces == "C1" and n > 2:
        knots = KnotVector(np.concatenate([ends[:1] * 4, np.repeat(places[1:-1], 2), ends[1:] * 4]), 3)
        return knots, _hermite_points(places)
    degree = n - 1 if pieces == "one" else 1
    inner = places[1:-1] if pieces != "one" else places[:0]
    knots = KnotVector(np.concatenate([[ends[0]] * (degree + 1), inner, [ends[1]] * (degree + 1)]), degree)
    return knots, np.asarray(np.linalg.inv(knots.design(places)), dtype=float)


def _hermite_points(places: Array) -> Array:
    """Control points of the C1 cubic with double knots: each height with a third of a step along its slope."""
    n, steps, slopes = places.size, np.diff(places), _slopes(places)
    values = np.eye(n)
    rows = [values[0], values[0] + steps[0] / 3 * slopes[0]]
    for k in range(1, n - 1):
        rows += [values[k] - steps[k - 1] / 3 * slopes[k], values[k] + steps[k] / 3 * slopes[k]]
    return np.stack([*rows, values[-1] - steps[-1] / 3 * slopes[-1], values[-1]])


def _slopes(places: Array) -> Array:
    """Matrix from heights to the slopes of the parabola through each place and its neighbours, (n, n)."""
    n = places.size
    matrix = np.zeros((n, n))
    for k in range(n):
        near = np.arange(3) + min(max(k - 1, 0), n - 3)
        x = places[near]
        for j in range(3):
            others = np.delete(x, j)
            matrix[k, near[j]] = np.sum(places[k] - others) / np.prod(x[j] - others)
    return matrix
