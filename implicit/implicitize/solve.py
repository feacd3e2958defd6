"""Which method finds the polynomial, how long that may take, and the proof of the result."""

from math import ceil, comb, log2
from typing import Literal

from implicit.errors import TimeLimitError
from implicit.implicitize.certificate import Certificate
from implicit.implicitize.clock import Clock
from implicit.implicitize.degree import Count, count
from implicit.implicitize.eliminate import Implicit, lift, null_space_image
from implicit.implicitize.homogeneous import Coordinates
from implicit.implicitize.planes import minors_image, square_image
from implicit.implicitize.proof import identity_bits, proof_cost, prove_identity, prove_irreducible

_PROOF_SECONDS = 60.0  # a longer proof over the integers is left to fresh primes
_FREE_DEGREE = 20  # above this nothing is started without an estimate
_EASY_DEGREE = 4  # up to here the proof is as quick as a check
_SMALL_DEGREE = 7  # the null space is quicker up to here, with base points two degrees further


def solve(coordinates: Coordinates, clock: Clock) -> tuple[Implicit, Certificate]:
    """The irreducible polynomial of homogeneous coordinates and what is proved about it."""
    counted = count(coordinates)
    clock.check("the count of the degree")
    _check_size(coordinates, counted, clock)
    found, method = _find(coordinates, counted, clock)
    return found, _prove(coordinates, counted, found, method, clock)


def _find(coordinates: Coordinates, counted: Count, clock: Clock) -> tuple[Implicit, str]:
    degree, (m, n) = counted.degree, coordinates.bidegree
    free = counted.map_degree == 1 and degree == 2 * m * n
    if degree > _SMALL_DEGREE + (0 if free else 2):
        image = square_image(degree, clock) if free else minors_image(degree, counted.map_degree, clock)
        found = lift(coordinates, degree, image, clock)
        if found is not None:
            return found, "moving planes"
    if _null_space_seconds(degree) > clock.left:
        raise TimeLimitError(f"one null space of degree {degree} takes about {_null_space_seconds(degree):.0f} s")
    verify = prove_identity if degree <= _EASY_DEGREE else None
    found = lift(coordinates, degree, null_space_image(degree), clock, verify)
    if found is None:
        raise ArithmeticError(
            f"no polynomial of the degree {degree} that was counted modulo a prime; please report this"
        )
    return found, "null space"


def _null_space_seconds(degree: int) -> float:
    monomials = comb(degree + 3, 3)
    return 4e-10 * monomials**3 + 6e-7 * monomials**2


def _check_size(coordinates: Coordinates, counted: Count, clock: Clock) -> None:
    """Refuse work of which the estimate does not fit the time, and large work without a time limit."""
    if counted.degree <= _FREE_DEGREE:
        return
    seconds, terms = estimate_seconds(coordinates, counted), comb(counted.degree + 3, 3)
    if clock.timeout is not None and seconds < clock.left:
        return
    size = f"the equation has degree {counted.degree} and up to {terms} terms, about {_duration(seconds)} of work"
    advice = (
        f"; that does not fit timeout={clock.timeout:g}"
        if clock.timeout is not None
        else "; give a timeout in seconds to go ahead"
    )
    raise TimeLimitError(f'{size}{advice}, or use matrix_form or method="approximate"')


def estimate_seconds(coordinates: Coordinates, counted: Count) -> float:
    """A rough guess: the number of primes from the size of the coefficients, times determinants at all points."""
    m, n = coordinates.bidegree
    rows, degree = 2 * m * n, counted.degree
    bits = 1.5 * degree * max(log2(max(size, 2)) for size in coordinates.sizes)
    primes = ceil(2 * bits / 31) * coordinates.field.degree
    free = counted.map_degree == 1 and degree == rows
    determinants = comb(degree + 3, 3) if free else 2 * comb(degree + 2, 2) * (rows + 1)
    return primes * (determinants * rows**3 / 3 * 1.5e-8 + comb(degree + 3, 3) * 1e-5)


def _duration(seconds: float) -> str:
    for limit, unit, size in ((120.0, "s", 1.0), (7200.0, "min", 60.0), (172800.0, "h", 3600.0)):
        if seconds < limit:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds / 86400:.0f} days"


def _prove(coordinates: Coordinates, counted: Count, found: Implicit, method: str, clock: Clock) -> Certificate:
    """What can be proved in the time left; the polynomial has been checked modulo a fresh prime before."""
    exact = False
    if proof_cost(coordinates, found) < min(_PROOF_SECONDS, clock.left):
        try:
            if found.degree > _EASY_DEGREE and not prove_identity(coordinates, found, clock):
                raise ArithmeticError("a polynomial that vanishes modulo a prime does not vanish; please report this")
            exact = prove_irreducible(coordinates, found, clock)
        except TimeLimitError:
            exact = False
    proof: Literal["exact", "modular"] = "exact" if exact else "modular"
    chance = 0.0 if exact else _chance(coordinates, found)
    return Certificate(method, counted.degree, counted.map_degree, counted.base_points, proof, 0.0, chance)


def _chance(coordinates: Coordinates, found: Implicit) -> float:
    """A bound on the chance of error: all primes that can divide the coefficients, among the primes of the check."""
    return min(1.0, (identity_bits(coordinates, found) / 30 + 1) / 5e7)
