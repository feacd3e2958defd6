"""Where rays first meet a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import UndecidedError
from implicit.lines import CROSSING, HERE, NOTHING, UNKNOWN, Ints, Lines, Rays, lines_of
from implicit.surface import Surface, check_surface

if TYPE_CHECKING:
    from implicit.evaluate import Field

Floats: TypeAlias = NDArray[np.float64]

_LEVELS = 46
"""Parts of rays are halved so often at most; where f is not known to be other than 0 then, the ray touches."""
_AT_ONCE = 8192
_STEPS = 100
_PATIENCE = 4000
"""Parts of one ray that are looked at before it is given up."""
_NEAR = 0.01
"""Touching places are moved at most so far, as a share of the distance."""
_LAST = 2.0**-50
"""A root so much farther than the limit is at the limit but for rounding."""


def cast_rays(
    surface: Surface, origins: ArrayLike, directions: ArrayLike, *, limit: float = np.inf
) -> Floats | np.float64:
    """The distances (...,) from origins (..., 3) along directions (..., 3) to the first point with f = 0, else nan.

    The least s >= 0 with f(origin + s direction / |direction|) = 0 and s <= `limit`. Origins and directions are
    broadcast against each other; a single ray gives a scalar. A ray that starts on the surface, or lies in it, has 0.

    Promised: parts of rays are skipped only where f is proved not to vanish, by Bernstein coefficients of f on the ray
    (polynomials) or ranges of f on boxes. Where f changes sign the distance is that of a root of f to a few units in
    the last place of the points. Where the ray touches f = 0 without a change of sign it counts if f cannot be told
    from 0 by floats, and the place is accurate to the square root of that.
    Not promised: to tell apart two roots so near to each other that f between them is nothing but rounding, or, of a
    formula with abs, min or max or a function, that are in one of 2^24 parts of the ray. Where ranges of f are not
    finite in one of 2^45 parts it is taken for a pole and passed over; farther away than 2^45 times the origin's
    distance from 0, or along an asymptote where f is nothing but rounding, nothing is found.

    Parameters
    ----------
    surface
        A Surface. One without a formula needs a `lipschitz` constant, without which no place can be ruled out.
    origins, directions
        Real numbers; directions of any length but 0.
    limit
        A distance, beyond which nothing is looked for.

    Raises
    ------
    ValueError
        For wrong shapes, what is not finite, directions of length 0 and negative limits.
    UndecidedError
        Where a function without a formula or a constant cannot be ruled out, and where f is not finite along a ray;
        `indices` are the rays.

    Source: Hanrahan, Ray tracing algebraic surfaces, 1983, doi:10.1145/800059.801136, for polynomials on rays; Lane and
    Riesenfeld, Bounds on a polynomial, 1981, doi:10.1007/BF01941796, for their zeros by Bernstein coefficients.

    Examples
    --------
    >>> from implicit import Surface
    >>> cast_rays(Surface("x^2 + y^2 + z^2 = 1"), (-3, 0, 0), [(1, 0, 0), (2, 0, 0), (0, 1, 0)])
    array([ 2.,  2., nan])
    """
    check_surface(surface)
    start, way, shape = _read(origins, directions)
    far = _check_limit(limit)
    _check_field(surface.field, start, way)
    lines, result = lines_of(surface), np.empty(len(start))
    for first in range(0, len(start), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        try:
            rays = Rays(start[part], way[part], far)
            result[part] = _cast(surface.field, lines(rays), rays)
        except _Lost as lost:
            rows = first + lost.rows
            raise UndecidedError(
                f"{len(rows)} of {len(start)} rays could not be followed, the first, ray {rows[0]}, beyond a distance "
                f"of {lost.distances[0]:.6g}: there f is not finite, or not to be told from 0; a limit may help",
                rows,
            ) from None
    result[result > far * (1 + _LAST)] = np.nan
    return np.minimum(result, far).reshape(shape)[()]


class _Lost(Exception):
    """Rays (n,) that were given up at these distances (n,)."""

    def __init__(self, rows: Ints, distances: Floats) -> None:
        self.rows, self.distances = rows, distances
        super().__init__()


def _cast(field: Field, lines: Lines, rays: Rays) -> Floats:
    """The distances (n,) along some rays."""
    code, low, high = _search(lines, rays)
    touching = np.flatnonzero((code == UNKNOWN) | (code == HERE))
    touching = touching[(low[touching] == 0) | ~lines.fades(touching, low[touching])]
    result = np.full(len(code), np.nan)
    ends = rays.distances(np.stack([low, high]))
    crossing = np.flatnonzero(code == CROSSING)
    result[crossing] = _settle(field, rays.take(crossing), *ends[:, crossing])
    result[touching] = _touch(field, rays.take(touching), ends[0, touching])
    return result


def _search(lines: Lines, rays: Rays) -> tuple[NDArray[np.int8], Floats, Floats]:
    """For each ray NOTHING, or what was found first, and the part [low, high] of the ray where.

    A part is number i of 2^level. Where there is nothing, the next and largest part beside it is looked at, else its
    first half:

        level 0   |-------------------------------|
        level 1   |---------------|
        level 2   |-------|-------|                  the second quarter has nothing: the second half is next
        level 1                   |---------------|
    """
    count = len(rays.origins)
    found, low, high = np.zeros(count, np.int8), np.zeros(count), np.zeros(count)
    rows, i, level = np.arange(count), np.zeros(count, np.int64), np.zeros(count, np.int64)
    for _ in range(_PATIENCE):
        if not len(rows):
            break
        h = 0.5 ** level.astype(float)
        code = lines.look(rows, i * h, h)
        end = i + 1 == 1 << level  # a part that goes on to infinity: there nothing counts
        code[end & (code == CROSSING)] = UNKNOWN
        smallest = (code == UNKNOWN) & (level == _LEVELS)
        code[smallest & end] = NOTHING
        shown = (code == CROSSING) | (code == HERE) | (smallest & ~end)
        found[rows[shown]], low[rows[shown]] = code[shown], (i * h)[shown]
        high[rows[shown]] = ((i + 1) * h)[shown]
        on = ~shown & ~((code == NOTHING) & (end | ((i + 1) * h > rays.ends[rows])))
        rows, i, level, skip = rows[on], i[on], level[on], code[on] == NOTHING
        i, level = np.where(skip, i + 1, 2 * i), np.where(skip, level, level + 1)
        up = np.where(skip, np.minimum(level, np.log2((i & -i).astype(float), where=i > 0, out=np.zeros(len(i)))), 0)
        i, level = i >> up.astype(np.int64), level - up.astype(np.int64)
    if len(rows):
        raise _Lost(rows, rays.take(rows).distances(i * 0.5 ** level.astype(float)))
    return found, low, high


def _settle(field: Field, rays: Rays, low: Floats, high: Floats) -> Floats:
    """The roots (n,) of f on rays between distances (n,) where its signs differ: Newton's steps, or halves."""
    result = np.empty(len(low))
    rows, before = np.arange(len(low)), high - low
    inside = field.values(rays.points(low)) < 0
    s = (low + high) / 2
    for _ in range(_STEPS):
        f, gradient = field.gradients(rays.points(s))
        slope = np.einsum("ij,ij->i", gradient, rays.directions)
        nearer = (f < 0) == inside
        low, high = np.where(nearer, s, low), np.where(nearer, high, s)
        with np.errstate(all="ignore"):
            step = s - f / slope
        good = (step >= low) & (step <= high) & (np.abs(step - s) <= before / 2)
        fresh = np.where(f == 0, s, np.where(good, step, (low + high) / 2))
        moved = np.abs(fresh - s)
        result[rows] = fresh
        on = moved > 2.0**-52 * np.maximum(np.abs(fresh), rays.sizes * 0.5)
        if not on.any():
            break
        rows, rays, inside, s = rows[on], rays.take(np.flatnonzero(on)), inside[on], fresh[on]
        low, high, before = low[on], high[on], moved[on]
    return result


def _touch(field: Field, rays: Rays, s: Floats) -> Floats:
    """Places (n,) where f can hardly be told from 0, moved to where it is least beside them."""
    reach = _NEAR * s
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            points = rays.points(s)
            f, gradient = field.gradients(points)
            slope = np.einsum("ij,ij->i", gradient, rays.directions)
            bend = np.einsum("ij,ijk,ik->i", rays.directions, field.hessians(points), rays.directions)
            places = [s, *(s - np.where(np.abs(step) <= reach, step, 0.0) for step in (f / slope, slope / bend))]
            sizes = np.abs([f, *(field.values(rays.points(place)) for place in places[1:])])
            best = np.nanargmin(np.where(np.isfinite(sizes), sizes, np.inf), axis=0)
            if not best.any():
                break
            s = np.choose(best, places)
    return s


def _check_field(field: Field, start: Floats, way: Floats) -> None:
    """Raise UndecidedError if nothing can be known of f but single values."""
    if not len(start):
        return
    tiny = np.stack([start[0], np.nextafter(start[0], start[0] + way[0])])
    box = np.sort(tiny, axis=0)[None]
    if not np.isfinite(field.values(start[:1])).all():
        return
    if not np.isfinite(field.ranges(box)).any():
        raise UndecidedError(
            "rays need a surface with a formula, or a function with a lipschitz constant: of a function known by its "
            "values alone no part of a ray can be ruled out"
        )


def _check_limit(limit: Any) -> float:
    try:
        far = float(limit)
    except (TypeError, ValueError):
        raise ValueError(f"limit must be a distance, got {limit!r}") from None
    if not far >= 0:
        raise ValueError(f"limit must be a distance of 0 or more, got {limit!r}")
    return far


def _read(origins: ArrayLike, directions: ArrayLike) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Origins and unit directions (n, 3), and the leading shape."""
    parts = []
    for values, name in ((origins, "origins"), (directions, "directions")):
        try:
            array = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be real numbers of shape (..., 3)") from None
        if array.ndim == 0 or array.shape[-1] != 3:
            raise ValueError(f"{name} must have shape (..., 3), got {array.shape}")
        if not np.isfinite(array).all():
            bad = tuple(int(k) for k in np.argwhere(~np.isfinite(array).all(axis=-1))[0])
            raise ValueError(f"{name} must be finite, but {name}{list(bad) if bad else ''} is {array[bad].tolist()}")
        parts.append(array)
    try:
        start, way = np.broadcast_arrays(*parts)
    except ValueError:
        shapes = " and ".join(str(part.shape) for part in parts)
        raise ValueError(f"origins and directions must go together, got shapes {shapes}") from None
    shape, (start, way) = start.shape[:-1], (np.array(part).reshape(-1, 3) for part in (start, way))
    most = np.abs(way).max(axis=1, keepdims=True)
    if not (most > 0).all():
        row = int(np.flatnonzero(most == 0)[0])
        raise ValueError(f"directions must not be 0, but that of ray {row} is")
    way = way / most
    return start, way / np.linalg.norm(way, axis=1, keepdims=True), shape
