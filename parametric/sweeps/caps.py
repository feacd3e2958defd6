"""Plane caps that close the ends of sweeps."""

import numpy as np

from parametric.curve import ParametricCurve
from parametric.parameters import Array
from parametric.splines.bspline import BezierCurve
from parametric.transfinite.blend import BlendedSurface, linear_blend


def cap(curve: ParametricCurve, *, reverse: bool = False) -> BlendedSurface | None:
    """Plane surface inside a closed plane curve: segments from a point that sees the whole curve.

    The normal is that of a curve seen clockwise, or counter-clockwise with `reverse`. None for a curve that is a
    point. A ValueError for curves that are open, not plane, or that no single point inside sees as a whole.
    """
    places = np.unique(np.concatenate([np.linspace(a, b, 33) for a, b in zip(curve.breaks[:-1], curve.breaks[1:])]))
    points = curve(places)
    middle = points.mean(axis=0)
    size = float(np.linalg.norm(points - middle, axis=-1).max())
    if size <= 1e-12 * max(1.0, float(np.abs(points).max())):
        return None
    if not curve.closed:
        raise ValueError("only a closed section can be capped")
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    height = float(np.abs((points - middle) @ axes[2]).max())
    if height > 1e-9 * size:
        raise ValueError(f"only a plane section can be capped, but this one leaves its plane by {height:.3g}")
    centre = middle + _visible_point((points - middle) @ axes[:2].T) @ axes[:2]
    point = BezierCurve([centre, centre]).over(curve.domain)
    return BlendedSurface((curve, point) if reverse else (point, curve), linear_blend())


def _visible_point(polygon: Array) -> Array:
    """The point deepest inside all edge lines of a plane polygon (its kernel), by linear programming."""
    from scipy.optimize import linprog

    edges = np.diff(polygon, axis=0)
    lengths = np.linalg.norm(edges, axis=-1)
    edges, starts = edges[lengths > 0] / lengths[lengths > 0, None], polygon[:-1][lengths > 0]
    area = np.sum(polygon[:-1, 0] * polygon[1:, 1] - polygon[:-1, 1] * polygon[1:, 0])
    inward = np.sign(area) * np.stack([-edges[:, 1], edges[:, 0]], axis=-1)
    rows = np.column_stack([-inward, np.ones(len(inward))])
    found = linprog([0, 0, -1], A_ub=rows, b_ub=-np.sum(inward * starts, axis=1), bounds=[(None, None)] * 3)
    if found.status != 0 or found.x[2] <= 0:
        raise ValueError("only a section that one point inside sees as a whole can be capped")
    return np.asarray(found.x[:2])
