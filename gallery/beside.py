"""What a plain marching cubes makes of a surface: the picture beside ours, where singular points are the subject."""

import numpy as np

from implicit.domain import Ball, Bounds
from implicit.mesh import Mesh
from implicit.surface import Surface


def plain_mesh(surface: Surface, bounds: Bounds, cells: int) -> Mesh:
    """The mesh of scikit-image's marching cubes on `cells` cells along the longest side, cut along a ball's sphere.

    The normals are those of the surface, so that the pictures differ by their triangles alone.
    """
    from skimage.measure import marching_cubes

    from implicit.polygonizers.clip import clip
    from implicit.polygonizers.weld import squeeze

    lower, upper = bounds.box.corners
    step = float((upper - lower).max()) / cells
    axes = [np.linspace(a, b, max(round((b - a) / step), 1) + 1) for a, b in zip(lower, upper, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    vertices, faces, _, _ = marching_cubes(
        np.asarray(surface(grid)), 0.0, spacing=tuple(axis[1] - axis[0] for axis in axes), gradient_direction="descent"
    )
    vertices = vertices.astype(float) + lower
    faces = faces.astype(np.int64)
    normals = _unit(surface.gradient(vertices))
    if isinstance(bounds, Ball):
        vertices, normals, faces = squeeze(*clip(vertices, normals, faces, bounds, surface.field, step))
    return Mesh(vertices, faces, normals)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
