"""Isolated singular points of any formula by Newton's iteration from a lattice: a search, not a proof."""

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds
from implicit.surface import Surface

Floats = NDArray[np.float64]

_STARTS = 14  # in each direction
_STEPS = 40


def search_numerically(surface: Surface, bounds: Bounds) -> list[Floats]:
    """Points (3,) in the bounds with f = 0, grad f = 0 and an invertible Hessian, to rounding."""
    box, size = bounds.box.corners, bounds.size
    axes = [np.linspace(a, b, _STARTS + 1)[:-1] + (b - a) / _STARTS * 0.47 for a, b in box.T]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    scale = _typical(np.linalg.norm(surface.gradient(points), axis=1))
    height = _typical(np.abs(surface(points)))
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            step = _newton(surface, points)
            length = np.linalg.norm(step, axis=1, keepdims=True)
            points = points - step * np.minimum(1, 0.25 * size / np.maximum(length, 1e-300))
            points = points[np.isfinite(points).all(axis=1) & (np.abs(points - box.mean(axis=0)).max(axis=1) < size)]
            if not len(points):
                return []
        flat = np.linalg.norm(surface.gradient(points), axis=1) < 1e-10 * scale
        zero = np.abs(surface(points)) < 1e-11 * height
        sharp = np.linalg.cond(surface.hessian(points)) < 1e8
    found: list[Floats] = []
    for p in points[flat & zero & sharp & bounds.contains(points)]:
        if all(np.abs(p - q).max() > 1e-7 * size for q in found):
            p.flags.writeable = False
            found.append(p)
    return found


def _typical(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return max(float(np.median(finite)), 1e-300) if len(finite) else 1.0


def _newton(surface: Surface, points: Floats) -> Floats:
    """The step of least length, so that degenerate Hessians do no harm."""
    hessian, gradient = surface.hessian(points), surface.gradient(points)
    good = np.isfinite(hessian).all(axis=(1, 2)) & np.isfinite(gradient).all(axis=1)
    step = np.full_like(points, np.nan)
    step[good] = np.einsum("nij,nj->ni", np.linalg.pinv(hessian[good], rcond=1e-9), gradient[good])
    return step
