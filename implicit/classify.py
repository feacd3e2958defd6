"""Where is this point: inside, on or outside, for every kind of solid."""

from __future__ import annotations

import numbers
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import OpenSurfaceError, UndecidedError, wrong_kind

if TYPE_CHECKING:
    from implicit.mesh import Mesh
    from implicit.sides.winding import MeshWinding
    from implicit.surface import Surface

Floats: TypeAlias = NDArray[np.float64]
Codes: TypeAlias = NDArray[np.int8]
Rule: TypeAlias = Literal["nonzero", "positive", "evenodd"]

INSIDE, ON, OUTSIDE = -1, 0, 1
_RULES = ("nonzero", "positive", "evenodd")
_SOLIDS = "a Surface, Mesh, Shell or parametric surface"


def classify(solid: Any, points: ArrayLike, *, tolerance: float | None = None, rule: Rule = "nonzero") -> Codes:
    """Inside -1, on 0, outside +1 for points (..., 3), an int8 array (...,); a single point (3,) gives a scalar.

    Implicit surfaces answer by the certified sign of f; shells, parametric surfaces and meshes by their winding number.
    -1 and +1 promise a distance above `tolerance` from the surface, 0 a distance of at most 1.01 `tolerance`.

    Parameters
    ----------
    solid
        Surface, Mesh, or a parametric surface or Shell.
    points
        Real numbers (..., 3). Integers, Fractions and sympy rationals are taken exactly.
    tolerance
        A distance. None: the certified floor of the solid, which is 0 for polynomials (exact answers, proved with
        rational arithmetic where floats cannot tell) and some units in the last place elsewhere.
        0: exact, or UndecidedError.
    rule
        Which winding numbers are inside: "nonzero", "positive" or "evenodd" (odd). Of no use to implicit surfaces.

    A mesh is a faceted copy of a surface: closer to the surface than its chord error any mesh answer about the surface
    is a coin toss, whatever the tolerance. The promises for a mesh concern its triangles.

    Raises
    ------
    ValueError
        For points that are no finite real numbers, naming the first; wrong shapes, tolerance or rule.
    OpenSurfaceError
        For shells and meshes with boundary edges; their `winding_number` is a fraction.
    SignAmbiguousError
        Where f has a factor of even multiplicity.
    UndecidedError
        Where an exact answer was wanted and not found; `indices` are the points.

    Examples
    --------
    >>> from implicit import Surface
    >>> classify(Surface("x^2 + y^2 + z^2 = 2401"), [(12, 24, 41), (12, 24, 40), (12, 24, 42)])
    array([ 0, -1,  1], dtype=int8)
    """
    from implicit.mesh import Mesh
    from implicit.surface import Surface

    if rule not in _RULES:
        raise ValueError(f"rule must be one of {', '.join(_RULES)}, got {rule!r}")
    tolerance = _check_tolerance(tolerance)
    flat, exact, shape = _read(points)
    if isinstance(solid, Surface):
        codes = _classify_surface(solid, flat, exact, tolerance)
    elif isinstance(solid, Mesh):
        codes = _classify_mesh(solid, flat, tolerance, rule)
    elif hasattr(solid, "classify_points"):
        codes = np.asarray(solid.classify_points(flat, tolerance=tolerance, rule=rule), dtype=np.int8)
    else:
        raise wrong_kind(_SOLIDS, solid)
    return codes.reshape(shape)[()]


def certified_floor(solid: Any) -> float:
    """The distance within which `classify` without a tolerance may answer "on": its certificate ends there.

    0 for polynomials and rational formulas with min, max and abs: all answers are exact. 2^-47 times the largest
    coordinate for other formulas, some units in the last place for shells and meshes, infinite for functions without
    a formula, whose computed signs are taken as they are.

    Examples
    --------
    >>> from implicit import Surface
    >>> certified_floor(Surface("x^2 + y^2 + z^2 = 1"))
    0.0
    """
    from implicit.mesh import Mesh
    from implicit.surface import Surface

    if isinstance(solid, Surface):
        from implicit.sides.sign import sign_of

        return sign_of(solid).floor
    if isinstance(solid, Mesh):
        from implicit.sides.winding import winding_of

        return winding_of(solid).floor
    if hasattr(solid, "certified_floor"):
        return float(solid.certified_floor)
    raise wrong_kind(_SOLIDS, solid)


def winding_number(solid: Any, points: ArrayLike) -> Floats:
    """How often a surface turns round points (..., 3): a float64 array (...,), fractional for open surfaces.

    w = (solid angle seen from the point) / 4 pi, positive where the normals point away. 1 inside and 0 outside of
    ordinary solids; for implicit surfaces 1 where f < 0, 0 where f > 0 and 1/2 where f = 0.

    Raises
    ------
    ValueError
        For points that are no finite real numbers, naming the first.
    UndecidedError
        Where the sign of f could not be proved.

    Examples
    --------
    >>> from implicit import Mesh
    >>> triangle = Mesh([(1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 1, 2)])
    >>> round(float(winding_number(triangle, (0, 0, 0))), 12)
    0.125
    """
    from implicit.mesh import Mesh
    from implicit.sides.winding import winding_of
    from implicit.surface import Surface

    flat, exact, shape = _read(points)
    if isinstance(solid, Surface):
        numbers_ = (1.0 - _classify_surface(solid, flat, exact, None)) / 2
    elif isinstance(solid, Mesh):
        numbers_ = winding_of(solid).numbers(flat)
    elif hasattr(solid, "winding_numbers"):
        numbers_ = np.asarray(solid.winding_numbers(flat), dtype=np.float64)
    else:
        raise wrong_kind(_SOLIDS, solid)
    return numbers_.reshape(shape)[()]


def _check_tolerance(tolerance: Any) -> float | None:
    if tolerance is None:
        return None
    if not isinstance(tolerance, int | float | np.integer | np.floating) or not 0 <= float(tolerance) < np.inf:
        raise ValueError(f"tolerance must be a finite distance >= 0 or None, got {tolerance!r}")
    return float(tolerance)


def _read(points: ArrayLike) -> tuple[Floats, dict[int, tuple[Fraction, Fraction, Fraction]], tuple[int, ...]]:
    """Points as floats (n, 3), those that floats cannot hold as fractions by index, and the leading shape."""
    array = np.asarray(points)
    if array.size == 0 and array.ndim <= 1:
        array = np.empty((0, 3))
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points must have shape (..., 3), got {array.shape}")
    shape = array.shape[:-1]
    rows = array.reshape(-1, 3)
    if rows.dtype.kind not in "fiubO":
        raise ValueError(f"points must be real numbers, got an array of {array.dtype}")
    try:
        flat = np.ascontiguousarray(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError("points must be real numbers within the range of floats") from None
    with np.errstate(over="ignore", invalid="ignore"):
        doubtful = not np.isfinite(flat.sum())  # far quicker, and finite only where all are
    if doubtful and not np.isfinite(flat).all():
        bad = np.flatnonzero(~np.isfinite(flat).all(axis=1))
        index = tuple(int(i) for i in np.unravel_index(bad[0], shape)) if shape else ()
        place = f"points{list(index)}" if index else "the point"
        raise ValueError(f"points must be finite, but {place} is {flat[bad[0]].tolist()}")
    return flat, _beyond_floats(rows, flat) if rows.dtype.kind in "iuO" else {}, shape


def _beyond_floats(rows: NDArray[Any], flat: Floats) -> dict[int, tuple[Fraction, Fraction, Fraction]]:
    """The points with coordinates that no float equals."""
    if rows.dtype.kind != "O" and abs(flat).max(initial=0.0) <= 2.0**53:
        return {}
    out = {}
    for i, row in enumerate(rows):
        a, b, c = (_fraction(value) for value in row.tolist())
        if any(Fraction(f) != exact for f, exact in zip(flat[i].tolist(), (a, b, c), strict=True)):
            out[i] = (a, b, c)
    return out


def _fraction(value: Any) -> Fraction:
    if isinstance(value, numbers.Rational | float):
        return Fraction(value)
    if getattr(value, "is_Rational", False):
        return Fraction(int(value.p), int(value.q))
    return Fraction(float(value))


def _classify_surface(
    surface: Surface, points: Floats, exact: dict[int, tuple[Fraction, Fraction, Fraction]], tolerance: float | None
) -> Codes:
    from implicit.algebra.exact import to_fmpq
    from implicit.kernels.filter import UNSURE
    from implicit.sides.nearness import Nearness
    from implicit.sides.sign import FLOOR, sign_of

    sign = sign_of(surface)
    sign.check_multiplicity()
    if tolerance == 0 and surface.expression is None:
        codes = np.full(len(points), UNSURE, dtype=np.int8)
    elif tolerance:
        codes = Nearness(sign, tolerance).decide(points)
    else:
        codes = sign.signs(points)
        for i, point in exact.items():
            codes[i] = sign.exactly([to_fmpq(c) for c in point])
    unsure = np.flatnonzero(codes == UNSURE)
    if len(unsure) and tolerance is None:
        codes[unsure] = [Nearness(sign, FLOOR * max(1.0, abs(p).max())).decide(p[None])[0] for p in points[unsure]]
        unsure = unsure[codes[unsure] == UNSURE]
    if len(unsure):
        wanted = "an exact answer" if tolerance == 0 else "an answer"
        raise UndecidedError(
            f"{wanted} was not proved at {len(unsure)} of {len(points)} points, first at {points[unsure[0]].tolist()}",
            unsure,
        )
    return codes


def _classify_mesh(mesh: Mesh, points: Floats, tolerance: float | None, rule: Rule) -> Codes:
    from implicit.sides.winding import winding_of

    winding = winding_of(mesh)
    _check_closed(winding)
    floor = winding.floor
    distance = floor if tolerance is None else max(float(tolerance), 0.0)
    near = winding.within(points, max(distance, floor))
    if distance < floor and near.any():
        indices = np.flatnonzero(near)
        raise UndecidedError(
            f"{len(indices)} points lie within {floor:.3g} of the mesh, where rounding hides the side; "
            f"the first is {indices[0]}; with tolerance=None they are on",
            indices,
        )
    inside = count_inside(winding.numbers(points), rule)
    return np.where(near, ON, np.where(inside, INSIDE, OUTSIDE)).astype(np.int8)


def count_inside(numbers_: Floats, rule: Rule) -> NDArray[np.bool_]:
    """Which whole winding numbers are inside under a rule."""
    whole = np.rint(numbers_).astype(np.int64)
    if rule == "positive":
        return whole > 0
    return whole % 2 != 0 if rule == "evenodd" else whole != 0


def _check_closed(winding: MeshWinding) -> None:
    edges = winding.boundary
    if len(edges):
        listed = ", ".join(f"{a}-{b}" for a, b in edges[:5].tolist())
        raise OpenSurfaceError(
            f"a closed mesh was wanted, but {len(edges)} edges have faces on one side only: {listed}"
            + (", ..." if len(edges) > 5 else "")
        )
