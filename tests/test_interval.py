"""Ranges of tapes hold f and every value computed in the box; they are unbounded where f is undefined."""

import itertools

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface
from implicit.tape import make_tape
from tests.test_tape import random_solid

FORMULAS = [
    "sin(7x) cos(y) + exp(y) cos(3z)",
    "tan(x) + 1/(y - 0.5)",
    "max(x, -y, abs(z) - 1) - sqrt(x^2 + y^2)/(z^2 + 1)",
    "abs(x)^2.2 + (y + 9)^(1/3) + tanh(x)/(z + 9) + atan(x y) + log(9 + y) cosh(z)",
    "(x^2 + y^2)^(-0.7) + sqrt(abs(z))",
    "1000sin(1000000x) + 1e-8 cos(x - y)",
    "(x - y)^3 (y - z)^2 / 3 - sqrt(2)",
    "exp(300x) - exp(-300y) + sin(exp(9z))",
]


@given(st.sampled_from(FORMULAS), st.floats(-12, 1), st.integers(0, 2**31))
@settings(max_examples=80, deadline=None)
def test_ranges_hold_every_computed_value(text, scale, seed):
    check(Surface.from_expression(Surface(text).expression), scale, seed)


@given(st.integers(0, 15), st.floats(-6, 0), st.integers(0, 2**31))
@settings(max_examples=30, deadline=None)
def test_ranges_hold_for_solids(which, scale, seed):
    check(Surface.from_expression(random_solid(which)), scale, seed)


def check(surface, scale, seed):
    from implicit.evaluate import TapeField

    rng = np.random.default_rng(seed)
    field = TapeField(make_tape(surface.expression))
    lower = rng.uniform(-3, 3, (20, 3))
    boxes = np.stack([lower, lower + 10**scale * rng.uniform(0, 1, (20, 3))], axis=1)
    t = rng.uniform(0, 1, (40, 20, 3))
    t[:8] = np.array(list(itertools.product((0, 1), repeat=3)))[:, None]
    points = np.clip(boxes[:, 0] + t * (boxes[:, 1] - boxes[:, 0]), boxes[:, 0], boxes[:, 1])
    bounds, values = field.ranges(boxes), field.values(points.reshape(-1, 3)).reshape(40, 20)
    undefined = np.isnan(values).any(axis=0)
    assert not np.isfinite(bounds[undefined]).all(axis=1).any()
    assert (bounds[:, 0] <= values)[:, ~undefined].all() and (values <= bounds[:, 1])[:, ~undefined].all()


@pytest.mark.parametrize(
    ("text", "low", "high", "wanted"),
    [
        ("x^2", -1, 2, (0, 4)),
        ("abs(x)", -3, 2, (0, 3)),
        ("sin(x)", 0, 3, (0, 1)),
        ("cos(x)", 2, 4, (-1, np.cos(2))),
        ("sqrt(x)", 4, 9, (2, 3)),
        ("1/x", 1, 2, (0.5, 1)),
        ("exp(x)", 0, 1, (1, np.e)),
        ("x^1.5", 0, 4, (0, 8)),
        ("atan(x)", -1, 1, (-np.pi / 4, np.pi / 4)),
        ("sqrt(x^2 + y^2)", -1e-200, 1e-200, (0, 2e-200)),
    ],
)
def test_ranges_are_tight(text, low, high, wanted):
    from implicit.evaluate import TapeField

    field = TapeField(make_tape(Surface(text).expression))
    bounds = field.ranges(np.array([[[low] * 3, [high] * 3]], dtype=float))[0]
    assert bounds[0] <= wanted[0] and bounds[1] >= wanted[1]
    assert np.allclose(bounds, wanted, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    "text", ["1/x", "sqrt(x)", "log(x)", "x^0.3", "x^(-1/3)", "max(1/x, 5)", "log(x^2)", "tan(2x + 2)"]
)
def test_unbounded_where_undefined(text):
    field = Surface(text).field
    assert not np.isfinite(field.ranges(np.array([[[-0.5] * 3, [0.5] * 3]]))).all()


def along_x(text, a):
    return Surface(text).field.values(np.stack([a, np.zeros_like(a), np.zeros_like(a)], axis=1))


def test_elementary_functions_are_well_within_what_the_ranges_allow():
    rng = np.random.default_rng(1)
    near, far = rng.uniform(-4, 4, 500), rng.uniform(-1e5, 1e5, 500)
    a = np.concatenate([near, far, rng.uniform(1e5, 1e12, 100), np.pi / 2 * np.arange(200)])
    for text, function in (("sin(x)", mpmath.sin), ("cos(x)", mpmath.cos)):
        found = along_x(text, a)
        assert max(abs(float(function(mpmath.mpf(v)) - mpmath.mpf(w))) for v, w in zip(a, found, strict=True)) < 1e-15
    b = np.concatenate([rng.uniform(-708, 709, 600), rng.uniform(-1, 1, 400)])
    found = along_x("exp(x)", b)
    assert max(abs(float(mpmath.mpf(w) / mpmath.exp(mpmath.mpf(v)) - 1)) for v, w in zip(b, found, strict=True)) < 4e-15
    ends = along_x("exp(x)", np.array([-1e9, 1e9, -np.inf, np.inf, np.nan]))
    assert np.array_equal(ends, [0, np.inf, 0, np.inf, np.nan], equal_nan=True)


def test_known_lipschitz_constants_give_ranges():
    surface = Surface.from_function(lambda p: np.linalg.norm(p, axis=1) - 1, lipschitz=1)
    boxes = np.array([[[2.0, 2, 2], [3, 3, 3]], [[0, 0, 0], [2, 2, 2]]])
    bounds = surface.field.ranges(boxes)
    assert bounds[0, 0] > 0 and bounds[1, 0] < 0 < bounds[1, 1]
    assert not np.isfinite(Surface.from_function(lambda p: p[:, 0]).field.ranges(boxes)).any()
    moved = (surface - Surface("x")).translate((1, 0, 0)).rotate(0.3).field
    rng = np.random.default_rng(0)
    p = rng.uniform(2, 3, (100, 3))
    low, high = moved.ranges(boxes[:1])[0]
    assert (low <= moved.values(p)).all() and (moved.values(p) <= high).all()
