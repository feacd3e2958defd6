"""Whether two exact points are one: by minimal polynomials, and values closer than two roots can be."""

from math import ceil, log2

from flint import arb, fmpz_poly

from implicit.singular.exact import BITS, ExactPoint, minimal
from implicit.singular.form import precision
from implicit.singular.proof import Point


def coincide(p: ExactPoint, q: ExactPoint) -> bool:
    """Whether two exact points are the same; both answers are proved.

    They are the same if each coordinate has one minimal polynomial for both, and values nearer than two of its roots
    can be (K. Mahler, Michigan Math. J. 11 (1964) 257-262, doi:10.1307/mmj/1028999140).
    """
    places = p.value(BITS), q.value(BITS)
    if apart(*places):
        return False
    gaps = []
    for a, b, s, t in zip(p.coordinates, q.coordinates, *places, strict=True):
        polynomial = minimal(a, p.modulus, s)
        if polynomial != minimal(b, q.modulus, t):
            return False
        gaps.append(_gap(polynomial))
    bits = max(BITS, *gaps)
    while not apart(*places):
        if all(_near(a, b, gap) for a, b, gap in zip(*places, gaps, strict=True)):
            return True
        bits *= 2
        places = p.value(bits), q.value(bits)
    return False


def apart(p: Point, q: Point) -> bool:
    """Whether two enclosures have no point in common."""
    return not all(a.overlaps(b) for a, b in zip(p, q, strict=True))


def _gap(polynomial: fmpz_poly) -> int:
    """Bits g such that two different roots of an irreducible polynomial are at least 2^-g apart; 0 for one root."""
    n = int(polynomial.degree())
    if n < 2:
        return 0
    length = sum(abs(int(c)) for c in polynomial.coeffs())
    return ceil((n + 2) / 2 * log2(n) + (n - 1) * length.bit_length())


def _near(a: arb, b: arb, gap: int) -> bool:
    """Whether two values are closer than that, or need not be compared as there is one root only."""
    with precision(gap + BITS):
        return gap == 0 or bool(abs(a - b) < arb(2) ** -gap)
