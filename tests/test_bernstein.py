"""Bernstein coefficients enclose, on any box, and agree with their polynomial."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface
from implicit.bernstein import derivative, hull, interval_matrices, on_boxes, power_tensor, split

NAMED = [
    "x^2 + y^2 + z^2 = 1",
    "x^3 - 3x y^2 + z/7",
    "(x^2 + 9/4 y^2 + z^2 - 1)^3 = x^2 z^3 + 9/80 y^2 z^3",
    "sqrt(5) x^4 y - pi z^2 + 0.1",
    "(x^2 - 0.001)^4 (y - 1/3)^5 + z^9",
]


def inside(boxes, n, rng):
    t = rng.uniform(0, 1, (n, len(boxes), 3))
    t[:8] = np.array(list(itertools.product((0, 1), repeat=3)))[:, None]
    return np.clip(boxes[:, 0] + t * (boxes[:, 1] - boxes[:, 0]), boxes[:, 0], boxes[:, 1])


@given(st.sampled_from(NAMED), st.floats(-9, 1), st.integers(0, 2**31))
@settings(max_examples=60, deadline=None)
def test_ranges_hold_every_computed_value(text, scale, seed):
    rng = np.random.default_rng(seed)
    surface = Surface(text)
    lower = rng.uniform(-3, 3, (20, 3)) * 10 ** rng.uniform(-3, 1)
    boxes = np.stack([lower, lower + 10**scale * rng.uniform(0, 1, (20, 3))], axis=1)
    bounds, values = surface.field.ranges(boxes), surface(inside(boxes, 40, rng))
    assert (bounds[:, 0] <= values).all() and (values <= bounds[:, 1]).all()


def test_ranges_tighten_quadratically():
    surface = Surface(NAMED[2])
    for size in (1e-2, 1e-3, 1e-4):
        box = np.array([[[0.3, 0.2, 0.7], [0.3 + size, 0.2 + size, 0.7 + size]]])
        corners = surface(inside(box, 8, np.random.default_rng(0)))
        assert np.ptp(surface.field.ranges(box)) - np.ptp(corners) < 30 * size**2


def test_a_point_box_has_the_value():
    p = np.array([0.3, -0.2, 0.9])
    surface = Surface(NAMED[1])
    low, high = surface.field.ranges(np.stack([p, p])[None])[0]
    assert low <= surface(p) <= high and high - low < 1e-13


def test_overflow_is_unbounded():
    assert np.array_equal(Surface("x^9").field.ranges(np.array([[[1e200] * 3, [2e200] * 3]])), [[-np.inf, np.inf]])


def test_corner_coefficients_are_corner_values():
    surface = Surface(NAMED[2])
    field = surface.field
    box = np.array([[[-0.4, 0.1, 0.2], [0.3, 0.5, 1.1]]])
    tensor = on_boxes(power_tensor(field.exponents, field.coefficients), box)[0]
    for corner in itertools.product((0, 1), repeat=3):
        place = [box[0, c, axis] for axis, c in enumerate(corner)]
        assert np.isclose(tensor[tuple(-c for c in corner)], surface(place), rtol=1e-12, atol=1e-12)


def test_matrices_reproduce_constants():
    matrices = interval_matrices(np.array([-1.0, 2.0]), np.array([3.0, 2.5]), 5)
    assert np.allclose(matrices[:, :, 0], 1)


@given(st.integers(0, 2), st.floats(0.1, 0.9), st.integers(0, 2**31))
@settings(max_examples=25, deadline=None)
def test_halves_agree_with_the_conversion(axis, t, seed):
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(3, 4, 2))
    box = np.array([[0.0, -1.0, 0.5], [2.0, 1.0, 1.0]])
    whole = on_boxes(table, box[None])[0]
    left, right = split(whole, axis, t)
    low, high = box.copy(), box.copy()
    low[1, axis] = high[0, axis] = (1 - t) * box[0, axis] + t * box[1, axis]
    assert np.allclose(left, on_boxes(table, low[None])[0]) and np.allclose(right, on_boxes(table, high[None])[0])
    outer, inner = hull(whole), np.stack([hull(left), hull(right)])
    assert outer[0] <= inner[:, 0].min() + 1e-12 and outer[1] >= inner[:, 1].max() - 1e-12


def test_derivative_is_that_of_the_polynomial():
    surface = Surface(NAMED[2])
    box = np.array([[[-0.4, 0.1, 0.2], [0.3, 0.5, 1.1]]])
    p = surface.polynomial
    for axis in range(3):
        d = p.derivative(axis)
        wanted = on_boxes(power_tensor(d.exponents, d.coefficients), box)[0]
        whole = on_boxes(power_tensor(p.exponents, p.coefficients), box)[0]
        found = derivative(whole, axis, box[0, 1, axis] - box[0, 0, axis])
        assert np.isclose(hull(found)[0], hull(wanted)[0], rtol=1) and found.shape[axis] == whole.shape[axis] - 1
        assert np.isclose(found[0, 0, 0], wanted[0, 0, 0]) and np.isclose(found[-1, -1, -1], wanted[-1, -1, -1])
