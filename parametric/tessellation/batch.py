"""Points of many surfaces in one call: each point names its surface."""

import numba
import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array
from parametric.shell import Shell
from parametric.splines.tensor import BezierSurface
from parametric.tessellation.triangulation import Evaluate

Ints = NDArray[np.int64]


def evaluator(shell: Shell) -> Evaluate:
    """A function of surface numbers (n,) and parameters (n, 2) that gives points (n, 3)."""
    if all(isinstance(surface, BezierSurface) for surface in shell.surfaces):
        return _of_patches([s for s in shell.surfaces if isinstance(s, BezierSurface)])

    def evaluate(home: Ints, places: Array) -> Array:
        result = np.empty((len(home), 3))
        order = np.argsort(home, kind="stable")
        numbers, starts = np.unique(home[order], return_index=True)
        for k, rows in zip(numbers, np.split(order, starts[1:])):
            result[rows] = shell.surfaces[k](places[rows, 0], places[rows, 1])
        return result

    return evaluate


def _of_patches(patches: list[BezierSurface]) -> Evaluate:
    """The same for Bezier surfaces, by one kernel."""
    weights = [np.ones(s.points.shape[:2]) if s.weights is None else s.weights for s in patches]
    nets = [np.concatenate([s.points * w[..., None], w[..., None]], axis=2) for s, w in zip(patches, weights)]
    shapes = np.array([net.shape[:2] for net in nets], dtype=np.int64)
    sizes = np.array([net.size for net in nets])
    starts = np.cumsum(sizes) - sizes
    rational = any(s.weights is not None for s in patches)
    flat = np.concatenate([net.ravel() for net in nets])

    def evaluate(home: Ints, places: Array) -> Array:
        out = np.empty((len(home), 3))
        points_of_patches(flat, starts, shapes, rational, home, np.ascontiguousarray(places), out)
        return out

    return evaluate


@numba.njit(cache=True, error_model="numpy", nogil=True)
def points_of_patches(
    nets: Array, starts: Ints, shapes: Ints, rational: bool, home: Ints, places: Array, out: Array
) -> None:
    """Fill points (n, 3) of patches with weighted control points (x, y, z, w), one net after the other."""
    along, across = np.empty(shapes.max()), np.empty(shapes.max())
    for i in range(len(home)):
        k = home[i]
        p, q, place = shapes[k, 0], shapes[k, 1], starts[k]
        _bernstein(along, p, places[i, 0])
        _bernstein(across, q, places[i, 1])
        x = y = z = w = 0.0
        for a in range(p):
            rx = ry = rz = rw = 0.0
            for b in range(q):
                f = across[b]
                rx += f * nets[place]
                ry += f * nets[place + 1]
                rz += f * nets[place + 2]
                rw += f * nets[place + 3]
                place += 4
            f = along[a]
            x, y, z, w = x + f * rx, y + f * ry, z + f * rz, w + f * rw
        if not rational:
            w = 1.0
        out[i, 0], out[i, 1], out[i, 2] = x / w, y / w, z / w


@numba.njit("void(float64[::1], int64, float64)", cache=True, error_model="numpy", no_cpython_wrapper=True)
def _bernstein(values: Array, count: int, t: float) -> None:
    """All Bernstein polynomials of degree count - 1 at t."""
    values[0] = 1.0
    for k in range(1, count):
        carried = 0.0
        for a in range(k):
            part = values[a]
            values[a] = carried + (1.0 - t) * part
            carried = t * part
        values[k] = carried
