"""The textbook's algorithms, one point at a time: de Casteljau, de Boor, Bernstein and B-spline functions.

They work on any numbers, fractions included, and are the references against which the fast evaluation is tested.
"""

from collections.abc import Sequence
from math import comb
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[Any]


def bernstein(n: int, i: int, t: Any) -> Any:
    """B_n,i(t) = C(n, i) t^i (1 - t)^(n - i); its maximum over [0, 1] is at i / n.

    Examples
    --------
    >>> bernstein(3, 1, 0.5)
    0.375
    """
    return comb(n, i) * t**i * (1 - t) ** (n - i)


def de_casteljau(points: ArrayLike, t: Any) -> list[Points]:
    """The triangular scheme of de Casteljau: level 0 is the control points, the last level the point at t.

    The first points of all levels control the part before t, the last points (from the last level up) the part after.

    Examples
    --------
    >>> de_casteljau([(-1, 0), (0, 1), (2, 0)], 0.5)[-1].tolist()
    [[0.25, 0.5]]
    """
    levels = [np.asarray(points)]
    while len(levels[-1]) > 1:
        level = levels[-1]
        levels.append((1 - t) * level[:-1] + t * level[1:])
    return levels


def de_casteljau_surface(net: ArrayLike, u: Any, v: Any) -> Points:
    """The point of a Bezier surface: each row at v, then the points q_0(v) ... q_m(v) at u.

    Examples
    --------
    >>> de_casteljau_surface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]], 0.5, 0.5).tolist()
    [0.5, 0.5, 0.25]
    """
    rows = np.stack([de_casteljau(row, v)[-1][0] for row in np.asarray(net)])
    return np.asarray(de_casteljau(rows, u)[-1][0])


def find_span(knots: Sequence[Any], degree: int, t: Any) -> int:
    """The index k with u_k <= t < u_(k+1) in the domain; at its end the last span that is not empty."""
    last = len(knots) - degree - 2
    if not knots[degree] <= t <= knots[last + 1]:
        raise ValueError(f"parameter must lie in [{knots[degree]}, {knots[last + 1]}], got {t}")
    k = degree
    for candidate in range(degree, last + 1):
        if knots[candidate] < knots[candidate + 1] and knots[candidate] <= t:
            k = candidate
    return k


def basis_function(knots: Sequence[Any], i: int, degree: int, t: Any) -> Any:
    """N_i,p(t) by the recursion of Cox and de Boor, with 0/0 = 0 and the last span closed at its end.

    N_i,p = (t - u_i) / (u_(i+p) - u_i) N_i,p-1 + (u_(i+p+1) - t) / (u_(i+p+1) - u_(i+1)) N_i+1,p-1.

    Examples
    --------
    >>> basis_function([0, 1, 2, 3, 4], 0, 2, 1.5)
    0.75
    """
    if degree == 0:
        low, high = knots[i], knots[i + 1]
        return int(low <= t < high or (low < high == t and high == knots[-1]))
    total: Any = 0
    if knots[i + degree] != knots[i]:
        total += (t - knots[i]) / (knots[i + degree] - knots[i]) * basis_function(knots, i, degree - 1, t)
    if knots[i + degree + 1] != knots[i + 1]:
        share = (knots[i + degree + 1] - t) / (knots[i + degree + 1] - knots[i + 1])
        total += share * basis_function(knots, i + 1, degree - 1, t)
    return total


def de_boor(points: ArrayLike, knots: Sequence[Any], degree: int, t: Any) -> list[Points]:
    """The triangular scheme of de Boor: the last level is the point at t.

    With u_k <= t < u_(k+1) and t a knot of multiplicity s (or s = 0), only P_(k-p) ... P_(k-s) take part.

    Examples
    --------
    >>> de_boor([(0, 0), (1, 2), (2, 0), (3, 2)], [0, 0, 0, 0, 1, 1, 1, 1], 3, 0.5)[-1].tolist()
    [[1.5, 1.0]]
    """
    k = find_span(knots, degree, t)
    s = min(degree, sum(1 for knot in knots[: k + 1] if knot == t))
    level = np.asarray(points)[k - degree : k - s + 1]
    levels = [level]
    for r in range(1, degree - s + 1):
        low = [knots[i] for i in range(k - degree + r, k - s + 1)]
        high = [knots[i + degree - r + 1] for i in range(k - degree + r, k - s + 1)]
        ratio = np.array([(t - a) / (b - a) for a, b in zip(low, high)])[:, None]
        level = (1 - ratio) * level[:-1] + ratio * level[1:]
        levels.append(level)
    return levels


def de_boor_surface(
    net: ArrayLike, knots: tuple[Sequence[Any], Sequence[Any]], degrees: tuple[int, int], u: Any, v: Any
) -> Points:
    """The point of a B-spline surface: de Boor along v on the rows that take part, then along u.

    Examples
    --------
    >>> net = [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]]
    >>> de_boor_surface(net, ([0, 0, 1, 1], [0, 0, 1, 1]), (1, 1), 0.5, 0.5).tolist()
    [0.5, 0.5, 0.25]
    """
    rows = np.stack([de_boor(row, knots[1], degrees[1], v)[-1][0] for row in np.asarray(net)])
    return np.asarray(de_boor(rows, knots[0], degrees[0], u)[-1][0])
