"""Matrix forms of cubics and bicubics: p(t) = [t^3 t^2 t 1] M G and p(u, v) = U M G M^T V^T.

Every matrix is derived from what defines its curve. G holds points or, for Hermite data, p(0), p(1), p'(0), p'(1).
"""

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import Array
from parametric.splines.knots import to_knots


def powers(t: ArrayLike, degree: int = 3) -> Array:
    """Rows [t^n ... t 1], (..., n+1)."""
    return np.asarray(t, dtype=float)[..., None] ** np.arange(degree, -1, -1)


def bezier_matrix(degree: int = 3) -> Array:
    """The coefficient of t^k in B_n,i is (-1)^(k-i) C(n, i) C(n-i, k-i).

    Examples
    --------
    >>> bezier_matrix().tolist()
    [[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    """
    n = degree
    rows = [
        [(-1) ** (k - i) * comb(n, i) * comb(n - i, k - i) if k >= i else 0 for i in range(n + 1)]
        for k in range(n, -1, -1)
    ]
    return np.array(rows, dtype=float)


def hermite_matrix() -> Array:
    """The inverse of the map from coefficients to p(0), p(1), p'(0), p'(1).

    Examples
    --------
    >>> hermite_matrix().tolist()
    [[2.0, -2.0, 1.0, 1.0], [-3.0, 3.0, -2.0, -1.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    """
    slopes = [[3 * t * t, 2 * t, 1, 0] for t in (0, 1)]
    conditions = np.vstack([powers([0, 1]), slopes])
    return np.asarray(np.rint(np.linalg.inv(conditions))) + 0.0


def parabolic_matrix() -> Array:
    """Parabolic blending of P1 ... P4: the Hermite cubic from P2 to P3 with tangents (P3 - P1)/2 and (P4 - P2)/2."""
    data = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [-0.5, 0, 0.5, 0], [0, -0.5, 0, 0.5]])
    return hermite_matrix() @ data


def bspline_matrix(degree: int = 3) -> Array:
    """A span of the uniform B-spline, with t running over [0, 1] on it; for clamped ends it does not hold.

    Examples
    --------
    >>> (6 * bspline_matrix()).round(12).tolist()[0]
    [-1.0, 3.0, -3.0, 1.0]
    """
    knots = to_knots("open", degree, degree + 1)
    return bezier_matrix(degree) @ knots.extraction[0]


def hermite_data(net: ArrayLike) -> Array:
    """The matrix [B] (4, 4, 3) of corners, tangents and twists of a bicubic Bezier net (4, 4, 3).

    B = M_H^-1 M_B P M_B^T M_H^-T; rows and columns are value at 0, value at 1, slope at 0, slope at 1.
    """
    return _both(np.linalg.solve(hermite_matrix(), bezier_matrix()), net)


def bezier_net(data: ArrayLike) -> Array:
    """The bicubic Bezier net (4, 4, 3) of a matrix [B] (4, 4, 3): the inverse of `hermite_data`."""
    return _both(np.linalg.solve(bezier_matrix(), hermite_matrix()), data)


def bspline_hermite_data(net: ArrayLike) -> Array:
    """The matrix [B] (4, 4, 3) of one span of a uniform bicubic B-spline: M_H^-1 M_S P M_S^T M_H^-T."""
    return _both(np.linalg.solve(hermite_matrix(), bspline_matrix()), net)


def evaluate_form(matrix: Array, geometry: ArrayLike, u: ArrayLike, v: ArrayLike | None = None) -> Array:
    """U M G for a curve, U M G M^T V^T for a surface: (..., d).

    Examples
    --------
    >>> evaluate_form(hermite_matrix(), [(0, 3, 0), (3, 0, 0), (3, 0, 0), (3, 0, 0)], 0.5)
    array([1.5, 1.5, 0. ])
    """
    g = np.asarray(geometry, dtype=float)
    row = powers(u, len(matrix) - 1) @ matrix
    if v is None:
        return row @ g
    return np.asarray(np.einsum("...i,...j,ijc->...c", row, powers(v, len(matrix) - 1) @ matrix, g))


def _both(change: ArrayLike, net: ArrayLike) -> Array:
    points = np.asarray(net, dtype=float)
    if points.ndim != 3 or points.shape[:2] != (4, 4):
        raise ValueError(f"a bicubic patch has 4 x 4 vectors, got shape {points.shape}")
    return np.asarray(np.einsum("ai,bj,ijc->abc", np.asarray(change), np.asarray(change), points))
