"""How far lines and triangles of a triangulation are from the surface: measured at points."""

import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.triangulation import Triangulation

Ints = NDArray[np.int64]
ALONG = (0.25, 0.5, 0.75)
INSIDE = np.array([[1, 1, 1], [1.8, 0.6, 0.6], [0.6, 1.8, 0.6], [0.6, 0.6, 1.8]]) / 3


def line_deviations(net: Triangulation, which: Ints) -> Array:
    """The largest distance from lines (n,) of the surface at three points along each."""
    lines = net.lines
    a, b = (net.vertices[lines.ends[which, end]] for end in (0, 1))
    start, end = lines.places[which, 0], lines.places[which, 1]
    worst = np.zeros(which.size)
    step = b - a
    squared = np.maximum(np.einsum("nc,nc->n", step, step), 1e-300)
    for s in ALONG:
        away = net.evaluate(lines.home[which], start + s * (end - start)) - a
        along = np.clip(np.einsum("nc,nc->n", away, step) / squared, 0, 1)
        away -= along[:, None] * step
        np.maximum(worst, np.einsum("nc,nc->n", away, away), out=worst)
    return np.sqrt(worst)


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
    """The largest distance from the planes of triangles (n,) of the surface at four points inside each."""
    t = net.triangles
    corners = net.vertices[t.corners[which]]
    places = corner_places(net, which)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt(np.einsum("nc,nc->n", normal, normal))
    normal /= np.maximum(length, 1e-300)[:, None]
    worst = np.zeros(which.size)
    for weights in INSIDE:
        away = net.evaluate(t.home[which], np.einsum("k,nkc->nc", weights, places)) - corners[:, 0]
        np.maximum(worst, np.abs(np.einsum("nc,nc->n", away, normal)), out=worst)
    return worst
