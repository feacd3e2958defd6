"""The mesh of the sweep, and the parts of it near some cells."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import OPTIONS
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.weld import list_marked
from implicit.topology import renumbered

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BITS = 3
"""Cells are kept in bricks of 2^3 along each axis, of which there are only those with a cell."""
_REST = (1 << _BITS) - 1


@dataclass(frozen=True, eq=False)
class Near:
    """A part of the sweep: the numbers that its vertices have there, and its faces in numbers of its own."""

    names: IntArray
    vertices: FloatArray
    normals: FloatArray
    faces: IntArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """The mesh of the sweep."""

    grid: Grid
    vertices: FloatArray
    normals: FloatArray
    faces: IntArray

    def near(self, cells: IntArray) -> tuple[NDArray[np.bool_], Near]:
        """The part with a vertex in some cells (n, 3) or beside them, and which faces do not belong to it."""
        marked = np.zeros(len(self.vertices), np.bool_)
        number = _bricks(cells, self.grid.cells)
        meant = np.zeros((int(number.max()) + 1, *[1 << _BITS] * 3), np.bool_)
        _mark(self.vertices, self.grid.origin, self.grid.step, cells, number, meant, marked)
        rows = list_marked(self.faces, marked)
        names, faces = renumbered(self.faces[rows], len(self.vertices))
        rest = np.ones(len(self.faces), bool)
        rest[rows] = False
        return rest, Near(names, self.vertices[names], self.normals[names], faces)


def _bricks(cells: IntArray, size: IntArray) -> IntArray:
    """The number of each brick of a lattice with one more cell all round, 0 where there are none of some cells (n, 3),
    nor cells beside them.
    """
    used = np.zeros(((size + 1) >> _BITS) + 1, np.bool_)
    low, high = cells.T >> _BITS, cells.T + 2 >> _BITS
    for x, y, z in product((low, high), repeat=3):
        used[x[0], y[1], z[2]] = True
    return np.where(used, np.cumsum(used).reshape(used.shape), 0)


@njit(**OPTIONS)
def _mark(vertices: Any, origin: Any, step: float, cells: Any, number: Any, meant: Any, marked: Any) -> None:
    """Mark vertices in cells or beside them; meant (bricks + 1, 8, 8, 8) has room for these cells."""
    for row in range(len(cells)):
        for k in range(27):
            x, y, z = cells[row, 0] + k // 9, cells[row, 1] + k // 3 % 3, cells[row, 2] + k % 3
            meant[number[x >> _BITS, y >> _BITS, z >> _BITS], x & _REST, y & _REST, z & _REST] = True
    for v in range(len(vertices)):
        x = int((vertices[v, 0] - origin[0]) / step) + 1
        y = int((vertices[v, 1] - origin[1]) / step) + 1
        z = int((vertices[v, 2] - origin[2]) / step) + 1
        marked[v] = meant[number[x >> _BITS, y >> _BITS, z >> _BITS], x & _REST, y & _REST, z & _REST]
