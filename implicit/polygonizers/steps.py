"""Newton's steps along the gradient, from places near a surface onto it."""

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field

FloatArray = NDArray[np.float64]

_MOST = 30
_EXACT = 1e-12
"""The last step, as a share of the reach."""


def step_onto(field: Field, points: FloatArray, reach: float) -> FloatArray:
    """Points (n, 3) moved to f = 0 by steps of at most `reach`; where these lead nowhere, they end anywhere."""
    for _ in range(_MOST):
        values, slopes = field.gradients(points)
        square = (slopes * slopes).sum(axis=1)
        share = np.divide(values, square, out=np.zeros_like(values), where=square > 0)
        step = share[:, None] * slopes
        length = np.linalg.norm(step, axis=1, keepdims=True)
        points = points - step * np.minimum(1.0, reach / np.maximum(length, 1e-300))
        if not (length > _EXACT * reach).any():
            break
    return points
