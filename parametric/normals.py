"""Unit normals, and their limits where p_u x p_v vanishes."""

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from implicit.errors import SingularPointError
from parametric.basis import cross
from parametric.parameters import Array
from parametric.surface import Jet, ParametricSurface

VANISHING = 1e-9
"""A cross product below this part of its largest size is taken for zero: half the digits of its direction are lost."""
HIGHEST = 4
"""Terms of the expansion of the normal that are tried."""


def unit_normals(surface: ParametricSurface, u: ArrayLike, v: ArrayLike, strict: bool, jet: Jet | None = None) -> Array:
    """Unit normals (..., 3); where there is none, nan, or a SingularPointError if `strict`."""
    jet = surface.jet(u, v, 1) if jet is None else jet
    a, b = np.broadcast_arrays(jet[1, 0], jet[0, 1])
    units, sizes = cross(np.ascontiguousarray(a).reshape(-1, 3), np.ascontiguousarray(b).reshape(-1, 3))
    normals, lengths = units.reshape(a.shape), sizes.reshape(a.shape[:-1])
    vanishing = ~(lengths > VANISHING * surface.scale[0] * surface.scale[1])
    if not vanishing.any():
        return normals
    where = (np.broadcast_to(p, lengths.shape)[vanishing].tolist() for p in surface.parameters(u, v))
    pairs = list(zip(*where))
    found = {pair: _limit(surface, *pair) for pair in dict.fromkeys(pairs)}
    lost = [pair for pair, normal in found.items() if normal is None]
    if lost and strict:
        at = f"({lost[0][0]:g}, {lost[0][1]:g})"
        raise SingularPointError(f"no normal at (u, v) = {at}: p_u x p_v vanishes without a limit direction")
    nothing = np.full(3, np.nan)
    limits = [found[pair] for pair in pairs]
    normals[vanishing] = [nothing if normal is None else normal for normal in limits]
    return normals


def _limit(surface: ParametricSurface, u: float, v: float) -> Array | None:
    """The normal that all ways into the point agree on, or None.

    Where a whole edge of the domain shrinks to one point, the ways in from every place on that edge must agree.
    """
    (u0, u1), (v0, v1) = surface.domain
    along_u, along_v = np.linspace(u0, u1, 9), np.linspace(v0, v1, 9)
    places = [(u, v)]
    if _collapsed(surface.derivative(along_u, v, 1, 0), surface.scale[0]):
        places += [(float(a), v) for a in along_u]
    if _collapsed(surface.derivative(u, along_v, 0, 1), surface.scale[1]):
        places += [(u, float(b)) for b in along_v]
    normals = [_expand(surface, *place) for place in places]
    if any(normal is None for normal in normals):
        return None
    result = np.array(normals)
    return result[0] if np.abs(result - result[0]).max() < 1e-6 else None


def _collapsed(tangents: Array, scale: float) -> bool:
    return bool(np.abs(tangents).max() <= VANISHING * scale)


def _expand(surface: ParametricSurface, u: float, v: float) -> Array | None:
    """Direction of the first term of N(u + s a, v + s b) = sum s^k N_k(a, b) that does not vanish."""
    (u0, u1), (v0, v1) = surface.domain
    width, height = u1 - u0, v1 - v0
    jet = surface.jet(u, v, HIGHEST + 1)
    scale = max(surface.scale[0] * width * surface.scale[1] * height, 1e-300)
    angles = np.arange(32) * np.pi / 16 + 0.1
    a, b = np.cos(angles) * width, np.sin(angles) * height
    inward = ((u > u0) | (a > 0)) & ((u < u1) | (a < 0)) & ((v > v0) | (b > 0)) & ((v < v1) | (b < 0))
    a, b = a[inward], b[inward]
    for k in range(HIGHEST + 1):
        terms = _term(jet, k, a, b) * width * height
        lengths = np.linalg.norm(terms, axis=-1)
        if lengths.max() > VANISHING * scale:
            if lengths.min() <= 1e-6 * lengths.max():
                return None
            units = terms / lengths[:, None]
            return units[0] if np.abs(units - units[0]).max() < 1e-6 else None
    return None


def _term(jet: Jet, k: int, a: Array, b: Array) -> Array:
    """N_k(a, b) = sum over i + j = k of a^i b^j / (i! j!) d_u^i d_v^j (p_u x p_v), (n, 3)."""
    total = np.zeros((a.size, 3))
    for i in range(k + 1):
        j = k - i
        factor = 1.0
        for n in range(2, i + 1):
            factor /= n
        for n in range(2, j + 1):
            factor /= n
        cross = np.zeros(3)
        for m in range(i + 1):
            for n in range(j + 1):
                cross += comb(i, m) * comb(j, n) * np.cross(jet[m + 1, n], jet[i - m, j - n + 1])
        total += factor * (a**i * b**j)[:, None] * cross
    return total
