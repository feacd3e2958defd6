"""What the real surface looks like along a singular curve: how many leaves end on it, and where that changes."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from flint import arb
from numpy.typing import NDArray

from implicit.singular.chains import Chain
from implicit.singular.form import Form, Monomial

Floats = NDArray[np.float64]

_SAMPLES = 6  # places between special points where leaves are counted
_APART = 0.02  # of the size of the bounds: how far these are from special points
_PLACES, _TWICE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)), (1, 1, 1, 2, 2, 2)
_ANGLES = np.linspace(0, 2 * np.pi, 1441)[:-1]


class Values:
    """The second derivatives of f in floats, all divided by the power of two that makes their coefficients about 1.

    Undivided, the coefficients of a surface that was turned by floats pass 1e100, and products of minors overflow.
    """

    def __init__(self, form: Form) -> None:
        seconds = [form.hessian[a][b].coefficients() for a, b in _PLACES]
        largest = max((abs(c) for terms in seconds for c in terms.values()), default=arb(0))
        mantissa, exponent = largest.mid().man_exp()
        scale = arb(2) ** -(int(exponent) + int(mantissa).bit_length())
        self.seconds = [_table(terms, scale) for terms in seconds]

    def bend(self, points: Floats) -> tuple[Floats, Floats]:
        """The sum of the principal 2x2 minors of the Hessian at points (n, 3), and the size of errors in it.

        Where the Hessian is degenerate along the curve the sum is the product of its other two eigenvalues: negative
        where two sheets cross, positive where the surface is only the curve, zero at pinch points.
        """
        xx, yy, zz, xy, xz, yz = (_evaluate(t, points) for t in self.seconds)
        minors = xx * yy - xy**2 + xx * zz - xz**2 + yy * zz - yz**2
        size = np.sqrt(xx**2 + yy**2 + zz**2 + 2 * (xy**2 + xz**2 + yz**2))
        error = 1e-14 * sum(_evaluate((e, np.abs(c)), np.abs(points)) for e, c in self.seconds)
        return minors, 100 * error * (size + error)

    def stretch(self, points: Floats) -> tuple[Floats, Floats]:
        """The sum of the squares of the second derivatives at points (n, 3), and the size of errors in it."""
        square = sum(weight * _evaluate(t, points) ** 2 for t, weight in zip(self.seconds, _TWICE, strict=True))
        error = 1e-12 * sum(_evaluate((e, np.abs(c)), np.abs(points)) for e, c in self.seconds)
        return np.asarray(square), np.asarray(error**2)

    def cubic(self, points: Floats, tangents: Floats) -> tuple[Floats, Floats]:
        """The third derivative along k, and the size of errors in it: where the Hessian has rank 1, k is its null
        vector across the tangents (n, 3) of a curve.
        """
        xx, yy, zz, xy, xz, yz = (_evaluate(t, points) for t in self.seconds)
        hessian = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
        steep = np.linalg.eigh(hessian)
        first = np.take_along_axis(steep[1], np.abs(steep[0]).argmax(axis=1)[:, None, None], axis=2)[..., 0]
        k = np.cross(first, tangents)
        k /= np.maximum(np.linalg.norm(k, axis=1, keepdims=True), 1e-300)
        total, size = np.zeros(len(points)), np.zeros(len(points))
        for table, weight, (a, b) in zip(self.seconds, _TWICE, _PLACES, strict=True):
            for axis in range(3):
                slope = _derivative(table, axis)
                total += weight * _evaluate(slope, points) * k[:, a] * k[:, b] * k[:, axis]
                size += _evaluate((slope[0], np.abs(slope[1])), np.abs(points))
        return total, 1e-12 * size

    def noisy_bend(self, points: Floats, size: float) -> tuple[Floats, Floats]:
        """The same, and errors that include those of the points themselves."""
        minors, noise = self.bend(points)
        step = 1e-6 * size
        moved = [np.abs(self.bend(points + step * unit)[0] - minors) for unit in np.eye(3)]
        return minors, noise + sum(moved) * 2e-11 * size / step


def _table(terms: dict[Monomial, arb], scale: arb) -> tuple[NDArray[np.int64], Floats]:
    values = np.array([float((c * scale).mid()) for c in terms.values()])
    return np.array(list(terms), dtype=np.int64).reshape(-1, 3), values


def _derivative(table: tuple[NDArray[np.int64], Floats], axis: int) -> tuple[NDArray[np.int64], Floats]:
    exponents, coefficients = table
    kept = exponents[:, axis] > 0
    return exponents[kept] - np.eye(3, dtype=np.int64)[axis], coefficients[kept] * exponents[kept, axis]


def _evaluate(table: tuple[NDArray[np.int64], Floats], points: Floats) -> Floats:
    exponents, coefficients = table
    highest = int(exponents.max(initial=0))
    powers = points[:, :, None] ** np.arange(highest + 1)
    total = np.zeros(len(points))
    for (i, j, k), c in zip(exponents, coefficients, strict=True):
        total += c * powers[:, 0, i] * powers[:, 1, j] * powers[:, 2, k]
    return total


def turning_points(chain: Chain, values: Values, box: Floats) -> list[tuple[int, Floats]]:
    """Where the sum of minors vanishes along a chain: (vertex before it, point), on the exact curve."""
    bend, noise = values.noisy_bend(chain.polyline, float((box[1] - box[0]).max()))
    if np.all(np.abs(bend) <= 1e3 * noise):
        return []
    near = np.all((chain.polyline >= box[0]) & (chain.polyline <= box[1]), axis=1)
    found = []
    for n in range(len(bend) - 1):
        if not (near[n] or near[n + 1]) or abs(bend[n]) <= noise[n]:
            continue
        if bend[n] * bend[n + 1] < 0 and abs(bend[n + 1]) > noise[n + 1]:
            sign = np.sign(bend[n])
            point = _bisect(chain, n, lambda p, sign=sign: values.bend(p[None])[0][0] * sign > 0)  # type: ignore[misc]
            if point is not None:
                found.append((n, point))
    zero = np.flatnonzero((np.abs(bend) <= noise) & near)
    for run in np.split(zero, np.flatnonzero(np.diff(zero) > 1) + 1):
        if len(run):
            best = int(run[np.argmin(np.abs(bend[run]))])
            found.append((best, chain.polyline[best]))
    small = 1e-13 * float((box[1] - box[0]).max())
    return [(n, np.where(np.abs(point) < small, 0.0, point)) for n, point in found]


def _bisect(chain: Chain, n: int, before: Callable[[Floats], bool]) -> Floats | None:
    """The point on the exact curve behind vertex n where a condition that holds at n ends."""
    (a, s), (b, u) = chain.sources[n], chain.sources[n + 1]
    if a is not b:
        s, a = (1.0 if b.ends_at(chain.polyline[n]) else 0.0), b
    low, high = s, u
    point: Floats | None = None
    for _ in range(60):
        middle = (low + high) / 2
        point = a.at(middle)
        if point is None or middle in (low, high):
            break
        low, high = (middle, high) if before(point) else (low, middle)
    return point


def leaf_changes(chain: Chain, marks: Sequence[int], form: Form, box: Floats) -> list[tuple[int, Floats]]:
    """Where the number of leaves changes and the minors do not show it: (vertex before it, point), by bisection.

    Between the vertices `marks` it is measured at a few vertices, none of them so near to a mark that other branches
    of a cusp could be counted.
    """
    line, size = chain.polyline, float((box[1] - box[0]).max())
    inside, far = np.all((line >= box[0]) & (line <= box[1]), axis=1), _APART * size

    def count(n: int) -> int:
        return leaves_at(form, line[n], line[n + 1] - line[n - 1], 1e-4 * size)

    found = []
    for low, high in pairwise(sorted({0, len(line) - 1, *marks})):
        ends = line[[low, high]]
        here = [n for n in range(low + 2, high - 1) if inside[n] and np.linalg.norm(ends - line[n], axis=1).min() > far]
        chosen = here[:: max(1, len(here) // _SAMPLES)]
        counts = [count(n) for n in chosen]
        for k in np.flatnonzero(np.diff(counts)):
            a, b = chosen[k], chosen[k + 1]
            while b - a > 1:
                middle = (a + b) // 2
                a, b = (middle, b) if count(middle) == counts[k] else (a, middle)
            point = _bisect(chain, a, lambda p, a=a, want=counts[k]: _same(form, p, line[a + 1] - line[a], want, size))  # type: ignore[misc]
            if point is not None:
                found.append((a, point))
    return found


def _same(form: Form, point: Floats, direction: Floats, leaves: int, size: float) -> bool:
    return leaves_at(form, point, direction, 1e-6 * size) == leaves


def leaves_at(form: Form, point: Floats, direction: Floats, radius: float) -> int:
    """The number of leaves of the surface f = 0 that end on a curve: sign changes of f on a small circle around it.

    The circle shrinks until two radii agree.
    """
    u = np.linalg.svd(direction[None])[2][1]
    v = np.cross(direction, u)
    before = -1
    for _ in range(7):
        high, _ = form.in_box(point - radius, point + radius)
        count = _sign_changes(high, u, v)
        if count == before:
            return count
        before, radius = count, radius / 4
    return before


def _sign_changes(table: Floats, u: Floats, v: Floats) -> int:
    """How often a polynomial changes sign on the unit circle spanned by u and v.

    On the circle it is a trigonometric polynomial; between its roots, found from its Fourier coefficients, it is looked
    at once more, so that sheets that nearly touch are told apart.
    """

    def values(angles: Floats) -> Floats:
        p = np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v
        return np.asarray(np.polynomial.polynomial.polyval3d(p[:, 0], p[:, 1], p[:, 2], table))

    degree = sum(table.shape) - 3
    count = 2 * degree + 1
    spectrum = np.fft.fftshift(np.fft.fft(values(2 * np.pi * np.arange(count) / count)))
    roots = np.roots(spectrum[::-1])
    near = np.sort(np.angle(roots[np.abs(np.abs(roots) - 1) < 1e-2]) % (2 * np.pi))
    between = (near + np.concatenate([near[1:], near[:1] + 2 * np.pi])) / 2 % (2 * np.pi) if len(near) else near
    sign = np.signbit(values(np.sort(np.concatenate([_ANGLES, between]))))
    return int(np.count_nonzero(sign != np.roll(sign, 1)))


def count_leaves(chain: Chain, form: Form, size: float) -> NDArray[np.int64]:
    """The number of leaves at each segment of a chain, measured once between neighbouring special points."""
    line = np.concatenate([chain.polyline, chain.polyline[:1]]) if chain.closed else chain.polyline
    marks = sorted(chain.special)
    cuts = sorted({0, *marks, len(line) - 1})
    out = np.zeros(len(line) - 1, np.int64)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    for low, high in pairwise(cuts):
        along = np.cumsum(steps[low:high])
        n = low + int(np.searchsorted(along, along[-1] * 0.382))
        middle, direction = (line[n] + line[n + 1]) / 2, line[n + 1] - line[n]
        if high - low > 1:
            middle = line[n] if n > low else line[n + 1]
        radius = min(1e-3 * size, 0.05 * float(along[-1]))
        out[low:high] = leaves_at(form, middle, direction / np.linalg.norm(direction), radius)
    if chain.closed and marks and 0 not in marks:
        out[: marks[0]] = out[-1]
    return out
