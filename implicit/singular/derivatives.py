"""Derivatives of f along a singular curve, and the numbers made of them that tell kinds of singularities apart."""

import numpy as np
from flint import arb
from numpy.typing import NDArray

from implicit.singular.form import Form, Monomial

Floats = NDArray[np.float64]
Table = tuple[NDArray[np.int64], Floats]
"""The exponents (n, 3) and coefficients (n,) of a polynomial."""

_PLACES, _TWICE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)), (1, 1, 1, 2, 2, 2)
_ERROR = 1e-12
"""What rounding may change, as a share of the sum of the sizes of all terms."""


class Values:
    """The second derivatives of f in floats, all divided by the power of two that makes their coefficients about 1.

    Undivided, the coefficients of a surface that was turned by floats pass 1e100, and products of minors overflow.
    """

    def __init__(self, form: Form) -> None:
        seconds = [form.hessian[a][b].coefficients() for a, b in _PLACES]
        largest = max((abs(c) for terms in seconds for c in terms.values()), default=arb(0))
        mantissa, exponent = largest.mid().man_exp()
        scale = arb(2) ** -(int(exponent) + int(mantissa).bit_length())
        self.seconds = [_table(terms, scale) for terms in seconds]

    def bend(self, points: Floats) -> tuple[Floats, Floats]:
        """The sum of the principal 2x2 minors of the Hessian at points (n, 3), and the size of errors in it.

        Where the Hessian is degenerate along the curve the sum is the product of its other two eigenvalues: negative
        where two sheets cross, positive where the surface is only the curve, zero at pinch points.
        """
        xx, yy, zz, xy, xz, yz = (_evaluate(t, points) for t in self.seconds)
        minors = xx * yy - xy**2 + xx * zz - xz**2 + yy * zz - yz**2
        size = np.sqrt(xx**2 + yy**2 + zz**2 + 2 * (xy**2 + xz**2 + yz**2))
        error = 1e-14 * sum(_evaluate((e, np.abs(c)), np.abs(points)) for e, c in self.seconds)
        return minors, 100 * error * (size + error)

    def stretch(self, points: Floats) -> tuple[Floats, Floats]:
        """The sum of the squares of the second derivatives at points (n, 3), and the size of errors in it."""
        square = sum(weight * _evaluate(t, points) ** 2 for t, weight in zip(self.seconds, _TWICE, strict=True))
        error = _ERROR * sum(_evaluate((e, np.abs(c)), np.abs(points)) for e, c in self.seconds)
        return np.asarray(square), np.asarray(error**2)

    def cubic(self, points: Floats, tangents: Floats) -> tuple[Floats, Floats]:
        """The third derivative along k, and the size of errors in it: where the Hessian has rank 1, k is its null
        vector across the tangents (n, 3) of a curve.
        """
        xx, yy, zz, xy, xz, yz = (_evaluate(t, points) for t in self.seconds)
        hessian = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
        sizes, vectors = np.linalg.eigh(hessian)
        steep = np.take_along_axis(vectors, np.abs(sizes).argmax(axis=1)[:, None, None], axis=2)[..., 0]
        k = _unit(np.cross(steep, tangents))
        third, size = self._thirds(points)
        return np.einsum("nabc,na,nb,nc->n", third, k, k, k), _ERROR * size

    def triple(self, points: Floats, tangents: Floats) -> tuple[Floats, Floats]:
        """The discriminant of the third derivatives across the tangents (n, 3) of a curve, and the size of errors in
        it: where the Hessian is 0, three sheets, real or complex, that do not touch have one other than 0.
        """
        u = _unit(np.cross(tangents, np.eye(3)[np.abs(tangents).argmin(axis=1)]))
        v = _unit(np.cross(tangents, u))
        third, size = self._thirds(points)
        a, b, c, d = (
            weight * np.einsum("nabc,na,nb,nc->n", third, *ways)
            for weight, ways in zip((1, 3, 3, 1), ((u, u, u), (u, u, v), (u, v, v), (v, v, v)), strict=True)
        )
        number = 18 * a * b * c * d - 4 * b**3 * d + b**2 * c**2 - 4 * a * c**3 - 27 * a**2 * d**2
        largest = np.abs([a, b, c, d]).max(axis=0)
        return number, 400 * _ERROR * size * (largest + _ERROR * size) ** 3

    def _thirds(self, points: Floats) -> tuple[Floats, Floats]:
        """All third derivatives (n, 3, 3, 3), and the sum of the sizes of their terms."""
        result, size = np.zeros((len(points), 3, 3, 3)), np.zeros(len(points))
        for table, (a, b) in zip(self.seconds, _PLACES, strict=True):
            for axis in range(3):
                slope = _derivative(table, axis)
                result[:, a, b, axis] = result[:, b, a, axis] = _evaluate(slope, points)
                size += _evaluate((slope[0], np.abs(slope[1])), np.abs(points))
        return result, size

    def noisy_bend(self, points: Floats, size: float) -> tuple[Floats, Floats]:
        """The same, and errors that include those of the points themselves."""
        minors, noise = self.bend(points)
        step = 1e-6 * size
        moved = [np.abs(self.bend(points + step * unit)[0] - minors) for unit in np.eye(3)]
        return minors, noise + sum(moved) * 2e-11 * size / step


def _table(terms: dict[Monomial, arb], scale: arb) -> Table:
    values = np.array([float((c * scale).mid()) for c in terms.values()])
    return np.array(list(terms), dtype=np.int64).reshape(-1, 3), values


def _derivative(table: Table, axis: int) -> Table:
    exponents, coefficients = table
    kept = exponents[:, axis] > 0
    return exponents[kept] - np.eye(3, dtype=np.int64)[axis], coefficients[kept] * exponents[kept, axis]


def _evaluate(table: Table, points: Floats) -> Floats:
    exponents, coefficients = table
    highest = int(exponents.max(initial=0))
    powers = points[:, :, None] ** np.arange(highest + 1)
    total = np.zeros(len(points))
    for (i, j, k), c in zip(exponents, coefficients, strict=True):
        total += c * powers[:, 0, i] * powers[:, 1, j] * powers[:, 2, k]
    return total


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))
