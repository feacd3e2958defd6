"""Derivatives of functions known only by their values, and the product rule."""

from collections.abc import Callable, Sequence
from math import comb

import numpy as np

from parametric.parameters import Array, Interval

NODES = np.arange(-4, 5)
STEPS = 512
"""The domain is divided into this many steps; a derivative of order k loses about 512^k units in the last place."""


def differentiate(function: Callable[[Array], Array], t: Array, order: int, domain: Interval) -> Array:
    """Derivative of a function (...,) -> (..., d) on an interval by differences of order eight.

    The nine nodes lie evenly about t, or against the end of the interval where t is near it.
    """
    if order == 0 or t.size == 0:
        return function(t)
    low, high = domain
    step = (high - low) / STEPS
    centre = np.clip(t, low + 4 * step, high - 4 * step)
    offset = (t - centre) / step
    powers = np.stack([_power(offset, m, order) for m in range(NODES.size)], axis=-1)
    weights = powers @ np.linalg.inv(np.vander(NODES, increasing=True).astype(float))
    values = function(np.clip(centre[..., None] + step * NODES, low, high))
    return np.asarray(np.einsum("...k,...kc->...c", weights, values) / step**order)


def _power(s: Array, exponent: int, order: int) -> Array:
    """Derivative of s^exponent."""
    if order > exponent:
        return np.zeros_like(s)
    factor = float(np.prod(np.arange(exponent - order + 1, exponent + 1)))
    return factor * s ** (exponent - order)


def multiply(a: Sequence[Array], b: Sequence[Array], product: Callable[[Array, Array], Array], order: int) -> Array:
    """Derivative of a product from those of its factors: sum C(order, k) a_k b_(order-k)."""
    terms = [comb(order, k) * product(a[k], b[order - k]) for k in range(order + 1)]
    return sum(terms[1:], terms[0])


def unit_derivatives(vectors: Sequence[Array]) -> list[Array]:
    """Derivatives of the unit vector from those of a vector (..., 3) that does not vanish.

    The length q follows from q q = w.w, the unit vector e from q e = w, both by the product rule.
    """
    lengths = [np.linalg.norm(vectors[0], axis=-1, keepdims=True)]
    units = [vectors[0] / lengths[0]]
    for n in range(1, len(vectors)):
        square = multiply(vectors, vectors, dot, n)
        rest = sum(comb(n, k) * lengths[k] * lengths[n - k] for k in range(1, n))
        lengths.append((square - rest) / (2 * lengths[0]))
        known = sum(comb(n, k) * lengths[k] * units[n - k] for k in range(1, n + 1))
        units.append((vectors[n] - known) / lengths[0])
    return units


def dot(a: Array, b: Array) -> Array:
    """Scalar products (..., 1) of vectors (..., 3)."""
    return np.asarray(np.einsum("...c,...c->...", a, b)[..., None])
