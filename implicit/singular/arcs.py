"""The real points of a projected curve: arcs between the values of X where roots meet, by exact root counts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from flint import acb_poly, arb, arb_poly, fmpq, fmpq_mpoly, fmpq_poly, fmpz_poly
from numpy.typing import NDArray

from implicit.singular.form import Field, precision
from implicit.singular.ideal import square_free
from implicit.singular.projection import PLANE, Projection
from implicit.singular.region import Deadline

Floats = NDArray[np.float64]

_BITS = 320
_TINY = fmpq(1, 1 << 100)  # how near to a critical value arcs are followed, of the length of their interval
_FIRST, _MOST, _HALVINGS = 8, 128, 24  # intervals between Chebyshev nodes, and how often those are halved
_SHARP = 1e-5  # of the tolerance of chords: the error of vertices that is aimed at


def rows(p: fmpq_mpoly) -> list[fmpq_poly]:
    """A polynomial in X and Y by powers of Y: for each a polynomial in X."""
    found: dict[int, dict[int, fmpq]] = {}
    for (i, j), c in p.to_dict().items():
        found.setdefault(int(j), {})[int(i)] = c
    return [_dense(found.get(j, {})) for j in range(max(found, default=0) + 1)]


def _dense(terms: dict[int, fmpq]) -> fmpq_poly:
    return fmpq_poly([terms.get(n, fmpq(0)) for n in range(max(terms, default=0) + 1)])


@dataclass(frozen=True, eq=False)
class Part:
    """An irreducible part of a projected curve; (x, y, z) = turn (X, Y, Z) + shift."""

    projection: Projection
    field: Field
    turn: Floats
    shift: Floats

    @property
    def polynomial(self) -> fmpq_mpoly:
        """The polynomial in X and Y."""
        return self.projection.plane

    @cached_property
    def _rows(self) -> list[list[fmpq_poly]]:
        p = self.projection
        return [rows(q) for q in (p.plane, p.plane.derivative(1), p.height, p.number)]

    def roots(self, at: fmpq) -> list[arb]:
        """The real Y over a value of X, ascending."""
        return real_roots(fmpq_poly([r(at) for r in self._rows[0]]))

    def lift(self, at: fmpq, root: arb) -> Floats | None:
        """The point (x, y, z) over (X, Y); None where the coefficients of the surface take conjugate values there."""
        with precision(_BITS):
            slope, height, number = (arb_poly([r(at) for r in q])(root) for q in self._rows[1:])
            if self.field.degree > 1 and not abs(number / slope - self.field.root).upper() < 1e-9:
                return None
            place = np.array([float(arb(at)), float(root.mid()), float((height / slope).mid())])
            point = self.turn @ place + self.shift
            size = np.abs(self.turn) @ np.abs(place) + np.abs(self.shift)
            return np.where(np.abs(point) < 1e-15 * size, 0.0, point)

    def critical(self, others: Sequence["Part"]) -> list[arb]:
        """The real X where roots of this part meet each other or those of other parts."""
        p = self.polynomial
        found = [p.discriminant("Y")] if p.degrees()[1] > 1 else []
        found += [p.resultant(other.polynomial, "Y") for other in others if other is not self]
        out: list[arb] = []
        for q in found:
            line = rows(q)[0]
            if line.degree() > 0:
                out.extend(real_roots(square_free(line)))
        return out

    def solitary(self, breaks: Sequence[fmpq]) -> list[Floats]:
        """Real points of the complex curve where no real arcs are: complex roots that become real at a critical X."""
        out = []
        for low, at, high in zip(breaks[:-2], breaks[1:-1], breaks[2:], strict=True):
            gaps = ((high - at) * _TINY, (low - at) * _TINY)
            pairs = [self._near_real(at + gap) for gap in gaps]
            ends = [[float(r.mid()) for r in self.roots(at + gap)] for gap in gaps]
            for y, point in pairs[0]:
                if any(abs(y - other) < 1e-8 for other, _ in pairs[1]) and not any(
                    abs(y - e) < 1e-8 for side in ends for e in side
                ):
                    out.append(point)
        return out

    def _near_real(self, at: fmpq) -> list[tuple[float, Floats]]:
        numerator: fmpz_poly = fmpq_poly([r(at) for r in self._rows[0]]).numer()
        found = []
        with precision(_BITS):
            root = self.field.root
            for y, _ in numerator.complex_roots():
                if y.imag > 0 and y.imag < 1e-9:
                    slope, height, number = (acb_poly([r(at) for r in q])(y) for q in self._rows[1:])
                    if self.field.degree == 1 or abs(number / slope - root).upper() < 1e-6:
                        z = height / slope
                        point = np.array([float(arb(at)), float(y.real.mid()), float(z.real.mid())])
                        if abs(float(z.imag.mid())) < 1e-6 * (1 + abs(point[2])):
                            found.append((float(y.real.mid()), self.turn @ point + self.shift))
        return found


def real_roots(p: fmpq_poly) -> list[arb]:
    """The real roots of a square-free polynomial, ascending; that they are all and real is proved."""
    numerator: fmpz_poly = p.numer()
    with precision(_BITS):
        found = [r.real for r, _ in numerator.complex_roots() if r.imag == 0] if numerator.degree() > 0 else []
    return sorted(found, key=lambda r: r.mid())


@dataclass(frozen=True, eq=False)
class Arc:
    """A piece of a curve over an interval of X, as points (n, 3) at `parameters` (n,) from 0 to 1."""

    part: Part
    index: int  # which of the roots Y
    start: fmpq
    end: fmpq
    parameters: Floats
    points: Floats

    def at(self, s: float) -> Floats | None:
        """The exact point for a parameter, as floats."""
        return _sample(self.part, self.start, self.end, s).get(self.index)

    def ends_at(self, point: Floats) -> bool:
        """Whether a point that is an end of the arc is its last one."""
        return bool(np.linalg.norm(self.points[-1] - point) < np.linalg.norm(self.points[0] - point))


def abscissa(start: fmpq, end: fmpq, s: float) -> fmpq:
    """X at parameter s: denser near the ends, where arcs may turn vertical like square roots."""
    share = (1 - np.cos(np.pi * s)) / 2 if s < 1 else 1.0
    return start + (end - start) * fmpq(int(share * 2**60), 1 << 60)


def _sample(part: Part, start: fmpq, end: fmpq, s: float) -> dict[int, Floats]:
    at = abscissa(start, end, s)
    lifted = {n: part.lift(at, root) for n, root in enumerate(part.roots(at))}
    return {n: p for n, p in lifted.items() if p is not None}


def trace(part: Part, breaks: Sequence[fmpq], tolerance: float, longest: float, deadline: Deadline) -> list[Arc] | None:
    """The arcs between neighbouring breaks, with chords within the tolerance and not longer than `longest`, or None.

    Points are exact at Chebyshev nodes, doubled until interpolation predicts the next ones far better than the
    tolerance; where many of them are not enough the interval is halved.
    """
    arcs = []
    todo = [(low, high, 0) for low, high in pairwise(breaks)]
    while todo:
        low, high, halvings = todo.pop()
        gap = (high - low) * _TINY
        start, end = low + gap, high - gap
        samples = _samples(part, start, end, tolerance, deadline)
        if samples is None:
            if deadline.passed or halvings == _HALVINGS:
                return None
            middle = (low + high) / 2
            todo += [(low, middle, halvings + 1), (middle, high, halvings + 1)]
            continue
        nodes = np.array(sorted(samples))
        for n in sorted(samples[0.0]):
            values = np.array([samples[s][n] for s in nodes])
            parameters, points = _resample(nodes, values, tolerance, longest)
            arcs.append(Arc(part, n, start, end, parameters, points))
    return arcs


def _samples(
    part: Part, start: fmpq, end: fmpq, tolerance: float, deadline: Deadline
) -> dict[float, dict[int, Floats]] | None:
    """Exact points at Chebyshev nodes from which the arcs can be interpolated; None where these are not enough."""
    samples: dict[float, dict[int, Floats]] = {}
    count = _FIRST
    while count <= _MOST:
        nodes = (1 - np.cos(np.pi * np.arange(count + 1) / count)) / 2
        old = sorted(samples)
        for s in nodes:
            if deadline.passed:
                return None
            if s not in samples:
                samples[float(s)] = _sample(part, start, end, float(s))
        names = set(samples[0.0])
        if any(set(points) != names or not _finite(points) for points in samples.values()):
            return None
        if not names:
            return samples
        if old and max(_misfit(old, nodes[1::2], samples, n) for n in names) < _SHARP * tolerance:
            return samples
        count *= 2
    return None


def _finite(points: dict[int, Floats]) -> bool:
    return all(np.isfinite(point).all() for point in points.values())


def _misfit(old: Sequence[float], fresh: Floats, samples: dict[float, dict[int, Floats]], name: int) -> float:
    values = np.array([samples[s][name] for s in old])
    guess = interpolate(np.array(old), values, fresh)
    return float(np.abs(guess - np.array([samples[float(s)][name] for s in fresh])).max())


def interpolate(nodes: Floats, values: Floats, at: Floats) -> Floats:
    """Barycentric interpolation (Berrut and Trefethen, SIAM Review 46, 2004, doi:10.1137/S0036144502417715)."""
    weights = (-1.0) ** np.arange(len(nodes))
    weights[[0, -1]] /= 2
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = weights / (at[:, None] - nodes)
        out = terms @ values / terms.sum(axis=1, keepdims=True)
    hits, which = np.nonzero(at[:, None] == nodes)
    out[hits] = values[which]
    return np.asarray(out)


def _resample(nodes: Floats, values: Floats, tolerance: float, longest: float) -> tuple[Floats, Floats]:
    """Parameters and points such that every chord is within half the tolerance of the interpolated arc."""
    s = np.linspace(0, 1, 9)
    points = interpolate(nodes, values, s)
    for _ in range(16):
        middles = (s[:-1] + s[1:]) / 2
        between = interpolate(nodes, values, middles)
        chord = points[1:] - points[:-1]
        length = np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-300)
        aside = (between - points[:-1]) - np.sum((between - points[:-1]) * chord, axis=1, keepdims=True) * (
            chord / length
        ) / length
        aside = np.where(length > 1e-290, aside, 0.0)
        bent = (np.linalg.norm(aside, axis=1) > tolerance / 2) | (length[:, 0] > longest)
        if not bent.any():
            break
        place = np.flatnonzero(bent) + 1
        s, points = np.insert(s, place, middles[bent]), np.insert(points, place, between[bent], axis=0)
    return s, points


def plane_range(turn: Floats, box: Floats) -> tuple[float, float]:
    """The least and greatest X in a box."""
    inverse = np.linalg.inv(turn)[0]
    corners = np.where(inverse > 0, box[::-1], box)
    pad = 1e-3 * float((box[1] - box[0]).max())
    return float(corners[1] @ inverse) - pad, float(corners[0] @ inverse) + pad


def breaks_of(part: Part, others: Sequence[Part], span: tuple[float, float]) -> list[fmpq]:
    """Rationals next to the critical X in the span, ascending, between both ends of it."""
    low, high = _rational(span[0]), _rational(span[1])
    with precision(_BITS):
        inside = [_near(c) for c in part.critical(others)]
    inside = sorted({c for c in inside if low < c < high})
    return [low, *inside, high]


def _near(value: arb) -> fmpq:
    mantissa, exponent = value.mid().man_exp()
    return fmpq(mantissa) * (fmpq(2) ** int(exponent))


def _rational(value: float) -> fmpq:
    p, q = float(value).as_integer_ratio()
    return fmpq(p, q)


def constant(p: fmpq_mpoly) -> bool:
    """Whether a polynomial in the plane is constant."""
    return bool(p == PLANE.constant(1)) or p.total_degree() <= 0
