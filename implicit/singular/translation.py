"""A rational translation of a polynomial, found from its coefficients, so that it can be undone.

A denominator that is a power of p changes the orders of coefficients in p only, so that primes are independent.
"""

from collections.abc import Iterator
from itertools import product

from flint import fmpq, fmpq_mat, fmpq_mpoly

from implicit.singular.harmonic import parts_of
from implicit.singular.homogeneous import affine_matrix, content, degree_of, identity, moved, order, primitive
from implicit.singular.refinement import kernel_of, slopes

_MANY = 64  # vectors modulo p that are tried


def unmoved(f: fmpq_mpoly, middle: fmpq_mat, primes: list[int]) -> fmpq_mat:
    """The shift (3, 1) after which the coefficients of a primitive polynomial are smallest, as far as it is found.

    Its part in p is that of the center, also where coefficients are as large without it, unless the center itself had p
    in the denominator before the translation.
    """
    whole, leading = fmpq_mat(3, 1), content(parts_of(f)[degree_of(f)])
    for p in primes:
        best, most = fmpq_mat(3, 1), 0
        for shift in (*([_digits(f, p)] if order(leading, p) > 0 else []), _fractions(middle, p)):
            if shift != fmpq_mat(3, 1):
                gain = order(content(moved(f, affine_matrix(identity(3), shift))), p)
                best, most = (shift, gain) if gain >= most else (best, most)
        whole = whole + best
    return whole


def _fractions(middle: fmpq_mat, p: int) -> fmpq_mat:
    """The partial fractions of three numbers whose denominator is a power of p, between 0 and 1."""
    parts = fmpq_mat(3, 1)
    for r in range(3):
        power, rest = 1, int(middle[r, 0].q)
        while rest % p == 0:
            power, rest = power * p, rest // p
        if power > 1:
            parts[r, 0] = fmpq(int(middle[r, 0].p) * pow(rest, -1, power) % power, power)
    return parts


def _digits(f: fmpq_mpoly, p: int) -> fmpq_mat:
    """A shift by its digits in base p, highest denominator first.

    With t replaced by p^k t the shift is integral and the polynomial is its leading form, shifted, modulo p. Each digit
    that makes it free of t modulo p allows to divide t by p.
    """
    degree, orders = degree_of(f), {k: order(content(part), p) for k, part in parts_of(f).items()}
    k = max((-((e - orders[degree]) // (degree - j)) for j, e in orders.items() if j < degree), default=0)
    whole = affine_matrix(identity(3), fmpq_mat(3, 1))
    whole[3, 3] = fmpq(p) ** max(k, 0)
    f = primitive(moved(f, whole))
    for _ in range(k):
        steps = list(_steps(f, p))
        if not steps:
            break
        images = [moved(f, step) for step in steps]
        best = max(range(len(steps)), key=lambda n: order(content(images[n]), p))
        whole, f = whole * steps[best], primitive(images[best])
    return fmpq_mat([[whole[r, 3] / whole[3, 3]] for r in range(3)])


def _steps(f: fmpq_mpoly, p: int) -> Iterator[fmpq_mat]:
    """Digits, with t divided by p: integral points along whose directions a polynomial does not change modulo p."""
    table = slopes(f)
    kernel = kernel_of([[int(table[r, c]) for c in range(4)] for r in range(table.nrows())], p)
    if p ** (len(kernel) - 1) > _MANY:
        return
    for numbers in product(range(p), repeat=len(kernel)):
        vector = [sum(n * v[c] for n, v in zip(numbers, kernel, strict=True)) % p for c in range(4)]
        if vector[3] == 1:
            yield fmpq_mat([[fmpq(p * int(r == c) if c < 3 else vector[r], p) for c in range(4)] for r in range(4)])
