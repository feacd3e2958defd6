"""The bicubic Hermite patch: sixteen vectors at its four corners."""

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import Array, to_points
from parametric.splines.tensor import BezierSurface
from parametric.textbook.matrices import bezier_net, hermite_data


class HermitePatch(BezierSurface):
    """Bicubic patch on [0, 1] x [0, 1] from 16 vectors, each array (2, 2, 3) indexed [u][v]; a Bezier surface.

    Parameters
    ----------
    corners : p at the corners
    tangents_u, tangents_v : p_u and p_v at the corners
    twists : p_uv at the corners

    Examples
    --------
    >>> square = [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]]
    >>> patch = HermitePatch(square, np.full((2, 2, 3), (1, 0, 0)), np.full((2, 2, 3), (0, 1, 0)), np.zeros((2, 2, 3)))
    >>> patch(0.25, 0.5)
    array([0.25, 0.5 , 0.  ])
    """

    def __init__(self, corners: ArrayLike, tangents_u: ArrayLike, tangents_v: ArrayLike, twists: ArrayLike) -> None:
        given = {"corners": corners, "tangents_u": tangents_u, "tangents_v": tangents_v, "twists": twists}
        c, a, b, w = (_corners(value, name) for name, value in given.items())
        super().__init__(bezier_net(_assemble(c, a, b, w)))

    @classmethod
    def from_bezier(cls, surface: BezierSurface) -> "HermitePatch":
        """The same patch from a bicubic Bezier surface; a ValueError for other degrees and for rational ones."""
        if surface.degrees != (3, 3) or surface.weights is not None:
            raise ValueError(f"a Hermite patch is a bicubic polynomial, got degrees {surface.degrees}")
        data = hermite_data(surface.points)
        return cls(data[:2, :2], data[2:, :2], data[:2, 2:], data[2:, 2:])

    def to_bezier(self) -> BezierSurface:
        """The same patch as a plain Bezier surface."""
        return BezierSurface(self.points)

    @property
    def data(self) -> Array:
        """The matrix [B] of the 16 vectors, (4, 4, 3): value at 0, value at 1, slope at 0, slope at 1 each way."""
        return hermite_data(self.points)


def _corners(values: ArrayLike, name: str) -> Array:
    vectors = to_points(values, name, 2)
    if vectors.shape != (2, 2, 3):
        raise ValueError(f"{name} must have shape (2, 2, 3), one vector for each corner [u][v], got {vectors.shape}")
    return vectors


def _assemble(corners: Array, tangents_u: Array, tangents_v: Array, twists: Array) -> Array:
    top, bottom = np.concatenate([corners, tangents_v], axis=1), np.concatenate([tangents_u, twists], axis=1)
    return np.concatenate([top, bottom], axis=0)
