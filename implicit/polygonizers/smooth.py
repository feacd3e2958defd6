"""A quick proof that a polynomial surface has no singular points, where that is easy to see."""

import numpy as np

from implicit.bernstein import power_tensor
from implicit.domain import Bounds, Box
from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.blocks import Dense, find_bricks
from implicit.polygonizers.lattice import CELLS, Lattice

_BRICKS = 32
"""Blocks are halved until they are this share of the bounds: what is singular stays, and is left to algebra."""
_LARGEST = 2000
"""Coefficients of a polynomial that is worth the attempt."""
_MARGIN = 0.01
"""The proof holds a little beyond the bounds: what lies on their faces is within them."""


def is_smooth(field: Field, bounds: Bounds) -> bool:
    """Whether each part of the bounds is seen to be free of singular points: f or a derivative keeps one sign there.

    It takes the kernels of the mesh alone, which saves a new user the compilation of the search for singular points.
    """
    if not isinstance(field, PolynomialField) or not len(field.exponents):
        return False
    if np.prod(field.exponents.max(axis=0) + 1) > _LARGEST:
        return False
    lower, upper = bounds.box.corners
    margin = _MARGIN * (upper - lower)
    lattice = Lattice.over(Box(lower - margin, upper + margin), CELLS * _BRICKS)
    slopes = [field.derivative(axis) for axis in range(3)]
    parts = [_dense(part) for part in (field, *slopes) if len(part.exponents)]
    return not len(find_bricks(parts, lattice))


def _dense(field: PolynomialField) -> Dense:
    return Dense(
        power_tensor(field.exponents, field.coefficients), (1, 1, 1), power_tensor(field.exponents, field.errors)
    )
