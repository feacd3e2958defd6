"""The Bezier patches of a shell, exact or fitted, and the rim: sides that no neighbour runs along in step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from parametric.arcs import SIDES, Arc, Side
from parametric.edges import Edge
from parametric.parameters import Array
from parametric.shell import Shell
from parametric.surface import ParametricSurface

IN_STEP = 1e-12
"""Sides run in step where they are within this part of the size of the shell at every common parameter."""
FITTED = 1e-13
_DEGREE = 8
_MOST = 64


@dataclass(frozen=True)
class Patches:
    """Bezier patches of one surface: weighted nets (m, n, p, q, 4), the grid lines between them, and their error."""

    nets: Array
    breaks: tuple[Array, Array]
    error: float

    def side(self, name: str) -> Array:
        """Weighted control points (k, n, 4) of the segments of a side, in the direction of its parameter."""
        end = -int(name[1])
        return self.nets[end, :, end, :] if name[0] == "u" else self.nets[:, end, :, end]


@dataclass(frozen=True)
class Pieces:
    """All patches (p, q, 4), turned as the shell is; rim curves (n, 4) along its boundary; largest gap inside it."""

    nets: list[Array]
    rim: list[Array]
    gap: float


def cut_into_pieces(shell: Shell) -> Pieces:
    """The patches of all surfaces and the sides between them that do not cancel."""
    patches = [to_patches(surface, FITTED * shell.size) for surface in shell.surfaces]
    error = max(part.error for part in patches)
    gap = error
    matched: set[tuple[int, str, int]] = set()
    for edge in shell.edges:
        found = _in_step(shell, edge, patches, IN_STEP * shell.size + 2 * error)
        if found is not None:
            matched |= found[0]
        gap = max(gap, edge.gap if found is None else found[1])
    nets: list[Array] = []
    rim: list[Array] = []
    for k, part in enumerate(patches):
        turned = shell.turns[k] < 0
        flat = part.nets.reshape(-1, *part.nets.shape[2:])
        nets += [np.ascontiguousarray(net[:, ::-1] if turned else net) for net in flat]
        for name in SIDES:
            forward = Side(shell.surfaces[k], k, name).inside_left != turned
            for j, curve in enumerate(part.side(name)):
                if (k, name, j) not in matched:
                    rim.append(np.ascontiguousarray(curve if forward else curve[::-1]))
    return Pieces(nets, rim, gap)


def _in_step(
    shell: Shell, edge: Edge, patches: list[Patches], limit: float
) -> tuple[set[tuple[int, str, int]], float] | None:
    """The segments along an edge, and the gap, where both surfaces run along it in step and in opposite directions."""
    if edge.kind == "degenerate":
        return _segments(edge.arcs[0], patches)[0], edge.gap
    if edge.kind != "shared" or not all(arc.proportional for arc in edge.arcs):
        return None
    first, second = edge.arcs
    turns = [shell.turns[arc.side.surface_index] * (1 if arc.inside_left else -1) for arc in edge.arcs]
    (names, stops), (others, other_stops) = (_segments(arc, patches) for arc in edge.arcs)
    if sum(turns) != 0 or len(stops) != len(other_stops) or np.abs(stops - other_stops).max() > 1e-12:
        return None
    if abs(stops[0]) > 1e-12 or abs(stops[-1] - 1) > 1e-12:
        return None
    places = np.array([0.0, 0.17, 0.35, 0.5, 0.68, 0.81, 1.0])
    s = (stops[:-1, None] + np.diff(stops)[:, None] * places).ravel()
    there = [arc.side.points(arc.parameter(s)) for arc in (first, second)]
    gap = float(np.linalg.norm(there[0] - there[1], axis=1).max())
    return (names | others, gap) if gap <= limit else None


def _segments(arc: Arc, patches: list[Patches]) -> tuple[set[tuple[int, str, int]], Array]:
    """The segments of a side that an arc covers, and the parameters of the edge where they meet."""
    k, name = arc.side.surface_index, arc.side.name
    breaks = patches[k].breaks[1 - arc.side.axis]
    low, high = arc.span
    slack = 1e-12 * (breaks[-1] - breaks[0])
    inside = np.flatnonzero((breaks >= low - slack) & (breaks <= high + slack))
    s = np.sort((breaks[inside] - arc.start) / (arc.end - arc.start))
    return {(k, name, int(j)) for j in inside[:-1]}, s if len(s) else np.array([np.nan])


def to_patches(surface: ParametricSurface, tolerance: float) -> Patches:
    """The Bezier patches of a surface: exact where it has them, else fitted within the tolerance if possible."""
    make = getattr(surface, "bezier_patches", None)
    if make is None:
        return fit_patches(surface, tolerance)
    shape = tuple(len(b) - 1 for b in surface.breaks)
    nets = []
    for patch in make():
        weights = np.ones(patch.points.shape[:2]) if patch.weights is None else patch.weights
        nets.append(np.concatenate([patch.points * weights[..., None], weights[..., None]], axis=2))
    array = np.array(nets)
    return Patches(array.reshape(*shape, *array.shape[1:]), surface.breaks, 0.0)


def fit_patches(surface: ParametricSurface, tolerance: float) -> Patches:
    """Patches of degree 8 through the Chebyshev points of a grid, finer until they keep the tolerance (at samples).

    Neighbouring patches share the points on their common side, so they meet exactly.
    """
    counts = [4 * (len(b) - 1) for b in surface.breaks]
    while True:
        grids = [_refine(b, n // (len(b) - 1)) for b, n in zip(surface.breaks, counts)]
        nets = _interpolate(surface, grids)
        errors = [_fit_error(surface, nets, grids, axis) for axis in (0, 1)]
        worst = int(errors[1] > errors[0])
        if errors[worst] <= tolerance or counts[worst] >= _MOST * (len(surface.breaks[worst]) - 1):
            weighted = np.concatenate([nets, np.ones((*nets.shape[:-1], 1))], axis=-1)
            return Patches(weighted, (grids[0], grids[1]), 4 * max(errors))
        counts[worst] *= 2


def _refine(breaks: Array, parts: int) -> Array:
    fractions = np.arange(parts) / parts
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * fractions).ravel(), breaks[-1])


def _bernstein(t: Array) -> Array:
    from scipy.special import binom

    i = np.arange(_DEGREE + 1)
    return np.asarray(binom(_DEGREE, i) * t[:, None] ** i * (1 - t[:, None]) ** (_DEGREE - i))


def _nodes() -> Array:
    nodes = (1 - np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)) / 2
    nodes[0], nodes[-1] = 0.0, 1.0
    return nodes


def _spread(grid: Array, places: Array) -> Array:
    return grid[:-1, None] + np.diff(grid)[:, None] * places


def _interpolate(surface: ParametricSurface, grids: list[Array]) -> Array:
    """Control nets (m, n, 9, 9, 3) of the patches through the points at Chebyshev nodes."""
    matrix = np.linalg.inv(_bernstein(_nodes()))
    matrix[0], matrix[-1] = np.eye(_DEGREE + 1)[0], np.eye(_DEGREE + 1)[-1]
    u, v = (_spread(grid, _nodes()) for grid in grids)
    u[:-1, -1], v[:-1, -1] = u[1:, 0], v[1:, 0]
    points = surface(u.ravel()[:, None], v.ravel()[None, :]).reshape(*u.shape, *v.shape, 3)
    return np.einsum("ai,bj,minjc->mnabc", matrix, matrix, points, optimize=True)


def _fit_error(surface: ParametricSurface, nets: Array, grids: list[Array], axis: int) -> float:
    """The largest distance of the patches from the surface between the nodes of one axis."""
    places = [_nodes(), _nodes()]
    places[axis] = (_nodes()[:-1] + _nodes()[1:]) / 2
    u, v = (_spread(grid, p) for grid, p in zip(grids, places))
    points = surface(u.ravel()[:, None], v.ravel()[None, :]).reshape(*u.shape, *v.shape, 3)
    fitted = np.einsum("ia,jb,mnabc->minjc", _bernstein(places[0]), _bernstein(places[1]), nets, optimize=True)
    return float(np.linalg.norm(points - fitted, axis=-1).max())


def pack(curves: list[Array]) -> tuple[Array, NDArray[np.int64]]:
    """Curves one after the other as flat numbers, and (place, number of control points) of each."""
    sizes = np.array([len(curve) for curve in curves], dtype=np.int64)
    starts = 4 * (np.cumsum(sizes) - sizes)
    flat = np.concatenate([curve.ravel() for curve in curves]) if curves else np.zeros(0)
    return flat, np.stack([starts, sizes], axis=1).astype(np.int64)
