"""A mesh cut to the bounds: by the sphere of a ball, or by the six planes of a box one after the other."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Ball, Bounds
from implicit.evaluate import Field
from implicit.polygonizers.clip import Rim, SphereRim, cut_along, unit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Trimesh = tuple[FloatArray, FloatArray, IntArray]


@dataclass(frozen=True, eq=False)
class PlaneRim:
    """The curve where f = 0 meets a face of a box. Points on faces that were cut before stay on them."""

    corners: FloatArray
    axis: int
    side: int
    field: Field
    cell: float

    def heights(self, points: FloatArray) -> FloatArray:
        """Signed distances (n,) from the plane, negative inside."""
        height = points[:, self.axis] - self.corners[self.side, self.axis]
        return np.asarray(height if self.side else -height)

    def reach(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points moved to the curve by Newton's steps within the plane, and unit normals there."""
        points = points.copy()
        points[:, self.axis] = self.corners[self.side, self.axis]
        free = np.ones(points.shape, bool)
        for bound in self.corners:
            near = np.abs(points - bound) < 1e-9 * self.cell
            points = np.where(near, bound, points)
            free &= ~near
        start = points
        for _ in range(24):
            f, gradient = self.field.gradients(points)
            slope = np.where(free, gradient, 0.0)
            steep = (slope * slope).sum(axis=1)
            usable = steep > 1e-12 * (gradient * gradient).sum(axis=1)
            step = np.divide(-f, steep, out=np.zeros_like(f), where=usable)[:, None] * slope
            near = np.linalg.norm(points + step - start, axis=1) < 2 * self.cell
            points = np.where(near[:, None], points + step, points)
            if not np.any(np.linalg.norm(step[near], axis=1) > 1e-14 * np.abs(self.corners).max()):
                break
        return points, unit(self.field.gradients(points)[1])


def rims(bounds: Bounds, field: Field, cell: float) -> list[Rim]:
    """The walls of the bounds."""
    if isinstance(bounds, Ball):
        return [SphereRim(bounds, field, cell)]
    return [PlaneRim(bounds.corners, axis, side, field, cell) for axis in range(3) for side in (0, 1)]


def trim(mesh: Trimesh, bounds: Bounds, field: Field, cell: float, fixed: IntArray) -> Trimesh:
    """The part of a mesh inside the bounds. Vertices keep their numbers, new ones come behind; `fixed` ones stay."""
    vertices, normals, faces = mesh
    for rim in rims(bounds, field, cell):
        mask = np.zeros(len(vertices), bool)
        mask[fixed] = True
        vertices, normals, faces = cut_along(rim, vertices, normals, faces, mask)
    return vertices, normals, faces
