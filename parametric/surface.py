"""ParametricSurface: everything that follows from one method, the derivatives of p(u, v)."""

from abc import ABC, abstractmethod
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import Array, Interval, to_parameters

Jet: TypeAlias = dict[tuple[int, int], Array]


class ParametricSurface(ABC):
    """A map p(u, v) from a rectangle to space.

    A subclass gives `domain` and `derivative`; the rest follows. u and v broadcast against each other:
    two arrays of one shape are scattered points, `surface(u[:, None], v[None, :])` is a grid, and is evaluated as one.
    """

    @property
    @abstractmethod
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1))."""

    @abstractmethod
    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3). (0, 0) is the point itself."""

    def __call__(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points p(u, v), shape (..., 3)."""
        return self.derivative(u, v, 0, 0)

    def grid(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points at every pair of u (m,) and v (n,): (m, n, 3)."""
        return self(np.asarray(u, dtype=float)[:, None], np.asarray(v, dtype=float)[None, :])

    def jet(self, u: ArrayLike, v: ArrayLike, order: int = 1) -> Jet:
        """All derivatives (i, j) with i + j <= order, each (..., 3)."""
        return {(i, k - i): self.derivative(u, v, i, k - i) for k in range(order + 1) for i in range(k + 1)}

    def parameters(self, u: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """Both parameters as floats; a ValueError where one leaves the domain."""
        return to_parameters(u, self.domain[0], "u"), to_parameters(v, self.domain[1], "v")

    def normal(self, u: ArrayLike, v: ArrayLike, *, undefined: str = "raise") -> Array:
        """Unit normals p_u x p_v / |p_u x p_v|, (..., 3)."""
        jet = self.jet(u, v, 1)
        return _unit(np.cross(jet[1, 0], jet[0, 1]))

    def twist(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Mixed derivatives p_uv, (..., 3)."""
        return self.derivative(u, v, 1, 1)


def _unit(vectors: Array) -> Array:
    return vectors / np.sqrt(np.einsum("...c,...c->...", vectors, vectors))[..., None]
