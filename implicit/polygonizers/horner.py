"""Samples and gradients of a polynomial from its coefficients, in loops of 64 that vectorise."""

from dataclasses import dataclass
from functools import cached_property
from math import gcd
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField
from implicit.polygonizers.blocks import find_bricks
from implicit.polygonizers.lattice import Lattice

FloatArray = NDArray[np.float64]
BrickArray = NDArray[np.int32]

LANES = 64


@njit(cache=True, nogil=True, fastmath={"contract"})
def fill_bricks(tensor: Any, powers: Any, lines: Any, bricks: Any, samples: Any) -> None:
    """Write the samples (n, 512) of bricks (n, 3): Horner's rule in z for 8 samples, in y for 64, in x for 512.

    powers (3, planes) hold t^step of every plane; lines (bricks along z, nx, ny, 8) the sums over powers of z.
    """
    nx, ny = tensor.shape[0], tensor.shape[1]
    plane = np.empty((nx, LANES))
    for index in range(len(bricks)):
        bx, by, bz = bricks[index]
        line = lines[bz]
        for a in range(nx):
            row = plane[a]
            for j in range(8):
                for k in range(8):
                    row[8 * j + k] = line[a, ny - 1, k]
            for b in range(ny - 2, -1, -1):
                for j in range(8):
                    v = powers[1, 7 * by + j]
                    for k in range(8):
                        row[8 * j + k] = row[8 * j + k] * v + line[a, b, k]
        for i in range(8):
            u = powers[0, 7 * bx + i]
            out = samples[index, LANES * i : LANES * i + LANES]
            for k in range(LANES):
                out[k] = plane[nx - 1, k]
            for a in range(nx - 2, -1, -1):
                row = plane[a]
                for k in range(LANES):
                    out[k] = out[k] * u + row[k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _step(high: Any, low: Any, by: Any, add: Any) -> None:
    """One step of Horner's rule for a value and a derivative: high = high by + low, low = low by + add."""
    for k in range(LANES):
        high[k] = high[k] * by[k] + low[k]
        low[k] = low[k] * by[k] + add[k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def differentiate(tensor: Any, lengths: Any, steps: Any, points: Any, values: Any, gradients: Any) -> None:
    """Values (n,) and gradients (3, n) at points (3, n), by Horner's rule with derivatives in z, y and x.

    lengths (a, b): the number of powers of z up to the last coefficient that is not 0.
    """
    nx, ny = lengths.shape
    t, slope = np.empty((3, LANES)), np.empty((3, LANES))
    h, hz = np.empty(LANES), np.empty(LANES)
    g, gy, gz = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    f, fx, fy, fz = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for base in range(0, points.shape[1], LANES):
        n = min(LANES, points.shape[1] - base)
        for axis in range(3):
            for k in range(LANES):
                t[axis, k] = points[axis, base + min(k, n - 1)]
                slope[axis, k] = 1.0
            for _ in range(steps[axis] - 1):
                for k in range(LANES):
                    slope[axis, k] *= t[axis, k]
            for k in range(LANES):
                t[axis, k] *= slope[axis, k]
                slope[axis, k] *= steps[axis]
        u, v, w = t[0], t[1], t[2]
        f[:], fx[:], fy[:], fz[:] = 0.0, 0.0, 0.0, 0.0
        for a in range(nx - 1, -1, -1):
            g[:], gy[:], gz[:] = 0.0, 0.0, 0.0
            for b in range(ny - 1, -1, -1):
                length = lengths[a, b]
                last = tensor[a, b, length - 1] if length else 0.0
                for k in range(LANES):
                    h[k] = last
                    hz[k] = 0.0
                for c in range(length - 2, -1, -1):
                    coefficient = tensor[a, b, c]
                    for k in range(LANES):
                        hz[k] = hz[k] * w[k] + h[k]
                        h[k] = h[k] * w[k] + coefficient
                for k in range(LANES):
                    gy[k] = gy[k] * v[k] + g[k]
                    g[k] = g[k] * v[k] + h[k]
                    gz[k] = gz[k] * v[k] + hz[k]
            for k in range(LANES):
                fx[k] = fx[k] * u[k] + f[k]
                f[k] = f[k] * u[k] + g[k]
                fy[k] = fy[k] * u[k] + gy[k]
                fz[k] = fz[k] * u[k] + gz[k]
        for k in range(n):
            values[base + k] = f[k]
            gradients[0, base + k] = fx[k] * slope[0, k]
            gradients[1, base + k] = fy[k] * slope[1, k]
            gradients[2, base + k] = fz[k] * slope[2, k]


@dataclass(frozen=True, eq=False)
class PolynomialSampler:
    """Samples a polynomial on the bricks where its Bernstein coefficients do not have one sign.

    tensor (a, b, c): coefficients of x^(a steps[0]) y^(b steps[1]) z^(c steps[2]); the steps are the greatest common
    divisors of the exponents, so that a polynomial in squares has half the degree.
    """

    tensor: FloatArray
    steps: tuple[int, int, int]
    lattice: Lattice
    bricks: BrickArray

    @classmethod
    def over(cls, field: PolynomialField, lattice: Lattice) -> "PolynomialSampler":
        """The sampler of a polynomial over a lattice."""
        exponents = field.exponents
        x, y, z = (max(gcd(*(int(e) for e in exponents[:, axis])), 1) for axis in range(3))
        places = exponents // np.array([x, y, z])
        tensor = np.zeros(tuple(places.max(axis=0, initial=0) + 1))
        tensor[tuple(places.T)] = field.coefficients
        return cls(tensor, (x, y, z), lattice, find_bricks(tensor, (x, y, z), lattice))

    @cached_property
    def _powers(self) -> FloatArray:
        return np.ascontiguousarray(self.lattice.padded ** np.array(self.steps)[:, None])

    @cached_property
    def _lines(self) -> FloatArray:
        """(bricks along z, nx, ny, 8) the polynomials in z at the planes of each brick, by Horner's rule."""
        planes = self._powers[2][7 * np.arange(self.lattice.bricks[2])[:, None] + np.arange(8)]
        lines = np.zeros((len(planes), *self.tensor.shape[:2], 8))
        for c in range(self.tensor.shape[2] - 1, -1, -1):
            lines *= planes[:, None, None, :]
            lines += self.tensor[:, :, c, None]
        return lines

    @cached_property
    def _lengths(self) -> NDArray[np.int64]:
        nz = self.tensor.shape[2]
        last = np.argmax(self.tensor[:, :, ::-1] != 0, axis=2)
        return np.where((self.tensor != 0).any(axis=2), nz - last, 0).astype(np.int64)

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""
        fill_bricks(self.tensor, self._powers, self._lines, self.bricks[first:last], samples)

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        return self.anywhere(points)

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        values, gradients = np.empty(points.shape[1]), np.empty(points.shape)
        differentiate(self.tensor, self._lengths, self.steps, points, values, gradients)
        return values, gradients
