"""Boxes round Bezier patches, and round their halves, quarters and so on: what a point looks at first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from parametric.parameters import Array

Ints = NDArray[np.int64]

_LEAVES = 4096
_LEVELS = 8
GROUP = 2
"""The axis of a node that only holds two others together; 0 and 1 stand for patches cut in u and in v."""


@dataclass(frozen=True)
class Hierarchy:
    """A binary tree: groups of patches above, halves of patches below, control nets at the leaves.

    boxes (K, 6)        lower and upper corners of the control points
    slabs (K, 5)        a unit normal, and the range of control points along it
    corners (K, 4, 3)   corners of a patch, counter-clockwise in its domain
    links (K, 5)        first child (-1 at leaves), second child or place of the net, axis, control points in u and v
    nets                control points (x, y, z, w) of the leaves, weighted, one after the other
    width               the largest number of control points of a patch
    """

    boxes: Array
    slabs: Array
    corners: Array
    links: Ints
    nets: Array
    width: int


def build_hierarchy(nets: Sequence[Array]) -> Hierarchy:
    """The tree over patches with weighted control nets (p, q, 4)."""
    levels = int(np.clip(np.log2(_LEAVES / len(nets)), 0, _LEVELS))
    builder = _Builder()
    roots = np.zeros(len(nets), np.int64)
    shapes = {net.shape for net in nets}
    for shape in sorted(shapes):
        members = np.array([k for k, net in enumerate(nets) if net.shape == shape])
        roots[members] = builder.grow(np.array([nets[k] for k in members]), levels)
    root = builder.gather(roots)
    order = np.roll(np.arange(builder.count), 1) if root == builder.count - 1 and root else np.arange(builder.count)
    return builder.finish(order, max(shape[0] * shape[1] for shape in shapes))


class _Builder:
    """Tables of nodes that grow."""

    def __init__(self) -> None:
        self.count = 0
        self.parts: list[tuple[Array, Array, Array, Ints]] = []
        self.nets: list[Array] = []
        self.size = 0

    def _add(self, boxes: Array, slabs: Array, corners: Array, links: Ints) -> None:
        self.parts.append((boxes, slabs, corners, links))
        self.count += len(boxes)

    def grow(self, nets: Array, levels: int) -> Ints:
        """Nodes for patches (n, p, q, 4) of one degree and for their halves; the numbers of the patches."""
        # Halving in extended precision and rounding once keeps every level as exact as the first.
        fine = nets.astype(np.longdouble)
        roots = self.count + np.arange(len(nets))
        for level in range(levels + 1):
            here = fine.astype(float)
            boxes, slabs, corners, axes = describe(here)
            links = np.zeros((len(fine), 5), np.int64)
            links[:, 2], links[:, 3], links[:, 4] = axes, *fine.shape[1:3]
            if level == levels:
                links[:, 0] = -1
                links[:, 1] = self.size + np.arange(len(fine)) * here[0].size
                self.nets.append(here.ravel())
                self.size += here.size
            else:
                links[:, 0] = self.count + len(fine) + 2 * np.arange(len(fine))
                links[:, 1] = links[:, 0] + 1
                fine = halve(fine, axes)
            self._add(boxes, slabs, corners, links)
        return roots

    def gather(self, roots: Ints) -> int:
        """Groups over all patches, by halves along the longest side; the number of the one that holds all."""
        boxes = np.concatenate([part[0] for part in self.parts])[roots]
        return self._gather(roots, boxes)

    def _gather(self, roots: Ints, boxes: Array) -> int:
        if len(roots) == 1:
            return int(roots[0])
        middles = boxes[:, :3] + boxes[:, 3:]
        order = np.argsort(middles[:, np.ptp(middles, axis=0).argmax()], kind="stable")
        half = len(order) // 2
        first, second = (self._gather(roots[o], boxes[o]) for o in (order[:half], order[half:]))
        box = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
        self._add(box[None], np.zeros((1, 5)), np.zeros((1, 4, 3)), np.array([[first, second, GROUP, 0, 0]]))
        return self.count - 1

    def finish(self, order: Ints, width: int) -> Hierarchy:
        """The tables, with the node that holds all in front."""
        boxes, slabs, corners, links = (np.concatenate(column) for column in zip(*self.parts))
        place = np.argsort(order)
        links = links.copy()
        inner = links[:, 0] >= 0
        links[inner, :2] = place[links[inner, :2]]
        return Hierarchy(boxes[order], slabs[order], corners[order], links[order], np.concatenate(self.nets), width)


def describe(nets: Array) -> tuple[Array, Array, Array, Ints]:
    """Boxes, slabs and corners of patches (n, p, q, 4), and the axis along which each is longer."""
    points = nets[..., :3] / nets[..., 3:]
    flat = points.reshape(len(points), -1, 3)
    boxes = np.concatenate([flat.min(axis=1), flat.max(axis=1)], axis=1)
    corners = np.stack([points[:, 0, 0], points[:, -1, 0], points[:, -1, -1], points[:, 0, -1]], axis=1)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(lengths > 0, lengths, 1.0)[:, None]
    along = np.einsum("nkc,nc->nk", flat, normals)
    slabs = np.concatenate([normals, along.min(axis=1)[:, None], along.max(axis=1)[:, None]], axis=1)
    slabs[:, 3:] += 2.0**-50 * np.abs(flat).max(initial=0.0) * np.array([-1.0, 1.0])  # the rounding of the products
    slabs[~(lengths > 0), 3:] = -np.inf, np.inf
    spans = [np.linalg.norm(np.diff(points, axis=axis), axis=-1).sum(axis=axis).max(axis=1) for axis in (1, 2)]
    return boxes, slabs, corners, (spans[1] > spans[0]).astype(np.int64)


def halve(nets: NDArray[np.longdouble], axes: Ints) -> NDArray[np.longdouble]:
    """Both halves of each patch (n, p, q, 4), cut along its axis: (2 n, p, q, 4), first halves at even places."""
    result = np.empty((len(nets), 2, *nets.shape[1:]), np.longdouble)
    for axis in (0, 1):
        rows = np.moveaxis(nets[axes == axis], axis + 1, 0).copy()
        n = len(rows)
        back = np.empty_like(rows)
        for level in range(n):
            back[n - 1 - level] = rows[-1]
            rows[level + 1 :] = (rows[level:-1] + rows[level + 1 :]) / 2
        result[axes == axis, 0] = np.moveaxis(rows, 0, axis + 1)
        result[axes == axis, 1] = np.moveaxis(back, 0, axis + 1)
    return result.reshape(-1, *nets.shape[1:])
