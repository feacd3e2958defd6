"""Coordinates at a singular point that fit its shape: axes along the kernel of the Hessian and its repeated tangent."""

from collections.abc import Iterable, Sequence
from functools import reduce

import numpy as np
from flint import Ordering, arb, fmpq, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly
from numpy.typing import NDArray

from implicit.singular.exact import ExactPoint
from implicit.singular.form import Field, evaluate, precision
from implicit.singular.germ import Germ, Taylor

Vector = tuple[fmpq_poly, fmpq_poly, fmpq_poly]

_RING = fmpq_mpoly_ctx.get(("x", "y", "z", "t"), Ordering.degrevlex)


def fitted(germ: Germ) -> tuple[Taylor, NDArray[np.float64]]:
    """The terms of f in fitted coordinates y, and the matrix (3, 3) with x - p = matrix y."""
    axes = [_scaled(a, germ.point) for a in _axes(germ)]
    theta = _theta(germ.point)
    with precision(64):
        matrix = np.array([[float(evaluate(c, theta).mid()) for c in axis] for axis in axes]).T
    return substitute(germ.taylor, axes, germ.point.modulus), matrix


def _theta(point: ExactPoint):  # type: ignore[no-untyped-def]
    with precision(128):
        return Field(point.modulus, point.near).root


def _axes(germ: Germ) -> list[Vector]:
    m = germ.point.modulus
    rows = [_vector(row) for row in germ.hessian]
    rows = [r for r in rows if any(c != 0 for c in r)]
    zero, one = fmpq_poly([0]), fmpq_poly([1])
    if germ.corank == 1:
        kernel = _nonzero(cross(r, s, m) for r in rows for s in rows)
        return [kernel, rows[0], cross(kernel, rows[0], m)]
    if germ.corank == 2:
        normal = rows[0]
        u = _nonzero(cross(normal, _unit(e), m) for e in np.eye(3, dtype=int))
        v = cross(normal, u, m)
        u = _repeated(germ, u, v)
        return [u, cross(normal, u, m), normal]
    return [(one, zero, zero), (zero, one, zero), (zero, zero, one)]


def _nonzero(vectors: Iterable[Vector]) -> Vector:
    return next(v for v in vectors if any(c != 0 for c in v))


def _vector(row: dict[int, fmpq_poly]) -> Vector:
    return row[0], row[1], row[2]


def _unit(e: NDArray[np.int64]) -> Vector:
    x, y, z = (fmpq_poly([int(c)]) for c in e)
    return x, y, z


def cross(a: Vector, b: Vector, modulus: fmpq_poly) -> Vector:
    """The cross product of exact vectors."""
    x, y, z = ((a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2]) % modulus for i in range(3))
    return x, y, z


def _repeated(germ: Germ, u: Vector, v: Vector) -> Vector:
    """The direction s u + t v of the repeated line of the cubic terms, or u where there is none."""
    m = germ.point.modulus
    zero = fmpq_poly([0])
    cubic = substitute({e: c for e, c in germ.taylor.items() if sum(e) == 3}, [u, v, (zero, zero, zero)], m)
    a, b, c, d = (cubic.get((3 - n, n, 0), zero) for n in range(4))
    h = [(b * b - 3 * a * c) % m, (b * c - 9 * a * d) % m, (c * c - 3 * b * d) % m]
    if (h[1] * h[1] - 4 * h[0] * h[2]) % m != 0:
        return u
    if h[0] != 0:
        s, t = -h[1] / 2, h[0]
    elif h[2] != 0:
        s, t = h[2], -h[1] / 2
    else:
        s, t = (-b / 3, a) if a != 0 else ((fmpq_poly([1]), zero) if d != 0 else (zero, fmpq_poly([1])))
    x, y, z = ((s * i + t * j) % m for i, j in zip(u, v, strict=True))
    return (x, y, z) if any(k != 0 for k in (x, y, z)) else u


def _scaled(axis: Vector, point: ExactPoint) -> Vector:
    """The axis times a power of two that brings its length near 1."""
    with precision(64):
        theta = _theta(point)
        squares = sum((evaluate(c, theta) ** 2 for c in axis), start=arb(0))
        power = round(float((squares.log() / (2 * arb(2).log())).mid()))  # the length may be beyond all floats
    factor = fmpq(1, 1 << power) if power > 0 else fmpq(1 << -power)
    x, y, z = (c * factor for c in axis)
    return x, y, z


def substitute(terms: Taylor, axes: Sequence[Vector], modulus: fmpq_poly) -> Taylor:
    """The terms after x = y_0 axes[0] + y_1 axes[1] + y_2 axes[2]."""
    x, y, z, t = _RING.gens()
    numbers = _RING.from_dict({(*m, n): a for m, c in terms.items() for n, a in enumerate(c.coeffs()) if a != 0})
    images = [
        sum((g * _lifted(axis[i], t) for g, axis in zip((x, y, z), axes, strict=True)), start=x * 0) for i in range(3)
    ]
    whole = numbers.compose(*images, t, ctx=_RING)
    if modulus.degree() > 1:
        whole = divmod(whole, _lifted(modulus, t))[1]
    out: dict[tuple[int, int, int], list[fmpq]] = {}
    for (i, j, k, n), c in whole.to_dict().items():
        line = out.setdefault((int(i), int(j), int(k)), [fmpq(0)] * int(modulus.degree()))
        line[int(n)] = c
    return {m: fmpq_poly(line) for m, line in out.items()}


def _lifted(c: fmpq_poly, t: fmpq_mpoly) -> fmpq_mpoly:
    return reduce(lambda total, a: total * t + a, reversed(c.coeffs()), t * 0)
