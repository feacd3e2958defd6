"""Points with exact coordinates, polynomials in one algebraic number: proposed by lattices, proved by substitution."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import sympy
from flint import acb, arb, arb_poly, fmpq, fmpq_mat, fmpq_poly, fmpz_mat, fmpz_poly

from implicit.singular.form import Field, Form, evaluate, precision
from implicit.singular.proof import CriticalPoint, Jet, sharpen

BITS = 480
MAX_DEGREE = 8
_MIX = (3, 5, 7, 11)


@dataclass(frozen=True)
class ExactPoint:
    """Coordinates x, y, z and the field generator w as polynomials in theta, the root of `modulus` in `near`."""

    modulus: fmpq_poly
    near: arb
    coordinates: tuple[fmpq_poly, fmpq_poly, fmpq_poly]
    generator: fmpq_poly

    @property
    def degree(self) -> int:
        """The degree of theta over Q."""
        return int(self.modulus.degree())

    def substitute(self, form: Form) -> fmpq_poly:
        """The exact value of a form, as a polynomial in theta."""
        powers = [_powers(c, d, self.modulus) for c, d in zip(self.coordinates, form.degrees, strict=True)]
        w = _powers(self.generator, form.field.degree, self.modulus)
        total = fmpq_poly([0])
        for (i, j, k), c in form.terms.items():
            number = sum((w[n] * a for n, a in enumerate(c.coeffs())), fmpq_poly([0]))
            total += (powers[0][i] * powers[1][j] % self.modulus) * (powers[2][k] * number % self.modulus)
        return total % self.modulus

    def is_singular(self, form: Form) -> bool:
        """Whether f and its gradient vanish there, exactly."""
        return all(self.substitute(g) == 0 for g in (form, *form.gradient))

    def value(self, bits: int) -> tuple[arb, arb, arb]:
        """Enclosures of the coordinates."""
        with precision(bits):
            theta = Field(self.modulus, self.near).root if self.degree > 1 else arb(-self.modulus[0])
            x, y, z = (evaluate(c, theta) for c in self.coordinates)
            return x, y, z

    @property
    def position(self) -> tuple[float, float, float]:
        """The coordinates to about 16 digits."""
        bits = 128
        while True:
            x, y, z = self.value(bits)
            if all(c.rad() < 1e-20 * (1 + abs(c)) for c in (x, y, z)):
                return float(x.mid()), float(y.mid()), float(z.mid())
            bits *= 2

    @cached_property
    def symbols(self) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr]:
        """The coordinates as sympy numbers."""
        x, y, z = (to_sympy(c, self.modulus, v) for c, v in zip(self.coordinates, self.value(BITS), strict=True))
        return x, y, z


def _powers(c: fmpq_poly, highest: int, modulus: fmpq_poly) -> list[fmpq_poly]:
    out = [fmpq_poly([1])]
    for _ in range(highest):
        out.append(out[-1] * c % modulus)
    return out


def relation(values: list[arb], bits: int) -> list[int] | None:
    """Small integers c with sum c v = 0 to the given precision, by lattice reduction; None when not convincing."""
    n = len(values)
    with precision(bits + 64):
        scaled = [int((v * arb(2) ** bits).mid().floor().unique_fmpz()) for v in values]
    rows = fmpz_mat([[int(r == c) for c in range(n)] + [scaled[r]] for r in range(n)]).lll()
    best = [int(rows[0, c]) for c in range(n)]
    height = max(abs(c) for c in best).bit_length()
    return best if height > 0 and (height + 2) * (n + 1) < 0.6 * bits else None


def recognise(jet: Jet, point: CriticalPoint) -> ExactPoint | None:
    """The exact singular point that is this critical point, proved; None if none of low degree is found.

    The lattice only proposes. Proof: f and its gradient vanish at the proposal in Q[theta], and its real value lies in
    the cube in which the critical point is the only one.
    """
    fine = sharpen(jet, point, BITS + 32)
    proposal = propose(list(fine.center), jet.form.field)
    if proposal is None or not proposal.is_singular(jet.form):
        return None
    with precision(BITS):
        near = all(abs(v - c).upper() < point.radius for v, c in zip(proposal.value(BITS), point.center, strict=True))
    return proposal if near else None


def propose(center: list[arb], field: Field, bits: int = BITS) -> ExactPoint | None:
    """Coordinates in a field of low degree that agree with the center to `bits` bits and contain w."""
    with precision(bits + 64):
        w = field.root
        values = [*center, w]
        theta = sum((a * v for a, v in zip(_MIX, values, strict=True)), arb(0))
        for degree in range(1, MAX_DEGREE + 1):
            if degree % field.degree and field.degree > 1:
                continue
            found = relation([theta**0 if n == 0 else theta**n for n in range(degree + 1)], bits)
            if found is not None and found[-1]:
                modulus = fmpq_poly(found) / found[-1]
                return _coordinates(values, theta, modulus, field, bits)
    return None


def _coordinates(values: list[arb], theta: arb, modulus: fmpq_poly, field: Field, bits: int) -> ExactPoint | None:
    powers = [theta**n if n else arb(1) for n in range(int(modulus.degree()))]
    forms = []
    for v in values:
        found = relation([-v, *powers], bits)
        if found is None or not found[0]:
            return None
        forms.append(fmpq_poly([fmpq(c, found[0]) for c in found[1:]]))
    near = isolate(modulus, theta)
    if near is None or not _is_generator(forms[3], modulus, near, field):
        return None
    return ExactPoint(modulus, near, (forms[0], forms[1], forms[2]), forms[3])


def _is_generator(form: fmpq_poly, modulus: fmpq_poly, near: arb, field: Field) -> bool:
    total, power = fmpq_poly([0]), fmpq_poly([1])
    for c in field.modulus.coeffs():
        total, power = total + power * c, power * form % modulus
    with precision(BITS):
        theta = Field(modulus, near).root if modulus.degree() > 1 else arb(-modulus[0])
        return bool(total % modulus == 0 and evaluate(form, theta).overlaps(field.near + arb(0, 1e-30)))


def isolate(modulus: fmpq_poly, theta: arb) -> arb | None:
    """A ball around theta with exactly one real root of the modulus; None where the modulus has none there."""
    if modulus.degree() == 1:
        return arb(-modulus[0])
    with precision(BITS):
        ball = theta.mid() + arb(0, 2.0**-60)
        slope = arb_poly(modulus.derivative())(ball)
        step = evaluate(modulus, theta.mid()) / slope
        return ball if not slope.contains(0) and abs(step).upper() < 2.0**-60 else None


def to_sympy(number: fmpq_poly, modulus: fmpq_poly, value: arb) -> sympy.Expr:
    """A polynomial in theta as a sympy number: rational, with square roots, or a root of its minimal polynomial."""
    if number.degree() < 1:
        return sympy.Rational(int(number[0].p), int(number[0].q))
    polynomial = minimal(number, modulus, value)
    below = sum(1 for r in _real_roots(polynomial) if r < value and not r.overlaps(value))
    return _root(tuple(int(c) for c in polynomial.coeffs()), below)


def minimal(number: fmpq_poly, modulus: fmpq_poly, value: arb) -> fmpz_poly:
    """The minimal polynomial, with integral coefficients, of a polynomial in theta with that value."""
    n = int(modulus.degree())
    rows = []
    for k in range(n):
        image = number * fmpq_poly([0] * k + [1]) % modulus
        rows.append([image[c] for c in range(n)])
    characteristic = fmpq_mat(rows).charpoly()
    _, factors = characteristic.numer().factor()
    with precision(BITS):
        return min(
            (f for f, _ in factors), key=lambda f: float(abs(arb_poly(f)(value)).lower()) if f.degree() else 1e300
        )


def _real_roots(polynomial: fmpz_poly) -> Iterator[arb]:
    with precision(BITS):
        for root, _ in polynomial.complex_roots():
            if acb(root).imag.contains(0):
                yield acb(root).real


@lru_cache(maxsize=4096)
def _root(coefficients: tuple[int, ...], index: int) -> sympy.Expr:
    """The real root number `index`, from below, of an irreducible polynomial, constant coefficient first."""
    c = [sympy.Integer(a) for a in coefficients]
    if len(c) == 2:
        return -c[0] / c[1]
    sign = 1 if index else -1
    if len(c) == 3:
        return (-c[1] + sign * sympy.sign(c[2]) * sympy.sqrt(c[1] ** 2 - 4 * c[0] * c[2])) / (2 * c[2])
    t = sympy.Symbol("t")
    return sympy.CRootOf(sympy.Poly(c[::-1], t), index)
