"""Bicubically blended Coons patches: edges with given derivatives across them, and twists at the corners."""

from math import comb
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array
from parametric.transfinite.blend import BlendedSurface, hermite_blend

ROWS, COLUMNS = ("bottom", "top"), ("left", "right")


class CoonsPatch(BlendedSurface):
    """A Coons patch; made by `coons`."""

    incompatibility: Array | None = None
    """By how much the twists that the two ribbons at each corner [u][v] ask for disagree, (2, 2); None without."""
    twist_error: Array | None = None
    """By how much the twist given at each corner differs from what a ribbon there asks for, (2, 2): up to 4/27 of it
    is what the patch misses the ribbons by. Zero for Gregory's patch."""


class GregoryPatch(CoonsPatch):
    """A Coons patch whose twists are blends (s a + r b) / (s + r) of those that its ribbons ask for.

    Here a is the derivative along v of p_u on the edge of constant u and b that along u of p_v on the edge of constant
    v; s is the distance from the first edge and r that from the second. Towards the second edge the twist becomes a,
    which is what its ribbon needs. Second derivatives at a corner depend on the way into it.
    """

    twists: tuple[Array, Array]

    def _product(self, u: Array, v: Array, i: int, j: int) -> Array:
        total = super()._product(u, v, i, j)
        along_v, along_u = self.twists
        for a in (0, 1):
            for b in (0, 1):
                jump = along_u[a, b] - along_v[a, b]
                total = total + self._share(u, v, i, j, a, b)[..., None] * jump
        return total

    def _share(self, u: Array, v: Array, i: int, j: int, a: int, b: int) -> Array:
        """Derivative (i, j) of f(u) g(v) r / (r + s), with r = |v - b| and s = |u - a| the distances."""
        total = np.zeros(np.broadcast_shapes(u.shape, v.shape))
        s, r = (u if a == 0 else 1 - u), (v if b == 0 else 1 - v)
        for k in range(i + 1):
            for m in range(j + 1):
                weight = comb(i, k) * comb(j, m) * (-1) ** (a * k + b * m)
                blends = self._slope(u, i - k, a, 0) * self._slope(v, j - m, b, 1)
                total = total + weight * blends * _fraction(r, s, m, k)
        return total

    def _slope(self, t: Array, order: int, end: int, axis: int) -> Array:
        blend = self.f if axis == 0 else self.g
        assert blend is not None
        return blend(t, order)[..., 2 + end]


def _fraction(r: Array, s: Array, m: int, k: int) -> Array:
    """Derivative, m times by r and k times by s, of r / (r + s); zero at the corner, where it has no value."""
    n, total = m + k, r + s
    inverse = np.divide(1.0, total, out=np.zeros(np.broadcast_shapes(r.shape, s.shape)), where=total > 0)
    sign, factorial = (-1) ** n, float(np.prod(np.arange(1, n + 1)))
    value = sign * factorial * r * inverse ** (n + 1)
    if m:
        value = value - sign * m * float(np.prod(np.arange(1, n))) * inverse**n
    return value


def ribboned(
    curves: dict[str, ParametricCurve], across: dict[str, ParametricCurve], corners: Array, twists: Any
) -> CoonsPatch:
    """The bicubically blended patch; see `coons`."""
    tensor = np.zeros((4, 4, 3))
    tensor[:2, :2] = corners
    _fill_tangents(tensor, curves, across)
    along_v = np.stack([across[name].derivative([0.0, 1.0]) for name in COLUMNS])  # d/dv of p_u
    along_u = np.stack([across[name].derivative([0.0, 1.0]) for name in ROWS], axis=1)  # d/du of p_v
    gregory = isinstance(twists, str) and twists == "gregory"
    tensor[2:, 2:] = along_v if gregory else _twists(twists, tensor)
    blend = hermite_blend()
    rows = [curves[n] for n in ROWS] + [across[n] for n in ROWS]
    columns = [curves[n] for n in COLUMNS] + [across[n] for n in COLUMNS]
    patch = (GregoryPatch if gregory else CoonsPatch)(rows, blend, columns, blend, tensor)
    patch.incompatibility = np.linalg.norm(along_v - along_u, axis=-1)
    given = np.linalg.norm(np.stack([along_v, along_u]) - tensor[2:, 2:], axis=-1).max(axis=0)
    patch.twist_error = np.zeros((2, 2)) if gregory else given
    if isinstance(patch, GregoryPatch):
        patch.twists = along_v, along_u
    return patch


def _fill_tangents(tensor: Array, curves: dict[str, ParametricCurve], across: dict[str, ParametricCurve]) -> None:
    """Enter the tangents at the corners; a ValueError where a ribbon disagrees with the edge it starts on."""
    for edges, ribbons, flip in ((COLUMNS, ROWS, False), (ROWS, COLUMNS, True)):
        slopes = np.stack([curves[name].derivative([0.0, 1.0]) for name in edges])
        ends = np.stack([across[name]([0.0, 1.0]) for name in ribbons], axis=1)
        gaps = np.linalg.norm(slopes - ends, axis=-1)
        k, m = np.unravel_index(gaps.argmax(), gaps.shape)
        if gaps[k, m] > 1e-8 * max(1e-300, float(np.abs(slopes).max())):
            raise ValueError(
                f"the ribbon across {ribbons[m]} ends with {ends[k, m].tolist()} where {edges[k]} "
                f"has the derivative {slopes[k, m].tolist()}: they are {gaps[k, m]:.3g} apart"
            )
        if flip:
            tensor[2:, :2] = slopes.transpose(1, 0, 2)
        else:
            tensor[:2, 2:] = slopes


def _twists(twists: Any, tensor: Array) -> Array:
    """The four twists [u][v], (2, 2, 3)."""
    if isinstance(twists, str):
        if twists == "zero":
            return np.zeros((2, 2, 3))
        if twists == "adini":
            return adini_twists(tensor)
        raise ValueError(f'twists must be "zero", "adini", "gregory" or an array (2, 2, 3), got {twists!r}')
    given = np.array(twists, dtype=float)
    if given.shape != (2, 2, 3):
        raise ValueError(f"twists must have shape (2, 2, 3), one for each corner [u][v], got shape {given.shape}")
    return given


def adini_twists(tensor: ArrayLike) -> Array:
    """Twists of the bilinearly blended patch with the same edges, from corners and tangents (4, 4, 3).

    p_uv = (p_v(1, v) - p_v(0, v)) + (p_u(u, 1) - p_u(u, 0)) - (p11 - p10 - p01 + p00), at each corner (u, v).
    """
    t = np.asarray(tensor, dtype=float)
    from_v = t[1, 2:] - t[0, 2:]
    from_u = t[2:, 1] - t[2:, 0]
    return from_v[None, :] + from_u[:, None] - (t[1, 1] - t[1, 0] - t[0, 1] + t[0, 0])
