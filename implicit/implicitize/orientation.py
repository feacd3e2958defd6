"""Which sign of f to take: positive far away where that decides, else along the normal p_u x p_v."""

import numpy as np
from numpy.typing import NDArray

from implicit.algebra.polynomial import Polynomial
from implicit.implicitize.homogeneous import Coordinates

_DIRECTIONS = 64
_SAMPLES = 48


def outward_sign(polynomial: Polynomial, coordinates: Coordinates) -> int:
    """+1 or -1, so that the sign times f is positive outside.

    The terms of highest degree decide if they have one sign in all directions. Otherwise the gradient is made to agree
    with p_u x p_v at most of some fixed parameters, and the first coefficient is made positive if that is a tie.
    """
    e, c = polynomial.exponents, polynomial.coefficients
    top = e.sum(axis=1) == polynomial.degree
    far = _monomials(_directions(), e[top]) @ c[top]
    if far.min() > -1e-9 * abs(far).max():
        return 1
    if far.max() < 1e-9 * abs(far).max():
        return -1
    points, normals = _samples(coordinates)
    with np.errstate(all="ignore"):
        agreement = np.sign(np.sum(_gradients(points, e, c) * normals, axis=1))
    vote = float(np.nansum(agreement))
    return int(np.sign(vote)) if abs(vote) > 0.2 * len(points) else int(np.sign(c[np.flatnonzero(top)[-1]]))


def _directions() -> NDArray[np.float64]:
    """Points spread over the unit sphere on a spiral."""
    k = np.arange(_DIRECTIONS) + 0.5
    height, angle = 1 - 2 * k / _DIRECTIONS, k * np.pi * (1 + 5**0.5)
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def _monomials(points: NDArray[np.float64], exponents: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.prod(points[:, None, :] ** np.maximum(exponents, 0), axis=2)


def _gradients(points: NDArray[np.float64], e: NDArray[np.int64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([_monomials(points, e - np.eye(3, dtype=int)[k]) @ (c * e[:, k]) for k in range(3)], axis=1)


def _samples(coordinates: Coordinates) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of the surface and p_u x p_v there, up to a positive factor."""
    s, t = np.random.default_rng(5).uniform(-1.2, 1.2, (2, _SAMPLES))
    value, by_s, by_t = (float_coordinates(coordinates, s, t, *order) for order in ((0, 0), (1, 0), (0, 1)))
    with np.errstate(all="ignore"):
        points = value[:3] / value[3]
        along_s, along_t = ((d[:3] - points * d[3]) / value[3] for d in (by_s, by_t))
    turned = np.sign(coordinates.substitutions[0].unit * coordinates.substitutions[1].unit)
    return points.T, np.cross(along_s.T, along_t.T) * turned


def float_coordinates(
    coordinates: Coordinates, s: NDArray[np.float64], t: NDArray[np.float64], ds: int = 0, dt: int = 0
) -> NDArray[np.float64]:
    """X, Y, Z, W or one of their derivatives at the parameters (k,): (4, k)."""
    out = np.zeros((4, len(s)))
    for row, terms in zip(out, coordinates.terms, strict=True):
        for (i, j), element in terms.items():
            if i >= ds and j >= dt:
                factor = coordinates.field.value(element) * (i if ds else 1) * (j if dt else 1)
                row += factor * s ** (i - ds) * t ** (j - dt)
    return out
