"""What is found: singular points, singular curves, and all of them together."""

from dataclasses import dataclass, field

import numpy as np
import sympy
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]


def _no_points() -> Floats:
    return np.zeros((0, 3))


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
    points, triple points, cusps and crossings, and the places where sheets touch that cross elsewhere, or cusps are
    sharper; each is a vertex of the polyline. Not promised: such places where cusps are sharper than x^2 = y^3 all
    along, or four sheets meet. `leaves`, one number per segment, counts the leaves of the real surface that end on the
    curve there: 4 where two sheets cross, 2 on a cuspidal edge, 0 where the curve is solitary, that is, where the real
    surface is only the curve.
    """

    polyline: Floats
    closed: bool = False
    expression: Triple | None = None
    special: Floats = field(default_factory=_no_points)
    leaves: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))


@dataclass(frozen=True, eq=False)
class SingularLocus:
    """All singular points and curves that were found, and what could not be decided.

    `complete` is True only if it is proved that there are no others in the bounds; otherwise all others lie in the
    boxes `undecided` (K, 2, 3), unless the formula is not polynomial. `repeated` are the factors of f that occur more
    than once: there grad f = 0 on the whole surface, and the answer is about the surface counted once. `infinity` are
    the singular points of the projective closure at infinity if they were asked for, as directions, else None.
    """

    points: tuple[SingularPoint, ...]
    curves: tuple[SingularCurve, ...]
    undecided: Floats
    complete: bool
    repeated: tuple[sympy.Expr, ...] = ()
    infinity: tuple[SingularPoint, ...] | None = None
