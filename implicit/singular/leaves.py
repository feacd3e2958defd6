"""What the real surface looks like along a singular curve: how many leaves end on it, and where that changes."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from implicit.singular.chains import Chain
from implicit.singular.derivatives import Values
from implicit.singular.form import Form

Floats = NDArray[np.float64]

_SAMPLES = 6  # places between special points where leaves are counted
_APART = 0.02  # of the size of the bounds: how far these are from special points
_ANGLES = np.linspace(0, 2 * np.pi, 1441)[:-1]


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
