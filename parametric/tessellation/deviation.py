"""How far lines and triangles of a triangulation are from the surface: measured at points."""

import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.tessellation.distance import farthest
from parametric.tessellation.samples import ALONG, CLOSELY, INSIDE
from parametric.tessellation.triangulation import Triangulation

Ints = NDArray[np.int64]
_UNEVEN = 0.1
"""Feet of samples on a line may be off by this part of it before the line is looked at more closely."""


def line_deviations(net: Triangulation, which: Ints) -> Array:
    """The largest distance from lines (n,) of the surface at three points along each, or sixteen where it is bent.

    The curve over a short line runs along it almost evenly; where it does not, three points say little.
    """
    off, lag = _from_lines(net, which, ALONG)
    uneven = np.flatnonzero(lag > _UNEVEN)
    if uneven.size:
        off[uneven] = np.maximum(off[uneven], _from_lines(net, which[uneven], CLOSELY)[0])
    return off


def _from_lines(net: Triangulation, which: Ints, along: Array) -> tuple[Array, Array]:
    """For lines (n,): the largest distance of the surface at parameters `along`, and how far feet are from there."""
    lines = net.lines
    a, b = (net.vertices[lines.ends[which, end]] for end in (0, 1))
    start, end = lines.places[which, 0], lines.places[which, 1]
    places = start + along[:, None, None] * (end - start)
    step = b - a
    squared = np.maximum(np.einsum("nc,nc->n", step, step), 1e-300)
    away = _evaluate(net, lines.home[which], places) - a
    feet = np.clip(np.einsum("knc,nc->kn", away, step) / squared, 0, 1)
    away -= feet[..., None] * step
    off = np.sqrt(np.einsum("knc,knc->kn", away, away).max(axis=0))
    return np.asarray(off), np.abs(feet - along[:, None]).max(axis=0)


def _evaluate(net: Triangulation, home: Ints, places: Array) -> Array:
    """Points (k, n, 3) at parameters (k, n, 2) of surfaces (n,)."""
    return net.evaluate(np.tile(home, len(places)), places.reshape(-1, 2)).reshape(*places.shape[:2], 3)


def corner_places(net: Triangulation, which: Ints) -> Array:
    """Parameters (n, 3, 2) of the corners of triangles; a pole takes the mean of the others' where it has none."""
    t = net.triangles
    places = t.places[which].copy()
    for k in range(3):
        others = (places[:, (k + 1) % 3] + places[:, (k + 2) % 3]) / 2
        for axis in (0, 1):
            rows = t.free[which, k] == axis
            places[rows, k, axis] = others[rows, axis]
    return places


def triangle_deviations(net: Triangulation, which: Ints) -> Array:
    """The largest distance from triangles (n,) of the surface at four points inside each."""
    corners = net.vertices[net.triangles.corners[which]]
    places = np.einsum("kj,njc->knc", INSIDE, corner_places(net, which))
    points = _evaluate(net, net.triangles.home[which], places)
    return farthest(corners, np.ascontiguousarray(np.swapaxes(points, 0, 1)))
