"""Critical points to any precision, with proof: where they are, and whether f is zero there.

f(p) is an algebraic number. If it is not zero, its size has a lower bound that follows from the coefficients of f
(`zero_gap`), so an enclosure below that bound proves f(p) = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, lcm, log

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from implicit.singular.form import Form, Nested, precision

Point = tuple[arb, arb, arb]

FIRST_BITS = 192


def integral(form: Form) -> Form:
    """The form times an integer, with coefficients in Z[w]."""
    scale = lcm(*(int(c.denom()) for c in form.terms.values()))
    return Form({m: c * scale for m, c in form.terms.items()}, form.field)


def zero_gap(form: Form) -> int:
    """Bits g such that f(p) = 0 or |f(p)| > 2^-g at every isolated complex critical point p, for f made integral.

    The heights h(p) of all isolated zeros of the gradient add up to at most B = sum of log |f_i|_1 prod of the other
    degrees (arithmetic Bezout inequality: D'Andrea, Krick, Sombra, Ann. Sci. ENS 46 (2013) 549-627,
    doi:10.24033/asens.2196). By Liouville log |f(p)| >= -[Q(p):Q] (deg f h(p) + log |f|_1); summed over the conjugates
    of the coefficients.
    """
    degrees = [max(1, g.degree) for g in form.gradient]
    total = 0.0
    for size in form.field.conjugates:
        lengths = [_log_length(g, size) for g in form.gradient]
        heights = sum(h * np.prod(degrees) / d for h, d in zip(lengths, degrees, strict=True))
        total += form.degree * heights + float(np.prod(degrees)) * _log_length(form, size)
    return ceil(total / log(2) * (1 + 1e-9)) + 2


def _log_length(form: Form, size: float) -> float:
    """A bound of log of the sum of |coefficients| when |w| is at most size; never negative."""
    with precision(64):
        w = arb(size)
        total = sum((abs(arb(c)) * w**n for p in form.terms.values() for n, c in enumerate(p.coeffs())), arb(1))
        return float(total.log().upper()) + 1e-9


@dataclass
class Jet:
    """f, its gradient and Hessian, ready at the precisions that were asked for."""

    form: Form
    _ready: dict[tuple[int, int], list[Nested]] = field(default_factory=dict)

    def at(self, order: int, bits: int) -> list[Nested]:
        """Evaluators of order 0 (f), 1 (three of them) or 2 (six: xx, xy, xz, yy, yz, zz) at a precision."""
        key = order, bits
        if key not in self._ready:
            forms: Sequence[Form] = {
                0: (self.form,),
                1: self.form.gradient,
                2: tuple(self.form.hessian[r][c] for r in range(3) for c in range(r, 3)),
            }[order]
            with precision(bits):
                self._ready[key] = [f.nested() for f in forms]
        return self._ready[key]

    def value(self, p: Point, bits: int) -> arb:
        """The enclosure of f at a point."""
        with precision(bits):
            return self.at(0, bits)[0](*p)

    def gradient(self, p: Point, bits: int) -> arb_mat:
        """The enclosure of the gradient, (3, 1)."""
        with precision(bits):
            return arb_mat([[g(*p)] for g in self.at(1, bits)])

    def hessian(self, p: Point, bits: int) -> arb_mat:
        """The enclosure of the Hessian at a point or box, (3, 3)."""
        with precision(bits):
            xx, xy, xz, yy, yz, zz = (h(*p) for h in self.at(2, bits))
        return arb_mat([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(frozen=True)
class CriticalPoint:
    """The only critical point within `radius` (in every coordinate) of `center`, closer than `error` to it."""

    center: Point
    radius: float
    error: arb

    @property
    def position(self) -> NDArray[np.float64]:
        """The nearest floats (3,)."""
        return np.array([float(c) for c in self.center])

    def holds(self, place: Point) -> bool:
        """Whether an enclosure lies in the cube where this critical point is alone."""
        return all(bool(abs(a - b) < self.radius) for a, b in zip(place, self.center, strict=True))


def _middle(matrix: arb_mat) -> arb_mat:
    return arb_mat([[matrix[r, c].mid() for c in range(matrix.ncols())] for r in range(matrix.nrows())])


def _largest(values: Sequence[arb]) -> arb:
    worst = arb(0)
    for v in values:
        worst = worst.max(abs(v))
    return worst


def _step(jet: Jet, p: Point, bits: int) -> arb_mat:
    """Newton's step; half of the bits are enough for the Hessian, as the gradient is small by the other half."""
    hessian, gradient = jet.hessian(p, bits // 2 + 64), jet.gradient(p, bits)
    with precision(bits):
        return _middle(hessian).solve(_middle(gradient))


def newton_step(jet: Jet, p: Point, bits: int) -> Point:
    """The inverse Hessian times the gradient; ZeroDivisionError where that is not defined."""
    step = _step(jet, p, bits)
    return step[0, 0].mid(), step[1, 0].mid(), step[2, 0].mid()


def polish(jet: Jet, start: NDArray[np.float64], size: float) -> CriticalPoint | None:
    """The critical point near `start`, proved to be the only one in a cube around it; None where that fails."""
    bits = FIRST_BITS
    with precision(bits):
        p = tuple(arb(float(v)) for v in start)
        try:
            for _ in range(12):
                step = _step(jet, p, bits)
                p = tuple((p[a] - step[a, 0]).mid() for a in range(3))
                moved = float(_largest([step[a, 0] for a in range(3)]).upper())
                if moved < 2.0**-150 * (1 + float(np.abs(start).max())):
                    break
            if not moved < 1e-20 * (1 + float(np.abs(start).max())):
                return None
        except ZeroDivisionError:
            return None
        return _enclose(jet, p, size, bits)


def _enclose(jet: Jet, p: Point, size: float, bits: int) -> CriticalPoint | None:
    """Krawczyk's test in cubes around p, smaller and smaller."""
    try:
        inverse = _middle(_middle(jet.hessian(p, bits)).inv())
    except ZeroDivisionError:
        return None
    step = inverse * jet.gradient(p, bits)
    shift = _largest([step[a, 0] for a in range(3)])
    for shrink in range(8):
        radius = size * 2.0 ** (-2 - 4 * shrink)
        cube = tuple(c + arb(0, radius) for c in p)
        rest = inverse * jet.hessian(cube, bits)
        rows = [sum((abs((1 if r == c else 0) - rest[r, c]) for c in range(3)), arb(0)) for r in range(3)]
        worst = float(_largest(rows).abs_upper())
        if worst < 0.5 and float(shift.upper()) + worst * radius < radius:
            return CriticalPoint(p, radius, 2 * shift.upper())
    return None


def sharpen(jet: Jet, point: CriticalPoint, bits: int) -> CriticalPoint:
    """The same critical point with about `bits` correct bits.

    Two points of the cube are at most twice as far apart as their images under inverse * gradient, because there
    |I - inverse * Hessian| < 1/2; that bounds the error of the last step.
    """
    p, ladder, work = point.center, [bits], bits + 32
    while ladder[-1] > FIRST_BITS:
        ladder.append(ladder[-1] // 2 + 16)
    with precision(work):
        inverse = _middle(_middle(jet.hessian(point.center, FIRST_BITS)).inv())
    for rung in reversed(ladder[1:]):
        p = _moved(p, _step(jet, p, rung + 32), rung + 32)
    for _ in range(4):
        p = _moved(p, _step(jet, p, work), work)
        with precision(work):
            step = inverse * jet.gradient(p, work)
            error = 2 * _largest([step[a, 0] for a in range(3)]).upper()
            if error < arb(2) ** -bits:
                break
    return CriticalPoint(p, point.radius, error)


def _moved(p: Point, step: arb_mat, bits: int) -> Point:
    with precision(bits):
        x, y, z = ((p[a] - step[a, 0]).mid() for a in range(3))
    return x, y, z


def _steepness(jet: Jet, point: CriticalPoint) -> arb:
    """The sum of bounds of the second derivatives in the cube of a critical point."""
    with precision(FIRST_BITS):
        cube = tuple(c + arb(0, point.radius) for c in point.center)
        bend = jet.hessian(cube, FIRST_BITS)
        return sum((abs(bend[r, c]) for r in range(3) for c in range(3)), arb(0)).upper()


def value_at(jet: Jet, point: CriticalPoint, bits: int) -> arb:
    """An enclosure of f at the critical point: f(center) widened by |Hessian| error^2, as the gradient is 0 there."""
    with precision(bits):
        value, e = jet.value(point.center, bits), point.error
        return value + (_steepness(jet, point) * e * e).upper() * arb(0, 1)


def is_zero(jet: Jet, point: CriticalPoint, gap: int) -> bool:
    """Whether f vanishes at the critical point, proved through `gap` = zero_gap(form); the form must be integral."""
    if not value_at(jet, point, FIRST_BITS).contains(0):
        return False
    spare = 64 + ceil(float((_steepness(jet, point) + 1).log().upper()) / log(2))
    for extra in (spare, 4 * spare, 16 * spare):
        value = value_at(jet, sharpen(jet, point, gap // 2 + extra), gap + 2 * extra)
        if not value.contains(0):
            return False
        with precision(FIRST_BITS):
            if value.abs_upper() < arb(2) ** -gap:
                return True
    raise ArithmeticError(f"f at a critical point could not be enclosed to {gap} bits, only to {value}")
