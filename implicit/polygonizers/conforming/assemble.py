"""A mesh that has the singular set of the surface among its vertices and edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds, Box, to_bounds
from implicit.mesh import Mesh, area_weighted_normals
from implicit.polygonizers.conforming.block import find_blocks, put_cones
from implicit.polygonizers.conforming.check import bent_cells, boxes_round, folded, hidden, not_singular, turns
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.trim import trim
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.weld import weld
from implicit.work import Job, Progress, check_workers

if TYPE_CHECKING:
    from implicit.singular import SingularLocus
    from implicit.surface import Surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MARGIN = 6
"""Cells beyond the bounds, so that the neighbourhood of a point on their boundary is whole."""


def conforming(
    surface: Surface,
    bounds: Bounds | float,
    resolution: int = 64,
    locus: SingularLocus | None = None,
    *,
    progress: Progress | None = None,
    workers: int = 1,
) -> Mesh:
    """The mesh of f = 0 within `bounds` that has the singular points of the surface as vertices.

    The fast sweep meshes the surface everywhere; round each isolated singular point its triangles in a block of cells
    are replaced by the cone from the point over the rim they leave.

    locus   the singular points and curves, if they are known; found by `singularities` if not

    Promised: `points` are the vertices at singular points. Where a block is used it is proved, up to the rounding of
    the polynomial's coefficients, that the surface in it is a cone over the rim that the sweep made. `unresolved` lists
    a box round everything else that is singular or may be, and round triangles over which the gradient turns by more
    than 101 degrees. Where it turns by more than 53 degrees the cells around are searched for singular points, and what
    is left of them is listed too. It is empty when there is nothing of the kind. Not promised: the topology elsewhere,
    which is seen by the lattice's signs and these tests alone.

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
    positions = np.array([point.position for point in locus.points]).reshape(-1, 3)
    near = _near(domain, positions, MARGIN * grid.step)
    positions = positions[near]
    blocks, left = find_blocks(surface.field, grid, positions)
    sampler = choose_sampler(surface, grid.lattice)
    marched = march(sampler, Job(len(sampler.bricks), progress, check_workers(workers)))
    weld(marched.vertices, marched.faces, marched.pinned)
    vertices, faces, special = put_cones(marched.vertices, without_repeats(marched.faces), grid, blocks)
    normals = np.concatenate([marched.normals, np.zeros((len(special), 3))])
    vertices, normals, faces = trim((vertices, normals, faces), domain, surface.field, grid.step, special)
    special = special[domain.contains(vertices[special])]
    cosines = turns(normals, faces, special)
    cells = bent_cells(vertices, faces, cosines, grid)
    for block in blocks:
        cells = cells[~block.holds(cells)]
    curves = [curve.polyline for curve in locus.curves]
    unresolved = [
        locus.undecided,
        boxes_round(positions[left], grid.step),
        not_singular(surface.field, grid, positions),
        folded(vertices, faces, cosines),
        hidden(surface.field, grid, cells),
        *(boxes_round(curve, grid.step) for curve in curves),
    ]
    return _compact(vertices, normals, faces, special, _meeting(domain.box, np.concatenate(unresolved)))


def without_repeats(faces: IntArray) -> IntArray:
    """The faces with three different vertices."""
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def _near(domain: Bounds, points: FloatArray, reach: float) -> NDArray[np.bool_]:
    """Which points are within `reach` of the bounds' box."""
    lower, upper = domain.box.corners
    return np.asarray(((points > lower - reach) & (points < upper + reach)).all(axis=1))


def _meeting(box: Box, boxes: FloatArray) -> FloatArray:
    """The boxes (n, 2, 3) that meet a box."""
    lower, upper = box.corners
    return boxes[((boxes[:, 0] <= upper) & (boxes[:, 1] >= lower)).all(axis=1)]


def _compact(
    vertices: FloatArray, normals: FloatArray, faces: IntArray, special: IntArray, unresolved: FloatArray
) -> Mesh:
    """A mesh of the vertices in use."""
    used = np.zeros(len(vertices), bool)
    used[faces.ravel()] = True
    used[special] = True
    number = np.cumsum(used) - 1
    vertices, normals, faces, special = vertices[used], normals[used], number[faces], number[special]
    flat = ~normals.any(axis=1)
    if flat.any():
        normals[flat] = area_weighted_normals(vertices, faces)[flat]
    return Mesh(vertices, faces, normals, points=special, unresolved=unresolved)
