"""A rational rotation and translation of a surface, found from its coefficients, so that it can be undone.

The center of a polynomial moves with it (`center`). Around the center only a rotation is left, and a rational rotation
is a product of turns by integral quaternions of prime norm p. There are p + 1 of norm p, one for each line of isotropic
vectors modulo p, x^2 + y^2 + z^2 = 0, and products of them are the vertices of a tree. The order in p of the
coefficients is a concave function on that tree: where it is not yet greatest exactly one of the p + 1 turns increases
it, so one turn after the other is undone without a search. Turns of norm 2 only exchange coordinates.
Trees of quaternions: Vigneras, Arithmetique des algebres de quaternions (1980), II.2, doi:10.1007/BFb0091027;
concavity: Kempf, Annals of Mathematics 108 (1978) 299-316, doi:10.2307/1971168.
"""

from functools import lru_cache
from math import isqrt

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_mpoly
from numpy.typing import NDArray

from implicit.singular.harmonic import harmonics, product
from implicit.singular.homogeneous import RING, affine_matrix, content, degree_of, identity, moved, order, primitive

Integers = NDArray[np.int64]

_ASIDE = (1, 2, 5)  # any direction


def unturned(f: fmpq_mpoly, primes: list[int]) -> fmpq_mat:
    """The rotation (3, 3) after which no further one, by denominators of these primes, makes coefficients smaller.

    The surface must have its center at 0. A rotation keeps the square of a harmonic part and leaves it multiples of p,
    so that p^2 divides the square once coefficients are made integral again.
    """
    whole, parts = identity(3), harmonics(f)
    squares = [product(part, part) for part in parts]
    for p in primes:
        if p == 2 or not any(order(square, p) > 1 for square in squares):
            continue
        while (turn := _turn(parts, p)) is not None:
            whole, parts = whole * turn, [primitive(_rotated(part, turn)) for part in parts]
    return whole


def _rotated(f: fmpq_mpoly, turn: fmpq_mat) -> fmpq_mpoly:
    return moved(f, affine_matrix(turn, fmpq_mat(3, 1)))


def _turn(parts: list[fmpq_mpoly], p: int) -> fmpq_mat | None:
    """The rotation of denominator p that makes the coefficients of primitive parts, taken together, smaller; if any."""
    matrices, lines = _turns(p)
    chosen = np.zeros(len(lines), dtype=np.bool_)
    for part in parts:
        chosen |= _vanishing(part, p, lines, degree_of(part) // 2)
    for matrix in matrices[chosen]:
        turn = fmpq_mat([[fmpq(int(e), p) for e in row] for row in matrix])
        if sum(order(content(_rotated(part, turn)), p) for part in parts) > 0:
            return turn
    return None


@lru_cache(maxsize=64)
def _turns(p: int) -> tuple[Integers, Integers]:
    """The p + 1 turns of odd prime norm p, as p times matrices (p + 1, 3, 3), and their lines modulo p (p + 1, 3).

    Modulo p a matrix has rank one: its image is a line of isotropic vectors, whose first coordinate is scaled to 1.
    Quaternions with the same line differ by one of norm 1 on the right.
    """
    matrices = _matrices(_quaternions(p))
    n = np.arange(len(matrices))
    columns = matrices[n, :, (matrices % p).any(axis=1).argmax(axis=1)] % p
    first = columns[n, (columns != 0).argmax(axis=1)]
    inverse = np.array([pow(int(v), -1, p) for v in first])
    lines, at = np.unique(columns * inverse[:, None] % p, axis=0, return_index=True)
    return matrices[at], lines


def _quaternions(p: int) -> Integers:
    """The integral quaternions of norm p whose first component is not negative (4, n)."""
    r = isqrt(p)
    a, b, c = np.meshgrid(np.arange(r + 1), *[np.arange(-r, r + 1)] * 2, indexing="ij")
    rest = p - a * a - b * b - c * c
    d = np.sqrt(np.maximum(rest, 0)).round().astype(np.int64)
    half = np.array([v[(rest >= 0) & (d * d == rest)] for v in (a, b, c, d)])
    return np.hstack([half, half * [[1], [1], [1], [-1]]])


def _matrices(quaternions: Integers) -> Integers:
    """The rotations by quaternions (4, n), times their norm (n, 3, 3)."""
    a, b, c, d = quaternions
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return np.moveaxis(np.array(rows, dtype=np.int64), 2, 0)


def _vanishing(part: fmpq_mpoly, p: int, points: Integers, k: int) -> NDArray[np.bool_]:
    """Where a form and its first k derivatives in some direction vanish modulo p.

    A turn that makes the coefficients of a form smaller has a line where the form vanishes more than half its degree.
    """
    found = np.ones(len(points), dtype=np.bool_)
    for _ in range(k + 1):
        found &= ~_values(part, p, points).any(axis=1)
        part = sum((part.derivative(a) * s for a, s in enumerate(_ASIDE)), start=RING.constant(0))
    return found


def _values(part: fmpq_mpoly, p: int, points: Integers) -> Integers:
    """An integral form at points (n, 3), modulo p, for each power of w (n, powers)."""
    terms = [([int(e) for e in m], int(c) % p) for m, c in part.to_dict().items()]
    values = np.zeros((len(points), 1 + max((m[4] for m, _ in terms), default=0)), dtype=np.int64)
    for m, c in terms:
        term = np.full(len(points), c, dtype=np.int64)
        for axis in range(3):
            for _ in range(m[axis]):
                term = term * points[:, axis] % p
        values[:, m[4]] += term
    return np.asarray(values % p)
