"""Degree of a rational surface, degree of its parametrization and its base points, counted modulo a large prime.

Two plane sections of the surface by a common line are two curves in the parameter plane. They meet in the base points,
which every section passes, and in degree x (degree of the map) other points (Bezout).
"""

from dataclasses import dataclass
from random import Random
from typing import Any

from flint import fmpz, nmod_mat, nmod_mpoly_ctx, nmod_poly

from implicit.errors import NotASurfaceError
from implicit.implicitize.homogeneous import Coordinates


@dataclass(frozen=True)
class Count:
    """What the count found: all three are right unless a random choice modulo a 62-bit prime was unlucky."""

    degree: int
    map_degree: int
    base_points: int


def count(coordinates: Coordinates) -> Count:
    """Degree of the image, number of parameters over a general point of it, finite base points with multiplicity."""
    sections = _Sections(coordinates, Random(1))
    sections.check_rank()
    through = [sections.plane_through_point() for _ in range(3)]
    first = sections.resultant(through[0], through[1])
    base = first.gcd(sections.resultant(sections.plane(), sections.plane()))
    total = _degree(first) - _degree(base)
    if first.is_zero() or total <= 0:
        raise NotASurfaceError("the coordinates describe a curve or a point: two planes in general position meet there")
    common = first.gcd(sections.resultant(through[0], through[2]))
    fibre = max(_degree(common) - _degree(base), 1)
    return Count(total // fibre, fibre, sections.finite_base_points() if _degree(base) else 0)


def _degree(polynomial: Any) -> int:
    return -1 if polynomial.is_zero() else int(polynomial.degrees()[0])


class _Sections:
    """Random plane sections modulo a 62-bit prime."""

    def __init__(self, coordinates: Coordinates, random: Random) -> None:
        self.random = random
        self.p, root = _large_prime(coordinates)
        self.ring = nmod_mpoly_ctx.get(["s", "t"], modulus=self.p, ordering="lex")
        self.parts = []
        for terms in coordinates.terms:
            images = {}
            for key, element in terms.items():
                value = 0
                for c in reversed(element):
                    value = (value * root + c) % self.p
                images[key] = value
            self.parts.append(self.ring.from_dict(images))
        self._cancel()
        self.point = [random.randrange(1, self.p) for _ in range(2)]
        self.image = self._values(self.parts)

    def _cancel(self) -> None:
        """Divide out a common factor that only shows over the number field."""
        common = self.parts[0]
        for part in self.parts[1:]:
            common = common.gcd(part)
        if not common.is_constant():
            self.parts = [part // common for part in self.parts]

    def _values(self, polynomials: list[Any]) -> list[int]:
        s, t = (self.ring.constant(c) for c in self.point)
        coefficients = [q.compose(s, t).coeffs() for q in polynomials]
        return [int(c[0]) if c else 0 for c in coefficients]

    def check_rank(self) -> None:
        """The tangent space at a random point must be a plane."""
        rows = [self.image] + [self._values([q.derivative(k) for q in self.parts]) for k in (0, 1)]
        rank = nmod_mat(3, 4, [c for row in rows for c in row], self.p).rank()
        if rank < 3:
            raise NotASurfaceError(
                f"the coordinates describe a {'curve' if rank == 2 else 'point'}, no surface: "
                f"the rank of the parametrization is {rank - 1} where it must be 2"
            )

    def plane(self) -> Any:
        """A random combination of X, Y, Z, W."""
        return sum((q * self.random.randrange(1, self.p) for q in self.parts), self.ring.constant(0))

    def plane_through_point(self) -> Any:
        """A random combination that vanishes at the chosen parameters."""
        first, *others = sorted(zip(self.image, self.parts, strict=True), key=lambda pair: pair[0] == 0)
        factors = [self.random.randrange(1, self.p) for _ in others]
        balance = -sum(c * value for c, (value, _) in zip(factors, others, strict=True)) * pow(first[0], -1, self.p)
        combined = (part * c for c, (_, part) in zip(factors, others, strict=True))
        return sum(combined, first[1] * (balance % self.p))

    def resultant(self, a: Any, b: Any) -> Any:
        """The parameters s of the common points of two curves."""
        if a.degrees()[1] == 0 and b.degrees()[1] == 0:
            return a.gcd(b)
        return a.resultant(b, "t")

    def finite_base_points(self) -> int:
        """Base points in the parameter plane: after a random shear no curve has a vertical asymptote."""
        s, t = self.ring.gens()
        slant = self.random.randrange(1, self.p)
        self.parts = [q.compose(s + t * slant, t) for q in self.parts]
        first, second = (self.resultant(self.plane(), self.plane()) for _ in range(2))
        return _degree(first.gcd(second))


def _large_prime(coordinates: Coordinates) -> tuple[int, int]:
    """A prime just below 2^62 and a root of the field's modulus there."""
    modulus, p = coordinates.field.modulus, 1 << 62
    while True:
        p -= 1
        if not fmpz(p).is_probable_prime():
            continue
        if coordinates.field.degree == 1:
            return p, 0
        roots = [int(r) for r, m in nmod_poly([c % p for c in modulus], p).roots() if m == 1]
        if roots:
            return p, roots[0]
