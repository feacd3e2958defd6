"""Surfaces through given curves: ruled, lofted, Coons patches of every kind, Gordon surfaces."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import CurveLike, ParametricCurve, share_domain, to_curve
from parametric.parameters import Array, to_vector
from parametric.splines.tensor import BezierSurface
from parametric.transfinite.blend import (
    Blend,
    BlendedSurface,
    FunctionBlend,
    cardinal_blend,
    cubic_blend,
    linear_blend,
)
from parametric.transfinite.ribbons import COLUMNS, ROWS, CoonsPatch, ribboned


def plane(point: ArrayLike, a: ArrayLike, b: ArrayLike) -> BezierSurface:
    """Plane parallelogram p(u, v) = point + u a + v b on [0, 1] x [0, 1], with normal a x b.

    Examples
    --------
    >>> plane((0, 0, 1), (2, 0, 0), (0, 3, 0))(0.5, 0.5)
    array([1. , 1.5, 1. ])
    """
    origin, along_u, along_v = (to_vector(x, name) for x, name in ((point, "point"), (a, "a"), (b, "b")))
    if not np.cross(along_u, along_v).any():
        raise ValueError(f"a plane needs two directions, but {along_u.tolist()} and {along_v.tolist()} are parallel")
    return BezierSurface([[origin, origin + along_v], [origin + along_u, origin + along_u + along_v]])


def ruled(a: CurveLike, b: CurveLike) -> BlendedSurface:
    """Ruled surface p(u, v) = (1 - v) a(u) + v b(u).

    The curves may be curve objects, callables on [0, 1] or vertices of polylines. u runs over the domain they share;
    if their domains differ, both run linearly over [0, 1]. v runs over [0, 1].

    Examples
    --------
    >>> from parametric.splines.bspline import line
    >>> ruled(line((0, 0, 0), (1, 0, 0)), [(0, 1, 0), (1, 1, 1)])(0.5, 0.5)
    array([0.5 , 0.5 , 0.25])
    """
    return BlendedSurface(share_domain(to_curve(a, "a"), to_curve(b, "b")), linear_blend())


def loft(sections: Sequence[CurveLike], v: ArrayLike | None = None, *, degree: int = 3) -> BlendedSurface:
    """Lofted surface through sections c_k(u) = p(u, v_k), by an interpolating spline in v of the given degree.

    `v` are the increasing parameters of the sections, by default evenly spaced over [0, 1].

    Examples
    --------
    >>> from parametric.conic import circle
    >>> vase = loft([circle(1), circle(2, (0, 0, 1)), circle(1, (0, 0, 2))])
    >>> vase(0.0, 0.5)
    array([2., 0., 1.])
    """
    if len(sections) < 2:
        raise ValueError(f"a loft needs at least two sections, got {len(sections)}")
    places = np.linspace(0, 1, len(sections)) if v is None else np.array(v, dtype=float)
    _check_places(places, len(sections), "v")
    curves = share_domain(*(to_curve(s, f"section {k}") for k, s in enumerate(sections)))
    return BlendedSurface(curves, cardinal_blend(places, degree))


def coons(
    bottom: CurveLike,
    top: CurveLike,
    left: CurveLike,
    right: CurveLike,
    blend: Any = "linear",
    ribbons: Sequence[CurveLike] | None = None,
    twists: Any = "zero",
) -> CoonsPatch:
    """Coons patch on [0, 1] x [0, 1] with bottom = p(u, 0), top = p(u, 1), left = p(0, v), right = p(1, v).

    Parameters
    ----------
    bottom, top, left, right : curves that meet at the corners
        Curve objects, callables on [0, 1] or vertices of polylines; each runs linearly over [0, 1].
    blend : "linear", "cubic" or (f1, g1)
        "linear" is the bilinearly blended patch, "cubic" the partially bicubic one; a pair is for u and for v.
        Functions (callables or sympy expressions) need f1(0) = 1 and f1(1) = 0; the second of each is 1 - f1.
    ribbons : (bottom, top, left, right), optional
        Derivatives across the edges p_v(u, 0), p_v(u, 1), p_u(0, v), p_u(1, v): the bicubically blended patch.
    twists : "zero", "adini", "gregory" or (2, 2, 3)
        The entries p_uv of the corner matrix, [u][v]; only used with ribbons. The two ribbons at a corner each ask
        for a twist. Where the one given differs, the patch misses the ribbons nearby: by how much it differs is
        `.twist_error`, by how much the two ribbons disagree is `.incompatibility`. "gregory" blends what they ask
        for and interpolates all ribbons, at the price of second derivatives that jump at the corners.

    Raises ValueError where curves or ribbons do not meet, with the corner and the distance.
    Source: Coons 1967, MIT MAC-TR-41; Gregory 1974, doi:10.1016/B978-0-12-079050-0.50009-6.

    Examples
    --------
    >>> arcs = [lambda t: (t, 0, 0), lambda t: (t, 1, 0), lambda t: (0, t, 0), lambda t: (1, t, t * (1 - t))]
    >>> coons(*arcs)(0.5, 0.5)
    array([0.5  , 0.5  , 0.125])
    """
    sides = {"bottom": bottom, "top": top, "left": left, "right": right}
    curves = {name: to_curve(side, name).over((0.0, 1.0)) for name, side in sides.items()}
    corners = _meet(curves)
    if ribbons is None:
        f, g = _blends(blend)
        rows, columns = ((curves[a], curves[b]) for a, b in (ROWS, COLUMNS))
        return CoonsPatch(rows, g, columns, f, corners)
    if len(ribbons) != 4:
        raise ValueError(f"ribbons are four, for bottom, top, left and right, got {len(ribbons)}")
    across = {name: to_curve(r, f"ribbon {name}").over((0.0, 1.0)) for name, r in zip(sides, ribbons)}
    return ribboned(curves, across, corners, twists)


def coons_triangle(
    bottom: CurveLike, left: CurveLike, right: CurveLike, blend: Any = ("linear", "cubic")
) -> CoonsPatch:
    """Three-sided Coons patch: left and right meet at the apex, where the fourth edge v = 1 shrinks to a point.

    With the default blend, linear from left to right and cubic towards the apex, the tangent plane there is that of
    the two sides. With others the apex is a cusp in general and has no normal.

    Examples
    --------
    >>> from parametric.splines.bspline import line
    >>> patch = coons_triangle(line((0, 0), (2, 0)), line((0, 0), (1, 1)), line((2, 0), (1, 1)))
    >>> patch(0.3, 1.0)
    array([1., 1., 0.])
    """
    apex = to_curve(left, "left").over((0.0, 1.0))(1.0)
    return coons(bottom, [apex, apex], left, right, blend)


def gordon(
    u_curves: Sequence[CurveLike], v_curves: Sequence[CurveLike], u: ArrayLike | None = None, v: ArrayLike | None = None
) -> BlendedSurface:
    """Gordon surface through a network of curves: u_curves[j] = p(u, v_j) and v_curves[i] = p(u_i, v).

    Every curve runs linearly over [0, 1]. The parameters u_i and v_j at which the curves cross are found, unless
    given; they must increase from 0 to 1, be the same on every curve of one family, and the curves must cross there:
    otherwise a ValueError that names the crossing and the distance. The surface interpolates every curve.
    Source: Gordon 1969, Journal of Mathematics and Mechanics 18.

    Examples
    --------
    >>> along = [lambda t, y=y: (t, y, t * y) for y in (0.0, 0.5, 1.0)]
    >>> across = [lambda t, x=x: (x, t, t * x) for x in (0.0, 0.5, 1.0)]
    >>> gordon(along, across)(0.25, 0.75).round(12)
    array([0.25  , 0.75  , 0.1875])
    """
    if min(len(u_curves), len(v_curves)) < 2:
        raise ValueError(f"a network needs two curves each way, got {len(u_curves)} and {len(v_curves)}")
    rows = [to_curve(c, f"u curve {k}").over((0.0, 1.0)) for k, c in enumerate(u_curves)]
    columns = [to_curve(c, f"v curve {k}").over((0.0, 1.0)) for k, c in enumerate(v_curves)]
    at_u = _crossings(rows[0], columns) if u is None else np.array(u, dtype=float)
    at_v = _crossings(columns[0], rows) if v is None else np.array(v, dtype=float)
    _check_places(at_u, len(columns), "u", whole=True)
    _check_places(at_v, len(rows), "v", whole=True)
    on_rows = np.stack([row(at_u) for row in rows], axis=1)
    on_columns = np.stack([column(at_v) for column in columns], axis=0)
    gaps = np.linalg.norm(on_rows - on_columns, axis=-1)
    size = np.ptp(on_rows.reshape(-1, 3), axis=0).max()
    i, j = np.unravel_index(gaps.argmax(), gaps.shape)
    if gaps[i, j] > 1e-9 * size:
        raise ValueError(
            f"u curve {j} at u = {at_u[i]:g} and v curve {i} at v = {at_v[j]:g} do not meet: "
            f"they are {gaps[i, j]:.3g} apart"
        )
    return BlendedSurface(rows, cardinal_blend(at_v), columns, cardinal_blend(at_u), (on_rows + on_columns) / 2)


def _crossings(curve: ParametricCurve, others: Sequence[ParametricCurve]) -> Array:
    """Parameters at which the curve is nearest to each of the others, by sampling and Gauss-Newton."""
    samples = np.unique(np.concatenate([np.linspace(0, 1, 65), curve.breaks]))
    mine = curve(samples)
    found = []
    for other in others:
        distances = np.linalg.norm(mine[:, None] - other(samples)[None], axis=-1)
        a, b = (float(samples[k]) for k in np.unravel_index(distances.argmin(), distances.shape))
        for _ in range(50):
            gap = curve(a) - other(b)
            jacobian = np.column_stack([curve.derivative(a), -other.derivative(b)])
            step = np.linalg.lstsq(jacobian, -gap, rcond=None)[0]
            a, b = (float(x) for x in np.clip((a + step[0], b + step[1]), 0, 1))
            if np.abs(step).max() < 1e-15:
                break
        found.append(a)
    return _snap(np.array(found))


def _snap(places: Array) -> Array:
    """The ends themselves where a search has come within rounding of them."""
    places = np.where(np.abs(places) < 1e-9, 0.0, places)
    return np.where(np.abs(places - 1) < 1e-9, 1.0, places)


def _check_places(places: Array, count: int, name: str, whole: bool = False) -> None:
    if places.shape != (count,) or not (np.diff(places) > 0).all():
        raise ValueError(f"{name} must be {count} increasing parameters, one for each curve, got {places.tolist()}")
    if whole and (places[0] != 0 or places[-1] != 1):
        raise ValueError(f"the network must reach from 0 to 1, got {name} from {places[0]:g} to {places[-1]:g}")


def _meet(curves: dict[str, ParametricCurve]) -> Array:
    """Corner points [u][v], (2, 2, 3); a ValueError where two curves do not meet."""
    ends = {name: curve([0.0, 1.0]) for name, curve in curves.items()}
    size = max(float(np.ptp(np.concatenate(list(ends.values())), axis=0).max()), 1e-300)
    corners = np.empty((2, 2, 3))
    for a, column in enumerate(COLUMNS):
        for b, row in enumerate(ROWS):
            p, q = ends[row][a], ends[column][b]
            gap = float(np.linalg.norm(p - q))
            if gap > 1e-9 * size:
                raise ValueError(
                    f"{row} and {column} do not meet at the corner (u, v) = ({a}, {b}): "
                    f"{p.tolist()} and {q.tolist()} are {gap:.3g} apart"
                )
            corners[a, b] = (p + q) / 2
    return corners


def _blends(blend: Any) -> tuple[Blend, Blend]:
    """Blending functions in u and in v."""
    if isinstance(blend, str):
        return _blend(blend), _blend(blend)
    if not (isinstance(blend, Sequence) and len(blend) == 2):
        raise ValueError(f'blend must be "linear", "cubic" or a pair of functions, got {blend!r}')
    return _blend(blend[0]), _blend(blend[1])


def _blend(blend: Any) -> Blend:
    if not isinstance(blend, str):
        return FunctionBlend(blend)
    if blend not in ("linear", "cubic"):
        raise ValueError(f'blend must be "linear", "cubic" or a pair of functions, got {blend!r}')
    return linear_blend() if blend == "linear" else cubic_blend()
