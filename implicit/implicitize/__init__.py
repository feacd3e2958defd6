"""From a parametrization to its equation: `implicitize`."""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

from implicit.algebra.polynomial import Polynomial
from implicit.implicitize.certificate import Certificate
from implicit.implicitize.clock import Clock
from implicit.implicitize.eliminate import Implicit
from implicit.implicitize.homogeneous import Coordinates, read_coordinates
from implicit.implicitize.orientation import outward_sign
from implicit.implicitize.solve import solve
from implicit.surface import Surface

Domain: TypeAlias = tuple[tuple[float, float], tuple[float, float]]

_MOST_BITS = 512  # of an integer coefficient; a float has room for 1024


def implicitize(
    coordinates: Sequence[Any],
    parameters: Sequence[Any],
    *,
    method: Literal["auto", "exact", "approximate"] = "auto",
    timeout: float | None = None,
    rationalize: float | None = None,
    degree: int = 4,
    domain: Domain | None = None,
) -> Surface:
    """The surface f(x, y, z) = 0 on which (x(u, v), y(u, v), z(u, v)) lies.

    The coordinates are rational functions of two parameters, or of sines, cosines and exponentials of their multiples.
    f is irreducible, of least degree, with coprime integer coefficients (or integers of a number field such as
    Q(sqrt 2)); it is negative inside where the terms of highest degree tell, else grad f goes along p_u x p_v.

    Parameters
    ----------
    coordinates
        Three sympy expressions or numbers. A float stands for its exact binary value.
    parameters
        Two sympy symbols.
    method
        "exact", or "approximate": a least-squares f of given degree; "auto" is "exact".
    timeout
        Seconds; TimeLimitError when they are over. Needed above degree 20, where the error states an estimate.
    rationalize
        Replace each float and each fraction by the simplest fraction within this distance.
    degree, domain
        For "approximate": the degree of f, and the patch ((u0, u1), (v0, v1)) that it is made for, by default from 0
        to 1, or to 2 pi for angles. `certificate.residual` is the largest distance that was measured; any coordinates
        that can be computed will do.

    Raises
    ------
    NotASurfaceError
        If the image is a curve or a point.
    TranscendentalError
        If the coordinates satisfy no polynomial equation, such as u mixed with sin(u), or contain pi.
    ValueError
        For zero denominators, other symbols, other than three coordinates.
    TypeError
        For coordinates that are neither sympy expressions nor numbers.

    Examples
    --------
    >>> from sympy import cos, sin, symbols
    >>> u, v = symbols("u v", real=True)
    >>> torus = implicitize(((2 + cos(v)) * cos(u), (2 + cos(v)) * sin(u), sin(v)), (u, v))
    >>> torus.degree, torus.certificate.proof
    (4, 'exact')
    """
    if method == "approximate":
        return _approximate(coordinates, parameters, degree, domain)
    if method not in ("auto", "exact"):
        raise ValueError(f'method must be "auto", "exact" or "approximate", got {method!r}')
    clock = Clock(timeout)
    homogeneous = read_coordinates(coordinates, parameters, rationalize)
    found, certificate = solve(homogeneous, clock)
    polynomial = to_polynomial(homogeneous, found)
    if outward_sign(polynomial, homogeneous) < 0:
        polynomial = -polynomial
    return Surface.from_polynomial(polynomial, certificate=certificate)


def to_polynomial(coordinates: Coordinates, found: Implicit) -> Polynomial:
    """The polynomial in the numbers of its field; coefficients far beyond floats are divided by a power of two."""
    scalars = coordinates.field
    terms = {m: scalars.coordinates(e) for m, e in found.terms.items()}
    bits = max(abs(c.numerator).bit_length() for e in terms.values() for c in e)
    if bits > _MOST_BITS:
        terms = {m: tuple(c / (1 << bits) for c in e) for m, e in terms.items()}
    if scalars.number_field is None:
        return Polynomial.from_terms({m: e[0] for m, e in terms.items()})
    return Polynomial.from_terms(terms, scalars.number_field)


def _approximate(coordinates: Sequence[Any], parameters: Sequence[Any], degree: int, domain: Domain | None) -> Surface:
    from implicit.implicitize.approximate import approximate, default_domain

    patch = domain or default_domain(coordinates, parameters)
    polynomial, residual = approximate(coordinates, parameters, degree, patch)
    return Surface.from_polynomial(polynomial, Certificate("approximate", degree, 0, 0, "approximate", residual, 1.0))
