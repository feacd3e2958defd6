"""Square-free parts and factors over Q and over real number fields.

Over Q(w) greatest common divisors are found modulo primes at which the minimal polynomial of w has all its roots: one
image for each root, interpolated, combined over several primes and proven by division. Factors come from the norm,
a polynomial over Q (Trager 1976, doi:10.1145/800205.806338).
"""

from collections.abc import Iterator
from fractions import Fraction
from math import isqrt, prod

import flint

from implicit.algebra.expand import ring
from implicit.algebra.numberfield import NumberField
from implicit.algebra.polynomial import Polynomial

Monomial = tuple[int, int, int]
Image = dict[Monomial, int]


def square_free(p: Polynomial) -> Polynomial:
    """The product of the distinct irreducible factors of p; over Q(w) with leading coefficient 1."""
    if p.field is None:
        _, parts = p.flint.factor_squarefree()
        return Polynomial(prod((part for part, _ in parts), start=p.flint * 0 + 1))
    shared = p
    for slope in p.gradient():
        if not slope.is_zero:
            shared = gcd(shared, slope)
        if shared.degree == 0:
            return _monic(p)
    quotient, _ = divide(p, shared)
    return _monic(quotient)


def factors(p: Polynomial) -> list[tuple[Polynomial, int]]:
    """The irreducible factors of p with their multiplicities."""
    if p.degree == 0:
        return []
    if p.field is None:
        return [(Polynomial(part), int(power)) for part, power in p.flint.factor()[1]]
    found = []
    rest = p
    for factor in _split(square_free(p)):
        power = 0
        while True:
            quotient, remainder = divide(rest, factor)
            if not remainder.is_zero:
                break
            rest, power = quotient, power + 1
        found.append((factor, power))
    return found


def _split(p: Polynomial) -> list[Polynomial]:
    """The irreducible factors of a square-free polynomial over Q(w)."""
    field = p.field
    assert field is not None
    x, y, z, w = ring(1).gens()
    minimal = sum((w**n * c for n, c in enumerate(field.minimal)), start=w * 0)
    for shift in range(100):
        moved = p.flint.compose(x + shift * w, y + (shift // 2) * w, z + (shift // 3) * w, w, ctx=ring(1))
        norm = moved.resultant(minimal, "w")
        _, parts = norm.factor()
        if all(power == 1 for _, power in parts):
            break
    else:
        raise ArithmeticError("no shift makes the norm square-free")
    if len(parts) == 1:
        return [p]
    base = Polynomial.over(moved, field)
    back = (x - shift * w, y - (shift // 2) * w, z - (shift // 3) * w, w)
    common = [gcd(base, Polynomial(part, field)) for part, _ in parts]
    return [_monic(Polynomial.over(c.flint.compose(*back, ctx=ring(1)), field)) for c in common]


def divide(p: Polynomial, q: Polynomial) -> tuple[Polynomial, Polynomial]:
    """Quotient and remainder over Q(w); the remainder is 0 when q divides p."""
    divisor = _monic(q)
    quotient, remainder = divmod(p.flint, divisor.flint)
    return Polynomial.over(quotient, p.field), Polynomial.over(remainder, p.field)


def _monic(p: Polynomial) -> Polynomial:
    """The multiple with leading coefficient 1 in the order x > y > z."""
    assert p.field is not None
    leading = p.terms[max(p.terms)]
    minimal = flint.fmpq_poly([flint.fmpq(c) for c in p.field.minimal])
    number = flint.fmpq_poly([flint.fmpq(c.numerator, c.denominator) for c in leading])
    shared, inverse, _ = number.xgcd(minimal)
    coefficients = [Fraction(int(c.p), int(c.q)) for c in (inverse / shared[0]).coeffs()]
    return p * Polynomial.from_terms({(0, 0, 0): coefficients}, p.field)


def gcd(p: Polynomial, q: Polynomial) -> Polynomial:
    """The greatest common divisor over Q(w), with leading coefficient 1."""
    field = p.field
    assert field is not None
    modulus, sums, before = 1, dict[Monomial, list[int]](), None
    for prime, roots in _split_primes(field):
        image = _gcd_image(p, q, prime, roots)
        if image is None:
            continue
        if sums and max(image) != max(sums):
            if max(image) > max(sums):
                continue  # an unlucky prime
            modulus, sums, before = 1, {}, None  # all others were
        for monomial in image.keys() | sums.keys():
            fresh = image.get(monomial, [0] * field.degree)
            old = sums.get(monomial, [0] * field.degree)
            inverse = pow(modulus, -1, prime)
            sums[monomial] = [a + modulus * ((b - a) * inverse % prime) for a, b in zip(old, fresh, strict=True)]
        modulus *= prime
        numbers = _rational(sums, modulus)
        if numbers is not None and numbers == before:
            common = Polynomial.from_terms(numbers, field)
            if common.degree == 0 or (divide(p, common)[1].is_zero and divide(q, common)[1].is_zero):
                return common
        before = numbers
        if len(image) == 1 and max(image) == (0, 0, 0):
            return Polynomial.from_terms({(0, 0, 0): [Fraction(1)]}, field)
    raise ArithmeticError("no primes left")


def _gcd_image(p: Polynomial, q: Polynomial, prime: int, roots: list[int]) -> dict[Monomial, list[int]] | None:
    """The gcd modulo a prime, each coefficient as a polynomial in w; None where the prime will not do."""
    context = flint.nmod_mpoly_ctx.get(("x", "y", "z"), prime, "lex")
    images = []
    for root in roots:
        pair = [_modulo(f, prime, root) for f in (p, q)]
        if any(
            image is None or max(image, default=None) != max(f.terms) for image, f in zip(pair, (p, q), strict=True)
        ):
            return None
        common = context.from_dict(pair[0]).gcd(context.from_dict(pair[1])).to_dict()
        whole = {(int(e[0]), int(e[1]), int(e[2])): int(c) for e, c in common.items()}
        scale = pow(whole[max(whole)], -1, prime)
        images.append({e: c * scale % prime for e, c in whole.items()})
    if len({max(image) for image in images}) > 1:
        return None
    basis = _lagrange(roots, prime)
    return {
        e: [
            sum(image.get(e, 0) * row[n] for image, row in zip(images, basis, strict=True)) % prime
            for n in range(len(roots))
        ]
        for e in set().union(*images)
    }


def _modulo(p: Polynomial, prime: int, root: int) -> Image | None:
    image: Image = {}
    for e, coordinates in p.terms.items():
        value = 0
        for c in reversed(coordinates):
            if c.denominator % prime == 0:
                return None
            value = (value * root + c.numerator * pow(c.denominator, -1, prime)) % prime
        if value:
            image[e] = value
    return image


def _lagrange(roots: list[int], prime: int) -> list[list[int]]:
    """For each root the coefficients of the polynomial that is 1 there and 0 at the others."""
    rows = []
    for root in roots:
        row, scale = [1], 1
        for other in roots:
            if other != root:
                row = [
                    ((row[n - 1] if n else 0) - other * (row[n] if n < len(row) else 0)) % prime
                    for n in range(len(row) + 1)
                ]
                scale = scale * (root - other) % prime
        inverse = pow(scale, -1, prime)
        rows.append([c * inverse % prime for c in row])
    return rows


def _rational(sums: dict[Monomial, list[int]], modulus: int) -> dict[Monomial, list[Fraction]] | None:
    """Fractions with these residues, of least numerator and denominator (Wang's reconstruction)."""
    bound = isqrt(modulus // 2)
    result = {}
    for monomial, residues in sums.items():
        row = []
        for residue in residues:
            a, b, s, t = modulus, residue % modulus, 0, 1
            while b > bound:
                a, b, s, t = b, a % b, t, s - (a // b) * t
            if t == 0 or abs(t) > bound:
                return None
            row.append(Fraction(b, t))
        if any(row):
            result[monomial] = row
    return result


def _split_primes(field: NumberField) -> Iterator[tuple[int, list[int]]]:
    """Primes below 2^62 modulo which the minimal polynomial has as many roots as its degree."""
    candidate = 2**62 + 1
    while candidate > 2**61:
        candidate -= 2
        if not flint.fmpz(candidate).is_probable_prime() or field.minimal[-1] % candidate == 0:
            continue
        found = flint.nmod_poly([c % candidate for c in field.minimal], candidate).factor()[1]
        if all(part.degree() == 1 and power == 1 for part, power in found):
            yield candidate, [int(-part[0]) % candidate for part, _ in found]
