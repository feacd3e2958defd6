"""The local algebra of a surface at an exact point: Milnor and Tjurina numbers, Arnold's type, exactly.

At p the germs O / (gradient) have dimension mu, O / (f, gradient) dimension tau. Both come from ranks of finite
matrices: d_k is the dimension modulo all monomials of degree k, and once d_k = d_(k+1), Nakayama's lemma says that
every monomial of degree k lies in the ideal.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz, nmod_mat, nmod_poly

from implicit.singular.exact import ExactPoint
from implicit.singular.form import Form, Monomial

Taylor = dict[Monomial, fmpq_poly]

MAX_ORDER = 14
MAX_NUMBER = 64


def expand_at(form: Form, point: ExactPoint) -> Taylor:
    """The Taylor coefficients of a form at an exact point, as polynomials in theta."""
    modulus, w = point.modulus, [fmpq_poly([1])]
    for _ in range(form.field.degree):
        w.append(w[-1] * point.generator % modulus)
    terms = {m: sum((w[n] * a for n, a in enumerate(c.coeffs())), fmpq_poly([0])) for m, c in form.terms.items()}
    for axis in range(3):
        terms = _shift(terms, axis, point.coordinates[axis], modulus)
    return {m: c for m, c in terms.items() if c != 0}


def _shift(terms: Taylor, axis: int, by: fmpq_poly, modulus: fmpq_poly) -> Taylor:
    lines: dict[tuple[int, int], dict[int, fmpq_poly]] = {}
    for m, c in terms.items():
        lines.setdefault((m[axis - 2], m[axis - 1]), {})[m[axis]] = c
    out: Taylor = {}
    for (after, before), line in lines.items():
        n = max(line)
        a = [line.get(k, fmpq_poly([0])) for k in range(n + 1)]
        for i in range(n):
            for j in range(n - 1, i - 1, -1):
                a[j] = (a[j] + by * a[j + 1]) % modulus
        for k, c in enumerate(a):
            key = [0, 0, 0]
            key[axis], key[axis - 2], key[axis - 1] = k, after, before
            out[key[0], key[1], key[2]] = c
    return out


@lru_cache(maxsize=32)
def monomials(order: int) -> list[Monomial]:
    """All monomials of degree below `order`, by degree."""
    return [(i, j, s - i - j) for s in range(order) for i in range(s, -1, -1) for j in range(s - i, -1, -1)]


def derivative(terms: Taylor, axis: int) -> Taylor:
    """The partial derivative of Taylor terms."""
    out = {}
    for m, c in terms.items():
        if m[axis]:
            out[m[0] - (axis == 0), m[1] - (axis == 1), m[2] - (axis == 2)] = c * m[axis]
    return out


@dataclass(frozen=True)
class Prime:
    """A prime with a root of theta's modulus: a map from Q(theta) to numbers mod p."""

    p: int
    root: int

    def reduce(self, c: fmpq_poly) -> int:
        """The image of a number; ZeroDivisionError where p divides a denominator."""
        value = 0
        for a in reversed(c.coeffs()):
            value = (value * self.root + int(a.p) * pow(int(a.q), -1, self.p)) % self.p
        return value


def primes(modulus: fmpq_poly, seed: int = 7) -> Iterator[Prime]:
    """Random primes of 60 bits over which the modulus has a root."""
    source = random.Random(seed)
    while True:
        p = source.randrange(1 << 59, 1 << 60) | 1
        if not fmpz(p).is_probable_prime():
            continue
        if any(int(c.q) % p == 0 for c in modulus.coeffs()):
            continue
        image = nmod_poly([int(c.p) * pow(int(c.q), -1, p) % p for c in modulus.coeffs()], p)
        roots = [f for f, _ in image.factor()[1] if f.degree() == 1]
        if roots:
            yield Prime(p, int(-roots[0][0] / roots[0][1]))


@dataclass(frozen=True)
class Germ:
    """The surface around an exact singular point."""

    form: Form
    point: ExactPoint

    @cached_property
    def taylor(self) -> Taylor:
        """The terms of f in coordinates from the point."""
        return expand_at(self.form, self.point)

    @cached_property
    def gradient(self) -> list[Taylor]:
        """The terms of the partial derivatives."""
        return [derivative(self.taylor, a) for a in range(3)]

    @cached_property
    def prime(self) -> Prime:
        """The prime at which ranks are taken."""
        return next(primes(self.point.modulus))

    def multiples(self, generators: Sequence[Taylor], order: int) -> Iterator[tuple[int, Monomial]]:
        """Pairs (generator, monomial) whose product has terms of degree below `order`."""
        for g, terms in enumerate(generators):
            lowest = min((sum(m) for m in terms), default=order)
            for m in monomials(order - lowest):
                yield g, m

    def rank(self, generators: Sequence[Taylor], order: int, exact: bool = False) -> int:
        """The dimension of the ideal modulo degree `order`; modulo a prime it can only come out too small."""
        place = {m: n for n, m in enumerate(monomials(order))}
        rows = []
        for g, m in self.multiples(generators, order):
            row = {}
            for e, c in generators[g].items():
                n = place.get((e[0] + m[0], e[1] + m[1], e[2] + m[2]))
                if n is not None:
                    row[n] = c
            rows.append(row)
        if not rows:
            return 0
        if not exact:
            flat = [[0] * len(place) for _ in rows]
            for line, row in zip(flat, rows, strict=True):
                for n, c in row.items():
                    line[n] = self.prime.reduce(c)
            return int(nmod_mat(flat, self.prime.p).rank())
        return exact_rank(rows, len(place), self.point.modulus)

    def dimension(self, generators: Sequence[Taylor]) -> tuple[int, int] | None:
        """(dimension of the local algebra, order k with all monomials of degree k in the ideal), or None."""
        before = -1
        for order in range(1, MAX_ORDER + 2):
            d = len(monomials(order)) - self.rank(generators, order)
            if d == before:
                return d, order - 1
            if d > MAX_NUMBER:
                return None
            before = d
        return None

    @cached_property
    def milnor(self) -> int | None:
        """The Milnor number, proved; None where the critical point is not isolated or the number too large."""
        found = self.dimension(self.gradient)
        if found is None:
            return None
        d, order = found
        exact = all(len(monomials(k)) - self.rank(self.gradient, k, exact=True) == d for k in (order, order + 1))
        return d if exact else None

    @cached_property
    def corank(self) -> int:
        """3 minus the rank of the Hessian."""
        return 3 - exact_rank(self.hessian, 3, self.point.modulus)

    @cached_property
    def hessian(self) -> list[dict[int, fmpq_poly]]:
        """The rows of the Hessian at the point."""
        unit = np.eye(3, dtype=int)
        rows = []
        for r in range(3):
            row = {}
            for c in range(3):
                i, j, k = (int(v) for v in unit[r] + unit[c])
                row[c] = self.taylor.get((i, j, k), fmpq_poly([0])) * (2 if r == c else 1)
            rows.append(row)
        return rows

    @cached_property
    def type(self) -> str | None:
        """Arnold's name of a simple singularity, else P8, X9 and the like by corank and multiplicity, or None."""
        mu = self.milnor
        if mu is None:
            return None
        if self.corank <= 1:
            return f"A{mu}"
        if self.corank == 3:
            return "P8" if mu == 8 and self._order() == 3 else None
        shape = self._cubic_shape()
        if shape == "distinct":
            return "D4"
        if shape == "double":
            return f"D{mu}"
        if shape == "triple":
            return f"E{mu}" if mu in (6, 7, 8) else ("J10" if mu == 10 else None)
        return "X9" if mu == 9 else None

    def _order(self) -> int:
        return min(sum(m) for m in self.taylor)

    def _cubic_shape(self) -> str:
        """How the lines of the cubic terms on the kernel of the Hessian lie: distinct, double, triple or none."""
        p = self.prime.p
        rows = [[self.prime.reduce(row[c]) for c in range(3)] for row in self.hessian]
        kernel = nmod_mat(rows, p).nullspace()[0]
        u, v = ([int(kernel[r, c]) for r in range(3)] for c in range(2))
        form = [0, 0, 0, 0]
        for m, c in self.taylor.items():
            if sum(m) == 3:
                product = nmod_poly([self.prime.reduce(c)], p)
                for a in range(3):
                    product *= nmod_poly([u[a], v[a]], p) ** m[a]
                for n in range(4):
                    form[n] += int(product[n])
        a, b, c2, d = (x % p for x in form)
        if not any((a, b, c2, d)):
            return "none"
        if (b * b * c2 * c2 - 4 * a * c2**3 - 4 * b**3 * d - 27 * a * a * d * d + 18 * a * b * c2 * d) % p:
            return "distinct"
        return (
            "double" if any(x % p for x in (b * b - 3 * a * c2, b * c2 - 9 * a * d, c2 * c2 - 3 * b * d)) else "triple"
        )


def exact_rank(rows: Sequence[dict[int, fmpq_poly]], width: int, modulus: fmpq_poly) -> int:
    """The rank over Q(theta): over Q every row and its multiples by powers of theta count `degree` times."""
    n = int(modulus.degree())
    flat = []
    for row in rows:
        for power in range(n):
            line = [fmpq(0)] * (width * n)
            for column, c in row.items():
                image = c * fmpq_poly([0] * power + [1]) % modulus
                for a, number in enumerate(image.coeffs()):
                    line[column * n + a] = number
            flat.append(line)
    return int(fmpq_mat(flat).rank()) // n
