"""Blocks of bricks that a polynomial surface may meet, by Bernstein coefficients.

On a block the polynomial is a combination of Bernstein polynomials, which are positive and add up to 1, so it lies
between the least and the largest coefficient. Blocks are halved until they are single bricks; a block is given up when
all coefficients have one sign by more than rounding can change, in them or in any sample computed on the closed block.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.bernstein import polar_weights
from implicit.kernels.elementary import FUSED
from implicit.polygonizers.lattice import Lattice, to_bricks

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_COARSE = 6
"""The first blocks are at most so many along each axis."""


@cache
def _exponents(degree: int) -> tuple[IntArray, IntArray]:
    """Exponents (m, s) of the upper and of the lower end in the products of m ends, s of them upper."""
    of_upper = np.tile(np.arange(degree + 1), (degree + 1, 1))
    return of_upper, np.maximum(of_upper.T - of_upper, 0)


def to_bernstein(lower: FloatArray, upper: FloatArray, degree: int) -> FloatArray:
    """Matrices (n, degree + 1, degree + 1) from coefficients of powers to Bernstein coefficients on [lower, upper].

    Row i, column m is the mean of the products of m out of i upper and degree - i lower ends: each is at most
    max(|lower|, |upper|)^m in size, and so is the rounding.
    """
    of_upper, of_lower = _exponents(degree)
    powers = np.arange(degree + 1)
    up, low = upper[:, None] ** powers, lower[:, None] ** powers
    # order="C": for arrays of another layout numba would compile the kernel anew
    return np.einsum("ims,nms->nim", polar_weights(degree), up[:, of_upper] * low[:, of_lower], order="C")


@njit(**FUSED)
def _clear_blocks(
    tensor: Any, sizes: Any, mx: Any, my: Any, mz: Any, far: Any, slack: float, mask: Any, layers: Any, rows: Any,
    one: Any, two: Any, room: Any,
) -> None:  # fmt: skip
    """Set to 0 the entries of `mask` (blocks along x, y, z) where the polynomial keeps one sign.

    tensor (c, a, b) coefficients, sizes their absolute values, mx my mz matrices to Bernstein form for the blocks along
    each axis, far (3, blocks, powers) powers of the farthest coordinate in each. layers and rows say where `mask` has
    any entry for bx, and for bx and by. To work in: one, of the tensor's shape, two (c, a b), room (c + 2, a b + c).
    """
    nz, nx, ny = tensor.shape
    three, size_one, size_two = room[nz, : nx * ny], room[:nz], room[nz + 1]
    for bx in range(mask.shape[0]):
        if not layers[bx]:
            continue
        for c in range(nz):
            for b in range(ny):
                size_one[c, b] = 0.0
                for e in range(nx):
                    size_one[c, b] += far[0, bx, e] * sizes[c, e, b]
            for a in range(nx):
                one[c, a] = 0.0
                for e in range(nx):
                    for b in range(ny):
                        one[c, a, b] += mx[bx, a, e] * tensor[c, e, b]
        for by in range(mask.shape[1]):
            if not rows[bx, by]:
                continue
            for c in range(nz):
                size_two[c] = 0.0
                for e in range(ny):
                    size_two[c] += far[1, by, e] * size_one[c, e]
                for a in range(nx):
                    for b in range(ny):
                        total = 0.0
                        for e in range(ny):
                            total += my[by, b, e] * one[c, a, e]
                        two[c, a * ny + b] = total
            for bz in range(mask.shape[2]):
                if mask[bx, by, bz]:
                    size = 0.0
                    for e in range(nz):
                        size += far[2, bz, e] * size_two[e]
                    mask[bx, by, bz] = _meets(two, mz[bz], size * slack, three)


@njit(**FUSED)
def _meets(two: Any, matrix: Any, slack: float, three: Any) -> bool:
    """Whether the Bernstein coefficients matrix @ two do not all have one sign; the first and the last row first."""
    nz = len(matrix)
    below, above = np.int64(0), np.int64(0)  # flags as wide as the numbers, so that the loop vectorises
    for turn in range(nz):
        c = turn - 1 if turn > 1 else (0 if turn == 0 else nz - 1)
        for q in range(len(three)):
            three[q] = matrix[c, 0] * two[0, q]
        for e in range(1, nz):
            factor = matrix[c, e]
            for q in range(len(three)):
                three[q] += factor * two[e, q]
        for q in range(len(three)):
            below |= np.int64(not (three[q] > slack))
            above |= np.int64(not (three[q] < -slack))
        if below and above:
            return True
    return False


@dataclass(frozen=True, eq=False)
class Dense:
    """A polynomial as a full table: tensor (a, b, c), the coefficients of x^(a steps[0]) y^(b steps[1]) z^(c steps[2]).

    `errors`, of the same shape, bound how far the coefficients are off; None means that they are what is meant.
    """

    tensor: FloatArray
    steps: tuple[int, int, int]
    errors: FloatArray | None = None

    def clear(self, lattice: Lattice, level: int, mask: NDArray[np.uint8]) -> None:
        """Set to 0 the entries of `mask`, blocks of 2^level bricks along each axis, where the polynomial keeps one
        sign.
        """
        turned = np.ascontiguousarray(self.tensor.transpose(2, 0, 1))
        degrees = sum(step * (length - 1) for step, length in zip(self.steps, self.tensor.shape, strict=True))
        slack = 16.0 * (degrees + 4) * float(np.finfo(float).eps)
        sizes = np.abs(turned)
        if self.errors is not None:
            sizes += self.errors.transpose(2, 0, 1) / slack
        matrices, far = [], np.zeros((3, max(mask.shape), max(self.tensor.shape)))
        for axis, length in enumerate(self.tensor.shape):
            low, high, reach = _ranges(lattice, axis, 2**level, self.steps[axis])
            matrices.append(to_bernstein(low, high, length - 1))
            far[axis, : len(reach), :length] = reach[:, None] ** np.arange(length)
        nz, nx, ny = turned.shape
        one, two, room = np.empty(turned.shape), np.empty((nz, nx * ny)), np.empty((nz + 2, nx * ny + nz))
        layers, rows = mask.any(axis=(1, 2)), mask.any(axis=2)
        _clear_blocks(turned, sizes, *matrices, far, slack, mask, layers, rows, one, two, room)


def find_bricks(parts: Sequence[Dense], lattice: Lattice) -> NDArray[np.int32]:
    """The bricks (n, 3), in the order of the sweep, where none of the polynomials is known to keep one sign."""
    level = max(max(lattice.bricks) // _COARSE, 1).bit_length() - 1
    mask = lattice.met(2**level).view(np.uint8)
    while True:
        for part in parts:
            part.clear(lattice, level, mask)
        if level == 0 or not mask.any():
            break
        level -= 1
        met = lattice.met(2**level).view(np.uint8)
        x, y, z = met.shape
        mask = met & mask.repeat(2, 0).repeat(2, 1).repeat(2, 2)[:x, :y, :z]
    return to_bricks(mask.view(np.bool_))


def _ranges(lattice: Lattice, axis: int, bricks: int, step: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The ranges of t^step over the blocks along an axis, and the largest |t^step|."""
    edges = lattice.edges(axis, bricks)
    ends = np.sort(np.stack([edges[:-1] ** step, edges[1:] ** step]), axis=0)
    if step % 2 == 0:
        ends[0, (edges[:-1] <= 0) & (edges[1:] >= 0)] = 0.0
    return ends[0], ends[1], np.abs(ends).max(axis=0)
