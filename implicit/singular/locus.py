"""Where a surface is singular: all real points with f = 0 and grad f = 0, and whether that is all."""

from dataclasses import dataclass, field

import numpy as np
import sympy
from numpy.typing import NDArray

from implicit.domain import Bounds, to_bounds
from implicit.errors import NotPolynomialError
from implicit.polynomial import Polynomial
from implicit.singular.form import Form
from implicit.singular.points import Node, search_nodes
from implicit.singular.proof import integral
from implicit.singular.region import Deadline

Floats = NDArray[np.float64]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]


@dataclass(frozen=True, eq=False)
class SingularPoint:
    """An isolated singular point.

    `position` (3,) is correct to about 1e-14; `exact` holds sympy numbers where the coordinates are of low degree;
    `type` is Arnold's name ("A1", "D4", "E8" ...) or None; `milnor` is the Milnor number or None.
    """

    position: Floats
    exact: Triple | None = None
    type: str | None = None
    milnor: int | None = None


@dataclass(frozen=True, eq=False)
class SingularCurve:
    """A curve of singular points, as an ordered polyline (n, 3) whose vertices lie on it.

    `expression` is an exact parametrization in t for lines and conics, else None. `special` (k, 3) are the pinch
    points, triple points, cusps and crossings; each is a vertex of the polyline. `sheets` (n - 1,), one number per
    segment, counts the sheets of the real surface that meet there: 0 where the curve is solitary.
    """

    polyline: Floats
    closed: bool = False
    expression: Triple | None = None
    special: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    sheets: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))


@dataclass(frozen=True, eq=False)
class SingularLocus:
    """All singular points and curves that were found, and what could not be decided.

    `complete` is True only if it is proved that there are no others in the bounds; otherwise all others lie in the
    boxes `undecided` (K, 2, 3), unless the formula is not polynomial.
    """

    points: tuple[SingularPoint, ...]
    curves: tuple[SingularCurve, ...]
    undecided: Floats
    complete: bool


def singularities(
    surface: object, bounds: Bounds | float | None = None, *, timeout: float | None = None
) -> SingularLocus:
    """All real points in the bounds where f = 0 and grad f = 0.

    Examples
    --------
    >>> from implicit import Surface
    >>> locus = singularities(Surface("x^2 + y^3 = y^2 - z^2"), 2)
    >>> [(point.exact, point.type) for point in locus.points], locus.complete
    ([((0, 0, 0), 'A1')], True)
    """
    deadline = Deadline(timeout)
    polynomial = getattr(surface, "polynomial", surface)
    if not isinstance(polynomial, Polynomial):
        raise NotPolynomialError("singularities needs a polynomial")
    if bounds is None:
        raise ValueError("singularities needs bounds")
    region = to_bounds(bounds)
    box = region.box.corners
    form = integral(Form.of(polynomial))
    search = search_nodes(form, box, deadline)
    margin = 1e-12 * float((box[1] - box[0]).max())
    points = []
    for node in search.nodes:
        position = node.point.position
        if np.all((position >= box[0] - margin) & (position <= box[1] + margin)):
            points.append(_point(node))
    undecided = search.region.corners(search.left)
    meets = np.all((undecided[:, 1] >= box[0]) & (undecided[:, 0] <= box[1]), axis=1)
    undecided = undecided[meets]
    return SingularLocus(tuple(points), (), undecided, len(undecided) == 0 and not deadline.passed)


def _point(node: Node) -> SingularPoint:
    position = node.point.position + 0.0
    position[np.abs(position) < 1e-40] = 0.0
    position.flags.writeable = False
    return SingularPoint(position, node.exact, "A1", 1)
