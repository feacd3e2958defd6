"""Polynomials over Q(w) made homogeneous by t, under rational matrices; w is carried along as one more variable."""

from math import lcm

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly, fmpz

from implicit.singular.form import Form

RING = fmpq_mpoly_ctx.get(("x", "y", "z", "t", "w"), Ordering.degrevlex)


def homogeneous(form: Form) -> fmpq_mpoly:
    """The form in x, y, z, t."""
    return RING.from_dict(
        {(*m, form.degree - sum(m), n): a for m, c in form.terms.items() for n, a in enumerate(c.coeffs()) if a != 0}
    )


def terms_of(f: fmpq_mpoly) -> dict[tuple[int, int, int], fmpq_poly]:
    """The terms of the form at t = 1."""
    found: dict[tuple[int, int, int], dict[int, fmpq]] = {}
    for m, c in f.to_dict().items():
        i, j, k, _, n = (int(e) for e in m)
        found.setdefault((i, j, k), {})[n] = c
    return {m: fmpq_poly([c.get(n, fmpq(0)) for n in range(max(c) + 1)]) for m, c in found.items()}


def size(f: fmpq_mpoly) -> int:
    """The number of digits of an integral polynomial."""
    return sum(int(c.p).bit_length() for c in f.coeffs())


def degree_of(f: fmpq_mpoly) -> int:
    """The degree in x, y, z, t."""
    return sum(int(e) for e in f.monoms()[0][:4])


def identity(n: int) -> fmpq_mat:
    """The unit matrix (n, n)."""
    return fmpq_mat([[fmpq(int(r == c)) for c in range(n)] for r in range(n)])


def affine_matrix(matrix: fmpq_mat, shift: fmpq_mat) -> fmpq_mat:
    """The map x = matrix X + shift on homogeneous coordinates (4, 4)."""
    rows = [[*(matrix[r, c] for c in range(3)), shift[r, 0]] for r in range(3)]
    return fmpq_mat([*rows, [fmpq(0), fmpq(0), fmpq(0), fmpq(1)]])


def moved(f: fmpq_mpoly, matrix: fmpq_mat) -> fmpq_mpoly:
    """The polynomial in new homogeneous coordinates, old = matrix new."""
    gens = RING.gens()
    images = [sum((gens[c] * matrix[r, c] for c in range(4)), start=gens[0] * 0) for r in range(4)]
    return f.compose(*images, gens[4], ctx=RING)


def content(f: fmpq_mpoly) -> fmpq:
    """The greatest rational number that leaves the coefficients integral when they are divided by it."""
    coefficients = f.coeffs()
    scale = lcm(*(int(c.q) for c in coefficients))
    found = fmpz(0)
    for c in coefficients:
        found = fmpz(int(c * scale)).gcd(found)
    return fmpq(int(found), scale)


def primitive(f: fmpq_mpoly) -> fmpq_mpoly:
    """The polynomial with integral coefficients that have no common factor."""
    return f * (1 / content(f))


def order(c: fmpq, p: int) -> int:
    """How often the prime p divides a number other than 0."""
    above, below, found = int(c.p), int(c.q), 0
    while above % p == 0:
        above, found = above // p, found + 1
    while below % p == 0:
        below, found = below // p, found - 1
    return found
