"""Curves that are all of the intersection of two surfaces, as their degrees show."""

from dataclasses import dataclass

import sympy
from flint import fmpq, fmpq_mat, fmpq_mpoly

from implicit.singular.arcs import Part

Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]


@dataclass(frozen=True)
class Shape:
    """A curve: equations in x, y, z that cut it out, and parametrizations in t of the lines or the conic that it is.

    Where `upright` is not empty the equations hold on some lines too, over the points where these are 0.
    """

    equations: tuple[fmpq_mpoly, ...]
    expressions: tuple[Triple, ...] = ()
    upright: tuple[fmpq_mpoly, ...] = ()


def intersection(part: Part, degree: int) -> Shape | None:
    """Two surfaces of degrees a b = `degree` that meet in this curve and, by Bezout, in nothing else; or None."""
    first, low = None, 0
    for n in range(2, degree):
        if n * n > degree and first is None:
            return None
        found = containing(part, n)
        if first is None and found:
            first, low, found = found[0], n, found[1:]
        if first is None or not found or degree != low * n:
            continue
        second = next((q for q in found if first.gcd(q).total_degree() <= 0), None)
        if second is not None:
            return Shape((first, second))
    return None


def containing(part: Part, degree: int) -> list[fmpq_mpoly]:
    """A basis of the polynomials up to a degree that vanish on a curve, where Z = R / P_Y."""
    p = part.projection
    x, y = p.plane.context().gens()
    slope, height = p.plane.derivative(1), p.height
    heights = _powers(height, degree, p.plane)
    slopes = _powers(slope, degree, p.plane)
    powers = [(i, j, k) for k in range(degree + 1) for i in range(degree + 1 - k) for j in range(degree + 1 - k - i)]
    columns = [divmod(x**i * y**j * heights[k] * slopes[degree - k], p.plane)[1].to_dict() for i, j, k in powers]
    keys = sorted({m for column in columns for m in column})
    reduced, rank = fmpq_mat([[column.get(m, fmpq(0)) for column in columns] for m in keys]).rref()
    leads = [_leading(reduced, r) for r in range(rank)]
    forms = p.forms()
    monomials = [forms[0] ** i * forms[1] ** j * forms[2] ** k for i, j, k in powers]
    out = []
    for c in sorted(set(range(len(powers))) - set(leads)):
        weights = {lead: -reduced[r, c] for r, lead in enumerate(leads)} | {c: fmpq(1)}
        out.append(sum((monomials[n] * weight for n, weight in weights.items()), start=forms[0] * 0))
    return out


def _powers(base: fmpq_mpoly, highest: int, modulus: fmpq_mpoly) -> list[fmpq_mpoly]:
    out = [base * 0 + 1]
    for _ in range(highest):
        out.append(divmod(out[-1] * base, modulus)[1])
    return out


def _leading(matrix: fmpq_mat, row: int) -> int:
    return next(c for c in range(matrix.ncols()) if matrix[row, c] != 0)
