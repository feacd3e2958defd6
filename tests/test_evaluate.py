"""Fields: coefficients and tapes agree with each other, with exact arithmetic and with themselves in any grouping."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface
from implicit.evaluate import PolynomialField, TapeField
from implicit.tape import make_tape

NAMED = [
    "x^2 + y^2 + z^2 = 1",
    "x^3 - 3x y^2 + z/7",
    "(x^2 + 9/4 y^2 + z^2 - 1)^3 = x^2 z^3 + 9/80 y^2 z^3",
    "sqrt(5) x^4 y - pi z^2 + 0.1",
    "x y z (x + y + z - 1) + x^7",
    "z",
]
POINTS = np.random.default_rng(2).uniform(-1.5, 1.5, (201, 3))


@pytest.mark.parametrize("text", NAMED)
def test_coefficients_and_tapes_agree(text):
    surface = Surface(text)
    a, b = surface.field, TapeField(make_tape(surface.expression))
    assert isinstance(a, PolynomialField)
    for left, right in [
        (a.values(POINTS), b.values(POINTS)),
        *zip(a.gradients(POINTS), b.gradients(POINTS), strict=True),
        (a.hessians(POINTS), b.hessians(POINTS)),
    ]:
        assert left.shape == right.shape and np.allclose(left, right, rtol=1e-12, atol=1e-11)


@given(st.sampled_from([NAMED[0], NAMED[1], NAMED[2], NAMED[4]]), st.integers(0, 200))
@settings(max_examples=30, deadline=None)
def test_polynomial_values_are_exact_to_rounding(text, index):
    p = Surface(text).polynomial
    place = [Fraction(float(c)) for c in POINTS[index]]
    parts = [c[0] * place[0] ** i * place[1] ** j * place[2] ** k for (i, j, k), c in p.terms.items()]
    value = Surface(text).field.values(POINTS[index : index + 1])[0]
    assert abs(Fraction(float(value)) - sum(parts)) <= 2.0**-48 * float(sum(map(abs, parts)))


@pytest.mark.parametrize("text", [*NAMED, "max(sin(x), y - z^2)", "exp(x y) - 2"])
def test_values_do_not_depend_on_the_company(text):
    """A point has the same value, bit for bit, alone and among others, with and without its gradient."""
    field = Surface(text).field
    values = field.values(POINTS)
    assert np.array_equal(values, np.concatenate([field.values(POINTS[:70]), field.values(POINTS[70:])]))
    assert np.array_equal(values[5:6], field.values(POINTS[5:6]))
    assert np.array_equal(values, field.gradients(POINTS)[0])
    assert np.array_equal(values[::-1], field.values(POINTS[::-1]))
    many = np.tile(POINTS, (7, 1))
    assert np.array_equal(field.values(many), np.tile(values, 7))


def test_high_degrees_keep_their_digits():
    """Multiplied out, this polynomial would lose every digit near (1, 1, 1)."""
    surface = Surface("(x - 1)^20 + (y - 1)^20 + (z - 1)^20 - 1e-30")
    assert isinstance(surface.field, TapeField) and surface.degree == 20
    assert np.isclose(surface((1.03, 1, 1)), 0.03**20 - 1e-30, rtol=1e-10)


def test_undefined_values_are_nan_and_overflows_infinite():
    assert np.isnan(Surface("sqrt(x) + y")((-1, 0, 0))) and np.isnan(Surface("log(x)")((-1, 0, 0)))
    assert np.isnan(Surface("x^0.3")((-1, 0, 0))) and np.isnan(Surface("max(sqrt(x), 5)")((-1, 0, 0)))
    assert np.isnan(Surface("max(5, sqrt(x))")((-1, 0, 0))) and np.isnan(Surface("min(5, sqrt(x))")((-1, 0, 0)))
    assert np.isinf(Surface("1/x")((0, 0, 0))) and np.isinf(Surface("exp(1000x)")((1, 0, 0)))


def test_large_arguments_of_sine_are_right():
    assert np.isclose(Surface("sin(x)")((1e10, 0, 0)), np.sin(1e10), rtol=1e-12)
    assert np.isclose(Surface("cos(x)")((-3e7, 0, 0)), np.cos(3e7), rtol=1e-12)


@pytest.mark.parametrize("text", ["1e400 x + y", "9^999 x = 1", "sin(1e400 x)"])
def test_numbers_beyond_all_floats_are_refused(text):
    with pytest.raises(ValueError, match="floats"):
        Surface(text).field  # noqa: B018


@pytest.mark.parametrize("text", ["x^1000 + y", "x^1000000000 + y^4", "(x + y)^3000 - 1", "x^40 y^40 z^40 - 1"])
def test_very_high_degrees_have_values_and_ranges(text):
    surface = Surface(text)
    bounds = surface.field.ranges(np.array([[[0.0] * 3, [0.5] * 3]]))[0]
    assert (
        bounds[0] <= surface((0.25, 0.25, 0.25)) <= bounds[1]
        and np.isfinite(surface.gradient((0.25, 0.25, 0.25))).all()
    )
