"""What the refinement of tetrahedra remembers from round to round."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.local import among, at_all

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WAY = np.array([1.0, np.pi, np.e])
"""Places have different shares along this way, so that sums and products of these can stand for edges and simplices."""
_STUCK = 1 / 6
"""Where others kept a vertex out the round before, it may be nearer to them by so much."""


def names_of(places: FloatArray) -> FloatArray:
    """Numbers (n,) for places (n, 3), the same wherever they stand in the array."""
    x, y, z = places.T
    return np.asarray(WAY[0] * x + WAY[1] * y + WAY[2] * z)


def names_of_all(names: FloatArray, tetrahedra: IntArray) -> FloatArray:
    """Numbers (n,) for tetrahedra (n, 4), of whose corners these are the names."""
    a, b, c, d = (names[corner] for corner in tetrahedra.T)
    return np.asarray((a + b) + (c + d))


@dataclass(eq=False)
class Waits:
    """Places where a vertex was wanted the round before, by name, and the spacing that was asked for."""

    names: FloatArray = field(default_factory=lambda: np.zeros(0))
    spacing: FloatArray = field(default_factory=lambda: np.zeros(0))

    def nearer(self, places: FloatArray, spacing: FloatArray) -> FloatArray:
        """The spacing at places (n, 3), less where one is wanted again: no vertex found room there."""
        names, first = np.unique(names_of(places), return_inverse=True)
        least = np.full(len(names), np.inf)
        np.minimum.at(least, first, spacing)
        again, row, old = np.intersect1d(names, self.names, return_indices=True)
        if len(again):
            least[row] = np.minimum(least[row], _STUCK * self.spacing[old])
        self.names, self.spacing = names, least
        return np.asarray(least[first])


@dataclass(eq=False)
class Seen:
    """What need not be looked at again, or must be, by names: edges that are right, corners of tetrahedra with an edge
    that is not or with a finger of the other sign, and tetrahedra whose triangles are right.
    """

    edges: FloatArray = field(default_factory=lambda: np.zeros(0))
    hit: FloatArray = field(default_factory=lambda: np.zeros(0))
    right: FloatArray = field(default_factory=lambda: np.zeros(0))

    def hit_among(self, places: FloatArray, tetrahedra: IntArray) -> IntArray:
        """The tetrahedra that have all their corners at such places."""
        return tetrahedra[at_all(among(names_of(places), self.hit), tetrahedra)] if len(self.hit) else tetrahedra[:0]
