"""Rational coordinates in which a surface has small coefficients, so that exact algebra does not depend on the frame.

A surface that was turned or moved by rational numbers is special modulo the primes p of their denominators: it does not
change along some directions, or contains a plane more than once. There the lattice of homogeneous coordinates is
refined by the vectors u / p along these directions or in this plane, as long as that makes coefficients smaller.
Minimisation of hypersurfaces: Kollar, Electronic Research Announcements AMS 3 (1997) 17-27, arXiv:alg-geom/9701013.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import lcm

import numpy as np
from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly, fmpz, fmpz_mat, nmod_mat
from flint import nmod_mpoly_ctx as modular
from numpy.typing import NDArray

from implicit.singular.form import Form

_NAMES = ("x", "y", "z", "t", "w")
_RING = fmpq_mpoly_ctx.get(_NAMES, Ordering.degrevlex)
_PRIMES = [p for p in range(2, 1000) if all(p % q for q in range(2, int(p**0.5) + 1))]
_SKEW = 30.0  # condition of a matrix: no coordinates in which distances are quite different
_WORTH = 0.7  # of the digits: other coordinates are taken where they need fewer
_VAIN = 8  # refinements that bring nothing: there is no end of them where a surface is unstable

Vector = list[int]


@dataclass(frozen=True, eq=False)
class Placement:
    """The surface in coordinates X with (x, y, z) = matrix X + shift."""

    form: Form
    matrix: fmpq_mat
    shift: fmpq_mat

    @cached_property
    def floats(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The matrix (3, 3) and the shift (3,) as floats."""
        matrix = [[_float(self.matrix[r, c]) for c in range(3)] for r in range(3)]
        return np.array(matrix), np.array([_float(self.shift[r, 0]) for r in range(3)])


def _float(c: fmpq) -> float:
    return int(c.p) / int(c.q)


def _identity(n: int) -> fmpq_mat:
    return fmpq_mat([[fmpq(int(r == c)) for c in range(n)] for r in range(n)])


def place(form: Form) -> Placement:
    """The form in the coordinates of the smallest coefficients that were met; as it is where it is a cone."""
    start = _primitive(_homogeneous(form))
    table = _slopes(start)
    square = (table.transpose() * table).det()
    best, least = Placement(form, _identity(3), fmpq_mat([[fmpq(0)]] * 3)), _WORTH * _size(start)
    kept = _identity(4)
    for p in reversed(_PRIMES if square != 0 else []):
        if square % p:
            continue
        whole, f, vain = kept, _primitive(_moved(start, kept)), 0
        while vain < _VAIN:
            finer = next((m for m in _candidates(f, p) if _gains(f, m, p)), None)
            if finer is None:
                break
            whole, f, vain = whole * finer, _primitive(_moved(f, finer)), vain + 1
            affine, matrix, shift = _affine(whole)
            near = _primitive(_moved(start, affine))
            found = Placement(Form(_terms(near), form.field), matrix, shift)
            if _size(near) < least and np.linalg.cond(found.floats[0]) < _SKEW:
                best, least, kept, vain = found, _size(near), whole, 0
    return best


def _size(f: fmpq_mpoly) -> int:
    """The number of digits of an integral polynomial."""
    return sum(int(c.p).bit_length() for c in f.coeffs())


def _homogeneous(form: Form) -> fmpq_mpoly:
    return _RING.from_dict(
        {(*m, form.degree - sum(m), n): a for m, c in form.terms.items() for n, a in enumerate(c.coeffs()) if a != 0}
    )


def _terms(f: fmpq_mpoly) -> dict[tuple[int, int, int], fmpq_poly]:
    found: dict[tuple[int, int, int], dict[int, fmpq]] = {}
    for m, c in f.to_dict().items():
        i, j, k, _, n = (int(e) for e in m)
        found.setdefault((i, j, k), {})[n] = c
    return {m: fmpq_poly([c.get(n, fmpq(0)) for n in range(max(c) + 1)]) for m, c in found.items()}


def _moved(f: fmpq_mpoly, matrix: fmpq_mat) -> fmpq_mpoly:
    """The polynomial in new homogeneous coordinates, old = matrix new."""
    gens = _RING.gens()
    images = [sum((gens[c] * matrix[r, c] for c in range(4)), start=gens[0] * 0) for r in range(4)]
    return f.compose(*images, gens[4], ctx=_RING)


def _content(f: fmpq_mpoly) -> fmpq:
    coefficients = f.coeffs()
    scale = lcm(*(int(c.q) for c in coefficients))
    content = fmpz(0)
    for c in coefficients:
        content = fmpz(int(c * scale)).gcd(content)
    return fmpq(int(content), scale)


def _primitive(f: fmpq_mpoly) -> fmpq_mpoly:
    return f * (1 / _content(f))


def _slopes(f: fmpq_mpoly) -> fmpz_mat:
    """The coefficients of the four partial derivatives of an integral polynomial, (monomials, 4)."""
    columns = [f.derivative(a).to_dict() for a in range(4)]
    keys = sorted({m for column in columns for m in column})
    return fmpz_mat([[int(column.get(m, fmpq(0))) for column in columns] for m in keys])


def _candidates(f: fmpq_mpoly, p: int) -> Iterator[fmpq_mat]:
    """Finer lattices: by the directions along which f is constant modulo p, or those of a multiple plane."""
    table = _slopes(f)
    rows = [[int(table[r, c]) for c in range(4)] for r in range(table.nrows())]
    kernel = _kernel(rows, p)
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
            yield _refined(_kernel([plane], p), p)


def _kernel(rows: list[Vector], p: int) -> list[Vector]:
    kernel, nullity = nmod_mat(rows, p).nullspace()
    return [[int(kernel[r, c]) for r in range(4)] for c in range(nullity)]


def _refined(vectors: list[Vector], p: int) -> fmpq_mat:
    """A basis, in columns, of the lattice Z^4 and the vectors / p."""
    rows = fmpz_mat([*vectors, *([p * int(r == c) for c in range(4)] for r in range(4))]).hnf()
    return fmpq_mat([[fmpq(int(rows[c, r]), p) for c in range(4)] for r in range(4)])


def _gains(f: fmpq_mpoly, finer: fmpq_mat, p: int) -> bool:
    """Whether coefficients become smaller in a finer lattice, beside what a mere change of scale does to them."""
    degree = sum(int(e) for e in f.monoms()[0][:4])
    index = _order(1 / finer.det(), p)
    return 4 * _order(_content(_moved(f, finer)), p) + index * degree > 0


def _order(c: fmpq, p: int) -> int:
    above, below, order = int(c.p), int(c.q), 0
    while above % p == 0:
        above, order = above // p, order + 1
    while below % p == 0:
        below, order = below // p, order - 1
    return order


def _affine(whole: fmpq_mat) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
    """A basis of the lattice, in columns, that keeps the plane at infinity: short vectors in it, and one beside it.

    Returns it with the last coordinate scaled to 1, and the matrix and shift of the affine map.
    """
    scale = lcm(*(int(whole[r, c].q) for r in range(4) for c in range(4)))
    order = (3, 0, 1, 2)
    rows = fmpz_mat([[int(whole[a, c] * scale) for a in order] for c in range(4)]).hnf()
    plane = fmpz_mat([[int(rows[r, c]) for c in (1, 2, 3)] for r in (1, 2, 3)]).lll()
    height = int(rows[0, 0])
    matrix = fmpq_mat([[fmpq(int(plane[c, r]), height) for c in range(3)] for r in range(3)])
    shift = fmpq_mat([[fmpq(int(rows[0, r + 1]), height)] for r in range(3)])
    steps = matrix.inv() * shift
    shift = shift - matrix * fmpq_mat([[fmpq(int((steps[r, 0] + fmpq(1, 2)).floor()))] for r in range(3)])
    affine = [[*(matrix[r, c] for c in range(3)), shift[r, 0]] for r in range(3)]
    return fmpq_mat([*affine, [fmpq(0), fmpq(0), fmpq(0), fmpq(1)]]), matrix, shift
