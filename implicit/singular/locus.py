"""Where a surface is singular: all real points with f = 0 and grad f = 0, and whether that is all."""

from dataclasses import replace

import numpy as np
import sympy

from implicit.domain import Bounds, Box, to_bounds
from implicit.singular.form import Form
from implicit.singular.infinity import points_at_infinity
from implicit.singular.investigation import Investigation
from implicit.singular.kinds import SingularLocus, SingularPoint
from implicit.singular.numeric import search_numerically
from implicit.singular.proof import integral
from implicit.singular.region import Deadline
from implicit.singular.rest import real_points
from implicit.surface import Surface, check_surface

MAX_DEGREE = 50  # in one variable: above it binomial coefficients are no longer exact in floats


def singularities(
    surface: Surface, bounds: Bounds | float | None = None, *, timeout: float | None = None, infinity: bool = False
) -> SingularLocus:
    """All real points in the bounds where f = 0 and grad f = 0.

    Polynomials with rational or algebraic coefficients are solved with proof: space is excluded by Bernstein
    coefficients, simple critical points are isolated by Krawczyk's test, f = 0 is proved by exact coordinates or by a
    lower bound of its nonzero values, degenerate points and curves by exact algebra. However near points are, they are
    told apart exactly. Other formulas get a numeric search for isolated points, never complete.

    Parameters
    ----------
    surface : Surface
    bounds : Box, Ball or number, optional
        Where to look. Without bounds all of space is searched, which needs finitely many singular points, and few
        enough for exact elimination.
    timeout : float, optional
        Seconds after which the answer is given as far as it is known.
    infinity : bool
        Whether the singular points of the projective closure at infinity are wanted too.

    Raises
    ------
    ValueError
        When f is zero everywhere, or of degree above 50 in a variable; without bounds, when there are singular curves
        or the points could not be found by elimination; the same for the points at infinity.

    Notes
    -----
    Krawczyk, Computing 4 (1969) 187-201, doi:10.1007/BF02234767; Arnold, Functional Analysis 6 (1972) 254-272,
    doi:10.1007/BF01077644 for the types.

    Examples
    --------
    >>> from implicit import Surface
    >>> locus = singularities(Surface("x^2 + y^3 = y^2 - z^2"), 2)
    >>> [(point.exact, point.type) for point in locus.points], locus.complete
    ([((0, 0, 0), 'A1')], True)
    >>> whitney = singularities(Surface("x^2 = y^2 z"), 2).curves[0]
    >>> whitney.expression, whitney.special.tolist(), sorted(set(whitney.leaves.tolist()))
    ((0, 0, t), [[0.0, 0.0, 0.0]], [0, 4])
    """
    check_surface(surface)
    deadline = Deadline(timeout)
    polynomial = surface.polynomial
    if polynomial is None:
        return _numeric(surface, bounds, infinity)
    if polynomial.is_zero:
        raise ValueError("a formula that is not zero everywhere was wanted: here every point is singular")
    repeated: tuple[sympy.Expr, ...] = ()
    reduced = polynomial.square_free
    if reduced.degree == polynomial.degree:
        reduced = polynomial  # the same up to a factor, which may have made coefficients large
    else:
        repeated = tuple(factor.to_sympy() for factor, power in polynomial.factors() if power > 1)
    if max(reduced.degrees) > MAX_DEGREE:
        raise ValueError(f"degree at most {MAX_DEGREE} in each variable was wanted, got degrees {reduced.degrees}")
    form = integral(Form.of(reduced))
    known = None if bounds is None else to_bounds(bounds)
    found = Investigation(form, known, deadline).locus() if known else _everywhere(form, deadline)
    return replace(found, repeated=repeated, infinity=points_at_infinity(form) if infinity else None)


def _numeric(surface: Surface, bounds: Bounds | float | None, infinity: bool) -> SingularLocus:
    if bounds is None:
        raise ValueError("singularities of a formula that is no polynomial needs bounds")
    if infinity:
        raise ValueError("a polynomial was wanted for points at infinity")
    domain = to_bounds(bounds)
    points = tuple(SingularPoint(p) for p in search_numerically(surface, domain))
    return SingularLocus(points, (), domain.box.corners[None], False)


def _everywhere(form: Form, deadline: Deadline) -> SingularLocus:
    """All of affine space: the points by elimination, then a search around them for proofs and types."""
    found = real_points(form, deadline)
    if found is None:
        raise ValueError(
            "bounds were wanted: without them there must be finitely many singular points, and few enough to eliminate"
        )
    if not found:
        return SingularLocus((), (), np.zeros((0, 2, 3)), True)
    points = np.array([point.position for point in found])
    margin = 1 + 0.1 * np.ptp(points, axis=0)
    box = Box(points.min(axis=0) - margin, points.max(axis=0) + margin)
    return Investigation(form, box, deadline).locus()
