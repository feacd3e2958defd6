"""A mesh that has the singular set of the surface among its vertices and edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds, Box, to_bounds
from implicit.mesh import Mesh, assemble
from implicit.polygonizers.conforming.check import (
    BENT,
    TURN,
    boxes_of,
    cells_of,
    hidden,
    not_singular,
    turning,
)
from implicit.polygonizers.conforming.curves.rim import Ragged
from implicit.polygonizers.conforming.diagonals import choose_diagonals
from implicit.polygonizers.conforming.draw import Draft, draw
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.neighbourhood import can_be_tried
from implicit.polygonizers.conforming.resolve import Cells, outside, plan, resolve
from implicit.polygonizers.conforming.sweep import Sweep
from implicit.polygonizers.conforming.trim import rims, trim
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.weld import fill_normals, squeeze_keeping, weld
from implicit.work import Job, Progress, check_workers

if TYPE_CHECKING:
    from implicit.singular import SingularLocus
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
MARGIN = 9
"""Cells beyond the bounds, so that the neighbourhood of a point on their boundary is whole, and curves end in them."""
_PATIENCE = 60.0
"""Seconds that the search for singular points may take before what is left is listed as undecided."""
_PASSES = 2
"""Where the sweep turns out too coarse, tetrahedra are tried in its place."""


def conforming_if_singular(
    surface: Surface, domain: Bounds, resolution: int, progress: Progress | None, workers: int
) -> Mesh | None:
    """The conforming mesh of a polynomial surface if it has, or may have, singular points in the bounds, else None."""
    if surface.polynomial is None:
        return None
    from implicit.singular import singularities

    grid = Grid.over(domain, resolution, MARGIN)
    locus = singularities(surface, grid.box, timeout=_PATIENCE)
    local = Local(surface.field, grid, tuple(rims(domain, surface.field, grid.step)))
    places = [point.position[None] for point in locus.points] + [curve.polyline for curve in locus.curves]
    inside = any((local.heights(grid.to_units(place)) < 1e-9).any() for place in places)
    if not inside and not len(_meeting(domain.box, locus.undecided)):
        return None
    return conforming(surface, domain, resolution, locus, progress=progress, workers=workers)


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

    The fast sweep meshes the surface everywhere; in each cell those diagonals are chosen that keep triangles near it.
    Round each isolated singular point its triangles in a block of cells are replaced by the cone from the point over
    the rim they leave, where it is proved that the surface is one. Along singular curves whose sheets are soon a cell's
    diagonal apart, cuspidal ones among them, the triangles near the curve give way to ribbons between the curve and the
    rims of what is left. Round all other singular points and curves the cells become tetrahedra with the singular set
    among their edges.

    locus   the singular points and curves, if they are known; found by `singularities` if not

    Promised: `points` are the vertices at special points, and every edge of `curves` that carries sheets is an edge of
    the mesh; parts of `curves` without faces are solitary. Blocks are proved, up to the rounding of the polynomial's
    coefficients, and so is, of a polynomial, that no edge of a tetrahedron is crossed twice, nor an edge or triangle of
    the spheres round special points. Inside, tetrahedra are refined until samples of f and its gradient agree. Ribbons
    are laid where rings round the curve meet as many sheets at each station, at several sizes, as there are rims from
    end to end, and no triangle is turned over; elsewhere there are tetrahedra.
    `unresolved` lists a box round everything that is singular or may be and is not resolved so, and round triangles
    over which the gradient turns by more than 78 degrees. Where it turns by more than 53 degrees the cells around are
    searched for singular points, and what is left of them is listed too. It is empty when there is nothing of the
    kind. Not promised: the topology elsewhere, which is seen by the lattice's signs and these tests alone.

    Of a formula that is no polynomial the whole of the bounds is listed, unless a locus is given.

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
    sampler = choose_sampler(surface, grid.lattice)
    marched = march(sampler, Job(len(sampler.bricks), progress, check_workers(workers)))
    choose_diagonals(marched.vertices, marched.normals, marched.faces)
    sweep = Sweep(grid, *weld(marched.vertices, marched.normals, marched.faces, marched.pinned))
    draft, skipped = _drawn(sweep, local, locus)
    draft.doubts += [locus.undecided, not_singular(surface.field, grid, draft.vertices[draft.singular])]
    return _finish(draft, domain, local, skipped)


def _drawn(sweep: Sweep, local: Local, locus: SingularLocus) -> tuple[Draft, list[Cells]]:
    """The mesh before it is cut to the bounds, and the cells in which singular points are known."""
    coarse = _coarse(sweep, local)
    first = plan(local, locus, coarse)
    seeds, hood, whole = first.seeds, None, frozenset[int]()
    while True:
        for _ in range(_PASSES):
            blocks, hood = resolve(local, locus, first, seeds, hood, whole)
            skipped = [block.holds for block in blocks]
            fresh = outside(coarse, skipped)
            fresh = fresh[~hood.takes(fresh)] if hood else fresh
            if not len(fresh) or not can_be_tried(local, fresh):
                break
            seeds = np.concatenate([seeds, fresh])
        try:
            return draw(sweep, local, blocks, hood), [*skipped, *([hood.holds] if hood else [])]
        except Ragged as ragged:  # tetrahedra do what ribbons cannot
            whole, hood = whole | {ragged.arc}, None


def _coarse(sweep: Sweep, local: Local) -> FloatArray:
    """The middles, in lattice units, of faces of the sweep in the bounds over which the gradient turns too far."""
    bad = sweep.faces[turning(sweep.normals, sweep.faces, np.zeros(0, np.int64), TURN)[0]]
    middles = local.grid.to_units(sweep.vertices[bad].mean(axis=1))
    return middles[local.heights(middles) < 1] if len(middles) else middles


def _finish(draft: Draft, domain: Bounds, local: Local, skipped: Sequence[Cells]) -> Mesh:
    """The draft cut to the bounds and checked."""
    grid, fixed = local.grid, draft.singular
    vertices, normals, faces = trim((draft.vertices, draft.normals, draft.faces), domain, local.field, grid.step, fixed)
    inside = np.zeros(len(vertices), bool)
    inside[fixed] = local.heights(grid.to_units(draft.vertices[fixed])) <= 1e-9 if len(fixed) else False
    if isinstance(domain, Box):  # ends of curves, and what lies in a wall, may be off by a rounding
        vertices = np.clip(vertices, *domain.corners)
    special = draft.special[inside[draft.special]]
    curves = [part for curve in draft.curves for part in _runs(curve, inside)]
    rows, cosines = turning(normals, faces, fixed, BENT)
    corners = vertices[faces[rows]]
    cells = cells_of(corners, grid)
    for holds in skipped:
        cells = cells[~holds(cells)]
    doubts = [*draft.doubts, boxes_of(corners[cosines < TURN]), hidden(local.field, grid, cells)]
    unresolved = _meeting(domain.box, np.concatenate(doubts))
    (vertices, normals, faces), number = squeeze_keeping(vertices, normals, faces, np.concatenate([special, *curves]))
    fill_normals(vertices, normals, faces)
    return assemble(vertices, faces, normals, [number[curve] for curve in curves], number[special], unresolved)


def _runs(curve: IntArray, inside: NDArray[np.bool_]) -> list[IntArray]:
    """The parts of a curve whose vertices all lie inside."""
    breaks = np.flatnonzero(~inside[curve])
    return [part[inside[part]] for part in np.split(curve, breaks) if inside[part].sum() > 1]


def _meeting(box: Box, boxes: FloatArray) -> FloatArray:
    """The boxes (n, 2, 3) that meet a box."""
    lower, upper = box.corners
    return boxes[((boxes[:, 0] <= upper) & (boxes[:, 1] >= lower)).all(axis=1)]
