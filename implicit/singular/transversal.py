"""Where the kind of singularity across a curve changes though no sign does.

The tangent of a singular curve is a null vector of the Hessian H of f. With e2, the sum of its principal 2x2 minors,

    where e2 is not 0 two sheets meet, real or complex; at its zeros they touch, or are complex on one side;
    where e2 is 0 all along there is a cusp; with k the other null vector, f_kkk is not 0 but where the cusp is sharper;
    where H is 0 all along three sheets meet, real or complex, at zeros of their discriminant they touch; or more do.

At a zero of even order no sign changes, so it is sought as a minimum: x^3 + x^2 z^2 = y^2 has one at the origin.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from implicit.singular.chains import Chain
from implicit.singular.derivatives import Values

Floats = NDArray[np.float64]
Numbers = tuple[Floats, Floats]
"""A number (n,) at each of n places, and the size of errors in it."""
Measure = Callable[[Floats], Numbers]
"""Numbers at places (n,) along a chain: 2.5 is in the middle between vertices 2 and 3."""

_LEAST = 48
"""At least so many places along a chain are looked at."""
_LOW = 0.6
"""A minimum is worth looking at where it is so small a share of what is beside it."""
_NOTHING = 1e3
"""What is hardly anywhere more than so many times its error is 0 all along."""
_ZERO = 1e-13
"""What is so small a share of what is beside it is 0."""
_GOLDEN, _STEPS = (5**0.5 - 1) / 2, 70
_STEP = 1e-5
"""Tangents are differences over so long a part of a segment."""


def kind_changes(chain: Chain, values: Values, box: Floats, known: Floats) -> list[tuple[int, Floats]]:
    """The points of a chain where its kind changes: (vertex before it, point), on the exact curve; not beside those of
    the points (k, 3) that are known.
    """
    count = chain.segments
    if count < 2:
        return []
    size = float((box[1] - box[0]).max())
    parts = max(1, -(-_LEAST // count))
    places = np.arange(count * parts + 1 + chain.closed) / parts  # round to the one after the start
    found = []
    for measure in _measures(chain, values, places, size):
        numbers = np.abs(measure(places)[0])
        inner, beside = numbers[1:-1], np.maximum(numbers[:-2], numbers[2:])
        least = (inner <= np.minimum(numbers[:-2], numbers[2:])) & (inner < _LOW * beside)
        for row in np.flatnonzero(least) + 1:
            ends = np.array([chain.at(places[row - 1]), chain.at(places[row + 1])])
            middle, reach = ends.mean(axis=0), np.linalg.norm(ends[1] - ends[0])
            if (np.linalg.norm(known - middle, axis=1) < reach).any() or _outside(ends, box):
                continue
            place = _minimum(measure, places[row - 1], places[row + 1])
            number, error = measure(np.array([place]))
            point = chain.at(place)
            if abs(number[0]) <= max(error[0], _ZERO * beside[row - 1]) and np.all(
                (point >= box[0]) & (point <= box[1])
            ):
                found.append((int(place % count), np.where(np.abs(point) < 1e-9 * size, 0.0, point)))
    return found


def _outside(points: Floats, box: Floats) -> bool:
    return bool((points.max(axis=0) < box[0]).any() or (points.min(axis=0) > box[1]).any())


def _measures(chain: Chain, values: Values, places: Floats, size: float) -> list[Measure]:
    """Those numbers that are not 0 all along the chain and tell its kinds apart."""

    def points(where: Floats) -> Floats:
        return np.array([chain.at(place) for place in where])

    def minors(where: Floats) -> Numbers:
        return values.noisy_bend(points(where), size)

    def hessian(where: Floats) -> Numbers:
        return values.stretch(points(where))

    def tangents(where: Floats) -> Floats:
        after, before = where + _STEP, where - _STEP
        if not chain.closed:
            after, before = np.minimum(after, places[-1]), np.maximum(before, 0)
        return points(after) - points(before)

    def cubic(where: Floats) -> Numbers:
        return values.cubic(points(where), tangents(where))

    def triple(where: Floats) -> Numbers:
        return values.triple(points(where), tangents(where))

    def vanishes(measure: Measure) -> bool:
        number, error = measure(places)
        return bool(np.median(np.abs(number) / (error + 1e-300)) <= _NOTHING)

    if not vanishes(minors):
        return [minors]
    wanted = [triple] if vanishes(hessian) else [hessian, cubic]
    return [measure for measure in wanted if not vanishes(measure)]


def _minimum(measure: Measure, low: float, high: float) -> float:
    """The place of the least absolute number between two places, by golden sections."""
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = (abs(measure(np.array([place]))[0][0]) for place in (a, b))
    for _ in range(_STEPS):
        if at_a <= at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = abs(measure(np.array([a]))[0][0])
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = abs(measure(np.array([b]))[0][0])
    return a if at_a <= at_b else b
