"""Sweeps along polylines: prisms that meet in the bisecting planes of the corners."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array, to_vector
from parametric.splines.bspline import BSplineCurve
from parametric.sweeps.frames import KINDS, first_normal
from parametric.sweeps.laws import Law
from parametric.transfinite.blend import BlendedSurface, SplineBlend


def mitred(
    section: ParametricCurve,
    path: BSplineCurve,
    frame: str,
    twist: Law,
    scale: Law,
    anchor: ArrayLike,
    start: ArrayLike | None,
) -> BlendedSurface:
    """The section at each vertex, projected onto the mitre plane there, joined by straight lines; see `sweep`."""
    if frame not in KINDS:
        raise ValueError(f"frame must be one of {', '.join(KINDS)}, got {frame!r}")
    if frame == "frenet":
        raise ValueError('a polyline has no Frenet frame: use frame="minimal"')
    vertices = path.points
    directions = _directions(vertices)
    closed = bool(np.abs(vertices[0] - vertices[-1]).max() <= 1e-12 * np.abs(vertices).max())
    frames = _frames(directions, first_normal(directions[0], start), frame == "fixed")
    into = np.vstack([directions[-1:] if closed else directions[:1], directions])
    out = np.vstack([directions, directions[:1] if closed else directions[-1:]])
    closing = 0.0
    if closed:
        frames.append(_carry(frames[-1], directions[-1], directions[0]) if frame == "minimal" else frames[0])
        closing = -_angle(frames[0], frames[-1], directions[0])
    else:
        frames.append(frames[-1])
    low, high = path.domain
    curves = []
    for k, s in enumerate((path.breaks - low) / (high - low)):
        tangent = directions[0] if frame == "fixed" else out[k]
        matrix = _placement(frames[k], tangent, twist(s) + closing * s, scale(s), to_vector(anchor, "anchor"))
        if frame == "minimal":
            matrix = _projection(into[k] + out[k], out[k]) @ matrix
        matrix[:3, 3] += vertices[k]
        curves.append(section.transform(matrix))
    return BlendedSurface(curves, SplineBlend(path.knots, np.eye(len(curves))))


def _directions(vertices: Array) -> Array:
    steps = np.diff(vertices, axis=0)
    lengths = np.linalg.norm(steps, axis=-1)
    if not lengths.all():
        k = int(np.flatnonzero(lengths == 0)[0])
        raise ValueError(f"the path has the same point twice, numbers {k} and {k + 1}: {vertices[k].tolist()}")
    directions = steps / lengths[:, None]
    turns = np.linalg.norm(directions[1:] + directions[:-1], axis=-1)
    if turns.size and turns.min() < 1e-9:
        raise ValueError(f"the path turns back on itself at vertex {int(turns.argmin()) + 1}")
    return np.asarray(directions)


def _frames(directions: Array, first: Array, fixed: bool) -> list[Array]:
    """The vector e1 of each segment, carried from the one before by the shortest rotation."""
    frames = [first]
    for before, after in pairwise(directions):
        frames.append(first if fixed else _carry(frames[-1], before, after))
    return frames


def _carry(vector: Array, before: Array, after: Array) -> Array:
    """A vector across `before`, turned by the shortest rotation that takes `before` to `after`."""
    middle = before + after
    return np.asarray(vector - (2 * (vector @ middle) / (middle @ middle)) * middle + 2 * (vector @ before) * after)


def _angle(first: Array, last: Array, axis: Array) -> float:
    return float(np.arctan2(np.cross(first, last) @ axis, first @ last))


def _placement(e1: Array, tangent: Array, angle: float, size: float, anchor: Array) -> Array:
    """Map of the section's plane, turned and scaled about the anchor, onto e1, e2, tangent."""
    e2 = np.cross(tangent, e1)
    matrix = np.eye(4)
    x, y = np.cos(angle) * e1 + np.sin(angle) * e2, np.cos(angle) * e2 - np.sin(angle) * e1
    matrix[:3, :3] = size * np.stack([x, y, tangent], axis=1)
    matrix[:3, 3] = -matrix[:3, :3] @ anchor
    return matrix


def _projection(normal: Array, direction: Array) -> Array:
    """Projection along a direction onto the plane through the origin with that normal."""
    matrix = np.eye(4)
    matrix[:3, :3] -= np.outer(direction, normal) / (normal @ direction)
    return matrix
