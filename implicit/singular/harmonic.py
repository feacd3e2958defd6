"""What rotations do not mix in a polynomial: harmonic forms of each degree, times powers of x^2 + y^2 + z^2."""

from math import factorial, prod

from flint import fmpq, fmpq_mpoly

from implicit.singular.homogeneous import RING, primitive


def parts_of(f: fmpq_mpoly) -> dict[int, fmpq_mpoly]:
    """The homogeneous parts in x, y, z by degree."""
    parts: dict[int, dict[tuple[int, ...], fmpq]] = {}
    for m, c in f.to_dict().items():
        i, j, k, _, n = (int(e) for e in m)
        parts.setdefault(i + j + k, {})[(i, j, k, 0, n)] = c
    return {k: RING.from_dict(part) for k, part in parts.items()}


def product(f: fmpq_mpoly, g: fmpq_mpoly) -> fmpq:
    """The scalar product f(d/dx, d/dy, d/dz) g of forms of the same degree; rotations keep it."""
    other = g.to_dict()
    total = fmpq(0)
    for m, c in f.to_dict().items():
        if m in other:
            i, j, k, _, _ = (int(e) for e in m)
            total += c * other[m] * (factorial(i) * factorial(j) * factorial(k))
    return total


def harmonics(f: fmpq_mpoly) -> list[fmpq_mpoly]:
    """The harmonic forms H, made primitive, where f is a sum of H (x^2 + y^2 + z^2)^j t^k; constants are left out."""
    found = []
    for degree, part in parts_of(f).items():
        for k in range(degree, 0, -2):
            form = _projected(part, k)
            if form != 0:
                found.append(primitive(form))
            part = _laplacian(part)
    return found


def _projected(f: fmpq_mpoly, k: int) -> fmpq_mpoly:
    """A harmonic form of degree k that differs from f by a multiple of x^2 + y^2 + z^2.

    sum of (-1)^j (2k - 2j - 1)!! / ((2j)!! (2k - 1)!!) (x^2 + y^2 + z^2)^j Laplacian^j f
    """
    square = sum((RING.gen(a) ** 2 for a in range(3)), start=RING.constant(0))
    total, power = RING.constant(0), RING.constant(1)
    for j in range(k // 2 + 1):
        below = prod(range(2, 2 * j + 1, 2)) * prod(range(2 * k - 2 * j + 1, 2 * k, 2))
        total += f * power * fmpq((-1) ** j, below)
        f, power = _laplacian(f), power * square
    return total


def _laplacian(f: fmpq_mpoly) -> fmpq_mpoly:
    return sum((f.derivative(a).derivative(a) for a in range(3)), start=RING.constant(0))
