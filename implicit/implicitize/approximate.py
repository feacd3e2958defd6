"""A polynomial of given degree that nearly vanishes on a patch, and how far off it is.

The singular vector of the smallest singular value of the matrix of all Chebyshev products of bounded total degree at
Chebyshev points of the patch (T. Dokken 2001, Approximate implicitization).
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.spatial import KDTree

from implicit.algebra.polynomial import Polynomial
from implicit.errors import NotASurfaceError
from implicit.implicitize.homogeneous import all_monomials, to_expressions, to_symbols

Floats: TypeAlias = NDArray[np.float64]
Domain: TypeAlias = tuple[tuple[float, float], tuple[float, float]]

_SAMPLES = 40  # Chebyshev points along each parameter
_TESTS = 4000  # random points where the distance is measured


def approximate(
    coordinates: Sequence[Any], parameters: Sequence[Any], degree: int, domain: Domain
) -> tuple[Polynomial, float]:
    """The polynomial, with f > 0 on the side of p_u x p_v, and the largest distance from f = 0 that was measured."""
    if degree < 1 or degree != int(degree):
        raise ValueError(f"degree must be a whole number from 1, got {degree!r}")
    expressions = to_expressions(coordinates)
    at = _sampler(expressions, to_symbols(parameters))
    nodes = (1 - np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)) / 2
    s, t = (grid.ravel() for grid in np.meshgrid(nodes, nodes, indexing="ij"))
    points = at(*_spread(s, t, domain))
    center, scale = _frame(points)
    local = (points - center) / scale
    if np.linalg.svd(local - local.mean(axis=0))[1][1] < 1e-12:
        raise NotASurfaceError("all samples lie on one line or in one point")
    monomials = all_monomials(degree)
    coefficients = np.linalg.svd(_chebyshev(local, monomials, degree), full_matrices=False)[2][-1]
    polynomial = _in_space(coefficients, monomials, center, scale)
    random = np.random.default_rng(17)
    s, t = random.random((2, _TESTS))
    tests = at(*_spread(s, t, domain))
    ahead = at(*_spread(s + 1e-6 * (1 - 2 * s), t, domain)), at(*_spread(s, t + 1e-6 * (1 - 2 * t), domain))
    normals = np.cross(*((end - tests) * np.sign(1 - 2 * w)[:, None] for end, w in zip(ahead, (s, t), strict=True)))
    distances, gradients = measure(polynomial, center, scale, tests, normals)
    if np.nansum(np.sign((gradients * normals).sum(axis=1))) < 0:
        polynomial = -polynomial
    return polynomial, float(distances.max())


def _sampler(expressions: list[sympy.Expr], parameters: Sequence[Any]) -> Callable[[Floats, Floats], Floats]:
    function = sympy.lambdify(list(parameters), expressions, "numpy")

    def at(u: Floats, v: Floats) -> Floats:
        with np.errstate(all="ignore"):
            points = np.stack([np.broadcast_to(np.asarray(c, dtype=float), u.shape) for c in function(u, v)], axis=1)
        if not np.isfinite(points).all():
            raise ValueError("the coordinates are not finite on the whole domain")
        return points

    return at


def _spread(s: Floats, t: Floats, domain: Domain) -> tuple[Floats, Floats]:
    (u0, u1), (v0, v1) = domain
    return u0 + (u1 - u0) * s, v0 + (v1 - v0) * t


def _frame(points: Floats) -> tuple[Floats, float]:
    """A short binary number for the middle, and a power of two that brings the points into [-1, 1]."""
    low, high = points.min(axis=0), points.max(axis=0)
    radius = float((high - low).max() / 2)
    if radius == 0:
        raise NotASurfaceError("all samples are one point")
    scale = 2.0 ** np.ceil(np.log2(radius))
    return np.round((low + high) / 2 / scale * 256) / 256 * scale, float(scale)


def _chebyshev(points: Floats, monomials: list[tuple[int, int, int]], degree: int) -> Floats:
    tables = [np.polynomial.chebyshev.chebvander(points[:, k], degree) for k in range(3)]
    i, j, k = np.array(monomials).T
    return np.asarray(tables[0][:, i] * tables[1][:, j] * tables[2][:, k])


def _in_space(coefficients: Floats, monomials: list[tuple[int, int, int]], center: Floats, scale: float) -> Polynomial:
    """The combination of Chebyshev products as a polynomial in x, y, z, exactly."""
    degree = max(map(sum, monomials))
    powers = [np.rint(np.polynomial.chebyshev.cheb2poly([0] * k + [1])).astype(int).tolist() for k in range(degree + 1)]
    total: dict[tuple[int, int, int], Fraction] = {}
    for c, (i, j, k) in zip(coefficients.tolist(), monomials, strict=True):
        for a, p in enumerate(powers[i]):
            for b, q in enumerate(powers[j]):
                for e, r in enumerate(powers[k]):
                    if p * q * r:
                        total[a, b, e] = total.get((a, b, e), Fraction(0)) + Fraction(c) * (p * q * r)
    unscaled = {m: c / Fraction(scale) ** sum(m) for m, c in total.items() if c}
    return Polynomial.from_terms(unscaled).shifted([-Fraction(c) for c in center.tolist()])


def measure(
    polynomial: Polynomial, center: Floats, scale: float, points: Floats, normals: Floats
) -> tuple[Floats, Floats]:
    """Distances (n,) from points to points found on f = 0, and the gradients (n, 3).

    Newton steps along the gradient; where they wander off, the nearest change of sign along the gradient or the normal;
    the nearest of all points of f = 0 that were found, if that is nearer. Infinite if there is none.
    """
    local = polynomial.shifted([Fraction(c) for c in center.tolist()])
    exponents, c = local.exponents, local.coefficients * scale ** local.exponents.sum(axis=1)
    start = (points - center) / scale
    value, first = _value(start, exponents, c)
    guess = np.abs(value) / np.maximum(np.linalg.norm(first, axis=1), 1e-300)
    feet = start.copy()
    for _ in range(6):
        value, gradient = _value(feet, exponents, c)
        square = np.maximum((gradient * gradient).sum(axis=1), 1e-300)
        feet = np.clip(feet - (value / square)[:, None] * gradient, -3, 3)
    value, gradient = _value(feet, exponents, c)
    distances = np.linalg.norm(feet - start, axis=1)
    slack = np.abs(value) / np.maximum(np.linalg.norm(gradient, axis=1), 1e-300)
    lost = np.flatnonzero(~((distances <= 3 * guess + 1e-14) & (slack <= 1e-3 * distances + 1e-14)))
    distances[lost] = np.inf
    for direction in (first[lost], -first[lost], normals[lost], -normals[lost]):
        unit = direction / np.maximum(np.linalg.norm(direction, axis=1), 1e-300)[:, None]
        reached = _first_change(start[lost], unit, exponents, c)
        nearer = reached < distances[lost]
        distances[lost[nearer]] = reached[nearer]
        feet[lost[nearer]] = (start[lost] + reached[:, None] * unit)[nearer]
    known = np.isfinite(distances)
    if known.any():
        distances = np.minimum(distances, KDTree(feet[known]).query(start)[0])
    return distances * scale, first


def _first_change(start: Floats, unit: Floats, exponents: NDArray[np.int64], c: Floats) -> Floats:
    """How far along a direction f changes its sign, by growing steps and then halving; inf if nowhere."""
    steps = np.concatenate([[0.0], 1.25 ** np.arange(-140.0, 4.0)])
    sign = np.sign(_value(start, exponents, c)[0])
    low, high = np.zeros(len(start)), np.full(len(start), np.inf)
    open_ = np.arange(len(start))
    for before, step in pairwise(steps.tolist()):
        changed = np.sign(_value(start[open_] + step * unit[open_], exponents, c)[0]) != sign[open_]
        low[open_[changed]], high[open_[changed]] = before, step
        open_ = open_[~changed]
    found = np.isfinite(high)
    for _ in range(12):
        middle = (low[found] + high[found]) / 2
        same = np.sign(_value(start[found] + middle[:, None] * unit[found], exponents, c)[0]) == sign[found]
        low[found], high[found] = np.where(same, middle, low[found]), np.where(same, high[found], middle)
    return high


def _value(points: Floats, exponents: NDArray[np.int64], c: Floats) -> tuple[Floats, Floats]:
    tables = [np.polynomial.polynomial.polyvander(points[:, k], int(exponents.max())) for k in range(3)]
    rows = [table[:, e] for table, e in zip(tables, exponents.T, strict=True)]
    slopes = [table[:, np.maximum(e - 1, 0)] * e for table, e in zip(tables, exponents.T, strict=True)]
    value = (rows[0] * rows[1] * rows[2]) @ c
    by_axis = [
        (slopes[0] * rows[1] * rows[2]) @ c,
        (rows[0] * slopes[1] * rows[2]) @ c,
        (rows[0] * rows[1] * slopes[2]) @ c,
    ]
    return value, np.stack(by_axis, axis=1)


def default_domain(coordinates: Sequence[Any], parameters: Sequence[Any]) -> Domain:
    """From 0 to 1, or one turn where a parameter occurs in sines and cosines."""
    ranges = []
    expressions = to_expressions(coordinates)
    for name in to_symbols(parameters):
        waves = [f for e in expressions for f in e.atoms(sympy.sin, sympy.cos, sympy.tan) if f.has(name)]
        ranges.append((0.0, float(2 * sympy.pi)) if waves else (0.0, 1.0))
    return ranges[0], ranges[1]
