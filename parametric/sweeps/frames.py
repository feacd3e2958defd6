"""Frames along a path: two unit vectors across it and its tangent, right-handed, with exact derivatives."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from implicit.errors import SingularPointError
from parametric.curve import ParametricCurve
from parametric.differences import dot, multiply, unit_derivatives
from parametric.parameters import Array, to_vector

KINDS = ("minimal", "frenet", "fixed")


class FrameField(ABC):
    """Unit vectors e1, e2 and tangent t along a path, e1 x e2 = t."""

    def __init__(self, path: ParametricCurve, start: ArrayLike | None = None) -> None:
        self.path = path
        tangents = self.tangents(np.array([path.domain[0]]), 0)
        self.start = first_normal(tangents[0][0], start)

    def tangents(self, s: Array, order: int) -> list[Array]:
        """The unit tangent and its derivatives up to the order; a ValueError where the path stands still."""
        velocities = [self.path.derivative(s, k + 1) for k in range(order + 1)]
        speeds = np.linalg.norm(velocities[0], axis=-1)
        if s.size and not (speeds > 1e-12 * speeds.max()).all():
            raise ValueError(f"the path stands still at s = {s.flat[int(speeds.argmin())]:g}: it has no tangent there")
        return unit_derivatives(velocities)

    @abstractmethod
    def normals(self, s: Array, tangents: list[Array]) -> list[Array]:
        """The vector e1 and as many derivatives as there are of the tangent."""

    def derivatives(self, s: Array, order: int) -> list[tuple[Array, Array, Array]]:
        """Frames (e1, e2, t) at s and their derivatives up to the order, each vector (..., 3)."""
        t = self.tangents(s, order)
        e1 = self.normals(s, t)
        e2 = [multiply(t, e1, np.cross, n) for n in range(order + 1)]
        return list(zip(e1, e2, t))


def first_normal(tangent: Array, start: ArrayLike | None) -> Array:
    """The unit vector e1 at the start: `start` without its part along the tangent.

    By default the x-axis, turned with the z-axis onto the tangent by the shortest rotation: a section drawn in the
    xy-plane keeps its place on a path that starts along +z.
    """
    if start is None:
        x, y, z = tangent
        if z < -1 + 1e-12:
            return np.array([1.0, 0, 0])
        return np.array([1 - x * x / (1 + z), -x * y / (1 + z), -x])
    given = to_vector(start, "start")
    across = given - (given @ tangent) * tangent
    size = float(np.linalg.norm(across))
    if size <= 1e-9 * float(np.linalg.norm(given)):
        raise ValueError(f"start must not lie along the path's tangent {tangent.tolist()}, got {given.tolist()}")
    return np.asarray(across / size)


class FixedFrame(FrameField):
    """The frame of the start, everywhere."""

    def derivatives(self, s: Array, order: int) -> list[tuple[Array, Array, Array]]:
        """The same vectors at every s, and zero."""
        t = self.tangents(np.array([self.path.domain[0]]), 0)[0][0]
        vectors = (self.start, np.cross(t, self.start), t)
        none = np.zeros(3)
        return [vectors if k == 0 else (none, none, none) for k in range(order + 1)]

    def normals(self, s: Array, tangents: list[Array]) -> list[Array]:
        """Not asked for: `derivatives` answers."""
        raise NotImplementedError


class FrenetFrame(FrameField):
    """Principal normal, binormal, tangent; a SingularPointError where the path has no curvature."""

    def normals(self, s: Array, tangents: list[Array]) -> list[Array]:
        """The principal normal and its derivatives."""
        order = len(tangents) - 1
        c = [self.path.derivative(s, k + 1) for k in range(order + 2)]
        binormals = [multiply(c[:-1], c[1:], np.cross, n) for n in range(order + 1)]
        sizes = np.linalg.norm(binormals[0], axis=-1)
        bound = np.linalg.norm(c[0], axis=-1) * np.linalg.norm(c[1], axis=-1)
        low, high = self.path.domain
        straight = np.linalg.norm(c[0], axis=-1) ** 2 / (high - low)  # |c' x c''| of a path that turns by one radian
        flat = ~(sizes > 1e-9 * np.maximum(bound, 1e-3 * straight))
        if flat.any():
            raise SingularPointError(
                f"the Frenet frame is not defined at s = {s[flat].flat[0]:g}, where the path has no curvature: "
                f'use frame="minimal"'
            )
        b = unit_derivatives(binormals)
        return [multiply(b, tangents, np.cross, n) for n in range(order + 1)]


class MinimalFrame(FrameField):
    """The frame that turns about the tangent as little as possible, by double reflection.

    Between the nodes one step of the same method is made, and the derivatives follow exactly from
    e1' = -(e1 . t') t. The nodes are doubled until the frame at the end moves by less than 1e-12.
    On a closed path the angle by which the frame misses its start is `holonomy`.
    Source: Wang, Juttler, Zheng, Liu 2008, doi:10.1145/1330511.1330513.
    """

    def __init__(self, path: ParametricCurve, start: ArrayLike | None = None) -> None:
        super().__init__(path, start)
        count, previous = 32, None
        while True:
            self.nodes = np.unique(
                np.concatenate([np.linspace(a, b, count + 1) for a, b in zip(path.breaks[:-1], path.breaks[1:])])
            )
            points, tangents = path(self.nodes), self.tangents(self.nodes, 0)[0]
            self.vectors = minimal_frames(points, tangents, self.start)
            if (previous is not None and np.abs(self.vectors[-1] - previous).max() < 1e-12) or count >= 4096:
                break
            previous, count = self.vectors[-1], 2 * count

    def normals(self, s: Array, tangents: list[Array]) -> list[Array]:
        """The minimal normal e1 and its derivatives."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, self.nodes.size - 2)
        before = self.nodes[k]
        e = _reflect_twice(self.path(before), self.tangents(before, 0)[0], self.path(s), tangents[0], self.vectors[k])
        e = e - dot(e, tangents[0]) * tangents[0]
        result = [e / np.linalg.norm(e, axis=-1, keepdims=True)]
        slopes: list[Array] = []
        for n in range(len(tangents) - 1):
            slopes.append(multiply(result, tangents[1:], dot, n))
            result.append(-multiply(slopes, tangents, np.multiply, n))
        return result

    @property
    def holonomy(self) -> float:
        """Angle from the first e1 to the last, about the tangent; meaningful where the path closes smoothly."""
        first, last = self.vectors[0], self.vectors[-1]
        tangent = self.tangents(self.nodes[:1], 0)[0][0]
        return float(np.arctan2(np.cross(first, last) @ tangent, first @ last))


def minimal_frames(points: ArrayLike, tangents: ArrayLike, start: ArrayLike) -> Array:
    """The vector `start` carried along sampled points (n, 3) with unit tangents (n, 3) by double reflection: (n, 3).

    The error of the frame is of fourth order in the spacing of the samples.
    """
    p, t = np.asarray(points, dtype=float), np.asarray(tangents, dtype=float)
    basis = np.eye(3)[:, None]
    turns = _reflect_twice(p[:-1], t[:-1], p[1:], t[1:], np.broadcast_to(basis, (3, len(p) - 1, 3)))
    vectors = np.empty_like(p)
    vectors[0] = start
    for k in range(len(p) - 1):
        vectors[k + 1] = vectors[k] @ turns[:, k]
    return vectors


def _reflect_twice(p: Array, t: Array, q: Array, end: Array, vectors: Array) -> Array:
    """Reflect in the plane between p and q, then in the plane that takes the reflected t to the tangent at q."""
    chord = q - p
    square = dot(chord, chord)
    first = np.divide(2.0, square, out=np.zeros_like(square), where=square > 0)
    moved = vectors - first * dot(chord, vectors) * chord
    bent = end - (t - first * dot(chord, t) * chord)
    square = dot(bent, bent)
    second = np.divide(2.0, square, out=np.zeros_like(square), where=square > 1e-30)
    return np.asarray(moved - second * dot(bent, moved) * bent)


def to_frame(kind: str, path: ParametricCurve, start: ArrayLike | None = None) -> FrameField:
    """The frame field of that kind along the path."""
    if kind not in KINDS:
        raise ValueError(f"frame must be one of {', '.join(KINDS)}, got {kind!r}")
    if kind == "frenet":
        return FrenetFrame(path)
    return (MinimalFrame if kind == "minimal" else FixedFrame)(path, start)


def turn(angles: list[Array], order: int) -> tuple[list[Array], list[Array]]:
    """Derivatives of cos and sin of an angle from those of the angle."""
    cos, sin = [np.cos(angles[0])], [np.sin(angles[0])]
    for n in range(order):
        cos.append(-multiply(angles[1:], sin, np.multiply, n))
        sin.append(multiply(angles[1:], cos[:-1], np.multiply, n))
    return cos, sin
