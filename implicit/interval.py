"""Guaranteed ranges of tapes on boxes."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.kernels.ranges import enclose
from implicit.kernels.values import WIDTH
from implicit.tape import Tape

Floats: TypeAlias = NDArray[np.float64]

_CHUNK = 512


def tape_ranges(tape: Tape, boxes: Floats) -> Floats:
    """Bounds (K, 2) on closed boxes (K, 2, 3) by interval arithmetic, rounded outward, infinite where unknown.

    They hold for f and for every value that the tape computes in the box.
    """
    n = len(tape)
    low, high, scratch = np.empty((n, WIDTH)), np.empty((n, WIDTH)), np.empty((4, WIDTH))
    result = np.empty((len(boxes), 2))
    data = (tape.code.copy(), 0, n, tape.arguments.copy(), tape.constants)  # writable: one signature is compiled
    for start in range(0, len(boxes), _CHUNK):
        corners = np.ascontiguousarray(boxes[start : start + _CHUNK].transpose(1, 2, 0))
        k = corners.shape[2]
        enclose(*data, corners[0], corners[1], k, low, high, scratch)
        result[start : start + k, 0] = low[n - 1, :k]
        result[start : start + k, 1] = high[n - 1, :k]
    return result
