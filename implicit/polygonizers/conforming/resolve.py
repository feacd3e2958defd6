"""Which singular points get a block of cells, and which a ball among tetrahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.block import Block
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood, mesh_neighbourhood

if TYPE_CHECKING:
    from implicit.singular import SingularLocus

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_APART = 5.0
"""A block nearer than this to other singular points or curves is given up for tetrahedra."""
_BEYOND = 1.5
"""Singular curves are followed so many cells beyond the bounds."""


def isolated_points(local: Local, locus: SingularLocus) -> FloatArray:
    """The isolated singular points (n, 3) in the bounds or close to them, each once."""
    points = _near(local, np.array([point.position for point in locus.points]).reshape(-1, 3))
    return points[_distinct(local.grid.to_units(points))]


def resolve(
    local: Local,
    locus: SingularLocus,
    found: tuple[list[Block], IntArray],
    seeds: FloatArray,
    before: Neighbourhood | None = None,
) -> tuple[list[Block], Neighbourhood | None]:
    """Blocks for the singular points that have one, and the neighbourhood of all others, of the curves and of seeds.

    found: the blocks that there are, and the rows of isolated points without one. seeds (n, 3), in lattice units, are
    places where the cells are too coarse. before: the neighbourhood that was found with fewer seeds.
    """
    grid = local.grid
    isolated = isolated_points(local, locus)
    on_curves = _near(local, np.concatenate([np.zeros((0, 3)), *(curve.special for curve in locus.curves)]))
    lines = [(grid.to_units(curve.polyline), curve.closed) for curve in locus.curves]
    blocks, left = found
    nodes = grid.to_units(np.concatenate([np.zeros((0, 3)), *(_near(local, curve.polyline) for curve in locus.curves)]))
    while True:
        special = grid.to_units(np.concatenate([isolated[left], on_curves]))
        special = special[_distinct(special)]
        if not len(special) and not lines and not len(seeds):
            return blocks, None
        clash = [block for block in blocks if _gap(block, np.concatenate([special, nodes, seeds])) < _APART]
        if not clash:
            hood = before = mesh_neighbourhood(local, special, lines, _BEYOND, seeds, before)
            clash = [block for block in blocks if hood.patch.region.holds(_cells_of(block)).any()]
            if not clash:
                return blocks, hood
        blocks = [block for block in blocks if block not in clash]
        kept = [block.point.tolist() for block in blocks]
        left = np.array([row for row, point in enumerate(isolated.tolist()) if point not in kept], np.int64)


def _gap(block: Block, units: FloatArray) -> float:
    """How many cells lie between a block and the nearest of some places."""
    away = np.maximum(block.lower - units, units - block.upper).max(axis=1)
    return float(away.min(initial=np.inf))


def _cells_of(block: Block) -> IntArray:
    ranges = [np.arange(a, b) for a, b in zip(block.lower, block.upper, strict=True)]
    return np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)


def _near(local: Local, points: FloatArray) -> FloatArray:
    """The points less than two cells outside the bounds."""
    return points[local.heights(local.grid.to_units(points)) < 2] if len(points) else points


def _distinct(points: FloatArray) -> NDArray[np.bool_]:
    """Which points (n, 3) do not repeat an earlier one."""
    far = np.linalg.norm(points[:, None] - points, axis=2) > 1e-6
    return np.array([far[row, :row].all() for row in range(len(points))], bool)
