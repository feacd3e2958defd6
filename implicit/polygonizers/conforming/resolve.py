"""Which singular points get a block of cells, and which a ball among tetrahedra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.conforming.curves.repeats import SAME, apart
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood, can_be_tried, mesh_neighbourhood
from implicit.polygonizers.conforming.points.block import Block, find_blocks

if TYPE_CHECKING:
    from implicit.singular import SingularLocus

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Cells = Callable[[IntArray], NDArray[np.bool_]]
"""Which of some cells (n, 3) are meant."""

_APART = 5.0
"""A block nearer than this to other singular points or curves is given up for tetrahedra."""
_FILLED = 3.0
"""Tetrahedra reach at least so many cells from singular points and curves."""
_BEYOND = 8.2
"""Singular curves are followed so many cells beyond the bounds, so that the widest zones end there."""


def isolated_points(local: Local, locus: SingularLocus) -> FloatArray:
    """The isolated singular points (n, 3) in the bounds or close to them, each once."""
    points = _near(local, np.array([point.position for point in locus.points]).reshape(-1, 3), 2)
    return points[apart(local.grid.to_units(points), SAME)]


@dataclass(frozen=True, eq=False)
class Plan:
    """Blocks to begin with, the rows of isolated points without one, and places (n, 3) that tetrahedra must reach.

    coarse (m, 3): all places where the sweep is too coarse.
    """

    blocks: list[Block]
    rest: IntArray
    seeds: FloatArray
    coarse: FloatArray


def plan(local: Local, locus: SingularLocus, coarse: FloatArray) -> Plan:
    """What is known before there are tetrahedra; coarse (n, 3), in lattice units: where the sweep is too coarse.

    Where that is beside a block, and no larger block takes it in, tetrahedra do better than both.
    """
    isolated = isolated_points(local, locus)
    blocks, rest = find_blocks(local.field, local.grid, isolated, np.arange(len(isolated)), coarse)
    special, nodes = _others(local, locus, isolated[rest])
    seeds = outside(coarse, [block.holds for block in blocks])
    if len(special) + len(nodes) and len(seeds):
        seeds = seeds[cKDTree(np.concatenate([special, nodes])).query(seeds)[0] > _FILLED]
    if can_be_tried(local, seeds):
        return Plan(blocks, rest, seeds, coarse)
    more, rest = find_blocks(local.field, local.grid, isolated, rest, coarse[:0])
    return Plan(blocks + more, rest, seeds[:0], coarse)


def outside(places: FloatArray, skipped: Sequence[Cells]) -> FloatArray:
    """The places (n, 3) in none of some cells."""
    for holds in skipped:
        places = places[~holds(np.floor(places).astype(np.int64))]
    return places


def resolve(
    local: Local,
    locus: SingularLocus,
    plan: Plan,
    seeds: FloatArray,
    before: Neighbourhood | None,
    whole: frozenset[int],
) -> tuple[list[Block], Neighbourhood | None]:
    """Blocks for the singular points that have one, and the neighbourhood of all others, of the curves and of seeds.

    seeds (n, 3), in lattice units, are places where the cells are too coarse. before: the neighbourhood that was found
    with fewer seeds. whole: arcs round which there are tetrahedra all along.
    """
    isolated = isolated_points(local, locus)
    lines = [(local.grid.to_units(curve.polyline), curve.closed) for curve in locus.curves]
    blocks, left = plan.blocks, plan.rest
    while True:
        special, nodes = _others(local, locus, isolated[left])
        if not len(special) and not lines and not len(seeds):
            return blocks, None
        clash = [block for block in blocks if _gap(block, np.concatenate([special, nodes, seeds])) < _APART]
        if not clash:
            coarse = outside(plan.coarse, [block.holds for block in blocks])
            hood = before = mesh_neighbourhood(local, special, lines, _BEYOND, seeds, coarse, before, whole)
            clash = [block for block in blocks if hood.holds(block.cells).any()]
            if not clash:
                return blocks, hood
        blocks = [block for block in blocks if block not in clash]
        kept = [block.point.tolist() for block in blocks]
        left = np.array([row for row, point in enumerate(isolated.tolist()) if point not in kept], np.int64)


def _others(local: Local, locus: SingularLocus, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Special points, those given among them, and places a cell apart on singular curves (n, 3), in lattice units."""
    none = np.zeros((0, 3))
    on_curves = _near(local, np.concatenate([none, *(curve.special for curve in locus.curves)]), _BEYOND)
    lines = [_even(curve.polyline, local.grid.step) for curve in locus.curves]
    nodes = _near(local, np.concatenate([none, *lines]), 2)
    to_units = local.grid.to_units
    special = to_units(np.concatenate([points, on_curves]))
    return special[apart(special, SAME)], to_units(nodes)


def _even(line: FloatArray, spacing: float) -> FloatArray:
    """Places (m, 3) on a polyline (n, 3) so far apart."""
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    where = np.linspace(0, length[-1], int(np.ceil(length[-1] / spacing)) + 1)
    return np.column_stack([np.interp(where, length, axis) for axis in line.T])


def _gap(block: Block, units: FloatArray) -> float:
    """How many cells lie between a block and the nearest of some places."""
    away = np.maximum(block.lower - units, units - block.upper).max(axis=1)
    return float(away.min(initial=np.inf))


def _near(local: Local, points: FloatArray, cells: float) -> FloatArray:
    """The points less than so many cells outside the bounds."""
    return points[local.heights(local.grid.to_units(points)) < cells] if len(points) else points
