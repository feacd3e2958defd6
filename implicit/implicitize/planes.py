"""Moving planes: planes a x + b y + c z + d = 0 whose coefficients are polynomials in s, t and that follow the surface.

Those of bidegree (2m-1, n-1) form a matrix M(x, y, z) = x A + y B + z C + D with 2mn rows. Without base points it is
square and det M = f^k, k the degree of the map; with simple base points f^k is the greatest common divisor of its
maximal minors (T. Sederberg, F. Chen 1995, doi 10.1145/218380.218460; L. Buse, D. Cox, C. D'Andrea 2003,
doi 10.1142/S0219498803000489). Determinants at points modulo primes, interpolated, give the coefficients.
"""

from math import comb

import numpy as np
from flint import nmod_mat, nmod_poly

from implicit.implicitize.clock import Clock
from implicit.implicitize.eliminate import Image, Monomial
from implicit.implicitize.homogeneous import all_monomials
from implicit.implicitize.modular import Residues, product

_BATCH = 160_000  # entries of the matrices whose determinants are found together: they fit in a cache


def plane_matrices(arrays: Residues, p: int) -> list[Residues]:
    """One or two choices of r = 2mn moving planes modulo p, as matrices (A, B, C, D), (4, r, r); none if too few exist.

    Mixing rows and columns with random numbers changes the determinant by a constant, makes zero pivots as rare as
    singular matrices, and makes a second, different minor where there are more than r moving planes.
    """
    m, n = arrays.shape[1] - 1, arrays.shape[2] - 1
    rows = 2 * m * n
    if rows == 0:
        return []
    basis = moving_planes(arrays, p)
    planes = basis.shape[2]
    random = np.random.default_rng(7)
    choices = []
    for _ in range(min(planes - rows + 1, 2)):
        left, right = random.integers(0, p, (rows, rows)), random.integers(0, p, (planes, rows))
        choices.append(np.stack([product(product(left, b, p), right, p) for b in basis]))
    return choices


def moving_planes(arrays: Residues, p: int) -> Residues:
    """A basis of the moving planes of bidegree (2m-1, n-1) modulo p: (4, 2mn, number of planes)."""
    m, n = arrays.shape[1] - 1, arrays.shape[2] - 1
    system = plane_system(arrays)
    kernel, nullity = nmod_mat(*system.shape, system.ravel().tolist(), p).nullspace()
    table = np.array([[int(c) for c in row[:nullity]] for row in kernel.tolist()], dtype=np.int64)
    return table.reshape(4, 2 * m * n, nullity)


def plane_system(arrays: np.ndarray) -> np.ndarray:
    """The linear system for moving planes: coefficients of a X + b Y + c Z + d W, by those of a, b, c, d.

    Row (i, j) belongs to s^i t^j; the columns to s^k t^l of a, then of b, c and d.
    """
    _, m, n = arrays.shape
    m, n = m - 1, n - 1
    system = np.zeros((3 * m, 2 * n, 4, 2 * m, n), dtype=arrays.dtype)
    for k in range(2 * m):
        for el in range(n):
            system[k : k + m + 1, el : el + n + 1, :, k, el] = np.moveaxis(arrays, 0, 2)
    return system.reshape(6 * m * n, 8 * m * n)


def determinants(stack: Residues, p: int) -> Residues:
    """Determinants modulo p of matrices (N, r, r) without division: steps scale the rest by the pivot."""
    work, prefix = stack, np.ones(len(stack), dtype=np.int64)
    scale = prefix
    for _ in range(stack.shape[1] - 1):
        pivot = work[:, 0, 0]
        work = (work[:, 1:, 1:] * pivot[:, None, None] - work[:, 1:, :1] * work[:, :1, 1:]) % p
        prefix = prefix * pivot % p
        scale = scale * prefix % p
    return prefix * work[:, 0, 0] % p * inverses(scale, p) % p


def inverses(values: Residues, p: int) -> Residues:
    """Inverses modulo p, zero for zero: one inversion of a product, undone pair by pair."""
    if len(values) == 1:
        value = int(values[0])
        return np.array([pow(value, -1, p) if value else 0])
    safe = np.where(values == 0, 1, values)
    odd = len(safe) % 2
    left, right = safe[odd::2], safe[odd + 1 :: 2]
    inverse = inverses(left * right % p, p)
    out = np.empty_like(safe)
    out[odd::2], out[odd + 1 :: 2] = inverse * right % p, inverse * left % p
    if odd:
        out[0] = pow(int(safe[0]), -1, p)
    return np.where(values == 0, 0, out)


def square_image(degree: int, clock: Clock) -> Image:
    """Find f modulo p where the matrix is square and det M = f: determinants on a simplex of points, interpolated."""

    def image(arrays: Residues, p: int, support: list[Monomial] | None) -> tuple[list[Monomial], list[int]] | None:
        choices = plane_matrices(arrays, p)
        if len(choices) != 1 or choices[0].shape[1] != degree:
            return None
        mats = choices[0]
        nodes = np.array(all_monomials(degree))
        values = np.zeros((degree + 1,) * 3, dtype=np.int64)
        values[tuple(nodes.T)] = _values(mats, nodes, p, clock)
        coefficients = interpolate(values, p)
        return _select(coefficients, support)

    return image


def _values(mats: Residues, points: Residues, p: int, clock: Clock) -> Residues:
    """The determinants of M at points (N, 3) modulo p."""
    out = np.empty(len(points), dtype=np.int64)
    batch = max(16, _BATCH // mats[0].size)
    for start in range(0, len(points), batch):
        clock.check("the determinants of moving planes")
        x, y, z = points[start : start + batch].T[:, :, None, None]
        stack = ((mats[0] * x % p + mats[1] * y % p) + (mats[2] * z % p + mats[3])) % p
        out[start : start + batch] = determinants(stack, p)
    return out


def _select(coefficients: Residues, support: list[Monomial] | None) -> tuple[list[Monomial], list[int]] | None:
    if support is None:
        support = [(i, j, k) for i, j, k in np.argwhere(coefficients).tolist()]
    return (support, [int(coefficients[m]) for m in support]) if support else None


def interpolate(values: Residues, p: int) -> Residues:
    """Coefficients of the polynomial of total degree <= d from its values at the points of {0..d}^n with sum <= d.

    Divided differences along every axis, then from the basis x (x-1) ... to powers; what lies beyond the simplex is
    never used.
    """
    size, axes = values.shape[0], values.ndim
    differences, powers = _newton_tables(size, p)
    out = values
    for axis in range(axes):
        out = _apply(differences, out, axis, p)
    out = np.where(np.indices(out.shape).sum(axis=0) < size, out, 0)
    for axis in range(axes):
        out = _apply(powers, out, axis, p)
    return out


def _apply(matrix: Residues, array: Residues, axis: int, p: int) -> Residues:
    moved = np.moveaxis(array, axis, 0)
    done = product(matrix, moved.reshape(len(moved), -1), p).reshape(moved.shape)
    return np.moveaxis(done, 0, axis)


def _newton_tables(size: int, p: int) -> tuple[Residues, Residues]:
    """Values at 0, 1, ... to divided differences, and falling factorials to powers, as matrices modulo p."""
    differences, powers = np.zeros((size, size), dtype=np.int64), np.zeros((size, size), dtype=np.int64)
    falling, factorial = [1], 1
    for k in range(size):
        inverse = pow(factorial, -1, p)
        for j in range(k + 1):
            differences[k, j] = (-1) ** (k - j) * comb(k, j) * inverse % p
        powers[: k + 1, k] = falling
        falling = [(a - k * b) % p for a, b in zip([0, *falling], [*falling, 0], strict=True)]
        factorial = factorial * (k + 1) % p
    return differences, powers


def minors_image(degree: int, map_degree: int, clock: Clock) -> Image:
    """Find f modulo p as a divisor of two minors on lines through one point: base points and multiple maps are fine."""

    def image(arrays: Residues, p: int, support: list[Monomial] | None) -> tuple[list[Monomial], list[int]] | None:
        choices = plane_matrices(arrays, p)
        if not choices:
            return None
        center = np.random.default_rng(9).integers(0, p, 3)
        nodes = [(j, k) for j in range(degree + 1) for k in range(degree + 1 - j)]
        restricted = _on_lines(choices, center, nodes, p, clock)
        parts = np.zeros((degree + 1, degree + 1, degree + 1), dtype=np.int64)
        for (j, k), polynomial in zip(nodes, restricted, strict=True):
            coefficients = _root(polynomial, degree, map_degree, p)
            if coefficients is None:
                return None
            parts[:, j, k] = coefficients
        shifted = np.zeros_like(parts)
        for total in range(degree + 1):
            form = interpolate(parts[total], p)
            for j, k in zip(*np.nonzero(form), strict=True):
                if j + k <= total:
                    shifted[total - j - k, j, k] = form[j, k]
        return _select(_shift(shifted, center, p), support)

    return image


def _on_lines(
    choices: list[Residues], center: Residues, nodes: list[tuple[int, int]], p: int, clock: Clock
) -> list[nmod_poly]:
    """The common divisor of two minors on each line center + w (1, j, k), as a polynomial in w."""
    rows = choices[0].shape[1]
    w = np.arange(rows + 1)
    directions = np.array([(1, j, k) for j, k in nodes])
    points = (center + w[:, None] * directions[:, None, :]).reshape(-1, 3) % p
    differences, powers = _newton_tables(rows + 1, p)
    to_powers = product(powers, differences, p)
    out: list[nmod_poly] = []
    for mats in choices:
        values = _values(mats, points, p, clock).reshape(len(nodes), rows + 1)
        found = [nmod_poly(row, p) for row in product(to_powers, values.T, p).T.tolist()]
        out = [a.gcd(b) for a, b in zip(out, found, strict=True)] if out else found
    return out


def _root(power: nmod_poly, degree: int, map_degree: int, p: int) -> list[int] | None:
    """The coefficients of f on a line from its power there, 1 at the center; None if the degree is not right."""
    if power.degree() > degree * map_degree or power.degree() < 0 or int(power[0]) == 0:
        return None
    f = power if map_degree == 1 else power // power.gcd(power.derivative())
    if f.degree() * map_degree != power.degree():
        return None
    inverse = pow(int(f[0]), -1, p)
    return [int(c) * inverse % p for c in f.coeffs()] + [0] * (degree - f.degree())


def _shift(coefficients: Residues, center: Residues, p: int) -> Residues:
    """The polynomial f(x - a, y - b, z - c)."""
    size = coefficients.shape[0]
    for axis, value in enumerate(center.tolist()):
        table = np.array(
            [[comb(j, i) * pow(-value, j - i, p) % p if j >= i else 0 for j in range(size)] for i in range(size)]
        )
        coefficients = _apply(table, coefficients, axis, p)
    return coefficients
