"""Rational coordinates in which a surface has small coefficients, so that exact algebra does not depend on the frame.

A rotation and a translation by rational numbers are undone first (`rotation`, `translation`); then the lattice of
homogeneous coordinates is refined, prime by prime, as other affine maps need it (`refinement`).
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf, lcm

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz_mat
from numpy.typing import NDArray

from implicit.singular.center import center
from implicit.singular.form import Field, Form
from implicit.singular.homogeneous import affine_matrix, homogeneous, identity, moved, primitive, size, terms_of
from implicit.singular.refinement import finer, slopes
from implicit.singular.rotation import unturned
from implicit.singular.translation import unmoved

_PRIMES = [p for p in range(2, 1000) if all(p % q for q in range(2, int(p**0.5) + 1))]
_SKEW = 30.0  # condition of a matrix: no coordinates in which distances are quite different
_WORTH = 0.7  # of the digits: other coordinates are taken where they need fewer
_VAIN = 8  # refinements that bring nothing: there is no end of them where a surface is unstable


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


def place(form: Form) -> Placement:
    """The form in the coordinates of the smallest coefficients that were met; only turned where it is a cone."""
    start = primitive(homogeneous(form))
    middle = center(start)
    best, least, kept = Placement(form, identity(3), fmpq_mat(3, 1)), _WORTH * size(start), identity(4)
    whole = _turned_back(start, middle)
    found, digits = _placed(start, form.field, whole, middle)
    if digits < least:
        best, least, kept = found, digits, whole
    for p in _special(primitive(moved(start, kept))):
        whole, vain = kept, 0
        while vain < _VAIN and (step := finer(primitive(moved(start, whole)), p)) is not None:
            whole, vain = whole * step, vain + 1
            found, digits = _placed(start, form.field, whole, middle)
            if digits < least:
                best, least, kept, vain = found, digits, whole, 0
    return best


def _placed(f: fmpq_mpoly, field: Field, whole: fmpq_mat, middle: fmpq_mat) -> tuple[Placement, float]:
    """The surface in a basis of the lattice that keeps the plane at infinity, and the number of digits it needs."""
    affine, matrix, shift = _affine(whole, middle)
    near = primitive(moved(f, affine))
    found = Placement(Form(terms_of(near), field), matrix, shift)
    return found, size(near) if np.linalg.cond(found.floats[0]) < _SKEW else inf


def _turned_back(f: fmpq_mpoly, middle: fmpq_mat) -> fmpq_mat:
    """The homogeneous coordinates (4, 4) without the rotation and translation that make coefficients large."""
    at_center = moved(f, affine_matrix(identity(3), middle))
    turn = unturned(at_center, _PRIMES)
    f = primitive(moved(f, affine_matrix(turn, fmpq_mat(3, 1))))
    shift = unmoved(f, turn.transpose() * middle, _PRIMES)
    return affine_matrix(turn, turn * shift)


def _special(f: fmpq_mpoly) -> list[int]:
    """The primes, from above, modulo which a polynomial may depend on fewer coordinates; none for a cone."""
    table = slopes(f)
    square = (table.transpose() * table).det()
    return [p for p in reversed(_PRIMES) if square % p == 0] if square != 0 else []


def _affine(whole: fmpq_mat, middle: fmpq_mat) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
    """A basis of the lattice, in columns, that keeps the plane at infinity: short vectors in it, and one to the middle.

    Returns it with the last coordinate scaled to 1, and the matrix and shift of the affine map.
    """
    scale = lcm(*(int(whole[r, c].q) for r in range(4) for c in range(4)))
    order = (3, 0, 1, 2)
    rows = fmpz_mat([[int(whole[a, c] * scale) for a in order] for c in range(4)]).hnf()
    plane = fmpz_mat([[int(rows[r, c]) for c in (1, 2, 3)] for r in (1, 2, 3)]).lll()
    height = int(rows[0, 0])
    matrix = fmpq_mat([[fmpq(int(plane[c, r]), height) for c in range(3)] for r in range(3)])
    shift = fmpq_mat([[fmpq(int(rows[0, r + 1]), height)] for r in range(3)])
    steps = matrix.inv() * (shift - middle)
    shift = shift - matrix * fmpq_mat([[fmpq(int((steps[r, 0] + fmpq(1, 2)).floor()))] for r in range(3)])
    return affine_matrix(matrix, shift), matrix, shift
