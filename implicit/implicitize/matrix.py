"""The matrix of moving planes as an implicit form: for patches whose polynomial is too large to write down."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.implicitize.angles import Substitution
from implicit.implicitize.degree import count
from implicit.implicitize.homogeneous import Coordinates, read_coordinates
from implicit.implicitize.modular import reduce_coordinates, split_primes
from implicit.implicitize.planes import moving_planes, plane_system
from implicit.kernels.pencil import pencil_determinants

Floats: TypeAlias = NDArray[np.float64]

_GAP = 1e-9  # singular values below this share of the largest count as zero when sheets are counted


@dataclass(frozen=True, eq=False)
class MatrixForm:
    """M(x, y, z) = x A + y B + z C + D, whose rank drops exactly on the surface.

    Rows belong to Bernstein polynomials of bidegree (2m-1, n-1) on the domain: on the surface their values at (u, v)
    are a left null vector, which gives the parameters back. Columns are moving planes.

    Attributes
    ----------
    planes
        A, B, C, D: (4, 2mn, q) with q = 2mn unless there are base points, then q is larger.
    degree, map_degree
        Of the surface and of its parametrization.
    """

    planes: Floats
    net: Floats
    degree: int
    map_degree: int
    domain: tuple[tuple[float, float], tuple[float, float]]
    substitutions: tuple[Substitution, Substitution]

    def __call__(self, points: ArrayLike) -> Floats:
        """The values det M (...,) at points (..., 3): a constant times f to the power of the map degree.

        Raises ValueError where base points make M wider than high.
        """
        rows, columns = self.planes.shape[1:]
        if rows != columns:
            raise ValueError(f"det M needs a square matrix, base points make it {rows} x {columns}: use contains")
        flat, shape = _flat(points)
        out = np.empty(len(flat))
        pencil_determinants(self._mixed, flat, out)
        return out.reshape(shape)[()]

    def invert(self, points: ArrayLike) -> Floats:
        """The parameters (u, v), (..., 2), of points (..., 3) on the surface; nan where the rank of M does not drop.

        Where sheets cross, the parameters in the domain are taken, or those nearest to it.
        """
        flat, shape = _flat(points)
        s, t = self._variables(flat)
        u, v = (sub.back(values) for sub, values in zip(self.substitutions, (s, t), strict=True))
        return np.stack([u, v], axis=-1).reshape(*shape, 2)

    def contains(self, points: ArrayLike, tolerance: float = 1e-9) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie within a distance of the surface point at their own parameters (...,).

        The whole algebraic surface counts, not only the part over the domain.
        """
        flat, shape = _flat(points)
        s, t = self._variables(flat)
        with np.errstate(all="ignore"):
            gaps = np.linalg.norm(self.evaluate(s, t) - flat, axis=1)
        return np.asarray(gaps <= tolerance).reshape(shape)[()]

    def evaluate(self, s: Floats, t: Floats) -> Floats:
        """The points (n, 3) of the surface at rational variables s and t."""
        a, b = _unit(s, self.domain[0]), _unit(t, self.domain[1])
        m, n = self.net.shape[1] - 1, self.net.shape[2] - 1
        value = np.einsum("kij,in,jn->kn", self.net, _bernstein(a, m), _bernstein(b, n))
        with np.errstate(all="ignore"):
            return (value[:3] / value[3]).T

    @cached_property
    def _mixed(self) -> Floats:
        """The planes between two random rotations, which leave det M alone and make small pivots rare."""
        random = np.random.default_rng(13)
        left, right = (np.linalg.qr(random.standard_normal(self.planes.shape[1:]))[0] for _ in range(2))
        left[0] *= np.sign(np.linalg.det(left) * np.linalg.det(right))
        return np.ascontiguousarray(left @ self.planes @ right)

    @cached_property
    def _index(self) -> tuple[int, int]:
        return 2 * (self.net.shape[1] - 1) - 1, self.net.shape[2] - 2

    def _variables(self, points: Floats) -> tuple[Floats, Floats]:
        """The rational variables (n,) of points: from the null vector, or from the eigenvectors of several."""
        s, t = np.full(len(points), np.nan), np.full(len(points), np.nan)
        for start in range(0, len(points), 4096):
            part = points[start : start + 4096]
            matrices = np.einsum("nk,kij->nij", np.column_stack([part, np.ones(len(part))]), self.planes)
            left, values, _ = np.linalg.svd(matrices, full_matrices=False)
            null = (values <= _GAP * values[:, :1]).sum(axis=1)
            s[start : start + 4096], t[start : start + 4096] = self._ratios(left[:, :, -1], part)
            for k in np.flatnonzero(null > 1):
                s[start + k], t[start + k] = self._separate(left[k, :, -null[k] :], part[k])
        return s, t

    def _ratios(self, vectors: Floats, points: Floats) -> tuple[Floats, Floats]:
        """The variables from null vectors (n, rows), the Bernstein polynomials at (s, t), of points (n, 3)."""
        s = _ratio(*self._neighbours(vectors, 0), self.domain[0])
        if self.net.shape[2] > 2:
            return s, _ratio(*self._neighbours(vectors, 1), self.domain[1])
        # Degree 1 in t: the planes say nothing, but for given s the gap p W - (X, Y, Z) is linear in t.
        ends = np.einsum("kij,in->jkn", self.net, _bernstein(_unit(s, self.domain[0]), self.net.shape[1] - 1))
        gap = [(points.T * end[3] - end[:3]).T for end in ends]
        return s, _ratio(gap[0], -gap[1], self.domain[1])

    def _neighbours(self, vectors: Floats, axis: int) -> tuple[Floats, Floats]:
        """Entries i + 1 and i along an axis, without their binomials: in the proportion a to 1 - a."""
        degrees = self._index
        grid = vectors.reshape(len(vectors), degrees[0] + 1, degrees[1] + 1)
        weights = np.array([comb(degrees[axis], i) for i in range(degrees[axis] + 1)], dtype=float)
        grid = np.moveaxis(grid, axis + 1, 1) / weights[:, None]
        return grid[:, 1:].reshape(len(vectors), -1), grid[:, :-1].reshape(len(vectors), -1)

    def _separate(self, null: Floats, point: Floats) -> tuple[float, float]:
        """The variables of one of several sheets with null vectors (rows, k).

        Multiplication by a on the null space has the candidates for a as eigenvalues; b is then a common root.
        """
        raised, lowered = (part.T for part in self._neighbours(null.T, 0))
        eigenvalues = np.linalg.eigvals(np.linalg.lstsq(raised + lowered, raised, rcond=None)[0]).real
        pairs = [(a, b) for a in eigenvalues for b in self._roots(a, point)]
        if not pairs:
            return np.nan, np.nan
        s, t = (
            low + (high - low) * np.array(w)
            for w, (low, high) in zip(zip(*pairs, strict=True), self.domain, strict=True)
        )
        with np.errstate(all="ignore"):
            gaps = np.nan_to_num(np.linalg.norm(self.evaluate(s, t) - point, axis=1), nan=np.inf)
        outside = np.abs(np.array(pairs) - 0.5).max(axis=1)
        good = gaps <= 1e3 * gaps.min() + 1e-7
        best = np.flatnonzero(good)[np.argmin(outside[good])]
        return float(s[best]), float(t[best])

    def _roots(self, a: float, point: Floats) -> list[float]:
        """Real parts of the roots b of p W - (X, Y, Z) at a, of all three coordinates."""
        m, n = self.net.shape[1] - 1, self.net.shape[2] - 1
        curve = np.einsum("kij,i->kj", self.net, _bernstein(np.array([a]), m)[:, 0])
        to_powers = np.linalg.inv(_to_bernstein(n, 0.0, 1.0))
        roots = [np.roots((to_powers @ gap)[::-1]) for gap in point[:, None] * curve[3] - curve[:3]]
        return [float(b.real) for b in np.concatenate(roots) if abs(b.imag) < 1e-5 * (1 + abs(b))]


def matrix_form(
    coordinates: Sequence[Any],
    parameters: Sequence[Any],
    domain: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 1.0), (0.0, 1.0)),
    *,
    rationalize: float | None = None,
) -> MatrixForm:
    """The matrix of moving planes of a rational parametrization; no polynomial is expanded.

    `domain` is where parameters are expected, for accuracy; the coordinates are as for `implicitize`.

    Raises
    ------
    NotASurfaceError, TranscendentalError, ValueError
        As `implicitize`.

    Examples
    --------
    >>> from sympy import symbols
    >>> u, v = symbols("u v", real=True)
    >>> form = matrix_form((u, v, u * v + u**2 * v**2), (u, v))
    >>> form.invert((0.5, 0.25, 0.140625)).round(9), bool(form.contains((0.5, 0.25, 0.14)))
    (array([0.5 , 0.25]), False)
    """
    return _build(read_coordinates(coordinates, parameters, rationalize), domain)


def _build(coordinates: Coordinates, domain: tuple[tuple[float, float], tuple[float, float]]) -> MatrixForm:
    counted = count(coordinates)
    ranges = []
    for substitution, (low, high) in zip(coordinates.substitutions, domain, strict=True):
        a, b = substitution.forward(np.array([low, high], dtype=float))
        ranges.append((float(min(a, b)), float(max(a, b))))
    first, second = ranges
    net = _bernstein_net(coordinates, (first, second))
    p, roots = next(split_primes(coordinates.field.modulus))
    planes = moving_planes(reduce_coordinates(coordinates, p, roots[0]), p).shape[2]
    rows = 2 * (net.shape[1] - 1) * (net.shape[2] - 1)
    scale = np.abs(net).max(axis=(1, 2))
    kernel = np.linalg.svd(_bernstein_system(net / scale[:, None, None]))[2][-planes:]
    matrices = kernel.reshape(planes, 4, rows).transpose(1, 2, 0) / scale[:, None, None]
    return MatrixForm(
        np.ascontiguousarray(matrices),
        net,
        counted.degree,
        counted.map_degree,
        (first, second),
        coordinates.substitutions,
    )


def _bernstein_net(coordinates: Coordinates, domain: tuple[tuple[float, float], tuple[float, float]]) -> Floats:
    """The homogeneous coordinates in Bernstein polynomials on the domain, (4, m+1, n+1)."""
    m, n = coordinates.bidegree
    net = np.zeros((4, m + 1, n + 1))
    for row, terms in zip(net, coordinates.terms, strict=True):
        for (i, j), element in terms.items():
            row[i, j] = coordinates.field.value(element)
    left, right = _to_bernstein(m, *domain[0]), _to_bernstein(n, *domain[1])
    return np.asarray(np.einsum("ai,kij,bj->kab", left, net, right))


def _to_bernstein(degree: int, low: float, high: float) -> Floats:
    """The matrix from powers of s to Bernstein coefficients on [low, high], by blossoms of s^i."""
    out = np.zeros((degree + 1, degree + 1))
    for i in range(degree + 1):
        for a in range(degree + 1):
            # the blossom of s^i at a times high and degree - a times low
            terms = (comb(a, k) * comb(degree - a, i - k) * high**k * low ** (i - k) for k in range(min(a, i) + 1))
            out[a, i] = sum(terms) / comb(degree, i)
    return out


def _bernstein_system(net: Floats) -> Floats:
    """The linear system for moving planes in Bernstein polynomials: as in powers, with binomials divided out."""
    m, n = net.shape[1] - 1, net.shape[2] - 1
    inner = net * _binomials(m)[:, None] * _binomials(n)
    system = plane_system(inner).reshape(3 * m, 2 * n, 4, 2 * m, n)
    planes = system * _binomials(2 * m - 1)[:, None] * _binomials(n - 1)
    whole = planes / _binomials(3 * m - 1)[:, None, None, None, None] / _binomials(2 * n - 1)[:, None, None, None]
    return whole.reshape(6 * m * n, 8 * m * n)


def _binomials(degree: int) -> Floats:
    return np.array([comb(degree, i) for i in range(degree + 1)], dtype=float)


def _bernstein(a: Floats, degree: int) -> Floats:
    i = np.arange(degree + 1)[:, None]
    return np.asarray(_binomials(degree)[:, None] * a**i * (1 - a) ** (degree - i))


def _ratio(raised: Floats, lowered: Floats, domain: tuple[float, float]) -> Floats:
    """The variable (n,) from vectors in the proportion a to 1 - a, by least squares."""
    whole = raised + lowered
    with np.errstate(all="ignore"):
        a = (whole * raised).sum(axis=1) / (whole * whole).sum(axis=1)
    return np.asarray(domain[0] + (domain[1] - domain[0]) * a)


def _unit(values: Floats, domain: tuple[float, float]) -> Floats:
    return (values - domain[0]) / (domain[1] - domain[0])


def _flat(points: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
    array = np.asarray(points, dtype=float)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points must have shape (..., 3), got {array.shape}")
    return np.ascontiguousarray(array.reshape(-1, 3)), array.shape[:-1]
