"""How large a ball round a special point may be: below the least critical value of the distance on the surface.

Where the distance from p is critical on f = 0 the gradient is along x - p. All boxes round p are looked at, and those
given up over which, by Bernstein coefficients, f or a part of grad f x (x - p) has one sign; from what is left Newton's
steps lead to the critical points.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.evaluate import PolynomialField
from implicit.polygonizers.conforming.check import eighths
from implicit.polygonizers.conforming.local import Local

FloatArray = NDArray[np.float64]

_COARSE, _HALVINGS, _MOST_HALVINGS = 4, 2, 6
"""Boxes along each axis at first, and how often they are halved; more often where few are left."""
_FEW = 60
_STEPS = 12
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
    home, length, rows = x.copy(), np.full(len(x), np.inf), np.arange(len(x))
    for _ in range(_STEPS):
        step = _step(local, point, x[rows])
        length[rows] = np.linalg.norm(step, axis=1)
        x[rows] -= step * np.minimum(1, 0.3 * reach / np.maximum(length[rows], 1e-300))[:, None]
        astray = np.linalg.norm(x - point, axis=1) > 3 * reach
        x[astray] = home[astray]
        rows = np.flatnonzero(length > 1e-9 * reach)
        if not len(rows):
            break
    offset = x - point
    distance = np.linalg.norm(offset, axis=1)
    value, slope = local.gradients(x)
    steep = np.linalg.norm(slope, axis=1) + 1e-300
    across = np.linalg.norm(np.cross(slope, offset), axis=1)
    good = (distance > 0.02 * reach) & (distance < 1.2 * reach) & (length < 1e-6 * reach)
    good &= (np.abs(value) < 1e-8 * steep * distance) & (across < 1e-7 * steep * distance)
    if tree is not None and good.any():
        good[good] &= tree.query(x[good])[0] > _NEAR * reach
    if good.any():
        good &= steep > 1e-7 * np.median(steep)
    return float(distance[good].min(initial=np.inf))


def _starts(local: Local, point: FloatArray, reach: float) -> FloatArray:
    """The middles (n, 3) of the boxes up to `reach` from the point in which the distance may be critical on f = 0."""
    edges = np.linspace(-reach, reach, _COARSE + 1)
    low = np.stack(np.meshgrid(*[edges[:-1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    boxes = point + np.stack([low, low + (edges[1] - edges[0])], axis=1)
    tests = _tests(local, point)
    for level in range(_MOST_HALVINGS + 1):
        nearest = np.clip(point, boxes[:, 0], boxes[:, 1]) - point
        boxes = boxes[np.linalg.norm(nearest, axis=1) < reach]
        for test in tests:
            bounds = test.ranges(local.grid.to_points(boxes))
            boxes = boxes[(bounds[:, 0] <= 0) & (bounds[:, 1] >= 0)]
        if level == _MOST_HALVINGS or (level >= _HALVINGS and len(boxes) > _FEW):
            break
        boxes = eighths(boxes)
    return boxes.mean(axis=1)


def _tests(local: Local, point: FloatArray) -> list[PolynomialField]:
    """Besides f the parts of grad f x (x - point), as polynomials; nothing for what is none."""
    field = local.field
    if not isinstance(field, PolynomialField):
        return []
    center = local.grid.to_points(point)
    slopes = [field.derivative(axis) for axis in range(3)]
    return [field] + [_difference(slopes[a], slopes[b], a, b, center) for a, b in ((1, 2), (2, 0), (0, 1))]


def _difference(first: PolynomialField, second: PolynomialField, a: int, b: int, p: FloatArray) -> PolynomialField:
    """`first` times (x_b - p_b) less `second` times (x_a - p_a)."""
    exponents, coefficients = [], []
    for factor, axis, sign in ((first, b, 1.0), (second, a, -1.0)):
        raised = factor.exponents.copy()
        raised[:, axis] += 1
        exponents += [raised, factor.exponents]
        coefficients += [sign * factor.coefficients, -sign * p[axis] * factor.coefficients]
    powers, rows = np.unique(np.concatenate(exponents), axis=0, return_inverse=True)
    rows, parts = rows.ravel(), np.concatenate(coefficients)
    rounding = 4 * np.finfo(float).eps * np.bincount(rows, np.abs(parts)).astype(float)
    return PolynomialField(powers, np.bincount(rows, parts).astype(float), rounding)


def _step(local: Local, point: FloatArray, x: FloatArray) -> FloatArray:
    """One step of Gauss and Newton, scaled by the size of the gradient and the distance."""
    offset = x - point
    value, slope = local.gradients(x)
    hessian = local.hessians(x)
    scale = 1 / ((np.linalg.norm(offset, axis=1) + 1e-300) * (np.linalg.norm(slope, axis=1) + 1e-300))
    jacobian = np.empty((len(x), 4, 3))
    for axis in range(3):
        jacobian[:, :3, axis] = np.cross(hessian[:, :, axis], offset) + np.cross(slope, np.eye(3)[axis])
    jacobian[:, 3] = slope
    rest = np.concatenate([np.cross(slope, offset), value[:, None]], axis=1) * scale[:, None]
    jacobian *= scale[:, None, None]
    jacobian = np.nan_to_num(jacobian, posinf=0, neginf=0).clip(-1e100, 1e100)
    normal = np.einsum("nki,nkj->nij", jacobian, jacobian)
    normal += (1e-12 * np.trace(normal, axis1=1, axis2=2) + 1e-200)[:, None, None] * np.eye(3)
    right = np.einsum("nki,nk->ni", jacobian, np.nan_to_num(rest).clip(-1e100, 1e100))
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])
