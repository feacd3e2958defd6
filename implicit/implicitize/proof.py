"""The proof that a polynomial is the one of a surface: an identity over the integers, and irreducibility.

Identity: F(s, t) = f(X, Y, Z, W) has bounded degrees and bounded coefficients. It is zero if it vanishes on a grid of
more points than its degrees, modulo primes whose product exceeds the bound. Irreducibility: if f restricted to one
line is irreducible modulo one prime, without loss of degree, then f is irreducible. Both are proofs, not tests.
"""

from itertools import islice
from math import log2

import numpy as np
from flint import nmod_mat, nmod_poly

from implicit.implicitize.clock import Clock
from implicit.implicitize.eliminate import Implicit, Monomial, monomial_rows
from implicit.implicitize.homogeneous import Coordinates
from implicit.implicitize.modular import (
    TO_PROVE,
    Residues,
    evaluate,
    powers,
    product,
    reduce_coordinates,
    reduce_element,
    split_primes,
)

_LINES = 8  # lines tried at a time


def identity_bits(coordinates: Coordinates, answer: Implicit) -> int:
    """Bits of a bound on every integer in the polynomial f(X, Y, Z, W)."""
    d, sizes, total = answer.degree, [max(s, 1) for s in coordinates.sizes], 0
    for (i, j, k), element in answer.terms.items():
        factors = zip(sizes, (i, j, k, d - i - j - k), strict=True)
        term = sum(map(abs, element))
        for size, exponent in factors:
            term *= size**exponent
        total += term
    return (total * coordinates.field.growth**d).bit_length()


def proof_cost(coordinates: Coordinates, answer: Implicit) -> float:
    """About how many seconds the identity takes."""
    m, n = coordinates.bidegree
    points = (answer.degree * m + 1) * (answer.degree * n + 1)
    images = coordinates.field.degree * (identity_bits(coordinates, answer) // 30 + 1)
    return images * (3e-4 + points * (len(answer.terms) + 10 * answer.degree**2) * 1.5e-9)


def prove_identity(coordinates: Coordinates, answer: Implicit, clock: Clock) -> bool:
    """Whether f(X, Y, Z, W) = 0 as a polynomial in s and t, decided exactly."""
    bits, covered = identity_bits(coordinates, answer), 0.0
    m, n = coordinates.bidegree
    s, t = (axis.ravel() for axis in np.indices((answer.degree * m + 1, answer.degree * n + 1)))
    for p, roots in split_primes(coordinates.field.modulus, TO_PROVE):
        clock.check("the proof")
        for root in roots:
            points = evaluate(reduce_coordinates(coordinates, p, root), s, t, p)
            terms = {m: reduce_element(e, p, root) for m, e in answer.terms.items()}
            if homogeneous_values(terms, answer.degree, points, p).any():
                return False
        covered += log2(p) - 1e-9
        if covered > bits:
            return True
    raise AssertionError("there are infinitely many primes")


def homogeneous_values(terms: dict[Monomial, int], degree: int, points: Residues, p: int) -> Residues:
    """A polynomial made homogeneous of the degree, at points (4, k) modulo p.

    For each power e = degree - i - j of z and w together, one matrix product sums over the split of e.
    """
    x, y, z, w = (powers(row, degree, p) for row in points)
    total = np.zeros(points.shape[1], dtype=np.int64)
    for e in range(degree + 1):
        table = np.zeros((degree - e + 1, e + 1), dtype=np.int64)
        for k in range(e + 1):
            for i in range(degree - e + 1):
                table[i, k] = terms.get((i, degree - e - i, k), 0)
        used = np.flatnonzero(table.any(axis=1))
        if not used.size:
            continue
        split = z[: e + 1] * w[e::-1] % p
        inner = product(table[used], split, p)
        outer = x[used] * y[degree - e - used] % p
        total += (outer * inner % p).sum(axis=0)
    return total % p


def prove_irreducible(coordinates: Coordinates, answer: Implicit, clock: Clock, attempts: int = 400) -> bool:
    """Whether a line was found on which f is irreducible modulo a prime; False proves nothing."""
    d = answer.degree
    if d <= 2:
        return d == 1 or _rank_of_quadric(coordinates, answer) >= 3
    random = np.random.default_rng(3)
    for p, roots in islice(split_primes(coordinates.field.modulus, TO_PROVE), max(1, attempts // _LINES)):
        clock.check("the proof of irreducibility")
        coefficients = np.array([reduce_element(e, p, roots[0]) for e in answer.terms.values()], dtype=np.int64)
        start, direction = random.integers(0, p, (2, 4, _LINES, 1))
        points = (start + direction * np.arange(d + 1)) % p
        points[3] = 1
        rows = monomial_rows(points.reshape(4, -1), list(answer.terms), d, p)
        values = product(rows, coefficients[:, None], p).reshape(_LINES, d + 1)
        vandermonde = nmod_mat(d + 1, d + 1, [pow(k, e, p) for k in range(d + 1) for e in range(d + 1)], p)
        solved = vandermonde.solve(nmod_mat(d + 1, _LINES, values.T.ravel().tolist(), p)).tolist()
        for line in range(_LINES):
            polynomial = nmod_poly([int(row[line]) for row in solved], p)
            if polynomial.degree() == d and len(factors := polynomial.factor()[1]) == 1 and factors[0][1] == 1:
                return True
    return False


def _rank_of_quadric(coordinates: Coordinates, answer: Implicit) -> int:
    """A lower bound for the rank of the homogeneous form: quadrics of rank 3 or 4 have no factors."""
    p, roots = next(split_primes(coordinates.field.modulus, TO_PROVE))
    form = [[0] * 4 for _ in range(4)]
    for (i, j, k), element in answer.terms.items():
        value = reduce_element(element, p, roots[0])
        first, second = [axis for axis, e in enumerate((i, j, k, 2 - i - j - k)) for _ in range(e)]
        form[first][second] += value
        form[second][first] += value
    return int(nmod_mat(4, 4, [c % p for row in form for c in row], p).rank())
