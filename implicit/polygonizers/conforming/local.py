"""The surface in lattice units, and small tools for places on circles and spheres."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field, PolynomialField
from implicit.polygonizers.clip import Rim
from implicit.polygonizers.conforming.grid import Grid

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_GOLDEN = np.pi * (1 + 5**0.5)


@dataclass(frozen=True, eq=False)
class Local:
    """f with places in lattice units; points (..., 3). walls: the boundary of the bounds."""

    field: Field
    grid: Grid
    walls: tuple[Rim, ...]

    def heights(self, units: FloatArray) -> FloatArray:
        """How many cells (n,) places (n, 3) lie outside the bounds; negative inside."""
        points = self.grid.to_points(units)
        return np.max([wall.heights(points) for wall in self.walls], axis=0) / self.grid.step

    @cached_property
    def degree(self) -> int | None:
        """The degree of a polynomial, None of anything else."""
        return self.field.degree if isinstance(self.field, PolynomialField) else None

    def noise(self, *corners: FloatArray) -> FloatArray:
        """How far values (n,) of a polynomial between corners (n, 3), as points, may be off by rounding."""
        sizes = np.abs(corners[0])
        for places in corners[1:]:
            np.maximum(sizes, np.abs(places), out=sizes)
        if not isinstance(self.field, PolynomialField):
            raise TypeError("only of a polynomial the rounding is known")
        return self.field.noise.values(sizes)

    def values(self, units: FloatArray) -> FloatArray:
        """The values (...,)."""
        flat = self.grid.to_points(np.ascontiguousarray(units).reshape(-1, 3))
        return self.field.values(flat).reshape(units.shape[:-1])

    def signs(self, units: FloatArray) -> IntArray:
        """-1 inside, 1 outside or on the surface, as the sweep has it."""
        return np.where(self.values(units) < 0, -1, 1)

    def gradients(self, units: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The values (...,) and gradients (..., 3) for places in lattice units."""
        flat = self.grid.to_points(np.ascontiguousarray(units).reshape(-1, 3))
        values, gradients = self.field.gradients(flat)
        return values.reshape(units.shape[:-1]), gradients.reshape(units.shape) * self.grid.step

    def hessians(self, units: FloatArray) -> FloatArray:
        """The second derivatives (n, 3, 3) for places (n, 3)."""
        points = self.grid.to_points(units)
        if self._derivatives is None:
            return self.field.hessians(points) * self.grid.step**2
        return np.stack([d.gradients(points)[1] for d in self._derivatives], axis=1) * self.grid.step**2

    @cached_property
    def _derivatives(self) -> list[PolynomialField] | None:
        field = self.field
        return [field.derivative(axis) for axis in range(3)] if isinstance(field, PolynomialField) else None


def frame(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (..., 3) at right angles to unit vectors (..., 3) and to each other."""
    u = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction), axis=-1)])
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return u, np.cross(direction, u)


def spread(count: int, rng: np.random.Generator) -> FloatArray:
    """So many points (n, 3) spread evenly over the unit sphere, turned at random."""
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), _GOLDEN * i
    points = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    return np.asarray(points @ np.linalg.qr(rng.normal(size=(3, 3)))[0])


def unit_rows(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) of length 1."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def pairs_of(simplices: IntArray) -> IntArray:
    """The edges (n, 2) of simplices (m, k), each once, lower vertex first."""
    k = simplices.shape[1]
    ends = np.concatenate([simplices[:, [i, j]] for i in range(k) for j in range(i)])
    if not len(ends):
        return np.zeros((0, 2), np.int64)
    low, high = ends.min(axis=1), ends.max(axis=1)
    size = int(high.max()) + 1
    keys = distinct(low * size + high)
    return np.column_stack([keys // size, keys % size])


def with_edges(tetrahedra: IntArray, edges: IntArray) -> IntArray:
    """The tetrahedra with one of the edges (n, 2), lower vertex first."""
    if not len(edges):
        return tetrahedra[:0]
    size = int(tetrahedra.max()) + 1
    corners = np.sort(tetrahedra, axis=1)
    names = [corners[:, i] * size + corners[:, j] for j in range(4) for i in range(j)]
    return tetrahedra[np.isin(np.column_stack(names), edges @ np.array([size, 1])).any(axis=1)]


def proper(faces: IntArray) -> IntArray:
    """The faces (n, 3) with three different corners."""
    a, b, c = faces.T
    return faces.take(np.flatnonzero((a != b) & (b != c) & (c != a)), axis=0)  # several times as fast as by a mask


def distinct(keys: NDArray[Any]) -> NDArray[Any]:
    """The different keys, ascending. Where most of them differ this is several times as fast as numpy's `unique`."""
    ordered = np.sort(keys, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered


def at_some(mask: NDArray[np.bool_], simplices: IntArray) -> NDArray[np.bool_]:
    """Which simplices (n, k) have a corner in the mask: several times as fast as `any` over short rows."""
    return np.asarray(np.logical_or.reduce([mask[corner] for corner in simplices.T]))


def at_all(mask: NDArray[np.bool_], simplices: IntArray) -> NDArray[np.bool_]:
    """Which simplices (n, k) have all their corners in the mask."""
    return np.asarray(np.logical_and.reduce([mask[corner] for corner in simplices.T]))


def among(keys: NDArray[Any], known: NDArray[Any]) -> NDArray[np.bool_]:
    """Which keys are among known ones, which ascend."""
    if not len(known):
        return np.zeros(keys.shape, bool)
    place = np.minimum(np.searchsorted(known, keys), len(known) - 1)
    return np.asarray(known[place] == keys)


def merged(known: NDArray[Any], keys: NDArray[Any]) -> NDArray[Any]:
    """The known keys, which ascend, with more among them."""
    return np.sort(np.concatenate([known, np.sort(keys)]), kind="stable")
