"""Samples and gradients of a polynomial from its coefficients, in loops of 64 that vectorise."""

from dataclasses import dataclass
from functools import cached_property
from math import gcd
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.evaluate import PolynomialField
from implicit.kernels.elementary import FUSED
from implicit.polygonizers.blocks import Dense, find_bricks
from implicit.polygonizers.lattice import Lattice

FloatArray = NDArray[np.float64]
BrickArray = NDArray[np.int32]

LANES = 64
POINTS = 128


@njit(**FUSED, inline="always")
def _sum_powers(rows: Any, e: Any, t: Any, out: Any) -> None:
    """Set out to the sum of rows[0] to rows[e] times powers of t, up to four at a time; all are 64 long."""
    if e == 0:
        a = rows[0]
        for k in range(LANES):
            out[k] = a[k]
    elif e == 1:
        b, a = rows[1], rows[0]
        for k in range(LANES):
            out[k] = b[k] * t[k] + a[k]
    elif e == 2:
        c, b, a = rows[2], rows[1], rows[0]
        for k in range(LANES):
            out[k] = (c[k] * t[k] + b[k]) * t[k] + a[k]
    elif e == 3:
        d, c, b, a = rows[3], rows[2], rows[1], rows[0]
        for k in range(LANES):
            out[k] = ((d[k] * t[k] + c[k]) * t[k] + b[k]) * t[k] + a[k]
    else:
        g, d, c, b, a = rows[e], rows[e - 1], rows[e - 2], rows[e - 3], rows[e - 4]
        for k in range(LANES):
            out[k] = (((g[k] * t[k] + d[k]) * t[k] + c[k]) * t[k] + b[k]) * t[k] + a[k]
        for f in range(e - 5, -1, -1):
            a = rows[f]
            for k in range(LANES):
                out[k] = out[k] * t[k] + a[k]


@njit(**FUSED)
def fill_bricks(powers: Any, lines: Any, bricks: Any, samples: Any, plane: Any, t: Any) -> None:
    """Write the samples (n, 512) of bricks (n, 3): Horner's rule in z for 8 samples, in y for 64, in x for 512.

    powers (3, planes) hold t^step of every plane; lines (bricks along z, nx, ny, 64) the sums over powers of z, for
    all y alike. To work in: plane (nx, 64), t (64,).
    """
    nx, ny = lines.shape[1], lines.shape[2]
    for index in range(len(bricks)):
        bx, by, bz = bricks[index, 0], bricks[index, 1], bricks[index, 2]
        for j in range(8):
            v = powers[1, 7 * by + j]
            for k in range(8):
                t[8 * j + k] = v
        for turn in range(nx + 8):  # powers of y, then of x: what is written once is compiled once
            rows, e, i = plane, nx - 1, turn - nx
            if turn < nx:
                rows, e, out = lines[bz, turn], ny - 1, plane[turn]
            else:
                out = samples[index, LANES * i : LANES * i + LANES]
                u = powers[0, 7 * bx + i]
                for k in range(LANES):
                    t[k] = u
            _sum_powers(rows, e, t, out)


@njit(**FUSED)
def _fill_powers(source: Any, step: int, powers: Any, slopes: Any) -> None:
    """Set powers to source^step, and slopes to the derivatives step source^(step - 1)."""
    for k in range(len(source)):
        powers[k] = source[k]
    for k in range(POINTS):
        slopes[k] = 1.0
    for _ in range(step - 1):
        for k in range(POINTS):
            slopes[k] *= powers[k]
    for k in range(POINTS):
        powers[k] *= slopes[k]
        slopes[k] *= step


@njit(**FUSED)
def _sum_line(row: Any, length: int, w: Any, h: Any, hz: Any) -> None:
    """Set h to the sum of row[c] w^c, of which there are three or more, and hz to its derivative."""
    c0, c1, c2 = row[length - 3], row[length - 2], row[length - 1]
    for k in range(POINTS):
        h[k] = (c2 * w[k] + c1) * w[k] + c0
        hz[k] = 2.0 * c2 * w[k] + c1
    for c in range(length - 4, -1, -1):
        c0 = row[c]
        for k in range(POINTS):
            hz[k] = hz[k] * w[k] + h[k]
            h[k] = h[k] * w[k] + c0


@njit(**FUSED)
def differentiate(tensor: Any, lengths: Any, steps: Any, points: Any, values: Any, gradients: Any, room: Any) -> None:
    """Values (n,) and gradients (3, n) at points (3, n), by Horner's rule with derivatives in z, y and x.

    lengths (a, b): the number of powers of z up to the last coefficient that is not 0. room (15, POINTS).
    """
    nx, ny = lengths.shape
    t, slope, h, hz, g, gy, gz = room[:3], room[3:6], room[6], room[7], room[8], room[9], room[10]
    f, fx, fy, fz = room[11], room[12], room[13], room[14]
    for base in range(0, points.shape[1], POINTS):
        n = points.shape[1] - base
        n = n if n < POINTS else POINTS
        for axis in range(3):
            _fill_powers(points[axis, base : base + n], steps[axis], t[axis], slope[axis])
        u, v, w = t[0], t[1], t[2]
        for k in range(POINTS):
            f[k] = fx[k] = fy[k] = fz[k] = 0.0
        for a in range(nx - 1, -1, -1):
            for k in range(POINTS):
                g[k] = gy[k] = gz[k] = 0.0
            for b in range(ny - 1, -1, -1):
                length, row = lengths[a, b], tensor[a, b]
                if length == 0:
                    for k in range(POINTS):
                        gy[k] = gy[k] * v[k] + g[k]
                        g[k] = g[k] * v[k]
                        gz[k] = gz[k] * v[k]
                elif length == 1:
                    c0 = row[0]
                    for k in range(POINTS):
                        gy[k] = gy[k] * v[k] + g[k]
                        g[k] = g[k] * v[k] + c0
                        gz[k] = gz[k] * v[k]
                elif length == 2:
                    c0, c1 = row[0], row[1]
                    for k in range(POINTS):
                        gy[k] = gy[k] * v[k] + g[k]
                        g[k] = g[k] * v[k] + (c1 * w[k] + c0)
                        gz[k] = gz[k] * v[k] + c1
                else:
                    _sum_line(row, length, w, h, hz)
                    for k in range(POINTS):
                        gy[k] = gy[k] * v[k] + g[k]
                        g[k] = g[k] * v[k] + h[k]
                        gz[k] = gz[k] * v[k] + hz[k]
            for k in range(POINTS):
                fx[k] = fx[k] * u[k] + f[k]
                f[k] = f[k] * u[k] + g[k]
                fy[k] = fy[k] * u[k] + gy[k]
                fz[k] = fz[k] * u[k] + gz[k]
        for k in range(n):
            values[base + k] = f[k]
        for axis in range(3):
            out = gradients[axis, base : base + n]
            for k in range(n):
                out[k] = room[12 + axis, k] * slope[axis, k]


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
    def over(cls, field: PolynomialField, lattice: Lattice, bricks: BrickArray | None = None) -> "PolynomialSampler":
        """The sampler of a polynomial over a lattice, of the given bricks or all that may be crossed."""
        exponents = field.exponents
        x, y, z = (max(gcd(*(int(e) for e in exponents[:, axis])), 1) for axis in range(3))
        places = exponents // np.array([x, y, z])
        tensor = np.zeros(tuple(places.max(axis=0, initial=0) + 1))
        tensor[tuple(places.T)] = field.coefficients
        if bricks is None:
            bricks = find_bricks([Dense(tensor, (x, y, z))], lattice)
        return cls(tensor, (x, y, z), lattice, bricks)

    @cached_property
    def _powers(self) -> FloatArray:
        return np.ascontiguousarray(self.lattice.padded ** np.array(self.steps)[:, None])

    @cached_property
    def _lines(self) -> FloatArray:
        """(bricks along z, nx, ny, 64) the polynomials in z at the planes of each brick, by Horner's rule."""
        planes = self._powers[2][7 * np.arange(self.lattice.bricks[2])[:, None] + np.arange(8)]
        lines = np.zeros((len(planes), *self.tensor.shape[:2], 8))
        for c in range(self.tensor.shape[2] - 1, -1, -1):
            lines *= planes[:, None, None, :]
            lines += self.tensor[:, :, c, None]
        return np.tile(lines, 8)

    @cached_property
    def _lengths(self) -> NDArray[np.int64]:
        nz = self.tensor.shape[2]
        last = np.argmax(self.tensor[:, :, ::-1] != 0, axis=2)
        return np.where((self.tensor != 0).any(axis=2), nz - last, 0).astype(np.int64)

    def fill(self, first: int, last: int, samples: FloatArray) -> None:
        """Write f at the sample points of bricks `first` to `last` into samples (last - first, 512)."""
        self.sample(self.bricks[first:last], samples)

    def sample(self, bricks: BrickArray, samples: FloatArray) -> None:
        """Write f at the sample points of any bricks (n, 3) into samples (n, 512)."""
        room = np.empty((self.tensor.shape[0] + 1, LANES))
        fill_bricks(self._powers, self._lines, bricks, samples, room[1:], room[0])

    def near(self, points: FloatArray, first: int, last: int, starts: Any) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        return self.anywhere(points)

    def anywhere(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n,) and gradients (3, n) at points (3, n)."""
        values, gradients = np.empty(points.shape[1]), np.empty(points.shape)
        room, points = np.zeros((15, POINTS)), np.ascontiguousarray(points)
        differentiate(self.tensor, self._lengths, self.steps, points, values, gradients, room)
        return values, gradients
