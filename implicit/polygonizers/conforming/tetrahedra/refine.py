"""Tetrahedra near the singular set, refined until they see the surface, and the triangles in them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.zone import Zones
from implicit.polygonizers.conforming.enclose import changes
from implicit.polygonizers.conforming.local import (
    Local,
    among,
    at_all,
    distinct,
    merged,
    pairs_of,
    unit_rows,
    with_edges,
)
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity, dead_vertices
from implicit.polygonizers.conforming.tetrahedra.region import Region, inner_places, reaching
from implicit.polygonizers.conforming.tetrahedra.seen import Seen, Waits, names_of, names_of_all
from implicit.polygonizers.conforming.tetrahedra.sheets import (
    find_roots,
    flat_tetrahedra,
    in_pyramids,
    in_tetrahedra,
    met,
)
from implicit.polygonizers.conforming.tetrahedra.skeleton import SHALLOW, Skeleton, thin

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Where = Callable[[FloatArray], NDArray[np.bool_]]
"""Which places (n, 3) are meant."""

_ROUNDS = 60
_INSIDE = np.array([(1, 1, 1, 0), (1, 1, 0, 1), (1, 0, 1, 1), (0, 1, 1, 1), (0.75,) * 4]) / 3
_TURN = 0.2
_AWAY = 0.3
_APART = 0.12
"""New vertices are so far from all others, as a share of the spacing there."""
_LEAST = 1e-6
"""The spacing, in cells, below which nothing is tried any more."""
_NEARLY = 1e-3
"""Where gradients are looked at need not be known better, as a share of the edge; the last step makes it its square."""
_FLAT = 0.05
"""Triangles this thin may face anywhere."""
_GROWTH = 4
_SPARE = 3000
"""More vertices than so many times those at the start, and these, are not tried."""
_BEYOND = 0.6
"""What is so many cells outside the bounds is not refined."""
_INSIDE_ZONE = 0.5
"""What is so many cells inside a zone is not refined."""


@dataclass(frozen=True, eq=False)
class Patch:
    """The mesh of a region: places (v, 3) in lattice units, oriented faces (f, 3).

    names (v, 2): the ends of the edge of each vertex, equal on the singular set. on: the vertex of each vertex of the
    skeleton, -1 where none is used. doubtful (n, 3): places where something could not be resolved. around (m, 3): the
    vertices off the singular set that were added to the lattice, by `cavity`. seen: what was looked at.
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
    seen: Seen


def mesh_region(
    local: Local, skeleton: Skeleton, zones: Zones, rng: np.random.Generator, lacking: Callable[[Region], FloatArray],
    before: Patch | None = None,
) -> Patch:  # fmt: skip
    """The mesh near a skeleton, wrong in the zones; before: one with the first vertices of this skeleton.

    lacking: places beyond a region that is refined, at which there shall be vertices too. It is asked once.
    """
    size = local.grid.cells

    def matters(places: FloatArray) -> NDArray[np.bool_]:
        if not len(places):
            return np.zeros(0, bool)
        return (local.heights(places) < _BEYOND) & (zones.depth(places) < _INSIDE_ZONE)

    doubtful: list[FloatArray] = []
    blocked: list[FloatArray] = []
    refined, waits, asked = False, Waits(), False
    around = skeleton.around
    cavity = before.cavity if before else Cavity()
    held = before.region if before else None
    seen = before.seen if before else Seen()
    dead, kept, further = np.zeros(0, bool), np.zeros((0, 3)), False
    for turn in range(_ROUNDS + 1):
        new = np.concatenate([skeleton.on, around])
        region = reaching(held, kept if turn else inner_places(skeleton.cleared, new), size)
        if turn and region is held:
            dead = dead | dead_vertices(region, skeleton.cleared[:0], kept)
        else:
            dead = dead_vertices(region, skeleton.cleared, new)
        held = region
        stay, fresh, known, fits = cavity.fill(region, dead, new)
        places = np.concatenate([region.places, new])
        signs = _signs(local, region, skeleton, places)
        if turn == _ROUNDS or len(around) > _GROWTH * len(skeleton.around) + _SPARE:
            break
        old = np.concatenate([stay, fresh[:known]])
        new_here = fresh if turn == 0 and not before else fresh[known:]
        doubted = np.concatenate([new_here, seen.hit_among(places, old)])
        active = stay[met(signs, stay)] if turn == 0 or further else stay[:0]
        wrong, spacing, ways = _unseen(local, places, signs, active, doubted, seen, matters)
        if not len(wrong):
            wrong, spacing = _turning(local, places, signs, np.concatenate([stay, fresh]), seen, matters)
            ways = np.zeros_like(wrong)
        further = not len(wrong) and not asked
        if further:
            asked, kept = True, skeleton.with_room(lacking(region), new)
            around = np.concatenate([around, kept])
            if len(kept):
                continue
        if not len(wrong):
            refined = True
            break
        kept = _with_room(skeleton, (wrong, spacing, ways), new, waits, blocked, rng)
        if not len(kept):
            break
        around = np.concatenate([around, kept])
    if not refined and len(wrong):
        doubtful.append(wrong)
    if not fits or flat_tetrahedra(signs, np.concatenate([stay, fresh])):
        doubtful.append(skeleton.on)
    doubtful.append(_missing_edges(skeleton, fresh, len(region.places)))
    return _patch(local, region, places, signs, stay, fresh, skeleton, doubtful, blocked, around, cavity, seen)


def _with_room(
    skeleton: Skeleton, wanted: tuple[FloatArray, FloatArray, FloatArray], new: FloatArray, waits: Waits,
    blocked: list[FloatArray], rng: np.random.Generator,
) -> FloatArray:  # fmt: skip
    """New vertices near places that are wanted, with the spacing there and ways along edges; those in tubes are added
    to the blocked ones. All else stays as it is until one finds room.
    """
    wrong, spacing, ways = wanted
    while True:
        spacing = waits.nearer(wrong, spacing)
        moved = skeleton.onto_spheres(wrong + 0.02 * spacing[:, None] * _shake(ways, rng))
        free = skeleton.free(moved, SHALLOW, 1.0)
        blocked.append(moved[~free])
        kept = moved[free][thin(moved[free], spacing[free], new, _APART)]
        if len(kept) or spacing.min() < _LEAST:
            return kept


def _signs(local: Local, region: Region, skeleton: Skeleton, places: FloatArray) -> IntArray:
    signs = local.signs(places)
    first = len(region.places)
    signs[first : first + len(skeleton.on)] = 0
    return signs


def _shake(ways: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Random vectors (n, 3) along ways (n, 3), or anywhere where a way is 0.

    On its edge a vertex lies in the spheres of all tetrahedra there, and beside it perhaps in none, so long as the
    edge is short beside their others.
    """
    anywhere = rng.normal(size=ways.shape)
    return np.where(ways.any(axis=1, keepdims=True), anywhere[:, :1] * ways, anywhere)


def _unseen(
    local: Local, places: FloatArray, signs: IntArray, active: IntArray, fresh: IntArray, seen: Seen, matters: Where
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places that matter where an edge hides crossings, or one of the fresh tetrahedra, of one sign, a finger of the
    other; the spacing there, and the ways (n, 3) of the edges, 0 for fingers.
    """
    looked = np.concatenate([active, fresh])
    edges = pairs_of(looked)
    edges = edges[at_all(signs != 0, edges)]
    names = names_of(places)
    keys = names[edges[:, 0]] * names[edges[:, 1]]
    left = ~among(keys, seen.edges)
    edges = edges[left]
    a, b = places[edges[:, 0]], places[edges[:, 1]]
    crossed = changes(local, a, b)
    beyond = a + crossed.beyond[:, None] * (b - a)
    twice = crossed.counts > 1
    twice[twice] = matters(beyond[twice])
    seen.edges = merged(seen.edges, keys[left][~twice])
    found = beyond[twice]
    spacing = np.linalg.norm((b - a)[twice], axis=1)
    same = fresh[at_all(signs < 0, fresh) | at_all(signs > 0, fresh)]
    samples = np.einsum("kb,tbc->tkc", _INSIDE, places[same])
    other = local.signs(samples) != signs[same[:, :1]]
    hit = np.flatnonzero(other.any(axis=1))
    finger = samples[hit, other[hit].argmax(axis=1)]
    near = matters(finger)
    hit, finger = hit[near], finger[near]
    length = np.linalg.norm(places[same[hit][:, 0]] - places[same[hit][:, 1]], axis=1)
    corners = np.concatenate([same[hit], with_edges(looked, edges[twice])])
    seen.hit = distinct(names[corners.ravel()])
    ways = np.concatenate([(b - a)[twice] / spacing[:, None], np.zeros_like(finger)])
    return np.concatenate([found, finger]), np.concatenate([spacing, length]), ways


def _turning(
    local: Local, places: FloatArray, signs: IntArray, tetrahedra: IntArray, seen: Seen, matters: Where
) -> tuple[FloatArray, FloatArray]:
    """Middles that matter, and sizes, of the triangles off the singular set over which the gradient turns too far, or
    that face away from it at all corners.
    """
    tets = tetrahedra[met(signs, tetrahedra)]
    keys = names_of_all(names_of(places), tets)
    left = ~among(keys, seen.right)
    tets, keys = tets[left], keys[left]
    named = in_tetrahedra(places, signs, tets)
    named = named[(named[..., 0] != named[..., 1]).all(axis=1)]
    ends, inverse = _uniquenames_of(named)
    points = find_roots(local, places[ends[:, 0]], places[ends[:, 1]], _NEARLY)
    normals = unit_rows(local.gradients(points)[1])
    faces = inverse.reshape(-1, 3)
    n, corners = normals[faces], points[faces]
    dots = np.minimum.reduce([np.einsum("ij,ij->i", n[:, k], n[:, (k + 1) % 3]) for k in range(3)])
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    away = np.einsum("ik,ijk->ij", across, n).max(axis=1) < -_AWAY * area
    bad = ((dots < _TURN) | (away & (area > _FLAT * size**2))) & (size > 1e-3)
    middles = corners[bad].mean(axis=1)
    near = matters(middles)
    bad[bad] = near
    wrong = np.zeros(len(places), bool)
    wrong[named[bad]] = True
    seen.right = merged(seen.right, keys[~at_all(wrong, tets)])
    return middles[near], size[bad]


def _uniquenames_of(named: IntArray) -> tuple[IntArray, IntArray]:
    """The different names (v, 2), lower end first, and for each corner which it is."""
    low, high = named.min(axis=-1).ravel(), named.max(axis=-1).ravel()
    size = int(high.max(initial=0)) + 1
    keys, inverse = np.unique(low * size + high, return_inverse=True)
    return np.column_stack([keys // size, keys % size]), inverse.ravel()


def _missing_edges(skeleton: Skeleton, fresh: IntArray, first: int) -> FloatArray:
    """Middles of the edges of the singular set that are no edges of the tetrahedra."""
    if not len(skeleton.edges):
        return np.zeros((0, 3))
    size = first + len(skeleton.on) + int(fresh.max(initial=0))
    on = np.zeros(size, np.int8)
    on[first : first + len(skeleton.on)] = 1
    have = pairs_of(fresh[sum(on[corner] for corner in fresh.T) > 1]) @ np.array([size, 1])
    want = np.sort(skeleton.edges + first, axis=1) @ np.array([size, 1])
    return skeleton.on[skeleton.edges[~np.isin(want, have)]].mean(axis=1)


def _patch(
    local: Local, region: Region, places: FloatArray, signs: IntArray, stay: IntArray, fresh: IntArray,
    skeleton: Skeleton, doubtful: list[FloatArray], blocked: list[FloatArray], around: FloatArray,
    cavity: Cavity, seen: Seen,
) -> Patch:  # fmt: skip
    """The triangles in all tetrahedra and pyramids, with their vertices on f = 0."""
    first, count = len(region.places), len(skeleton.on)
    named = np.concatenate(
        [in_tetrahedra(places, signs, np.concatenate([stay, fresh])), in_pyramids(signs, region.pyramids)]
    )
    names, inverse = _uniquenames_of(named)
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
        seen,
    )
