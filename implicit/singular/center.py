"""A rational point of a polynomial that turns and moves with it."""

from flint import fmpq, fmpq_mat, fmpq_mpoly

from implicit.singular.harmonic import parts_of, product
from implicit.singular.homogeneous import RING, affine_matrix, degree_of, identity, moved


def center(f: fmpq_mpoly) -> fmpq_mat:
    """A rational point (3, 1) that turns and moves with the surface.

    A step s changes the part of degree k, once those of higher degree do not change any more, by s times the gradient
    of the part of degree k + 1. The center makes it orthogonal to that gradient in the scalar product that rotations
    keep (`product`). What no part determines, along a cylinder, is left where it is.
    """
    free, at = identity(3), fmpq_mat(3, 1)
    for k in reversed(range(degree_of(f))):
        parts = parts_of(moved(f, affine_matrix(identity(3), at)))
        slopes = [parts[k + 1].derivative(a) if k + 1 in parts else RING.constant(0) for a in range(3)]
        n = free.ncols()
        along = [sum((slopes[a] * free[a, c] for a in range(3)), start=slopes[0] * 0) for c in range(n)]
        rest = parts.get(k, RING.constant(0))
        step, kernel = _solved([[product(a, b) for b in along] + [-product(a, rest)] for a in along])
        at = at + free * step
        if not kernel.ncols():
            break
        free = free * kernel
    return at


def _solved(rows: list[list[fmpq]]) -> tuple[fmpq_mat, fmpq_mat]:
    """A solution (n, 1) of n equations with the right hand side in the last column, and the kernel (n, k)."""
    n = len(rows)
    reduced, rank = fmpq_mat(rows).rref()
    lead = [next(c for c in range(n) if reduced[r, c] != 0) for r in range(rank)]
    others = [c for c in range(n) if c not in lead]
    solution, kernel = fmpq_mat(n, 1), fmpq_mat(n, len(others))
    for r, c in enumerate(lead):
        solution[c, 0] = reduced[r, n]
        for k, other in enumerate(others):
            kernel[c, k] = -reduced[r, other]
    for k, other in enumerate(others):
        kernel[other, k] = fmpq(1)
    return solution, kernel
