"""Rules that a finished mesh must pass; what fails is listed as boxes, never passed off as right."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.kernels.elementary import OPTIONS
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.tetrahedra.region import cells_round

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TURN = 0.2
"""Unit gradients at the corners of a triangle may not turn by more than this cosine."""
BENT = 0.6
"""Where they turn by more than this cosine, the cells around are searched for singular points."""
_DEPTH = 6
"""Cells are halved so often along each axis in that search."""
_MOST = 20_000
"""Boxes that are looked at together; more are listed as undecided."""
_SINGULAR = 1e-6
"""The gradient at a singular point, as a share of the gradients a cell away."""


@njit(**OPTIONS)
def _list_turning(normals: Any, loose: Any, faces: Any, limit: float, rows: Any, cosines: Any) -> int:
    count = 0
    for row in range(len(faces)):
        a, b, c = faces[row, 0], faces[row, 1], faces[row, 2]
        if loose[a] and loose[b] and loose[c]:
            ab = normals[a, 0] * normals[b, 0] + normals[a, 1] * normals[b, 1] + normals[a, 2] * normals[b, 2]
            bc = normals[b, 0] * normals[c, 0] + normals[b, 1] * normals[c, 1] + normals[b, 2] * normals[c, 2]
            ca = normals[c, 0] * normals[a, 0] + normals[c, 1] * normals[a, 1] + normals[c, 2] * normals[a, 2]
            least = ab if ab < bc else bc
            least = least if least < ca else ca
            if least < limit:
                rows[count], cosines[count] = row, least
                count += 1
    return count


def turning(normals: FloatArray, faces: IntArray, special: IntArray, limit: float) -> tuple[IntArray, FloatArray]:
    """The faces without a special vertex, and their cosines, where gradients at two corners turn by more than this."""
    loose = np.ones(len(normals), np.bool_)
    loose[special] = False
    rows, cosines = np.empty(len(faces), np.int64), np.empty(len(faces))
    count = _list_turning(normals, loose, faces, limit, rows, cosines)
    return rows[:count].copy(), cosines[:count].copy()


def boxes_of(corners: FloatArray) -> FloatArray:
    """Boxes (n, 2, 3) round triangles (n, 3, 3)."""
    return np.stack([corners.min(axis=1, initial=np.inf), corners.max(axis=1, initial=-np.inf)], axis=1)


def cells_of(corners: FloatArray, grid: Grid) -> IntArray:
    """The cells (n, 3) of the middles of triangles (n, 3, 3), and those beside them."""
    return cells_round(grid.to_units(corners.mean(axis=1)), 1, grid.cells)


def hidden(field: Field, grid: Grid, cells: IntArray) -> FloatArray:
    """Boxes (n, 2, 3) within the cells in which f and its gradient may vanish: all others hold no singular point."""
    if not isinstance(field, PolynomialField):
        return np.zeros((0, 2, 3))
    functions = [field, *(field.derivative(axis) for axis in range(3))]
    boxes = grid.to_points(np.stack([cells, cells + 1], axis=1))
    for depth in range(_DEPTH + 1):
        for function in functions:
            bounds = function.ranges(boxes)
            boxes = boxes[(bounds[:, 0] <= 0) & (bounds[:, 1] >= 0)]
        if depth == _DEPTH or not len(boxes) or len(boxes) > _MOST:
            break
        boxes = eighths(boxes)
    return boxes


def eighths(boxes: FloatArray) -> FloatArray:
    """Boxes (n, 2, 3) halved along each axis."""
    for axis in range(3):
        low, high = boxes.copy(), boxes.copy()
        low[:, 1, axis] = high[:, 0, axis] = boxes[:, :, axis].mean(axis=1)
        boxes = np.concatenate([low, high])
    return boxes


def not_singular(field: Field, grid: Grid, points: FloatArray) -> FloatArray:
    """Boxes (n, 2, 3) of a cell round those of the points where f or its gradient does not vanish."""
    if not len(points):
        return np.zeros((0, 2, 3))
    directions = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z])
    around = points[:, None] + grid.step * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    slopes = np.linalg.norm(field.gradients(around.reshape(-1, 3))[1], axis=1).reshape(len(points), -1)
    typical = np.median(slopes, axis=1)
    values, gradients = field.gradients(points)
    wrong = np.linalg.norm(gradients, axis=1) > _SINGULAR * typical
    wrong |= np.abs(values) > _SINGULAR * typical * grid.step
    return boxes_round(points[wrong], grid.step)


def boxes_round(points: FloatArray, reach: float) -> FloatArray:
    """Boxes (n, 2, 3) reaching so far from each point."""
    return np.asarray(points[:, None] + np.array([-reach, reach])[:, None])
