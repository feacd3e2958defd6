"""How large a ball round a special point may be: below the least critical value of the distance on the surface."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from implicit.polygonizers.conforming.local import Local

FloatArray = NDArray[np.float64]

_STARTS = 160
_STEPS = 24


def critical_radius(
    local: Local, point: FloatArray, reach: float, singular: FloatArray, rng: np.random.Generator
) -> float:
    """The least distance, up to `reach`, of a point of f = 0 where grad f is along x - point; infinite if none.

    Gauss-Newton steps from random starts on f = 0 and grad f x (x - point) = 0. Points near the singular curves (n, 3)
    do not count. Nothing is proved: a critical point may be missed.
    """
    way = rng.normal(size=(_STARTS, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    x = point + way * (1.1 * reach * rng.random(_STARTS) ** 0.6)[:, None]
    for _ in range(_STEPS):
        step = _step(local, point, x)
        length = np.linalg.norm(step, axis=1)
        x = x - step * np.minimum(1, 0.3 * reach / np.maximum(length, 1e-300))[:, None]
        far = np.linalg.norm(x - point, axis=1) > 3 * reach
        x = np.where(far[:, None], point + 0.5 * reach * way, x)
    offset = x - point
    distance = np.linalg.norm(offset, axis=1)
    value, slope = local.gradients(x)
    steep = np.linalg.norm(slope, axis=1) + 1e-300
    across = np.linalg.norm(np.cross(slope, offset), axis=1)
    good = (distance > 0.02 * reach) & (distance < 1.2 * reach) & (length < 1e-6 * reach)
    good &= (np.abs(value) < 1e-8 * steep * distance) & (across < 1e-7 * steep * distance)
    if len(singular) and good.any():
        good[good] &= cKDTree(singular).query(x[good])[0] > 0.03 * reach
    if good.any():
        good &= steep > 1e-7 * np.median(steep)
    return float(distance[good].min(initial=np.inf))


def _step(local: Local, point: FloatArray, x: FloatArray) -> FloatArray:
    """One step of Gauss and Newton, scaled by the size of the gradient and the distance."""
    offset = x - point
    value, slope = local.gradients(x)
    hessian = local.hessians(x)
    scale = 1 / ((np.linalg.norm(offset, axis=1) + 1e-300) * (np.linalg.norm(slope, axis=1) + 1e-300))
    jacobian = np.empty((len(x), 4, 3))
    turned = np.cross(hessian.transpose(0, 2, 1), offset[:, None]) + np.cross(slope[:, None], np.eye(3))
    jacobian[:, :3] = turned.transpose(0, 2, 1)
    jacobian[:, 3] = slope
    rest = np.concatenate([np.cross(slope, offset), value[:, None]], axis=1) * scale[:, None]
    jacobian *= scale[:, None, None]
    jacobian = np.nan_to_num(jacobian, posinf=0, neginf=0).clip(-1e100, 1e100)
    normal = np.einsum("nki,nkj->nij", jacobian, jacobian)
    normal += (1e-12 * np.trace(normal, axis1=1, axis2=2) + 1e-200)[:, None, None] * np.eye(3)
    right = np.einsum("nki,nk->ni", jacobian, np.nan_to_num(rest).clip(-1e100, 1e100))
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])
