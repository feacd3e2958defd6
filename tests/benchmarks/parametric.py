"""Evaluating surfaces against scipy, splipy and geomdl, in one run on one core: processor seconds, ratios, errors.

Bicubic B-spline of 20 x 20 control points over uneven clamped knots, and a Bezier surface of 10 x 10 degrees. Making
the surface, and the one extraction of its Bezier patches, are left out; one call before the first measurement compiles
the kernels. splipy and geomdl are measured where they are installed; geomdl on fewer points, scaled up.
"""

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import NdBSpline

from parametric import BezierSurface, BSplineSurface
from tests.benchmarks.measure import markdown, measure

_SIDE = 1000
_POINTS = _SIDE * _SIDE
_FEW = 2000
_FIRST = ((0, 0), (1, 0), (0, 1))


def _knots(count: int, degree: int, seed: int) -> NDArray[np.float64]:
    inner = np.sort(np.random.default_rng(seed).random(count - degree - 1))
    return np.concatenate([[0.0] * (degree + 1), inner, [1.0] * (degree + 1)])


def _row(
    task: str, goal: str, ours: Callable[[], Any], theirs: Callable[[], Any], peer: str = "scipy", scale: float = 1
) -> list[object]:
    """One comparison; the results are compared where both have the same shape."""
    ours()
    mine, other = measure(ours, 7), measure(theirs, 3 if scale == 1 else 1)
    one, two = np.asarray(mine.result), np.asarray(other.result)
    error = f"{np.abs(one - two).max():.0e}" if one.shape == two.shape else "-"
    seconds = other.seconds * scale
    return [task, f"{mine.seconds:.4f}", peer, f"{seconds:.4f}", f"{seconds / mine.seconds:.1f}x", goal, error]


def _scipy_rows() -> list[list[object]]:
    rng = np.random.default_rng(0)
    knots = (_knots(20, 3, 1), _knots(20, 3, 2))
    net, u, v = rng.normal(size=(20, 20, 3)), rng.random(_POINTS), rng.random(_POINTS)
    surface, peer, pairs = BSplineSurface(net, 3, knots), NdBSpline(knots, net, 3), np.stack([u, v], axis=-1)
    side = np.linspace(0, 1, _SIDE)
    mesh = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1)
    high = rng.normal(size=(11, 11, 3))
    bezier = BezierSurface(high)
    ends = np.repeat([0.0, 1.0], 11)
    high_peer = NdBSpline((ends, ends), high, 10)

    def three() -> NDArray[np.float64]:
        return np.stack([peer(pairs, nu=order) for order in _FIRST])

    return [
        _row("grid, positions", "25x", lambda: surface.grid(side, side), lambda: peer(mesh)),
        _row("scattered, positions", "1.7x", lambda: surface(u, v), lambda: peer(pairs)),
        _row("scattered, positions, partials and normals", "1.7x", lambda: surface.frame(u, v), three, "scipy 3 times"),
        _row("scattered, Bezier of degree 10 x 10", "5x", lambda: bezier(u, v), lambda: high_peer(pairs)),
        _row("a curve of constant u", "", lambda: surface.iso_u(0.3)(v), lambda: _curve(peer, v)),
    ]


def _curve(peer: NdBSpline, v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(peer(np.stack([np.full_like(v, 0.3), v], axis=-1)))


def _splipy_rows() -> list[list[object]]:
    from splipy import BSplineBasis, Surface

    net, knots = np.random.default_rng(0).normal(size=(20, 20, 3)), (_knots(20, 3, 1), _knots(20, 3, 2))
    surface, side = BSplineSurface(net, 3, knots), np.linspace(0, 1, _SIDE)
    columns_first = net.transpose(1, 0, 2).reshape(-1, 3)
    peer = Surface(BSplineBasis(4, knots[0]), BSplineBasis(4, knots[1]), columns_first)
    return [
        _row("grid, positions", "1.5x", lambda: surface.grid(side, side), lambda: peer(side, side), "splipy"),
        _row(
            "grid, normals", "", lambda: surface.normal(side[:, None], side), lambda: peer.normal(side, side), "splipy"
        ),
    ]


def _geomdl_rows() -> list[list[object]]:
    from geomdl import BSpline

    net, knots = np.random.default_rng(0).normal(size=(20, 20, 3)), (_knots(20, 3, 1), _knots(20, 3, 2))
    surface, peer = BSplineSurface(net, 3, knots), BSpline.Surface()
    peer.degree_u = peer.degree_v = 3
    peer.ctrlpts2d = net.tolist()
    peer.knotvector_u, peer.knotvector_v = knots[0].tolist(), knots[1].tolist()
    u, v = np.random.default_rng(1).random((2, _POINTS))
    few = np.stack([u, v], axis=-1)[:_FEW].tolist()
    scale = _POINTS / _FEW
    return [_row("scattered, positions", "", lambda: surface(u, v), lambda: peer.evaluate_list(few), "geomdl", scale)]


def table() -> str:
    """The table, and a line for each peer that is not installed."""
    rows, missing = _scipy_rows(), []
    for peer, measured in (("splipy", _splipy_rows), ("geomdl", _geomdl_rows)):
        if importlib.util.find_spec(peer):
            rows += measured()
        else:
            missing.append(f"{peer} is not installed: skipped.")
    header = ("1e6 points", "ours, s", "peer", "peer, s", "ratio", "goal", "largest difference")
    return "\n\n".join([markdown(header, rows), *missing])
