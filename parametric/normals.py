"""Unit normals, and their limits where p_u x p_v vanishes."""

from math import comb, factorial

import numpy as np
from numpy.typing import ArrayLike

from implicit.errors import SingularPointError
from parametric.parameters import Array
from parametric.splines.basis import cross
from parametric.surface import Jet, ParametricSurface

VANISHING = 1e-9
"""A cross product below this part of its largest size is taken for zero: half the digits of its direction are lost."""
NOTHING = np.full(3, np.nan)
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
    pairs = np.stack([np.broadcast_to(p, lengths.shape)[vanishing] for p in surface.parameters(u, v)], axis=-1)
    limits = _Limits(surface)
    found = np.array([limits.at(*pair) for pair in pairs.tolist()])
    lost = np.isnan(found).any(axis=-1)
    if lost.any() and strict:
        at = "({:g}, {:g})".format(*pairs[lost][0])
        raise SingularPointError(f"no normal at (u, v) = {at}: p_u x p_v vanishes without a limit direction")
    normals[vanishing] = found
    return normals


class _Limits:
    """Limits of normals at singular points of one surface; each collapsed line of the domain is looked at once."""

    def __init__(self, surface: ParametricSurface) -> None:
        self.surface = surface
        self.known: dict[tuple[int, float], Array | None] = {}

    def at(self, u: float, v: float) -> Array:
        """The normal that all ways into the point agree on, or nan.

        Where a line of the domain shrinks to one point, the ways in from every place on that line must agree.
        """
        lines = [self._line(axis, value) for axis, value in ((1, v), (0, u))]
        if all(line is None for line in lines):
            return _expand(self.surface, u, v)
        return _agreed([line for line in lines if line is not None])

    def _line(self, axis: int, value: float) -> Array | None:
        """The common normal (or nan) along the line of constant v (axis 1) or u (axis 0); None if it has a length."""
        if (axis, value) not in self.known:
            running = np.linspace(*self.surface.domain[1 - axis], 9)
            u, v = (running, np.full(9, value)) if axis else (np.full(9, value), running)
            tangents = self.surface.derivative(u, v, axis, 1 - axis)
            collapsed = np.abs(tangents).max() <= VANISHING * self.surface.scale[1 - axis]
            self.known[axis, value] = self._along(u, v) if collapsed else None
        return self.known[axis, value]

    def _along(self, u: Array, v: Array) -> Array:
        return _agreed([_expand(self.surface, a, b) for a, b in zip(u.tolist(), v.tolist())])


def _agreed(normals: list[Array]) -> Array:
    """The first of the normals if all are the same, otherwise nan."""
    same = np.abs(np.array(normals) - normals[0]).max() < 1e-6
    return normals[0] if same else NOTHING


def _expand(surface: ParametricSurface, u: float, v: float) -> Array:
    """Direction of the first term of N(u + s a, v + s b) = sum s^k N_k(a, b) that does not vanish."""
    (u0, u1), (v0, v1) = surface.domain
    width, height = u1 - u0, v1 - v0
    scale = max(surface.scale[0] * width * surface.scale[1] * height, 1e-300)
    angles = np.arange(32) * np.pi / 16 + 0.1
    a, b = np.cos(angles) * width, np.sin(angles) * height
    inward = ((u > u0) | (a > 0)) & ((u < u1) | (a < 0)) & ((v > v0) | (b > 0)) & ((v < v1) | (b < 0))
    a, b = a[inward], b[inward]
    for k in range(HIGHEST + 1):
        terms = _term(surface.jet(u, v, k + 1), k, a, b) * width * height
        lengths = np.linalg.norm(terms, axis=-1)
        if lengths.max() > VANISHING * scale:
            if lengths.min() <= 1e-6 * lengths.max():
                return NOTHING
            units = terms / lengths[:, None]
            return _agreed(list(units))
    return NOTHING


def _term(jet: Jet, k: int, a: Array, b: Array) -> Array:
    """N_k(a, b) = sum over i + j = k of a^i b^j / (i! j!) d_u^i d_v^j (p_u x p_v), (n, 3)."""
    total = np.zeros((a.size, 3))
    for i in range(k + 1):
        j = k - i
        product = np.zeros(3)
        for m in range(i + 1):
            for n in range(j + 1):
                product += comb(i, m) * comb(j, n) * np.cross(jet[m + 1, n], jet[i - m, j - n + 1])
        total += (a**i * b**j)[:, None] * product / (factorial(i) * factorial(j))
    return total
