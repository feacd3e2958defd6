"""Tetrahedra near the singular set, refined until they see the surface, and the triangles in them."""

from collections.abc import Callable
from functools import partial

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
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity
from implicit.polygonizers.conforming.tetrahedra.fill import Filled, fill, fill_again
from implicit.polygonizers.conforming.tetrahedra.patch import Patch, build_patch, unique_names
from implicit.polygonizers.conforming.tetrahedra.region import Region
from implicit.polygonizers.conforming.tetrahedra.seen import Seen, Waits, names_of, names_of_all
from implicit.polygonizers.conforming.tetrahedra.sheets import find_roots, in_tetrahedra, met
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


def mesh_region(
    local: Local, skeleton: Skeleton, zones: Zones, rng: np.random.Generator, lacking: Callable[[Region], FloatArray],
    before: Patch | None = None,
) -> Patch:  # fmt: skip
    """The mesh near a skeleton, wrong in the zones; before: one with the first vertices of this skeleton.

    lacking: places beyond a region that is refined, at which there shall be vertices too. It is asked once.
    """
    matters = partial(_matters, local, zones)
    most = len(skeleton.on) + _GROWTH * len(skeleton.around) + _SPARE
    blocked: list[FloatArray] = []
    waits, asked, wrong = Waits(), False, np.zeros((0, 3))
    cavity, seen = (before.cavity, before.seen) if before else (Cavity(), Seen())
    filled, all_too = fill(local, skeleton, cavity, before.region if before else None), True
    for _ in range(_ROUNDS):
        if len(filled.new) > most:
            break
        wrong, spacing, ways = _wanted(local, filled, all_too, seen, matters)
        all_too = not len(wrong) and not asked
        if len(wrong):
            more = _with_room(skeleton, (wrong, spacing, ways), filled.new, waits, blocked, rng)
        elif all_too:
            asked, more = True, skeleton.with_room(lacking(filled.region), filled.new)
        else:
            break
        if not len(more):
            break
        filled = fill_again(local, skeleton, cavity, filled, more)
    return build_patch(local, filled, skeleton, wrong, blocked, cavity, seen)


def _matters(local: Local, zones: Zones, places: FloatArray) -> NDArray[np.bool_]:
    if not len(places):
        return np.zeros(0, bool)
    return (local.heights(places) < _BEYOND) & (zones.depth(places) < _INSIDE_ZONE)


def _wanted(
    local: Local, filled: Filled, all_too: bool, seen: Seen, matters: Where
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places where edges or tetrahedra hide something, or else where triangles do not follow the surface; the spacing
    there, and the ways (n, 3) of the edges, 0 for others. all_too: those of the lattice are looked at as well.
    """
    stay = filled.stay
    active = stay[met(filled.signs, stay)] if all_too else stay[:0]
    looked = np.concatenate([filled.latest, seen.hit_among(filled.places, filled.old)])
    wrong, spacing, ways = _unseen(local, filled.places, filled.signs, active, looked, seen, matters)
    if not len(wrong):
        wrong, spacing = _turning(local, filled.places, filled.signs, filled.tetrahedra, seen, matters)
        ways = np.zeros_like(wrong)
    return wrong, spacing, ways


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
    ends, inverse = unique_names(named)
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
