"""How large a ball round a special point may be: below the least critical value of the distance on the surface.

Where the distance from p is critical on f = 0 the gradient is along x - p. With x = p + t w, w on the boundary of a
cube, f and the parts of grad f x w are t^m times polynomials, m the multiplicity of p. All boxes of (t, w) are looked
at, and those given up over which, by Bernstein coefficients, one of these has one sign; where the surface is like a
smooth cone that is all of them near p. From what is left Newton's steps lead to the critical points.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.evaluate import PolynomialField
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.points.blowup import germs_at, halves
from implicit.polygonizers.conforming.points.hull import Hull
from implicit.polygonizers.conforming.points.squares import boxes_between

FloatArray = NDArray[np.float64]

_COARSE, _HALVINGS, _MOST_HALVINGS = 4, 2, 6
"""Boxes along each axis of a face at first, and how often they are halved; more often where few are left."""
_FACES = list(product(range(3), (-1.0, 1.0)))
"""The faces w[axis] = side of a cube."""
_SAMPLES = 16
"""Places along each axis to start from where f is no polynomial."""
_FEW = 60
_STEPS = 12
_LEAST, _DRAWN = 0.02, 0.01
"""Shares of the reach: critical points nearer than the first do not count, steps nearer than the second lead to p."""
_NEAR = 0.03
"""A share of the reach: critical points so near to singular curves are those of the curves."""


def critical_radius(local: Local, point: FloatArray, reach: float, singular: FloatArray) -> float:
    """The least distance, up to `reach`, of a point of f = 0 where grad f is along x - point; infinite if none.

    singular (n, 3): places on singular curves; critical points near them do not count. No box that may hold a critical
    point is left out, but in a box with several some may be missed.
    """
    x = _starts(local, point, 1.1 * reach)
    tree = cKDTree(singular) if len(singular) else None
    if tree is not None and len(x):
        x = x[tree.query(x)[0] > _NEAR * reach]
    if not len(x):
        return np.inf
    home, length, distance = x.copy(), np.full(len(x), np.inf), np.linalg.norm(x - point, axis=1)
    for _ in range(_STEPS):
        rows = np.flatnonzero((length > 1e-9 * reach) & (distance > _DRAWN * reach))
        if not len(rows):
            break
        step = _step(local, point, x[rows])
        length[rows] = np.linalg.norm(step, axis=1)
        x[rows] -= step * np.minimum(1, 0.3 * reach / np.maximum(length[rows], 1e-300))[:, None]
        distance = np.linalg.norm(x - point, axis=1)
        astray = distance > 3 * reach
        x[astray], distance[astray] = home[astray], 3 * reach
    offset = x - point
    distance = np.linalg.norm(offset, axis=1)
    value, slope = local.gradients(x)
    steep = np.linalg.norm(slope, axis=1) + 1e-300
    across = np.linalg.norm(np.cross(slope, offset), axis=1)
    good = (distance > _LEAST * reach) & (distance < 1.2 * reach) & (length < 1e-6 * reach)
    good &= (np.abs(value) < 1e-8 * steep * distance) & (across < 1e-7 * steep * distance)
    if tree is not None and good.any():
        good[good] &= tree.query(x[good])[0] > _NEAR * reach
    if good.any():
        good &= steep > 1e-7 * np.median(steep)
    return float(distance[good].min(initial=np.inf))


def _starts(local: Local, point: FloatArray, reach: float) -> FloatArray:
    """Places (n, 3) up to `reach` from the point, one in each box in which the distance may be critical on f = 0."""
    if not isinstance(local.field, PolynomialField):
        along = (np.arange(_SAMPLES) + 0.5) * 2 / _SAMPLES - 1
        places = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.asarray(point + reach * places[np.linalg.norm(places, axis=1) < 1])
    germ = germs_at(local.field, local.grid.to_points(point)[None], reach * local.grid.step)[0]
    hulls = [Hull.of(part.faces(np.full(3, -1.0), np.ones(3))) for part in (germ, *germ.across())]
    ends = np.linspace(-1, 1, _COARSE + 1)
    sides = np.stack([ends[:-1], ends[1:]], axis=1)
    boxes = np.concatenate([boxes_between(sides, sides, number) for number in range(len(_FACES))])
    boxes[:, 0, 0] = 0
    for level in range(_MOST_HALVINGS + 1):
        boxes = boxes[_nearest(boxes) < 1]
        for hull in hulls:
            bounds = hull.ranges(boxes)
            boxes = boxes[(bounds[:, 0] <= 0) & (bounds[:, 1] >= 0)]
        if level == _MOST_HALVINGS or not len(boxes) or (level >= _HALVINGS and len(boxes) > _FEW):
            break
        boxes = halves(boxes)[0]
    return np.asarray(point + reach * _middles(boxes))


def _nearest(boxes: FloatArray) -> FloatArray:
    """How near (n,) boxes (n, 4, 2) of t, u, v on faces of a cube come to its centre."""
    low, high = boxes[:, 1:3, 0], boxes[:, 1:3, 1]
    beside = np.where(low * high > 0, np.minimum(low**2, high**2), 0.0).sum(axis=1)
    return np.asarray(boxes[:, 0, 0] * np.sqrt(1 + beside))


def _middles(boxes: FloatArray) -> FloatArray:
    """The places t w (n, 3) in the middle of boxes (n, 4, 2)."""
    t, u, v, number = boxes.mean(axis=2).T
    faces = np.array(_FACES)[number.astype(np.int64)]
    axis, rows = faces[:, 0].astype(np.int64), np.arange(len(boxes))
    w = np.empty((len(boxes), 3))
    w[rows, axis], w[rows, (axis + 1) % 3], w[rows, (axis + 2) % 3] = faces[:, 1], u, v
    return t[:, None] * w


def _step(local: Local, point: FloatArray, x: FloatArray) -> FloatArray:
    """One step of Gauss and Newton, scaled by the size of the gradient and the distance."""
    offset = x - point
    value, slope = local.gradients(x)
    scale = 1 / ((np.linalg.norm(offset, axis=1) + 1e-300) * (np.linalg.norm(slope, axis=1) + 1e-300))
    around = _cross_matrices(slope)
    equations = np.empty((len(x), 4, 4))  # grad f x (x - p) and f: derivatives, and the values themselves
    equations[:, :3, :3] = around - _cross_matrices(offset) @ local.hessians(x)
    equations[:, :3, 3] = (around @ offset[..., None])[..., 0]
    equations[:, 3, :3] = slope
    equations[:, 3, 3] = value
    equations = np.nan_to_num(equations * scale[:, None, None]).clip(-1e100, 1e100)
    jacobian, rest = equations[..., :3], equations[..., 3:]
    turned = jacobian.transpose(0, 2, 1)
    normal = turned @ jacobian
    normal += (1e-12 * np.trace(normal, axis1=1, axis2=2) + 1e-200)[:, None, None] * np.eye(3)
    return np.asarray(np.linalg.solve(normal, turned @ rest)[..., 0])


def _cross_matrices(vectors: FloatArray) -> FloatArray:
    """The matrices (n, 3, 3) that take w to v x w."""
    x, y, z = vectors.T
    result = np.zeros((len(vectors), 3, 3))
    result[:, 0, 1], result[:, 0, 2], result[:, 1, 2] = -z, y, -x
    result[:, 1, 0], result[:, 2, 0], result[:, 2, 1] = z, -y, x
    return result
