"""The mesh drawn: the sweep, with cones in blocks, tetrahedra's triangles in a patch, and ribbons along curves."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import unit
from implicit.polygonizers.conforming.check import boxes_round
from implicit.polygonizers.conforming.curves.ribbon import lay_ribbons
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.mend import mend
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood
from implicit.polygonizers.conforming.points.block import Block, put_cones
from implicit.polygonizers.conforming.points.inward import Mesh, refine_inwards
from implicit.polygonizers.conforming.sweep import Near, Sweep
from implicit.polygonizers.conforming.tetrahedra.join import join_patch
from implicit.topology import with_others

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(eq=False)
class Draft:
    """A mesh in the making: `special` vertices at singular points, `curves` along singular curves, doubtful boxes.

    normals are 0 at singular vertices.
    """

    vertices: FloatArray
    normals: FloatArray
    faces: IntArray
    special: IntArray
    curves: list[IntArray] = field(default_factory=list)
    doubts: list[FloatArray] = field(default_factory=list)

    @cached_property
    def singular(self) -> IntArray:
        """All vertices on the singular set."""
        return np.unique(np.concatenate([self.special, *self.curves]))


@dataclass(eq=False)
class _Added:
    """What comes to the sweep: places (n, 3) and faces between them. Of the faces that are near, those `gone` leave.

    special and curves: the numbers of vertices on the singular set; stations: of those of each course.
    """

    gone: NDArray[np.bool_]
    places: list[FloatArray]
    faces: list[IntArray]
    special: IntArray
    curves: list[IntArray] = field(default_factory=list)
    stations: list[IntArray] = field(default_factory=list)
    doubts: list[FloatArray] = field(default_factory=list)


def draw(sweep: Sweep, local: Local, blocks: list[Block], hood: Neighbourhood | None) -> Draft:
    """The sweep with cones in the blocks, the patch of a neighbourhood in place of what is there, and its ribbons.

    Raises Ragged where ribbons cannot be laid.
    """
    cells = [block.cells for block in blocks] + ([hood.cells, hood.zones.cells(sweep.grid.cells)] if hood else [])
    stay, near = sweep.near(np.concatenate([np.zeros((0, 3), np.int64), *cells]))
    first = len(near.names)
    gone, cones = np.zeros(len(near.faces), bool), near.faces[:0]
    if blocks:
        gone, cones = put_cones(near.vertices[near.faces], near.faces, sweep.grid, blocks, first)
    points = np.array([block.point for block in blocks]).reshape(-1, 3)
    added = _Added(gone, [points], [cones], first + np.arange(len(blocks)))
    if hood:
        _add_neighbourhood(added, sweep.grid, near, hood, first + len(blocks))
    places, normals, faces = _changed(near, local, added, hood)
    names = np.append(near.names, len(sweep.vertices) + np.arange(len(places) - first))
    vertices = np.concatenate([sweep.vertices, places[first:]])
    upright = np.concatenate([sweep.normals, normals[first:]])
    vertices[near.names], upright[near.names] = places[:first], normals[:first]
    faces = with_others(sweep.faces, stay, names[faces])
    return Draft(vertices, upright, faces, names[added.special], [names[c] for c in added.curves], added.doubts)


def _changed(near: Near, local: Local, added: _Added, hood: Neighbourhood | None) -> Mesh:
    """The near part of the sweep with what comes to it: cones refined, ribbons laid, triangles mended."""
    first = len(near.names)
    places = np.concatenate([near.vertices, *added.places])
    normals = np.concatenate([near.normals, unit(local.field.gradients(places[first:])[1])])
    fixed = np.zeros(len(places), bool)
    fixed[np.concatenate([added.special, *added.curves])] = True
    normals[fixed] = 0
    places, normals, fresh = refine_inwards(local, (places, normals, np.concatenate(added.faces)), added.special, fixed)
    mesh = places, normals, np.concatenate([near.faces[~added.gone], fresh])
    if hood and hood.zones.stretches:
        mesh = lay_ribbons(local, mesh, hood, added.stations, fixed)
    return mend(local, mesh, np.append(fixed, np.zeros(len(mesh[0]) - len(fixed), bool)))


def _add_neighbourhood(added: _Added, grid: Grid, near: Near, hood: Neighbourhood, first: int) -> None:
    """Add the vertices on the singular set, numbered from `first` on, and the patch."""
    on = hood.skeleton.on
    added.stations, more = hood.threads(first)
    on_curves, doubtful = np.concatenate([on, more]), hood.doubtful
    if hood.patch:
        (inside, faces), places, missing = join_patch(near.vertices, near.faces, grid, hood.patch, on_curves, first)
        added.gone = added.gone | inside
        added.places.append(places)
        added.faces.append(faces)
        doubtful = np.concatenate([doubtful, on if missing else on[:0]])
    else:
        added.places.append(grid.to_points(on_curves))
    added.special = np.concatenate([added.special, first + np.arange(len(hood.skeleton.balls))])
    for course, stations in zip(hood.courses, added.stations, strict=True):
        start, end = ([first + ball[0]] if ball else [] for ball in (course.start, course.end))
        added.curves.append(np.array([*start, *stations, *end], np.int64))
    added.doubts = [boxes_round(grid.to_points(doubtful), grid.step)]
