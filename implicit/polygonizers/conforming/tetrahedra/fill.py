"""A region filled with the tetrahedra of a skeleton's vertices, and filled again where more vertices come."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity, dead_vertices
from implicit.polygonizers.conforming.tetrahedra.region import Region, inner_places, reaching
from implicit.polygonizers.conforming.tetrahedra.skeleton import Skeleton

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Filled:
    """A region filled: places (v, 3), first its own, with signs (v,), 0 on the singular set.

    dead: which of its own places are not used. stay (n, 4): its tetrahedra that are left; fresh (m, 4): the others, of
    which the first `known` were there before the last vertices came. fits: whether they fill the region exactly.
    """

    region: Region
    dead: NDArray[np.bool_]
    places: FloatArray
    signs: IntArray
    stay: IntArray
    fresh: IntArray
    known: int
    fits: bool

    @property
    def new(self) -> FloatArray:
        """The places (k, 3) that are not the region's, those of the skeleton on the singular set first."""
        return self.places[len(self.region.places) :]

    @property
    def old(self) -> IntArray:
        """The tetrahedra that were there before the last vertices came."""
        return np.concatenate([self.stay, self.fresh[: self.known]])

    @property
    def latest(self) -> IntArray:
        """The tetrahedra that came with the last vertices."""
        return self.fresh[self.known :]

    @property
    def tetrahedra(self) -> IntArray:
        """All of them."""
        return np.concatenate([self.stay, self.fresh])


def fill(local: Local, skeleton: Skeleton, cavity: Cavity, held: Region | None) -> Filled:
    """The region of a skeleton, with all of one that is `held`, filled by the cavity."""
    new = np.concatenate([skeleton.on, skeleton.around])
    region = reaching(held, inner_places(skeleton.cleared, new), local.grid.cells)
    return _fill(local, skeleton, cavity, region, dead_vertices(region, skeleton.cleared, new), new)


def fill_again(local: Local, skeleton: Skeleton, cavity: Cavity, last: Filled, more: FloatArray) -> Filled:
    """The region, larger if need be, with more vertices (k, 3)."""
    new = np.concatenate([last.new, more])
    region = reaching(last.region, more, local.grid.cells)
    if region is last.region:
        dead = last.dead | dead_vertices(region, skeleton.cleared[:0], more)
    else:
        dead = dead_vertices(region, skeleton.cleared, new)
    return _fill(local, skeleton, cavity, region, dead, new)


def _fill(
    local: Local, skeleton: Skeleton, cavity: Cavity, region: Region, dead: NDArray[np.bool_], new: FloatArray
) -> Filled:
    stay, fresh, known, fits = cavity.fill(region, dead, new)
    places = np.concatenate([region.places, new])
    signs = local.signs(places)
    first = len(region.places)
    signs[first : first + len(skeleton.on)] = 0
    return Filled(region, dead, places, signs, stay, fresh, known, fits)
