"""Finer lattices of homogeneous coordinates, in which a polynomial has smaller coefficients.

A surface that was moved by rational numbers is special modulo the primes p of their denominators: it does not change
along some directions, or contains a plane more than once. There the lattice of homogeneous coordinates is refined by
the vectors u / p along these directions or in this plane, as long as that makes coefficients smaller.
Minimisation of hypersurfaces: Kollar, Electronic Research Announcements AMS 3 (1997) 17-27, arXiv:alg-geom/9701013.
"""

from collections.abc import Iterator

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpz_mat, nmod_mat
from flint import nmod_mpoly_ctx as modular

from implicit.singular.homogeneous import content, degree_of, moved, order

Vector = list[int]


def finer(f: fmpq_mpoly, p: int) -> fmpq_mat | None:
    """A basis, in columns, of a lattice finer by p in which coefficients are smaller; None where none is met."""
    return next((m for m in _candidates(f, p) if _gains(f, m, p)), None)


def slopes(f: fmpq_mpoly) -> fmpz_mat:
    """The coefficients of the four partial derivatives of an integral polynomial, (monomials, 4)."""
    columns = [f.derivative(a).to_dict() for a in range(4)]
    keys = sorted({m for column in columns for m in column})
    return fmpz_mat([[int(column.get(m, fmpq(0))) for column in columns] for m in keys])


def _candidates(f: fmpq_mpoly, p: int) -> Iterator[fmpq_mat]:
    """Finer lattices: by the directions along which f is constant modulo p, or those of a multiple plane."""
    table = slopes(f)
    rows = [[int(table[r, c]) for c in range(4)] for r in range(table.nrows())]
    kernel = kernel_of(rows, p)
    if 0 < len(kernel) < 4:
        yield _refined(kernel, p)
    ring = modular.get(("x", "y", "z", "t"), modulus=p, ordering=Ordering.degrevlex)
    image: dict[tuple[int, ...], int] = {}
    for m, c in f.to_dict().items():
        *exponents, n = (int(e) for e in m)
        image[tuple(exponents)] = (image.get(tuple(exponents), 0) + (3 * n + 1) * int(c)) % p
    reduced = ring.from_dict({m: c for m, c in image.items() if c})
    if reduced == 0:
        return
    for factor, power in reduced.factor()[1]:
        if power > 1 and factor.total_degree() == 1:
            plane = [int(factor.to_dict().get(tuple(int(a == b) for b in range(4)), 0)) for a in range(4)]
            yield _refined(kernel_of([plane], p), p)


def kernel_of(rows: list[Vector], p: int) -> list[Vector]:
    """A basis of the vectors (4,) that are orthogonal to the rows modulo p."""
    kernel, nullity = nmod_mat(rows, p).nullspace()
    return [[int(kernel[r, c]) for r in range(4)] for c in range(nullity)]


def _refined(vectors: list[Vector], p: int) -> fmpq_mat:
    """A basis, in columns, of the lattice Z^4 and the vectors / p."""
    rows = fmpz_mat([*vectors, *([p * int(r == c) for c in range(4)] for r in range(4))]).hnf()
    return fmpq_mat([[fmpq(int(rows[c, r]), p) for c in range(4)] for r in range(4)])


def _gains(f: fmpq_mpoly, basis: fmpq_mat, p: int) -> bool:
    """Whether coefficients become smaller in a finer lattice, beside what a mere change of scale does to them."""
    index = order(1 / basis.det(), p)
    return 4 * order(content(moved(f, basis)), p) + index * degree_of(f) > 0
