"""A mesh that has the singular set of the surface among its vertices and edges."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds, Box, to_bounds
from implicit.evaluate import Field
from implicit.mesh import Mesh, area_weighted_normals
from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.block import Block, find_blocks, put_cones
from implicit.polygonizers.conforming.check import bent_cells, boxes_round, folded, hidden, not_singular, turns
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.join import join_patch
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood, mesh_neighbourhood
from implicit.polygonizers.conforming.trim import rims, trim
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.weld import weld
from implicit.work import Job, Progress, check_workers

if TYPE_CHECKING:
    from implicit.singular import SingularLocus
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Cells = Callable[[IntArray], NDArray[np.bool_]]
"""Which of some cells (n, 3) are meant."""

MARGIN = 7
"""Cells beyond the bounds, so that the neighbourhood of a point on their boundary is whole."""
_APART = 5.0
"""A block nearer than this to other singular points or curves is given up for tetrahedra."""
_BEYOND = 1.5
"""Singular curves are followed so many cells beyond the bounds."""


@dataclass(eq=False)
class _Draft:
    """A mesh in the making: `special` vertices at singular points, `curves` along singular curves, doubtful boxes."""

    vertices: FloatArray
    faces: IntArray
    special: IntArray
    curves: list[IntArray] = field(default_factory=list)
    doubts: list[FloatArray] = field(default_factory=list)

    @property
    def singular(self) -> IntArray:
        """All vertices on the singular set."""
        return np.unique(np.concatenate([self.special, *self.curves]))


def conforming(
    surface: Surface,
    bounds: Bounds | float,
    resolution: int = 64,
    locus: SingularLocus | None = None,
    *,
    progress: Progress | None = None,
    workers: int = 1,
) -> Mesh:
    """The mesh of f = 0 within `bounds` that has the singular points and curves of the surface as vertices and edges.

    The fast sweep meshes the surface everywhere. Round each isolated singular point its triangles in a block of cells
    are replaced by the cone from the point over the rim they leave, where it is proved that the surface is one. Round
    all other singular points and curves the cells become tetrahedra with the singular set among their edges.

    locus   the singular points and curves, if they are known; found by `singularities` if not

    Promised: `points` are the vertices at special points, and every edge of `curves` that carries sheets is an edge of
    the mesh; parts of `curves` without faces are solitary. Blocks are proved, up to the rounding of the polynomial's
    coefficients; tetrahedra are refined until samples of f and its gradient on their edges and faces agree.
    `unresolved` lists a box round everything that is singular or may be and is not resolved so, and round triangles
    over which the gradient turns by more than 101 degrees. Where it turns by more than 53 degrees the cells around are
    searched for singular points, and what is left of them is listed too. It is empty when there is nothing of the
    kind. Not promised: the topology elsewhere, which is seen by the lattice's signs and these tests alone.

    Raises NotPolynomialError when the formula is no polynomial and no locus is given.

    >>> from implicit import Surface
    >>> mesh = conforming(Surface("x^2 + y^2 = z^2"), 1, 16)
    >>> mesh.vertices[mesh.points].tolist(), len(mesh.unresolved), mesh.euler
    ([[0.0, 0.0, 0.0]], 0, 1)
    """
    domain = to_bounds(bounds)
    grid = Grid.over(domain, resolution, MARGIN)
    if locus is None:
        from implicit.singular import singularities

        locus = singularities(surface, grid.box)
    local = Local(surface.field, grid, tuple(rims(domain, surface.field, grid.step)))
    blocks, hood = _resolve(local, locus)
    sampler = choose_sampler(surface, grid.lattice)
    marched = march(sampler, Job(len(sampler.bricks), progress, check_workers(workers)))
    weld(marched.vertices, marched.faces, marched.pinned)
    draft = _Draft(*put_cones(marched.vertices, _without_repeats(marched.faces), grid, blocks))
    if hood is not None:
        _join(draft, grid, hood)
    draft.doubts += [locus.undecided, not_singular(surface.field, grid, draft.vertices[draft.singular])]
    skipped = [block.holds for block in blocks] + ([hood.patch.region.holds] if hood else [])
    return _finish(draft, domain, local, skipped)


def _resolve(local: Local, locus: SingularLocus) -> tuple[list[Block], Neighbourhood | None]:
    """Blocks for the singular points that have one, and the neighbourhood of all others and of the curves."""
    grid = local.grid
    isolated = _near(local, np.array([point.position for point in locus.points]).reshape(-1, 3))
    on_curves = _near(local, np.concatenate([np.zeros((0, 3)), *(curve.special for curve in locus.curves)]))
    lines = [(grid.to_units(curve.polyline), curve.closed) for curve in locus.curves]
    blocks, left = find_blocks(local.field, grid, isolated)
    nodes = grid.to_units(np.concatenate([np.zeros((0, 3)), *(_near(local, curve.polyline) for curve in locus.curves)]))
    while True:
        special = _distinct(grid.to_units(np.concatenate([isolated[left], on_curves])))
        if not len(special) and not lines:
            return blocks, None
        clash = [block for block in blocks if _gap(block, np.concatenate([special, nodes])) < _APART]
        if not clash:
            hood = mesh_neighbourhood(local, special, lines, _BEYOND)
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


def _distinct(points: FloatArray) -> FloatArray:
    """The points without those that repeat an earlier one."""
    far = np.linalg.norm(points[:, None] - points, axis=2) > 1e-6
    return points[[row for row in range(len(points)) if far[row, :row].all()]]


def _without_repeats(faces: IntArray) -> IntArray:
    """The faces with three different vertices."""
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def _join(draft: _Draft, grid: Grid, hood: Neighbourhood) -> None:
    """Put a neighbourhood into the draft."""
    on = hood.skeleton.on
    draft.vertices, draft.faces, numbers, missing = join_patch(draft.vertices, draft.faces, grid, hood.patch, on)
    draft.special = np.concatenate([draft.special, numbers[: len(hood.skeleton.balls)]])
    draft.curves = [numbers[chain] for chain in hood.skeleton.chains]
    draft.doubts.append(boxes_round(grid.to_points(hood.doubtful), grid.step))
    if missing:
        draft.doubts.append(boxes_round(grid.to_points(on), grid.step))


def _finish(draft: _Draft, domain: Bounds, local: Local, skipped: Sequence[Cells]) -> Mesh:
    """The draft cut to the bounds and checked."""
    grid, fixed = local.grid, draft.singular
    normals = _normals(local.field, draft.vertices, fixed)
    vertices, normals, faces = trim((draft.vertices, normals, draft.faces), domain, local.field, grid.step, fixed)
    inside = np.zeros(len(vertices), bool)
    inside[: len(draft.vertices)] = local.heights(grid.to_units(draft.vertices)) <= 1e-9
    special = draft.special[inside[draft.special]]
    curves = [part for curve in draft.curves for part in _runs(curve, inside)]
    cosines = turns(normals, faces, fixed)
    cells = bent_cells(vertices, faces, cosines, grid)
    for holds in skipped:
        cells = cells[~holds(cells)]
    doubts = [*draft.doubts, folded(vertices, faces, cosines), hidden(local.field, grid, cells)]
    unresolved = _meeting(domain.box, np.concatenate(doubts))
    used = np.zeros(len(vertices), bool)
    used[np.concatenate([faces.ravel(), special, *curves])] = True
    number = np.cumsum(used) - 1
    vertices, normals, faces = vertices[used], normals[used], number[faces]
    flat = ~normals.any(axis=1)
    if flat.any():
        normals[flat] = area_weighted_normals(vertices, faces)[flat]
    return Mesh(vertices, faces, normals, [number[curve] for curve in curves], number[special], unresolved)


def _normals(surface: Field, vertices: FloatArray, singular: IntArray) -> FloatArray:
    """Unit gradients (n, 3), 0 at singular vertices."""
    normals = unit(surface.gradients(vertices)[1])
    normals[singular] = 0
    return normals


def _runs(curve: IntArray, inside: NDArray[np.bool_]) -> list[IntArray]:
    """The parts of a curve whose vertices all lie inside."""
    breaks = np.flatnonzero(~inside[curve])
    return [part[inside[part]] for part in np.split(curve, breaks) if inside[part].sum() > 1]


def _meeting(box: Box, boxes: FloatArray) -> FloatArray:
    """The boxes (n, 2, 3) that meet a box."""
    lower, upper = box.corners
    return boxes[((boxes[:, 0] <= upper) & (boxes[:, 1] >= lower)).all(axis=1)]
