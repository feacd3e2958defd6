"""How smoothly two surfaces or two curves meet, and control points moved so that they do."""

from dataclasses import dataclass, field
from typing import overload

import numpy as np

from parametric.curve import ParametricCurve
from parametric.parameters import Array
from parametric.splines.knots import KnotVector
from parametric.splines.tensor import BSplineSurface
from parametric.surface import ParametricSurface, check_surface

EDGES = ("u0", "u1", "v0", "v1")
ENDS = ("t0", "t1")
SAMPLES = 33


@dataclass(frozen=True)
class ContinuityReport:
    """What holds along a joint, within the tolerance it was asked with, and by how much each condition fails.

    `residuals`: "c0" a length; "c1", "c2" the difference of the first and second derivatives across the joint, by the
    parameters as they are; "g1" the angle between the tangent planes (for curves, the tangents) in radians; "g2" the
    difference of curvatures. `reversed` says whether the second edge runs the other way.
    """

    c0: bool
    c1: bool
    c2: bool
    g1: bool
    g2: bool
    residuals: dict[str, float] = field(compare=False)
    reversed: bool = False


@overload
def continuity(
    a: ParametricSurface, edge_a: str, b: ParametricSurface, edge_b: str, *, tolerance: float = ...
) -> ContinuityReport: ...
@overload
def continuity(
    a: ParametricCurve, edge_a: str, b: ParametricCurve, edge_b: str, *, tolerance: float = ...
) -> ContinuityReport: ...
def continuity(
    a: ParametricSurface | ParametricCurve,
    edge_a: str,
    b: ParametricSurface | ParametricCurve,
    edge_b: str,
    *,
    tolerance: float = 1e-9,
) -> ContinuityReport:
    """Continuity across the joint of two edges "u0", "u1", "v0", "v1", or of two ends of curves "t0", "t1".

    The joint is crossed from `a` out to `b` in; derivatives are by the parameters as they are, each on its own
    domain. `tolerance` is relative to the size of position and derivatives on the joint. The edges are sampled at 33
    places: a smooth patch cannot hide a gap between them, a wild one could.

    Examples
    --------
    >>> from parametric.splines.tensor import BezierSurface
    >>> left = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    >>> right = BezierSurface([[(1, 0, 0), (1, 1, 0)], [(3, 0, 0), (3, 1, 0)]])
    >>> report = continuity(left, "u1", right, "u0")
    >>> report.c0, report.c1, report.g1
    (True, False, True)
    """
    if isinstance(a, ParametricCurve) and isinstance(b, ParametricCurve):
        return _join_curves(a, edge_a, b, edge_b, tolerance)
    if isinstance(a, ParametricCurve) or isinstance(b, ParametricCurve):
        raise TypeError("a joint is between two surfaces or two curves")
    for surface in (a, b):
        check_surface(surface)
    s = np.linspace(0, 1, SAMPLES)
    one = _Side(a, edge_a, s, 1.0)
    other = _Side(b, edge_b, s, -1.0)
    flipped = np.linalg.norm(one.points - other.points[::-1]).item() < np.linalg.norm(one.points - other.points).item()
    if flipped:
        other = _Side(b, edge_b, s[::-1], -1.0)
    size = max(one.size, other.size)
    speed = max(float(np.abs(one.across).max()), float(np.abs(other.across).max()))
    bend = max(float(np.abs(one.bend).max()), float(np.abs(other.bend).max()), speed)
    residuals = {
        "c0": _largest(one.points - other.points),
        "c1": _largest(one.across - other.across),
        "c2": _largest(one.bend - other.bend),
        "g1": _plane_angle(one, other),
        "g2": _curvature_gap(one, other),
    }
    c0 = residuals["c0"] <= tolerance * size
    c1 = c0 and residuals["c1"] <= tolerance * speed
    g1 = c0 and residuals["g1"] <= max(tolerance, 1e-9)
    return ContinuityReport(
        c0,
        c1,
        c1 and residuals["c2"] <= tolerance * bend,
        g1,
        g1 and residuals["g2"] * size <= 100 * tolerance,
        residuals,
        flipped,
    )


class _Side:
    """One surface along one edge: points, first and second derivatives across (out of a, into b) and along."""

    def __init__(self, surface: ParametricSurface, edge: str, s: Array, sign: float) -> None:
        if edge not in EDGES:
            raise ValueError(f"an edge is one of {', '.join(EDGES)}, got {edge!r}")
        axis, end = "uv".index(edge[0]), int(edge[1])
        fixed, running = surface.domain[axis][end], surface.domain[1 - axis]
        along = running[0] + (running[1] - running[0]) * s
        u, v = (np.full_like(s, fixed), along) if axis == 0 else (along, np.full_like(s, fixed))
        self.surface, self.u, self.v = surface, u, v
        jet = surface.jet(u, v, 2)
        outward = sign * (1.0 if end else -1.0)
        self.points = jet[0, 0]
        self.across = outward * jet[(1, 0) if axis == 0 else (0, 1)]
        self.bend = jet[(2, 0) if axis == 0 else (0, 2)]
        self.along, self.mixed = jet[(0, 1) if axis == 0 else (1, 0)], outward * jet[1, 1]
        self.along_bend = jet[(0, 2) if axis == 0 else (2, 0)]
        self.size = float(np.ptp(self.points, axis=0).max()) or float(np.abs(self.across).max())


def _largest(differences: Array) -> float:
    return float(np.linalg.norm(differences, axis=-1).max())


def _plane_angle(a: _Side, b: _Side) -> float:
    """Largest angle by which the two half planes at the joint fail to continue each other."""
    tangent = a.along / np.maximum(np.linalg.norm(a.along, axis=-1, keepdims=True), 1e-300)
    one, other = (side.across - _dot(side.across, tangent) * tangent for side in (a, b))
    angles = np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), _dot(one, other)[:, 0])
    weight = np.minimum(np.linalg.norm(one, axis=-1), np.linalg.norm(other, axis=-1))
    regular = weight > 1e-9 * max(float(weight.max()), 1e-300)
    return float(np.abs(angles[regular]).max()) if regular.any() else float("nan")


def _curvature_gap(a: _Side, b: _Side) -> float:
    """Largest difference of the second fundamental forms, in the orthonormal frame of the joint."""
    gaps = [_second_form(side) for side in (a, b)]
    finite = np.isfinite(gaps[0]).all(axis=-1) & np.isfinite(gaps[1]).all(axis=-1)
    return float(np.abs(gaps[0] - gaps[1])[finite].max()) if finite.any() else float("nan")


def _second_form(side: _Side) -> Array:
    """Second fundamental form (n, 3) on the unit tangent t of the edge and the unit vector across it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.linalg.norm(side.along, axis=-1, keepdims=True)
        t = side.along / length
        shift = _dot(side.across, t)
        across = side.across - shift * t
        width = np.linalg.norm(across, axis=-1, keepdims=True)
        n = np.cross(across / width, t)
        a11 = _dot(side.along_bend, n) / length**2
        a12 = (_dot(side.mixed, n) / length - shift * a11) / width
        a22 = (_dot(side.bend, n) - 2 * shift * width * a12 - shift**2 * a11) / width**2
    return np.concatenate([a11, a12, a22], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...c,...c->...", a, b)[..., None])


def _join_curves(a: ParametricCurve, end_a: str, b: ParametricCurve, end_b: str, tolerance: float) -> ContinuityReport:
    for end in (end_a, end_b):
        if end not in ENDS:
            raise ValueError(f"an end of a curve is one of {', '.join(ENDS)}, got {end!r}")
    sign_a, sign_b = (1.0 if end_a == "t1" else -1.0), (1.0 if end_b == "t0" else -1.0)
    ta, tb = a.domain[int(end_a[1])], b.domain[int(end_b[1])]
    one = [sign_a**k * a.derivative(ta, k) for k in range(3)]
    other = [sign_b**k * b.derivative(tb, k) for k in range(3)]
    gaps = [float(np.linalg.norm(p - q)) for p, q in zip(one, other)]
    scales = [max(float(np.linalg.norm(p)), float(np.linalg.norm(q)), 1e-300) for p, q in zip(one, other)]
    size = max(scales[0], scales[1])
    turn = float(np.arctan2(np.linalg.norm(np.cross(one[1], other[1])), one[1] @ other[1]))
    bend = float(np.linalg.norm(_bend(one) - _bend(other)))
    c0 = gaps[0] <= tolerance * size
    c1 = c0 and gaps[1] <= tolerance * scales[1]
    c2 = c1 and gaps[2] <= tolerance * max(scales[1], scales[2])
    g1 = c0 and turn <= tolerance
    residuals = {"c0": gaps[0], "c1": gaps[1], "c2": gaps[2], "g1": turn, "g2": bend}
    return ContinuityReport(c0, c1, c2, g1, g1 and bend * size <= 100 * tolerance, residuals)


def _bend(jet: list[Array]) -> Array:
    """Curvature vector of a curve."""
    speed = float(jet[1] @ jet[1])
    return (jet[2] - (jet[2] @ jet[1]) / speed * jet[1]) / speed if speed else np.full(3, np.nan)


def make_c0(a: BSplineSurface, edge_a: str, b: BSplineSurface, edge_b: str) -> BSplineSurface:
    """`b` with its edge's control points moved onto those of `a`."""
    return _moved(a, edge_a, b, edge_b, None)


def make_c1(a: BSplineSurface, edge_a: str, b: BSplineSurface, edge_b: str) -> BSplineSurface:
    """`b` with its first two rows of control points moved so that the joint is C1 by the parameters as they are.

    Both surfaces must be polynomial, of the same degree and knots along the joint, and clamped at it.

    Examples
    --------
    >>> from parametric.splines.tensor import BezierSurface
    >>> left = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])
    >>> right = BezierSurface([[(1, 0, 0), (1, 1, 0)], [(3, 0, 0), (3, 1, 0)], [(4, 0, 1), (4, 1, 1)]])
    >>> continuity(left, "u1", make_c1(left, "u1", right, "u0"), "u0").c1
    True
    """
    return _moved(a, edge_a, b, edge_b, 1.0)


def make_g1(a: BSplineSurface, edge_a: str, b: BSplineSurface, edge_b: str, ratio: float = 1.0) -> BSplineSurface:
    """As `make_c1`, with derivatives across the joint `ratio` > 0 times as long in `b` as in `a`."""
    if not ratio > 0:
        raise ValueError(f"the ratio of derivatives must be positive, got {ratio!r}")
    return _moved(a, edge_a, b, edge_b, ratio)


def _moved(a: BSplineSurface, edge_a: str, b: BSplineSurface, edge_b: str, ratio: float | None) -> BSplineSurface:
    rows_a, rate_a, along_a = _rows(a, edge_a)
    rows_b, rate_b, along_b = _rows(b, edge_b)
    if rows_a[0].shape == rows_b[0].shape and np.linalg.norm(rows_a[0][::-1] - rows_b[0]) < np.linalg.norm(
        rows_a[0] - rows_b[0]
    ):
        low, high = along_a.domain
        rows_a, along_a = rows_a[:, ::-1], KnotVector(low + high - along_a.values[::-1], along_a.degree, along_a.closed)
    if along_a.degree != along_b.degree or not _same(along_a.values, along_b.values):
        raise ValueError("both surfaces must have the same degree and knots along the joint: elevate or insert first")
    rows = rows_b.copy()
    rows[0] = rows_a[0]
    if ratio is not None:
        rows[1] = rows[0] + ratio * rate_a / rate_b * (rows_a[0] - rows_a[1])
    axis, end = "uv".index(edge_b[0]), int(edge_b[1])
    points = np.moveaxis(rows[::-1] if end else rows, 0, axis)
    return b.with_points(points)


def _same(a: Array, b: Array) -> bool:
    return a.shape == b.shape and bool(np.abs(a - b).max() <= 1e-12 * np.ptp(a))


def _rows(surface: BSplineSurface, edge: str) -> tuple[Array, float, KnotVector]:
    """Control points by rows from the edge inwards, derivative per step from the edge, and knots along the edge."""
    if edge not in EDGES:
        raise ValueError(f"an edge is one of {', '.join(EDGES)}, got {edge!r}")
    if surface.weights is not None:
        raise ValueError("a joint is made between polynomial surfaces, not rational ones")
    axis, end = "uv".index(edge[0]), int(edge[1])
    knots = surface.knots[axis]
    ends = knots.values[-knots.degree - 1 :] if end else knots.values[: knots.degree + 1]
    if np.ptp(ends) > 0:
        raise ValueError(f"the surface must be clamped at {edge}")
    step = knots.values[-knots.degree - 2] if end else knots.values[knots.degree + 1]
    rows = np.moveaxis(surface.points, axis, 0)
    return rows[::-1] if end else rows, knots.degree / abs(step - ends[0]), surface.knots[1 - axis]
