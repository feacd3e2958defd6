"""Tetrahedra near the singular set, refined until they see the surface, and the triangles in them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.cavity import Cavity, dead_vertices
from implicit.polygonizers.conforming.link import middle_of_other
from implicit.polygonizers.conforming.local import Local, pairs_of, unit_rows
from implicit.polygonizers.conforming.region import Region, build_region, cells_round
from implicit.polygonizers.conforming.sheets import find_roots, flat_tetrahedra, in_pyramids, in_tetrahedra
from implicit.polygonizers.conforming.skeleton import Skeleton, thin

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDS, _LAST, _FEW = 30, 60, 50
"""So many rounds of refinement; more, up to the last, while few places are left, as along thin horns."""
_REACH = 2
"""The region reaches so many cells beyond the cells with new vertices."""
_SHARES = np.linspace(0, 1, 9)[1:-1]
_INSIDE = np.array([(1, 1, 1, 0), (1, 1, 0, 1), (1, 0, 1, 1), (0, 1, 1, 1), (0.75,) * 4]) / 3
_TURN = 0.2
_AWAY = 0.3
_FLAT = 0.05
"""Triangles this thin may face anywhere."""
_APART, _STUCK = 0.12, 0.02
"""A vertex is added this share of the size of what asks for it away from others; less where none is that far away."""
_GROWTH = 4
_SPARE = 3000
"""More vertices than so many times those at the start, and these, are not tried."""
_BEYOND = 0.6
"""What is so many cells outside the bounds is not refined."""


@dataclass(frozen=True, eq=False)
class Patch:
    """The mesh of a region: places (v, 3) in lattice units, oriented faces (f, 3).

    names (v, 2): the ends of the edge of each vertex, equal on the singular set. on: the vertex of each vertex of the
    skeleton, -1 where none is used. doubtful (n, 3): places where something could not be resolved. around (m, 3): the
    vertices off the singular set that were added to the lattice, by `cavity`.
    """

    region: Region
    places: FloatArray
    faces: IntArray
    names: IntArray
    on: IntArray
    doubtful: FloatArray
    blocked: FloatArray
    around: FloatArray
    cavity: Cavity


def mesh_region(
    local: Local, skeleton: Skeleton, size: IntArray, rng: np.random.Generator, before: Patch | None = None
) -> Patch:
    """The mesh near a skeleton on a lattice of `size` cells; before: one with the first vertices of this skeleton."""
    doubtful, blocked = [], []
    refined = False
    around = skeleton.around
    cavity = before.cavity if before else Cavity()
    held = before.region if before else None
    tested = np.zeros(0)
    wrong = np.zeros((0, 3))
    for turn in range(_LAST + 1):
        new = np.concatenate([skeleton.on, around])
        region = held = _region(held, _touched(skeleton, new), size)
        dead = dead_vertices(region, skeleton.cleared, new)
        stay, fresh, fits = cavity.fill(region, dead, new)
        places = np.concatenate([region.places, new])
        signs = _signs(local, region, skeleton, places)
        enough = turn == _LAST or (turn >= _ROUNDS and len(wrong) > _FEW)
        if enough or len(around) > _GROWTH * len(skeleton.around) + _SPARE:
            break
        act = stay[np.ptp(signs[stay], axis=1) > 0] if turn == 0 else stay[:0]
        wrong, spacing, tested = _unseen(local, places, signs, np.concatenate([act, fresh]), fresh, tested)
        if not (local.heights(wrong) < _BEYOND).any():
            wrong, spacing = _turning(local, places, signs, stay, fresh, len(region.places), len(skeleton.on))
        near = local.heights(wrong) < _BEYOND
        wrong, spacing = wrong[near], spacing[near]
        if not len(wrong):
            refined = True
            break
        wrong = skeleton.onto_spheres(wrong + rng.normal(size=wrong.shape) * 0.02 * spacing[:, None])
        free = skeleton.free(wrong, 0.999, 1.0)
        blocked.append(wrong[~free])
        kept = wrong[free][thin(wrong[free], spacing[free], new, _APART)]
        if not len(kept):
            kept = wrong[free][thin(wrong[free], spacing[free], new, _STUCK)]
        if not len(kept):
            break
        around = np.concatenate([around, kept])
    if not refined and len(wrong):
        doubtful.append(wrong)
    if not fits or flat_tetrahedra(signs, np.concatenate([stay, fresh])):
        doubtful.append(skeleton.on)
    doubtful.append(_missing_edges(skeleton, fresh, len(region.places)))
    return _patch(local, region, places, signs, stay, fresh, skeleton, doubtful, blocked, around, cavity)


def _region(last: Region | None, touched: FloatArray, size: IntArray) -> Region:
    """The last region where it reaches far enough, else a new one, with a cell to spare if there was one before."""
    if last is not None and last.holds(cells_round(touched, _REACH, size)).all():
        return last
    return build_region(cells_round(touched, _REACH + (last is not None), size), size)


def _touched(skeleton: Skeleton, new: FloatArray) -> FloatArray:
    """Places whose cells the region must hold: the new vertices, and what is cleared."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 3**0.5
    shell = skeleton.cleared[:, None, :3] + skeleton.cleared[:, None, 3:] * np.concatenate(
        [corners, np.eye(3), -np.eye(3)]
    )
    return np.concatenate([new, shell.reshape(-1, 3)])


def _signs(local: Local, region: Region, skeleton: Skeleton, places: FloatArray) -> IntArray:
    signs = local.signs(places)
    first = len(region.places)
    signs[first : first + len(skeleton.on)] = 0
    return signs


def _unseen(
    local: Local, places: FloatArray, signs: IntArray, tetrahedra: IntArray, fresh: IntArray, tested: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places where an edge hides crossings, or a tetrahedron of one sign a finger of the other; the spacing there.

    tested: edges that hide nothing, named by their middles.
    """
    edges = pairs_of(tetrahedra)
    edges = edges[(signs[edges] != 0).all(axis=1)]
    a, b = places[edges[:, 0]], places[edges[:, 1]]
    keys = (a + b) @ np.array([1.0, np.pi, np.e])
    fresh_edges = ~np.isin(keys, tested)
    edges, a, b = edges[fresh_edges], a[fresh_edges], b[fresh_edges]
    between = a[:, None] + (b - a)[:, None] * _SHARES[:, None]
    inner = local.signs(between)
    row = np.column_stack([signs[edges[:, 0]], inner, signs[edges[:, 1]]])
    found = middle_of_other(between, inner, row)
    hiding = np.count_nonzero(np.diff(row, axis=1), axis=1) > 1
    spacing = np.linalg.norm(b - a, axis=1)[hiding]
    tested = np.concatenate([tested, keys[fresh_edges][~hiding]])
    same = fresh[np.abs(signs[fresh].sum(axis=1)) == 4]
    samples = np.einsum("kb,tbc->tkc", _INSIDE, places[same])
    other = local.signs(samples) != signs[same[:, :1]]
    hit = other.any(axis=1)
    finger = samples[hit][np.arange(hit.sum()), other[hit].argmax(axis=1)]
    length = np.linalg.norm(places[same[hit][:, 0]] - places[same[hit][:, 1]], axis=1)
    return np.concatenate([found, finger]), np.concatenate([spacing, length]), tested


def _turning(
    local: Local, places: FloatArray, signs: IntArray, stay: IntArray, fresh: IntArray, first: int, count: int
) -> tuple[FloatArray, FloatArray]:
    """Middles and sizes of the triangles off the singular set over which the gradient turns too far, or that face away
    from it at all corners.
    """
    named = in_tetrahedra(places, signs, np.concatenate([stay, fresh]))
    named = named[(named[..., 0] != named[..., 1]).all(axis=1)]
    ends, inverse = _unique_names(named)
    points = find_roots(local, places[ends[:, 0]], places[ends[:, 1]])
    normals = unit_rows(local.gradients(points)[1])
    faces = inverse.reshape(-1, 3)
    n, corners = normals[faces], points[faces]
    dots = np.minimum.reduce([np.einsum("ij,ij->i", n[:, k], n[:, (k + 1) % 3]) for k in range(3)])
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    away = np.einsum("ik,ijk->ij", across, n).max(axis=1) < -_AWAY * area
    bad = ((dots < _TURN) | (away & (area > _FLAT * size**2))) & (size > 1e-3)
    return corners[bad].mean(axis=1), size[bad]


def _unique_names(named: IntArray) -> tuple[IntArray, IntArray]:
    """The different names (v, 2), lower end first, and for each corner which it is."""
    low, high = named.min(axis=-1).ravel(), named.max(axis=-1).ravel()
    size = int(high.max(initial=0)) + 1
    keys, inverse = np.unique(low * size + high, return_inverse=True)
    return np.column_stack([keys // size, keys % size]), inverse.ravel()


def _missing_edges(skeleton: Skeleton, fresh: IntArray, first: int) -> FloatArray:
    """Middles of the edges of the singular set that are no edges of the tetrahedra."""
    if not len(skeleton.edges):
        return np.zeros((0, 3))
    size = int(fresh.max()) + 1
    have = pairs_of(fresh) @ np.array([size, 1])
    want = np.sort(skeleton.edges + first, axis=1) @ np.array([size, 1])
    return skeleton.on[skeleton.edges[~np.isin(want, have)]].mean(axis=1)


def _patch(
    local: Local, region: Region, places: FloatArray, signs: IntArray, stay: IntArray, fresh: IntArray,
    skeleton: Skeleton, doubtful: list[FloatArray], blocked: list[FloatArray], around: FloatArray,
    cavity: Cavity,
) -> Patch:  # fmt: skip
    """The triangles in all tetrahedra and pyramids, with their vertices on f = 0."""
    first, count = len(region.places), len(skeleton.on)
    named = np.concatenate(
        [in_tetrahedra(places, signs, np.concatenate([stay, fresh])), in_pyramids(signs, region.pyramids)]
    )
    names, inverse = _unique_names(named)
    points = places[names[:, 0]].copy()
    loose = names[:, 0] != names[:, 1]
    points[loose] = find_roots(local, places[names[loose, 0]], places[names[loose, 1]])
    on = np.full(count, -1)
    on[names[~loose, 0] - first] = np.flatnonzero(~loose)
    return Patch(
        region,
        points,
        inverse.reshape(-1, 3),
        names,
        on,
        np.concatenate([np.zeros((0, 3)), *doubtful]),
        np.concatenate([np.zeros((0, 3)), *blocked]),
        around,
        cavity,
    )
