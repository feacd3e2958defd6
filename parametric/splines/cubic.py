"""Cubic curves from points and tangents."""

import numpy as np
from numpy.typing import ArrayLike

from parametric.parameters import to_points, to_vector
from parametric.splines.bspline import BezierCurve, BSplineCurve


class HermiteCurve(BezierCurve):
    """The cubic on [0, 1] from p0 to p1 with derivatives d0 and d1 there.

    Examples
    --------
    >>> HermiteCurve((0, 3, 0), (3, 0, 0), (3, 0, 0), (3, 0, 0))(0.5)
    array([1.5, 1.5, 0. ])
    """

    def __init__(self, p0: ArrayLike, p1: ArrayLike, d0: ArrayLike, d1: ArrayLike) -> None:
        a, b, c, d = (to_vector(value, name) for value, name in ((p0, "p0"), (p1, "p1"), (d0, "d0"), (d1, "d1")))
        super().__init__([a, a + c / 3, b - d / 3, b])


class ParabolicBlend(BSplineCurve):
    """Parabolically blended curve through points P_1 ... P_n, from P_2 to P_(n-1) (Overhauser 1968).

    Between neighbours it blends the parabolas through three points on either side; the domain is [0, n-3], one unit
    for each pair of neighbours, and the tangent at P_k is (P_(k+1) - P_(k-1)) / 2.

    Examples
    --------
    >>> ParabolicBlend([(0, 1, 0), (2, 3, 0), (4, 1, 0), (5, 2, 0)])(0.5)
    array([3.0625, 2.0625, 0.    ])
    """

    def __init__(self, points: ArrayLike) -> None:
        p = to_points(points, "points", 1)
        if len(p) < 4:
            raise ValueError(f"a parabolic blend needs at least four points, got {len(p)}")
        tangents = (p[2:] - p[:-2]) / 2
        start, end = p[1:-2], p[2:-1]
        pieces = np.stack([start, start + tangents[:-1] / 3, end - tangents[1:] / 3], axis=1)
        net = np.concatenate([pieces.reshape(-1, 3), p[-2:-1]])
        joints = np.repeat(np.arange(len(p) - 2.0), 3)
        super().__init__(net, 3, np.concatenate([joints[:1], joints, joints[-1:]]))
