"""Rules that a finished mesh must pass; what fails is listed as boxes, never passed off as right."""

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.conforming.grid import Grid

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TURN = 0.2
"""Unit gradients at the corners of a triangle may not turn by more than this cosine."""
_BENT = 0.6
"""Where they turn by more than this cosine, the cells around are searched for singular points."""
_DEPTH = 6
"""Cells are halved so often along each axis in that search."""
_MOST = 20_000
"""Boxes that are looked at together; more are listed as undecided."""
_SINGULAR = 1e-6
"""The gradient at a singular point, as a share of the gradients a cell away."""


def turns(normals: FloatArray, faces: IntArray, special: IntArray) -> FloatArray:
    """The least cosine between gradients at two corners of each face (n,), 1 for faces with a special vertex."""
    loose = np.ones(len(normals), bool)
    loose[special] = False
    n = normals[faces]
    dots = np.minimum.reduce([np.einsum("ij,ij->i", n[:, i], n[:, (i + 1) % 3]) for i in range(3)])
    return np.where(loose[faces].all(axis=1), dots, 1.0)


def folded(vertices: FloatArray, faces: IntArray, cosines: FloatArray) -> FloatArray:
    """Boxes (n, 2, 3) round the faces over which the gradient turns too far."""
    corners = vertices[faces[cosines < TURN]]
    return np.stack([corners.min(axis=1, initial=np.inf), corners.max(axis=1, initial=-np.inf)], axis=1)


def bent_cells(vertices: FloatArray, faces: IntArray, cosines: FloatArray, grid: Grid) -> IntArray:
    """The cells (n, 3) round the faces over which the gradient turns enough to look for singular points."""
    middle = vertices[faces[cosines < _BENT]].mean(axis=1)
    cells = np.floor(grid.to_units(middle)).astype(np.int64)
    around = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.unique((cells[:, None] + around).reshape(-1, 3), axis=0)


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
