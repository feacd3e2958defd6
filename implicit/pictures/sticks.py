"""Round sticks, tubes, balls and blocks: what stands for curves, points and boxes in a picture."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Points: TypeAlias = NDArray[np.float64]
Faces: TypeAlias = NDArray[np.int64]
Shape: TypeAlias = tuple[Points, Faces, Points]
"""Vertices (V, 3), faces (F, 3), normals (V, 3)."""


def merge(shapes: Sequence[Shape]) -> Shape:
    """Several shapes as one."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _, _ in shapes])
    faces = [faces + start for (_, faces, _), start in zip(shapes, starts)]
    return np.concatenate([s[0] for s in shapes]), np.concatenate(faces), np.concatenate([s[2] for s in shapes])


def tube(line: Points, radius: float, sides: int = 10) -> Shape:
    """A round tube along a polyline (n, 3): vertices, faces, normals. Its rings turn as little as they can."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line = line[np.concatenate([[True], steps > 1e-9 * radius])]
    along = unit(np.gradient(line, axis=0)) if len(line) > 1 else np.array([[0.0, 0.0, 1.0]])
    across = unit(np.cross(along[0], np.eye(3)[np.argmin(abs(along[0]))]))
    rings = []
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    for direction in along:
        across = unit(across - direction * (across @ direction))
        rings.append(np.cos(angles) * across + np.sin(angles) * np.cross(direction, across))
    normals = np.array(rings)
    start = (np.arange(len(line) - 1)[:, None] * sides + np.arange(sides)).ravel()
    after = (np.arange(len(line) - 1)[:, None] * sides + (np.arange(sides) + 1) % sides).ravel()
    faces = np.concatenate(
        [np.column_stack([start, after, after + sides]), np.column_stack([start, after + sides, start + sides])]
    )
    return (line[:, None] + radius * normals).reshape(-1, 3), faces, normals.reshape(-1, 3)


def rods(segments: Points, radius: float, sides: int = 6) -> Shape:
    """Round rods along segments (n, 2, 3)."""
    along = unit(segments[:, 1] - segments[:, 0])
    across = unit(np.cross(along, np.eye(3)[np.argmin(abs(along), axis=1)]))
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None, None]
    ring = np.cos(angles) * across + np.sin(angles) * np.cross(along, across)  # (sides, n, 3)
    normals = np.stack([ring, ring])
    vertices = segments.transpose(1, 0, 2)[:, None] + radius * normals
    count = len(segments)
    start = np.arange(sides * count)
    after = np.roll(start, -count)
    above = sides * count
    faces = [np.column_stack([start, after, after + above]), np.column_stack([start, after + above, start + above])]
    return vertices.reshape(-1, 3), np.concatenate(faces), normals.reshape(-1, 3)


def ball(center: Points, radius: float, rings: int = 12) -> Shape:
    """A sphere of 2 `rings` meridians: vertices, faces, normals."""
    height, turn = np.meshgrid(
        np.linspace(np.pi, 0, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij"
    )
    normals = np.stack([np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)], axis=-1)
    row = np.arange(rings)[:, None] * (2 * rings + 1) + np.arange(2 * rings)
    a, b = row.ravel(), row.ravel() + 2 * rings + 1
    faces = np.concatenate([np.column_stack([a, a + 1, b + 1]), np.column_stack([a, b + 1, b])])
    normals = normals.reshape(-1, 3)
    return center + radius * normals, faces, normals


def block(box: Points) -> Shape:
    """The six faces of a box (2, 3), each with its own normal."""
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    vertices, normals = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            square = np.insert(unit if side else unit[::-1], axis, side, axis=1)
            square = square if axis != 1 else square[::-1]
            vertices.append(box[0] + square * (box[1] - box[0]))
            normals.append(np.tile(np.eye(3)[axis] * (2 * side - 1), (4, 1)))
    first = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    return np.concatenate(vertices), faces, np.concatenate(normals)


def unit(vectors: Points) -> Points:
    """Vectors (..., 3) of length 1 in the same directions; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
