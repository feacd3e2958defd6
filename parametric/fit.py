"""Surfaces and curves fitted to points: interpolation and least squares by B-splines."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import Array, to_parameters, to_points
from parametric.splines.bspline import BSplineCurve
from parametric.splines.knots import KnotVector
from parametric.splines.tensor import BSplineSurface

SPACINGS = {"uniform": 0.0, "centripetal": 0.5, "chord": 1.0}


def interpolate(
    points: ArrayLike, degrees: Sequence[int] = (3, 3), parameters: str | tuple[ArrayLike, ArrayLike] = "chord"
) -> BSplineSurface:
    """B-spline surface through a grid of points (m, n, 3).

    `parameters` says where: "uniform", "chord" (by distance) or "centripetal" (by its root), averaged over the rows
    and the columns, or a pair of increasing arrays (m,) and (n,). Knots are averages of neighbouring parameters, so
    that the equations are solvable (de Boor 1978). Degrees must be less than the numbers of points.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    >>> surface = interpolate(np.stack([x, y, x * y], axis=-1), (3, 2))
    >>> surface(0.25, 0.0).round(12).tolist()
    [1.0, 0.0, 0.0]
    """
    grid = to_points(points, "points", 2)
    places = _places(grid, parameters)
    knots = [averaged_knots(p, degree) for p, degree in zip(places, degrees, strict=True)]
    return _through(grid, places, knots)


def interpolate_curve(points: ArrayLike, degree: int = 3, parameters: str | ArrayLike = "chord") -> BSplineCurve:
    """B-spline curve through points (n, 3); `parameters` as for `interpolate`.

    Examples
    --------
    >>> interpolate_curve([(0, 0), (1, 1), (2, 0), (3, 1)], parameters="uniform")(1 / 3).round(12)
    array([1., 1., 0.])
    """
    row = to_points(points, "points", 1)
    named = isinstance(parameters, str)
    places = _mean_spacing(row[:, None], str(parameters)) if named else _given(parameters, len(row), "t")
    knots = averaged_knots(places, degree)
    return BSplineCurve(_solve(knots.design(places), row), degree, knots)


def approximate(
    points: ArrayLike,
    counts: Sequence[int],
    degrees: Sequence[int] = (3, 3),
    parameters: str | tuple[ArrayLike, ArrayLike] = "chord",
) -> BSplineSurface:
    """B-spline surface of `counts` control points that is nearest to a grid of points (m, n, 3) by least squares.

    Examples
    --------
    >>> x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 15), indexing="ij")
    >>> approximate(np.stack([x, y, x * y], axis=-1), (5, 4)).points.shape
    (5, 4, 3)
    """
    grid = to_points(points, "points", 2)
    places = _places(grid, parameters)
    knots = [_spread_knots(p, degree, count) for p, degree, count in zip(places, degrees, counts, strict=True)]
    return _through(grid, places, knots)


def fit_scattered(
    points: ArrayLike,
    u: ArrayLike,
    v: ArrayLike,
    counts: Sequence[int],
    degrees: Sequence[int] = (3, 3),
    *,
    smoothing: float = 0.0,
) -> BSplineSurface:
    """B-spline surface on [0, 1] x [0, 1] nearest to scattered points (n, 3) with parameters u, v (n,).

    Least squares, plus `smoothing` times the mean square of second differences of the net. Without smoothing a
    ValueError where the points leave a control point undetermined.

    Examples
    --------
    >>> u, v = np.random.default_rng(0).random((2, 200))
    >>> fit_scattered(np.stack([u, v, u * v], axis=-1), u, v, (4, 4))(0.5, 0.5).round(9)
    array([0.5 , 0.5 , 0.25])
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    cloud = to_points(points, "points", 1)
    places = [np.asarray(p, dtype=float).ravel() for p in (u, v)]
    if any(p.size != len(cloud) for p in places):
        raise ValueError(f"every point needs one u and one v, got {len(cloud)}, {places[0].size} and {places[1].size}")
    knots = [_spread_knots(np.array([0.0, 1.0]), d, c) for d, c in zip(degrees, counts, strict=True)]
    (fu, wu), (fv, wv) = (k.weights(to_parameters(p, k.domain, name)) for k, p, name in zip(knots, places, "uv"))
    rows = fu[:, None, None] + np.arange(wu.shape[1])[:, None]
    columns = fv[:, None, None] + np.arange(wv.shape[1])
    index, values = rows * knots[1].count + columns, wu[:, :, None] * wv[:, None, :]
    at = np.broadcast_to(np.arange(len(cloud))[:, None, None], index.shape)
    size = knots[0].count * knots[1].count
    design = coo_matrix((values.ravel(), (at.ravel(), index.ravel())), shape=(len(cloud), size)).tocsr()
    normal, right = (design.T @ design).tocsc(), design.T @ cloud
    if smoothing > 0:
        normal = normal + smoothing * len(cloud) / size * _roughness(knots[0].count, knots[1].count)
    elif np.linalg.matrix_rank(design.toarray()) < size:
        raise ValueError(f"{len(cloud)} points do not determine {size} control points: use fewer, or smoothing > 0")
    net = np.asarray(spsolve(normal, right)).reshape(knots[0].count, knots[1].count, 3)
    return BSplineSurface(net, (knots[0].degree, knots[1].degree), knots)


def _places(grid: Array, parameters: str | tuple[ArrayLike, ArrayLike]) -> list[Array]:
    """Parameters of the rows and of the columns of a grid of points."""
    if isinstance(parameters, str):
        return [_mean_spacing(np.moveaxis(grid, axis, 0), parameters) for axis in (0, 1)]
    return [_given(p, size, name) for p, size, name in zip(parameters, grid.shape, "uv", strict=False)]


def _through(grid: Array, places: Sequence[Array], knots: Sequence[KnotVector]) -> BSplineSurface:
    """The surface over the knots that passes through the grid, or nearest to it, one axis after the other."""
    net = grid
    for axis, (k, p) in enumerate(zip(knots, places)):
        net = np.moveaxis(_solve(k.design(p), np.moveaxis(net, axis, 0)), 0, axis)
    return BSplineSurface(net, (knots[0].degree, knots[1].degree), list(knots))


def _roughness(m: int, n: int) -> Any:
    """Quadratic form of the second differences of an m x n net in both directions."""
    from scipy.sparse import diags_array, eye_array, kron

    def second(size: int) -> Any:
        if size < 3:
            return diags_array([np.zeros(size)], offsets=[0])
        bands = [np.full(size - 2, weight) for weight in (1.0, -2.0, 1.0)]
        d = diags_array(bands, offsets=[0, 1, 2], shape=(size - 2, size))
        return d.T @ d

    return (kron(second(m), eye_array(n)) + kron(eye_array(m), second(n))).tocsc()


def averaged_knots(places: Array, degree: int) -> KnotVector:
    """Clamped knots whose inner ones are means of `degree` neighbouring parameters."""
    if not 1 <= degree < places.size:
        raise ValueError(f"degree {degree} needs at least {degree + 1} points in a row, got {places.size}")
    inner = [places[k : k + degree].mean() for k in range(1, places.size - degree)]
    return KnotVector([places[0]] * (degree + 1) + inner + [places[-1]] * (degree + 1), degree)


def _spread_knots(places: Array, degree: int, count: int) -> KnotVector:
    """Clamped knots for `count` control points with inner knots at even shares of the parameters."""
    if count <= degree:
        raise ValueError(f"degree {degree} needs at least {degree + 1} control points, got {count}")
    if places.size > 2 and count > places.size:
        raise ValueError(f"{places.size} points in a row do not determine {count} control points")
    shares = np.linspace(0, places.size - 1, count - degree + 1)[1:-1]
    inner = np.interp(shares, np.arange(places.size), places)
    return KnotVector(np.concatenate([[places[0]] * (degree + 1), inner, [places[-1]] * (degree + 1)]), degree)


def _mean_spacing(rows: Array, spacing: str) -> Array:
    """Parameters in [0, 1] along the first axis of points (m, n, 3), averaged over the second."""
    if spacing not in SPACINGS:
        raise ValueError(f"parameters must be one of {', '.join(SPACINGS)} or given, got {spacing!r}")
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=-1) ** SPACINGS[spacing]
    totals = steps.sum(axis=0)
    steps = steps[:, totals > 0] / totals[totals > 0]
    mean = steps.mean(axis=1) if steps.size else np.full(len(rows) - 1, 1 / max(1, len(rows) - 1))
    if not (mean > 0).all():
        k = int(np.flatnonzero(mean <= 0)[0])
        raise ValueError(f"points {k} and {k + 1} coincide in every row: their parameters cannot be told apart")
    return np.concatenate([[0.0], np.cumsum(mean)[:-1], [1.0]])


def _given(values: ArrayLike, count: int, name: str) -> Array:
    places = np.array(values, dtype=float)
    if places.shape != (count,) or not (np.diff(places) > 0).all():
        raise ValueError(f"parameters {name} must be {count} increasing numbers, got {places.tolist()}")
    return places


def _solve(matrix: Array, right: Array) -> Array:
    """Solution, or least squares where there are more equations than unknowns, along the first axis."""
    flat = right.reshape(len(right), -1)
    square = matrix.shape[0] == matrix.shape[1]
    found = np.linalg.solve(matrix, flat) if square else np.linalg.lstsq(matrix, flat, rcond=None)[0]
    return np.asarray(found.reshape(-1, *right.shape[1:]), dtype=float)
