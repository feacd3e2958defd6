"""How far around a degenerate singular point no other one can be, by exact identities."""

from collections.abc import Sequence

import numpy as np
from flint import arb, fmpq, fmpq_mat, fmpq_poly, nmod_mat
from numpy.typing import NDArray

from implicit.singular.exact import ExactPoint
from implicit.singular.form import Field, evaluate, precision
from implicit.singular.frame import fitted
from implicit.singular.germ import Germ, Taylor, derivative, monomials


def lonely_radius(germ: Germ) -> tuple[float, NDArray[np.float64]]:
    """A radius r and axes (3, 3): no other singular point p + axes y, real or complex, has all |y_i| < r.

    From identities x^k = sum h g + r with terms of r of degree above k, for each coordinate x and the generators g.
    At a zero of all g whose largest coordinate is |x| = s > 0 that says s^k <= sum |r_m| s^|m|: impossible while
    sum |r_m| s^(|m| - k) < 1. Where nothing is found the radius is 0.
    """
    terms, axes = fitted(germ)
    generators = [*(derivative(terms, a) for a in range(3)), terms]
    found = germ.dimension(generators)
    if found is None or (germ.point.degree > 1 and found[1] > 6):
        return 0.0, axes
    order = found[1]
    rests = identities(germ, generators, order)
    size = 64.0
    while rests is not None and size > 2.0**-60:
        if all(_share(rest, germ.point, order, size) < 1.0 for rest in rests):
            return size, axes
        size /= 2
    return 0.0, axes


def _share(rest: Taylor, point: ExactPoint, order: int, size: float) -> float:
    with precision(64):
        theta = Field(point.modulus, point.near).root if point.degree > 1 else arb(0)
        total = arb(0)
        for m, c in rest.items():
            value = evaluate(c, theta) if point.degree > 1 else arb(c[0])
            total += abs(value) * arb(size) ** (sum(m) - order)
        return float(total.upper())


def identities(germ: Germ, generators: Sequence[Taylor], order: int) -> list[Taylor] | None:
    """The rests r = x_a^order - sum h g of degree above `order`, exactly, for a = 0, 1, 2."""
    n, modulus = germ.point.degree, germ.point.modulus
    columns = monomials(order + 1)
    place = {m: c for c, m in enumerate(columns)}
    pairs = list(germ.multiples(generators, order + 1))
    reduced = [[0] * len(columns) for _ in pairs]
    for line, (g, m) in zip(reduced, pairs, strict=True):
        for e, c in generators[g].items():
            column = place.get((e[0] + m[0], e[1] + m[1], e[2] + m[2]))
            if column is not None:
                line[column] = germ.prime.reduce(c)
    matrix = nmod_mat(reduced, germ.prime.p)
    chosen, kept = _pivots(matrix.transpose()), _pivots(matrix)
    system = [[fmpq(0)] * (len(chosen) * n) for _ in range(len(kept) * n)]
    row_of = {columns[c]: r for r, c in enumerate(kept)}
    for column, pair in enumerate(chosen):
        g, m = pairs[pair]
        for e, c in generators[g].items():
            row = row_of.get((e[0] + m[0], e[1] + m[1], e[2] + m[2]))
            if row is not None:
                for power in range(n):
                    image = c * fmpq_poly([0] * power + [1]) % modulus
                    for a, number in enumerate(image.coeffs()):
                        system[row * n + a][column * n + power] = number
    targets = [[fmpq(0)] * 3 for _ in range(len(kept) * n)]
    for a in range(3):
        top = tuple(order if b == a else 0 for b in range(3))
        if top not in row_of:
            return None
        targets[row_of[top] * n][a] = fmpq(1)
    solution = fmpq_mat(system).solve(fmpq_mat(targets))
    rests = []
    for a in range(3):
        rest: Taylor = {tuple(order if b == a else 0 for b in range(3)): fmpq_poly([1])}  # type: ignore[dict-item]
        for column, pair in enumerate(chosen):
            h = fmpq_poly([solution[column * n + power, a] for power in range(n)])
            if h != 0:
                g, m = pairs[pair]
                for e, c in generators[g].items():
                    key = (e[0] + m[0], e[1] + m[1], e[2] + m[2])
                    rest[key] = rest.get(key, fmpq_poly([0])) - h * c % modulus
        rest = {m: c for m, c in rest.items() if c != 0}
        if any(sum(m) <= order for m in rest):
            return None
        rests.append(rest)
    return rests


def _pivots(matrix: nmod_mat) -> list[int]:
    """The columns that are not combinations of earlier ones."""
    reduced, rank = matrix.rref()
    pivots, column = [], 0
    for row in range(rank):
        while int(reduced[row, column]) == 0:
            column += 1
        pivots.append(column)
        column += 1
    return pivots
