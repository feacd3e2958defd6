"""Winding numbers of meshes: how often the triangles turn round a point, and how far away they are."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from implicit.kernels.crossing import LEAF, UNSURE, crossings, nearest
from implicit.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SHEARS = ((0.347281, 0.210973), (-0.173911, 0.412703), (0.091733, -0.330187), (-0.271339, -0.118571))
"""Slopes of the rays: away from the directions in which meshes have their edges."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Boxes round groups of triangles that lie near each other, see `implicit.kernels.crossing`."""

    corners: Floats
    ranks: Ints
    boxes: Floats


def build_tree(vertices: Floats, faces: Ints) -> Tree:
    """Triangles along a space-filling curve, LEAF to a leaf, and the boxes of a binary tree over the leaves."""
    corners = vertices[faces]
    order = np.argsort(_morton(corners.mean(axis=1)), kind="stable")
    corners, ranks = np.ascontiguousarray(corners[order]), np.ascontiguousarray(faces[order])
    leaves = 1 << max(0, (len(faces) - 1) // LEAF).bit_length()
    boxes = np.empty((2 * leaves - 1, 6))
    boxes[:, :3], boxes[:, 3:] = np.inf, -np.inf
    filled = np.arange(0, len(faces), LEAF)
    if len(filled):
        boxes[leaves - 1 : leaves - 1 + len(filled), :3] = np.minimum.reduceat(corners.min(axis=1), filled)
        boxes[leaves - 1 : leaves - 1 + len(filled), 3:] = np.maximum.reduceat(corners.max(axis=1), filled)
    width = leaves // 2
    while width:
        level, below = slice(width - 1, 2 * width - 1), slice(2 * width - 1, 4 * width - 1)
        boxes[level, :3] = boxes[below, :3].reshape(width, 2, 3).min(axis=1)
        boxes[level, 3:] = boxes[below, 3:].reshape(width, 2, 3).max(axis=1)
        width //= 2
    return Tree(corners, ranks, boxes)


def _morton(points: Floats) -> Ints:
    """Positions along a curve that visits eighths of the box, eighths of those, and so on."""
    if not len(points):
        return np.empty(0, dtype=np.int64)
    low, high = points.min(axis=0), points.max(axis=0)
    cells = ((points - low) / np.where(high > low, high - low, 1.0) * ((1 << 20) - 1)).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(20):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


@dataclass(frozen=True, eq=False)
class MeshWinding:
    """Winding numbers of one mesh."""

    mesh: Mesh

    @cached_property
    def boundary(self) -> Ints:
        """The edges (B, 2) that faces use more often in this direction than in the other, repeated as often."""
        sides = np.concatenate([self.mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)])
        low, high = sides.min(axis=1), sides.max(axis=1)
        keys, place = np.unique(low * len(self.mesh.vertices) + high, return_inverse=True)
        balance = np.bincount(place, np.sign(sides[:, 1] - sides[:, 0]), minlength=len(keys)).astype(np.int64)
        edges = np.stack([keys // max(len(self.mesh.vertices), 1), keys % max(len(self.mesh.vertices), 1)], axis=1)
        turned = np.where((balance > 0)[:, None], edges, edges[:, ::-1])
        return np.repeat(turned, abs(balance), axis=0)

    @cached_property
    def floor(self) -> float:
        """The distance below which rounding can hide the side: 64 units in the last place of the largest coordinate."""
        return float(64 * 2.0**-53 * abs(self.mesh.vertices).max(initial=0.0))

    @cached_property
    def _plain(self) -> Tree:
        return build_tree(self.mesh.vertices, self.mesh.faces)

    def within(self, points: Floats, distance: float) -> NDArray[np.bool_]:
        """Which points (n, 3) are within a distance of a triangle."""
        out = np.empty(len(points))
        nearest(points, self._plain.corners, self._plain.boxes, distance, out)
        return np.asarray(np.isfinite(out))

    def numbers(self, points: Floats) -> Floats:
        """Winding numbers (n,): whole for closed meshes, by counting the faces that a ray crosses.

        The boundary of an open mesh is closed by curtains that fall to infinity along the ray, on the other side;
        their solid angle is subtracted. Points closer to the mesh than `floor` may get the number of either side.
        """
        out = np.zeros(len(points))
        todo = np.arange(len(points))
        for shear in _SHEARS:
            counted = self._count(points[todo], shear)
            sure = counted != UNSURE
            out[todo[sure]] = counted[sure] - self._curtains(points[todo[sure]], shear)
            todo = todo[~sure]
            if not len(todo):
                return out
        for i in todo:
            total = float(solid_angles(self.mesh.vertices[self.mesh.faces] - points[i]).sum() / (4 * np.pi))
            out[i] = total if len(self.boundary) else round(total)
        return out

    def _count(self, points: Floats, shear: tuple[float, float]) -> Ints:
        """Crossings with rays that shearing makes vertical; one shear moves mesh and points alike."""
        tree = self._sheared[_SHEARS.index(shear)]
        out = np.empty(len(points), dtype=np.int64)
        crossings(_shear(points, shear), tree.corners, tree.ranks, tree.boxes, out)
        return out

    @cached_property
    def _sheared(self) -> "_Trees":
        return _Trees(self.mesh)

    def _curtains(self, points: Floats, shear: tuple[float, float]) -> Floats:
        if not len(self.boundary):
            return np.zeros(len(points))
        ray = np.array([*shear, 1.0])
        down, total = -ray / np.linalg.norm(ray), np.zeros(len(points))
        for a, b in self.mesh.vertices[self.boundary]:
            total += curtain_angles(a - points, b - points, down)
        return total / (4 * np.pi)


def winding_of(mesh: Mesh) -> MeshWinding:
    """The winding numbers of a mesh, kept with it as its other derived properties are."""
    known = mesh.__dict__.get("_winding")
    if known is None:
        known = mesh.__dict__["_winding"] = MeshWinding(mesh)
    return known


class _Trees:
    """The trees of the sheared mesh, each built when it is first asked for."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.built: dict[int, Tree] = {}

    def __getitem__(self, index: int) -> Tree:
        if index not in self.built:
            self.built[index] = build_tree(_shear(self.mesh.vertices, _SHEARS[index]), self.mesh.faces)
        return self.built[index]


def _shear(points: Floats, shear: tuple[float, float]) -> Floats:
    out = np.array(points)
    out[:, 0] -= shear[0] * points[:, 2]
    out[:, 1] -= shear[1] * points[:, 2]
    return out


def solid_angles(corners: Floats) -> Floats:
    """Signed solid angles (F,) of triangles (F, 3, 3) seen from the origin, positive from behind.

    A. van Oosterom, J. Strackee, The solid angle of a plane triangle (1983), doi 10.1109/TBME.1983.325207.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.linalg.norm(e, axis=1) for e in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", e, f) for e, f in ((a, b), (b, c), (c, a)))
    return np.asarray(2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb))


def curtain_angles(a: Floats, b: Floats, direction: Floats) -> Floats:
    """Signed solid angles (n,) of the strips a b, a + direction t, b + direction t for all t > 0, that run b to a."""
    la, lb = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    volume = np.cross(b, a) @ direction
    return np.asarray(
        2 * np.arctan2(volume, la * lb + np.einsum("ij,ij->i", a, b) + (a @ direction) * lb + (b @ direction) * la)
    )
