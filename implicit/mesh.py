"""Meshes: vertices and triangles, counter-clockwise seen from outside, and what is true of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import OpenSurfaceError

if TYPE_CHECKING:
    from implicit.report import MeshReport
    from implicit.topology import Edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, init=False, eq=False)
class Mesh:
    """Vertices (V, 3) joined by triangles (F, 3), counter-clockwise seen from outside.

    normals (V, 3)      unit normals; computed from the faces, weighted by area, if not given (0 where there is none)
    curves              index arrays of polylines: singular and solitary curves
    points              indices of special vertices
    unresolved          (K, 2, 3) boxes that could not be decided; None when nobody asked

    All arrays are read-only copies. Raises ValueError for wrong shapes, vertices that are not finite, and indices
    that are no vertex.

    >>> tetrahedron = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    >>> round(tetrahedron.volume, 12)
    0.166666666667
    >>> print(tetrahedron.report())
    4 vertices, 6 edges, 4 faces: closed, manifold, oriented
    1 component, Euler characteristic 2, genus 0
    """

    vertices: FloatArray
    faces: IntArray
    normals: FloatArray
    curves: tuple[IntArray, ...]
    points: IntArray
    unresolved: FloatArray | None

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        normals: ArrayLike | None = None,
        curves: Sequence[ArrayLike] = (),
        points: ArrayLike = (),
        unresolved: ArrayLike | None = None,
    ) -> None:
        corners = _rows(vertices, np.float64, 3, "vertices")
        triangles = _rows(faces, np.int64, 3, "faces")
        size = len(corners)
        _check_finite(corners, "vertex")
        _check_indices(triangles, size, "face")
        lines = tuple(_indices(curve, size, f"curve {i}") for i, curve in enumerate(curves))
        if normals is None:
            directions = _frozen(area_weighted_normals(corners, triangles), np.float64)
        else:
            directions = _rows(normals, np.float64, 3, "normals")
            if len(directions) != size:
                raise ValueError(f"normals must be one per vertex, got {len(directions)} for {size} vertices")
            _check_finite(directions, "normal")
        boxes = None if unresolved is None else _frozen(np.asarray(unresolved, float).reshape(-1, 2, 3), np.float64)
        values = (corners, triangles, directions, lines, _indices(points, size, "points"), boxes)
        for name, value in zip(self.__dataclass_fields__, values, strict=True):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        """Counts, not arrays."""
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"

    @cached_property
    def _edges(self) -> Edges:
        from implicit.topology import find_edges

        return find_edges(self.faces, len(self.vertices))

    @property
    def area(self) -> float:
        """The sum of the triangles' areas."""
        return float(np.linalg.norm(double_areas(self.vertices, self.faces), axis=1).sum() / 2)

    @property
    def volume(self) -> float:
        """The signed volume inside, sum of det(a, b, c) / 6: positive when the faces look outward.

        Raises OpenSurfaceError when the faces bound no solid: an edge is not used once in each direction.
        """
        if not self._edges.balanced:
            raise OpenSurfaceError(
                "a volume needs a closed, consistently oriented mesh, "
                f"got {self._edges.boundary} boundary edges among {self._edges.count} edges"
            )
        if not len(self.faces):
            return 0.0
        middle = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2
        first = self.vertices[self.faces[:, 0]] - middle
        return float(np.einsum("ij,ij->", first, double_areas(self.vertices, self.faces)) / 6)

    @property
    def euler(self) -> int:
        """The Euler characteristic V - E + F, counting vertices in use and the edges of curves."""
        return self.report().euler

    def report(self) -> MeshReport:
        """What is true of this mesh: counts, and whether it is closed, manifold and oriented."""
        return self._report

    @cached_property
    def _report(self) -> MeshReport:
        from implicit.report import describe

        return describe(self, self._edges)

    def separate(self) -> Mesh:
        """The mesh with a vertex for each sheet where sheets cross or touch: manifold, as printers want it."""
        from implicit.separate import separate

        return separate(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the mesh in the format of the suffix: stl, ply, obj, glb, 3mf or vtp."""
        from implicit.files import save

        save(self, path)

    def to_pyvista(self) -> Any:
        """The mesh as a `pyvista.PolyData` with its normals."""
        from implicit.show import to_pyvista

        return to_pyvista(self)

    def plot(self) -> None:
        """Show the mesh in a window."""
        from implicit.show import show

        show(self)


def assemble(
    vertices: FloatArray,
    faces: IntArray,
    normals: FloatArray,
    curves: Sequence[IntArray] = (),
    points: Sequence[int] | IntArray = (),
    unresolved: FloatArray | None = None,
) -> Mesh:
    """A mesh that takes arrays over without checks or copies: for makers of meshes, who know what they made."""
    mesh = object.__new__(Mesh)
    for array in (vertices, faces, normals):
        array.flags.writeable = False
    lines = tuple(_frozen(curve, np.int64) for curve in curves)
    boxes = None if unresolved is None else _frozen(unresolved, np.float64)
    values = (vertices, faces, normals, lines, _frozen(points, np.int64), boxes)
    for name, value in zip(Mesh.__dataclass_fields__, values, strict=True):
        object.__setattr__(mesh, name, value)
    return mesh


def area_weighted_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Unit normals (V, 3): at each vertex the mean of its faces' normals by area, 0 where there is none."""
    weighted = double_areas(vertices, faces)
    total = np.zeros((len(vertices), 3))
    for axis in range(3):
        for corner in range(3):
            total[:, axis] += np.bincount(faces[:, corner], weighted[:, axis], minlength=len(vertices))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def double_areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """(b - a) x (c - a) for faces (F, 3) with corners a, b, c: along their normals, twice as long as they are large."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a))


def _frozen(array: Any, dtype: type) -> NDArray[Any]:
    """`array` itself if nobody can change it, else a read-only copy."""
    kept: NDArray[Any] = np.asarray(array, dtype=dtype)
    if kept.flags.writeable or not kept.flags.owndata or not kept.flags.c_contiguous:
        kept = np.array(kept, dtype=dtype, order="C")
        kept.flags.writeable = False
    return kept


def _rows(values: ArrayLike, dtype: type, width: int, name: str) -> NDArray[Any]:
    array = np.asarray(values)
    if array.size == 0:
        array = np.zeros((0, width), dtype)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} must have shape (n, {width}), got {array.shape}")
    if dtype is np.int64 and array.dtype.kind not in "iu":
        raise ValueError(f"{name} must be integers, got {array.dtype}")
    return _frozen(array, dtype)


def _indices(values: ArrayLike, size: int, name: str) -> IntArray:
    array = np.asarray(values)
    if array.size == 0:
        array = np.zeros(0, np.int64)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise ValueError(f"{name} must be a list of vertex indices, got shape {array.shape} of {array.dtype}")
    _check_indices(array, size, name)
    return _frozen(array, np.int64)


def _check_finite(rows: FloatArray, name: str) -> None:
    with np.errstate(all="ignore"):
        fine = np.isfinite(rows.sum())
    if not fine and not np.isfinite(rows).all():
        index = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise ValueError(f"every {name} must be finite, got {name} {index} = {tuple(rows[index].tolist())}")


def _check_indices(indices: NDArray[Any], size: int, name: str) -> None:
    if indices.size and (indices.min() < 0 or indices.max() >= size):
        bad = (indices < 0) | (indices >= size)
        row = int(np.argwhere(bad)[0][0])
        where = f"{name} {row}" if indices.ndim > 1 else f"{name}, place {row},"
        raise ValueError(
            f"{where} names vertex {int(indices[bad][0])}, but the mesh has {size} vertices (0 to {size - 1})"
        )
