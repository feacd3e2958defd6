"""The triangles in a region's tetrahedra and pyramids, with their vertices on the surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import Local, pairs_of
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity
from implicit.polygonizers.conforming.tetrahedra.fill import Filled
from implicit.polygonizers.conforming.tetrahedra.region import Region
from implicit.polygonizers.conforming.tetrahedra.seen import Seen
from implicit.polygonizers.conforming.tetrahedra.sheets import (
    find_roots,
    flat_tetrahedra,
    in_pyramids,
    in_tetrahedra,
)
from implicit.polygonizers.conforming.tetrahedra.skeleton import Skeleton

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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


def build_patch(
    local: Local, filled: Filled, skeleton: Skeleton, wrong: FloatArray, blocked: list[FloatArray], cavity: Cavity,
    seen: Seen,
) -> Patch:  # fmt: skip
    """The triangles in all tetrahedra and pyramids; wrong (n, 3): places where more vertices would be needed."""
    first, count = len(filled.region.places), len(skeleton.on)
    places, signs, tetrahedra = filled.places, filled.signs, filled.tetrahedra
    named = np.concatenate([in_tetrahedra(places, signs, tetrahedra), in_pyramids(signs, filled.region.pyramids)])
    names, inverse = unique_names(named)
    points = places[names[:, 0]].copy()
    loose = names[:, 0] != names[:, 1]
    points[loose] = find_roots(local, places[names[loose, 0]], places[names[loose, 1]])
    on = np.full(count, -1)
    on[names[~loose, 0] - first] = np.flatnonzero(~loose)
    misfit = not filled.fits or flat_tetrahedra(signs, tetrahedra)
    doubtful = [wrong, skeleton.on[: count if misfit else 0], _missing_edges(skeleton, filled.fresh, first)]
    return Patch(
        filled.region,
        points,
        inverse.reshape(-1, 3),
        names,
        on,
        np.concatenate(doubtful),
        np.concatenate([np.zeros((0, 3)), *blocked]),
        filled.new[count:],
        cavity,
        seen,
    )


def unique_names(named: IntArray) -> tuple[IntArray, IntArray]:
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
