"""Arithmetic modulo primes below 2^31, whose products fit in an int64, and the way back to fractions."""

from collections.abc import Iterator, Sequence
from math import gcd, isqrt
from typing import TypeAlias

import numpy as np
from flint import fmpz, nmod_mat, nmod_poly
from numpy.typing import NDArray

from implicit.implicitize.homogeneous import Coordinates

Residues: TypeAlias = NDArray[np.int64]
Element: TypeAlias = tuple[int, ...]
"""An integer of a number field: coefficients of 1, a, a^2, ... for the generator a; one number over the rationals."""


TO_FIND, TO_CHECK, TO_PROVE = 1 << 31, 7 << 28, 3 << 29
"""Where the primes for the three purposes start, downward: far enough apart that they never meet."""


def split_primes(modulus: Sequence[int], below: int = TO_FIND) -> Iterator[tuple[int, list[int]]]:
    """Primes p < `below` where the monic integer polynomial `modulus` has as many roots as its degree.

    Each comes with its roots: the images of the generator of the number field in the integers modulo p. The constant
    term of the modulus is first.
    """
    degree, p = len(modulus) - 1, below
    while True:
        p -= 1
        if not fmpz(p).is_prime():
            continue
        if degree == 1:
            yield p, [-modulus[0] % p]
            continue
        roots = [int(r) for r, multiplicity in nmod_poly([c % p for c in modulus], p).roots() if multiplicity == 1]
        if len(roots) == degree:
            yield p, sorted(roots)


def powers(base: Residues, degree: int, p: int) -> Residues:
    """1, base, ..., base^degree modulo p along a new first axis."""
    table = np.ones((degree + 1, *base.shape), dtype=np.int64)
    for k in range(1, degree + 1):
        np.remainder(table[k - 1] * base, p, out=table[k])
    return table


def product(left: Residues, right: Residues, p: int) -> Residues:
    """The matrix product modulo p.

    The left factor is cut into two halves of at most 16 bits: sums of 32 products with 31 bits are exact in doubles.
    """
    if left.shape[1] <= 6:
        return (left[:, :, None] * right % p).sum(axis=1) % p
    out = np.zeros((left.shape[0], right.shape[1]), dtype=np.int64)
    for k in range(0, left.shape[1], 32):
        high, low = np.divmod(left[:, k : k + 32], 1 << 16)
        exact = right[k : k + 32].astype(np.float64)
        upper, lower = ((half.astype(np.float64) @ exact).astype(np.int64) % p for half in (high, low))
        out += ((upper << 16) + lower) % p
    return out % p


def reduce_coordinates(coordinates: Coordinates, p: int, root: int) -> Residues:
    """The four coefficient arrays X, Y, Z, W modulo p, (4, m+1, n+1), with the field's generator sent to `root`."""
    m, n = coordinates.bidegree
    out = np.zeros((4, m + 1, n + 1), dtype=np.int64)
    for row, terms in zip(out, coordinates.terms, strict=True):
        for (i, j), element in terms.items():
            row[i, j] = reduce_element(element, p, root)
    return out


def reduce_element(element: Element, p: int, root: int) -> int:
    """An integer of the number field modulo p, the generator sent to `root`."""
    value = 0
    for coefficient in reversed(element):
        value = (value * root + coefficient) % p
    return value


def evaluate(arrays: Residues, s: Residues, t: Residues, p: int) -> Residues:
    """The coordinates (4, m+1, n+1) at the parameters s and t, (k,) each: an array (4, k) modulo p."""
    _, rows, columns = arrays.shape
    in_s, in_t = powers(s, rows - 1, p), powers(t, columns - 1, p)
    in_t_only = product(arrays.transpose(0, 2, 1).reshape(4 * columns, rows), in_s, p).reshape(4, columns, -1)
    return (in_t_only * in_t % p).sum(axis=1) % p


def unmix(values: list[list[int]], roots: list[int], p: int) -> list[list[int]]:
    """The coefficients modulo p of field elements whose images at the roots are given, one list of images per root."""
    if len(roots) == 1:
        return [[value] for value in values[0]]
    n = len(roots)
    vandermonde = nmod_mat(n, n, [pow(r, k, p) for r in roots for k in range(n)], p)
    images = nmod_mat(n, len(values[0]), [v for row in values for v in row], p)
    solved = vandermonde.solve(images).tolist()
    return [[int(solved[k][j]) for k in range(n)] for j in range(len(values[0]))]


class Remainders:
    """A vector of unknown fractions with a common denominator, known modulo a growing product of primes."""

    def __init__(self) -> None:
        self.modulus = 1
        self.values: list[int] = []

    def add(self, residues: Sequence[int], p: int) -> None:
        """Chinese remaindering with the residues modulo one more prime."""
        if self.modulus == 1:
            self.values, self.modulus = [int(r) for r in residues], p
            return
        inverse, modulus = pow(self.modulus, -1, p), self.modulus
        self.values = [a + modulus * ((int(r) - a) * inverse % p) for a, r in zip(self.values, residues, strict=True)]
        self.modulus *= p

    def fractions(self) -> list[int] | None:
        """Integers in the same proportion as the fractions, or None while the modulus is too small to tell."""
        denominator, numerators = 1, list[tuple[int, int]]()
        limit = self.modulus >> (self.modulus.bit_length() // 4)
        for value in self.values:
            scaled = value * denominator % self.modulus
            centered = scaled if 2 * scaled <= self.modulus else scaled - self.modulus
            if abs(centered) < limit:
                numerators.append((centered, denominator))
                continue
            found = _reconstruct(scaled, self.modulus)
            if found is None:
                return None
            numerators.append((found[0], found[1] * denominator))
            denominator *= found[1]
        whole = [n * (denominator // d) for n, d in numerators]
        content = gcd(*whole)
        return [w // content for w in whole] if content else None


def _reconstruct(residue: int, modulus: int) -> tuple[int, int] | None:
    """The fraction n/d = residue modulo `modulus` with |n| and d below sqrt(modulus/2), or None."""
    bound = isqrt(modulus // 2)
    r0, r1, s0, s1 = modulus, residue, 0, 1
    while r1 > bound:
        quotient = r0 // r1
        r0, r1, s0, s1 = r1, r0 - quotient * r1, s1, s0 - quotient * s1
    if s1 == 0 or abs(s1) > bound:
        return None
    return (r1, s1) if s1 > 0 else (-r1, -s1)
