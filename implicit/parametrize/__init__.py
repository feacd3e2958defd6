"""From an equation to a parametrization: `parametrize`."""

from implicit.errors import NotPolynomialError
from implicit.parametrize.chart import Chart, verify
from implicit.parametrize.cyclide import parametrize_cyclide
from implicit.parametrize.monoid import parametrize_monoid
from implicit.parametrize.quadric import parametrize_plane, parametrize_quadric
from implicit.parametrize.revolution import parametrize_revolution
from implicit.surface import Surface, check_surface


def parametrize(surface: Surface) -> Chart:
    """A parametrization of an algebraic surface, exactly: f(x(u, v), y(u, v), z(u, v)) = 0.

    Planes, quadrics of all types (those with straight lines along them), tori and quartic Dupin cyclides, surfaces of
    revolution of rational curves about any axis, and monoids: degree d with a point of multiplicity d - 1, which may be
    at infinity, as it is for graphs z = p(x, y).

    Raises
    ------
    NotPolynomialError
        If f is no polynomial with algebraic coefficients.
    ValueError
        If the surface is none of these, has several components, or no real points.

    Examples
    --------
    >>> chart = parametrize(Surface("x^2 + y^2 = z^2"))
    >>> chart.kind, chart.coordinates
    ('cone', (v*cos(u), v*sin(u), v))
    """
    check_surface(surface)
    polynomial = surface.polynomial
    if polynomial is None:
        raise NotPolynomialError(f"a polynomial with algebraic coefficients was wanted, got {surface}")
    factors = [factor for factor, _ in polynomial.factors()]
    if len(factors) > 1:
        listed = ", ".join(str(factor.to_sympy()) for factor in factors)
        raise ValueError(f"an irreducible surface was wanted, this one has the components {listed}: parametrize each")
    irreducible = factors[0] if factors else polynomial
    expression = irreducible.to_sympy()
    if irreducible.degree <= 2:
        chart: Chart | None = (parametrize_plane if irreducible.degree == 1 else parametrize_quadric)(expression)
    else:
        chart = None
        for method in (parametrize_cyclide, parametrize_revolution, parametrize_monoid):
            chart = chart or method(expression)
    if chart is None:
        raise ValueError(
            f"no rational parametrization of this surface of degree {irreducible.degree} is known here: quadrics, "
            "tori and Dupin cyclides, surfaces of revolution of rational curves and monoids are"
        )
    verify(irreducible, chart)
    return chart
