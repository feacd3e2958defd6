"""Signed permutations of the coordinates that map a surface to itself, verified exactly, and the part they leave."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import permutations, product
from typing import TypeVar

import numpy as np
import sympy
from flint import arb
from numpy.typing import NDArray

from implicit.singular.form import Form
from implicit.singular.proof import CriticalPoint

Number = TypeVar("Number", arb, sympy.Expr)

_GENERIC = np.array([1.0, 0.6180, 0.2770])


@dataclass(frozen=True)
class Symmetry:
    """The map p -> (sign[a] p[order[a]]) for a = 0, 1, 2."""

    order: tuple[int, int, int]
    sign: tuple[int, int, int]

    def apply(self, p: tuple[Number, Number, Number]) -> tuple[Number, Number, Number]:
        """The image of a point."""
        x, y, z = (s * p[o] for o, s in zip(self.order, self.sign, strict=True))
        return x, y, z

    def matrix(self) -> NDArray[np.float64]:
        """The map as a matrix (3, 3)."""
        return np.eye(3)[list(self.order)] * np.array(self.sign)[:, None]

    def move(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """The images of boxes (K, 2, 3)."""
        return np.sort(boxes[:, :, list(self.order)] * np.array(self.sign), axis=1)

    def preserves(self, form: Form) -> bool:
        """Whether f after the map is f or -f, exactly."""
        ratio = 0
        for m, c in form.terms.items():
            image = [0, 0, 0]
            sign = 1
            for a in range(3):
                image[self.order[a]] = m[a]
                sign *= self.sign[a] ** m[a]
            other = form.terms.get((image[0], image[1], image[2]))
            if other is None:
                return False
            here = 1 if other == c * sign else (-1 if other == -c * sign else 0)
            if not here or (ratio and here != ratio):
                return False
            ratio = here
        return True

    def keeps(self, box: NDArray[np.float64]) -> bool:
        """Whether the box (2, 3) is mapped onto itself."""
        image = np.sort(box[:, list(self.order)] * np.array(self.sign), axis=0)
        return bool(np.array_equal(image, box))


def symmetries(form: Form, box: NDArray[np.float64]) -> list[Symmetry]:
    """The group of all signed permutations that keep the surface and the box."""
    everything = (Symmetry(o, s) for o in permutations(range(3)) for s in product((1, -1), repeat=3))  # type: ignore[arg-type]
    return [g for g in everything if g.keeps(box) and g.preserves(form)]


def fundamental_cuts(group: Iterable[Symmetry], size: float) -> NDArray[np.float64]:
    """Half-spaces (n, 4) around a part of space that the group spreads over all of it: a Dirichlet cell."""
    rows = []
    for g in group:
        normal = _GENERIC - g.matrix() @ _GENERIC
        length = float(np.linalg.norm(normal))
        if length > 1e-9:
            rows.append([*(normal / length), 1e-3 * size])
    return np.array(rows).reshape(-1, 4)


def orbits(points: list[CriticalPoint], group: list[Symmetry]) -> list[list[tuple[CriticalPoint, Symmetry]]]:
    """The images of each point under the group, every point once, with the maps that lead there; first the point."""
    seen: list[CriticalPoint] = []
    places = np.full((len(points) * len(group), 3), np.inf)
    out = []
    for p in points:
        orbit: list[tuple[CriticalPoint, Symmetry]] = []
        for g in group:
            image = CriticalPoint(g.apply(p.center), p.radius, p.error)
            near = np.flatnonzero(
                np.abs(places[: len(seen)] - image.position).max(axis=1, initial=0) < 1e-6 * (1 + p.radius)
            )
            if not any(same(image, seen[n]) for n in near):
                places[len(seen)] = image.position
                seen.append(image)
                orbit.append((image, g))
        if orbit:
            out.append(orbit)
    return out


def same(p: CriticalPoint, q: CriticalPoint) -> bool:
    """Whether two critical points are one, because one lies in the cube where the other is alone."""
    far = max(float(abs(a - b).upper()) for a, b in zip(p.center, q.center, strict=True))
    return far + float(p.error.upper()) < q.radius or far + float(q.error.upper()) < p.radius
