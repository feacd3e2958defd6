"""The polynomial of a rational surface by linear algebra modulo primes.

The polynomials of degree d that vanish on the surface are a null space: of the matrix whose rows are all monomials of
degree <= d at points of the surface. At the degree of the surface that space is one line, spanned by the irreducible
polynomial (J. Sylvester; modular arithmetic, the Chinese remainder theorem and rational reconstruction bring it home).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from flint import nmod_mat

from implicit.implicitize.clock import Clock
from implicit.implicitize.homogeneous import Coordinates, all_monomials
from implicit.implicitize.modular import (
    TO_CHECK,
    Element,
    Remainders,
    Residues,
    evaluate,
    powers,
    reduce_coordinates,
    reduce_element,
    split_primes,
    unmix,
)

Monomial = tuple[int, int, int]
Image = Callable[[Residues, int, list[Monomial] | None], tuple[list[Monomial], list[int]] | None]
"""From coordinates modulo p, and the support if known, to the coefficients modulo p up to a common factor."""


@dataclass(frozen=True)
class Implicit:
    """An integer polynomial in x, y, z: elements of the field by exponents; `primes` is how many found it."""

    degree: int
    terms: dict[Monomial, Element]
    primes: int


Verify = Callable[[Coordinates, Implicit, Clock], bool]


def lift(
    coordinates: Coordinates, degree: int, image: Image, clock: Clock, verify: Verify | None = None
) -> Implicit | None:
    """The polynomial from its images modulo primes, verified, by default at points modulo further primes.

    None if there is no image modulo any of the first primes: the method does not suit the surface.
    """
    field = coordinates.field
    remainders, support, pivot, used, failed = Remainders(), None, None, 0, 0
    for p, roots in split_primes(field.modulus):
        clock.check("the images modulo primes")
        found = _images(coordinates, image, support, p, roots)
        if found is None:
            failed += 1
            if failed > used + 1:
                return None
            continue
        support, columns = found
        if pivot is None:
            pivot = next(k for k, c in enumerate(columns[0]) if c)
        if not all(column[pivot] for column in columns):
            continue
        columns = [_scale(column, pivot, p) for column in columns]
        remainders.add([c for element in unmix(columns, roots, p) for c in element], p)
        used += 1
        numbers = remainders.fractions()
        if numbers is None:
            continue
        grouped = [tuple(numbers[k : k + field.degree]) for k in range(0, len(numbers), field.degree)]
        answer = Implicit(degree, {m: e for m, e in zip(support, grouped, strict=True) if any(e)}, used)
        if (verify or vanishes)(coordinates, answer, clock):
            return answer
    raise AssertionError("there are infinitely many primes")


def _images(
    coordinates: Coordinates, image: Image, support: list[Monomial] | None, p: int, roots: list[int]
) -> tuple[list[Monomial], list[list[int]]] | None:
    """The coefficients at every root of the modulus, on one support."""
    columns = []
    for root in roots:
        found = image(reduce_coordinates(coordinates, p, root), p, support)
        if found is None:
            return None
        support = found[0]
        columns.append(found[1])
    return (support, columns) if support is not None else None


def _scale(column: list[int], pivot: int, p: int) -> list[int]:
    inverse = pow(column[pivot], -1, p)
    return [c * inverse % p for c in column]


def vanishes(coordinates: Coordinates, answer: Implicit, clock: Clock) -> bool:
    """Whether the polynomial is zero at random points of the surface modulo a prime that did not help to find it."""
    clock.check("the check of the polynomial")
    p, roots = next(split_primes(coordinates.field.modulus, TO_CHECK - 1000 * answer.primes))
    monomials = list(answer.terms)
    for root in roots:
        points = random_points(reduce_coordinates(coordinates, p, root), 8, p, answer.primes)
        coefficients = np.array([reduce_element(e, p, root) for e in answer.terms.values()], dtype=np.int64)
        rows = monomial_rows(points, monomials, answer.degree, p)
        if ((rows * coefficients % p).sum(axis=1) % p).any():
            return False
    return True


def random_points(arrays: Residues, count: int, p: int, seed: int) -> Residues:
    """Homogeneous points of the surface at random parameters modulo p, (4, count)."""
    random = np.random.default_rng(seed)
    s, t = random.integers(0, p, (2, count))
    return evaluate(arrays, s, t, p)


def monomial_rows(points: Residues, monomials: list[Monomial], degree: int, p: int) -> Residues:
    """All monomials, made homogeneous of the degree, at points (4, k): a matrix (k, monomials) modulo p."""
    x, y, z, w = (powers(row, degree, p) for row in points)
    i, j, k = np.array(monomials).reshape(-1, 3).T
    return ((x[i] * y[j] % p) * (z[k] * w[degree - i - j - k] % p) % p).T


def null_space_image(degree: int) -> Image:
    """The image modulo p of the one polynomial of the degree that vanishes on the surface, by a null space."""

    def image(arrays: Residues, p: int, support: list[Monomial] | None) -> tuple[list[Monomial], list[int]] | None:
        monomials = support or all_monomials(degree)
        rows = monomial_rows(random_points(arrays, len(monomials) + 3, p, 2), monomials, degree, p)
        kernel, nullity = nmod_mat(*rows.shape, rows.ravel().tolist(), p).nullspace()
        if nullity != 1:
            return None
        column = [int(kernel[k, 0]) for k in range(len(monomials))]
        if support is None:
            kept = [(m, c) for m, c in zip(monomials, column, strict=True) if c]
            return [m for m, _ in kept], [c for _, c in kept]
        return support, column

    return image
