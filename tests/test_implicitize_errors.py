"""What implicitization refuses, and its limits of time and size."""

import time
from functools import partial

import pytest
import sympy
from sympy import cos, exp, pi, sin, sqrt, symbols

from implicit import (
    NotASurfaceError,
    NotPolynomialError,
    Surface,
    TimeLimitError,
    TranscendentalError,
    implicitize,
    matrix_form,
)
from tests.rational import bezier, random_net, u, v


@pytest.mark.parametrize("coordinates", [(u, u**2, u**3), (u + v, (u + v) ** 2, 1), (cos(u), sin(u), 1)])
def test_a_curve_is_no_surface(coordinates):
    with pytest.raises(NotASurfaceError, match="curve"):
        implicitize(coordinates, (u, v))


def test_a_point_is_no_surface():
    with pytest.raises(NotASurfaceError, match="point"):
        implicitize((1, 2, 3), (u, v))


@pytest.mark.parametrize(
    ("coordinates", "message"),
    [
        ((u * cos(u), u * sin(u), v), "by itself"),
        ((cos(u), sin(sqrt(2) * u), v), "common unit"),
        ((cos(u), exp(u), v), "circular and in exponential"),
        ((sin(u * v), u, v), "no sum of multiples"),
        ((pi * u, v, u * v), "pi is no algebraic number"),
        ((sympy.log(u), v, u), "no rational function"),
        ((exp(u + 1), v, exp(2 * u) * v), "transcendental factor"),
    ],
)
def test_transcendental_coordinates(coordinates, message):
    with pytest.raises(TranscendentalError, match=message):
        implicitize(coordinates, (u, v))


def test_roots_of_parameters_are_refused():
    with pytest.raises(NotPolynomialError, match="substitution"):
        implicitize((sqrt(u), v, u * v), (u, v))


def test_zero_denominators():
    with pytest.raises(ValueError, match="coordinate y is not finite"):
        implicitize((u, sympy.zoo * v, v), (u, v))
    nothing = sympy.Add(u**2, -(u**2), evaluate=False)
    with pytest.raises(ValueError, match="denominator of coordinate z"):
        implicitize((u, v, sympy.Pow(nothing, -1, evaluate=False)), (u, v))


@pytest.mark.parametrize(
    ("coordinates", "parameters", "message"),
    [
        ((u, v), (u, v), "three coordinates"),
        ((u, v, u * v), (u, u), "two different"),
        ((u, v, u * v), ("u", "v"), "two different"),
        ((u, v, symbols("a") * u), (u, v), "contain a"),
    ],
)
def test_wrong_arguments(coordinates, parameters, message):
    with pytest.raises(ValueError, match=message):
        implicitize(coordinates, parameters)


def test_texts_are_refused():
    for coordinates in (("u", v, u * v), "uv"):
        with pytest.raises(TypeError, match="text"):
            implicitize(coordinates, (u, v))


@pytest.mark.parametrize("read", [implicitize, matrix_form, partial(implicitize, method="approximate")])
def test_things_of_another_kind_are_named(read):
    for given in (1, Surface("x")):
        with pytest.raises(TypeError, match=rf"three coordinates .* was wanted, got {type(given).__name__}"):
            read(given, (u, v))
    with pytest.raises(TypeError, match="a number for each coordinate was wanted, got object"):
        read((u, v, object()), (u, v))
    with pytest.raises(ValueError, match="two different sympy symbols, got 1"):
        read((u, v, u * v), 1)


def test_high_degrees_are_estimated_first():
    coordinates = bezier(random_net(4, 4, 1))
    with pytest.raises(TimeLimitError, match=r"degree 32 and up to 6545 terms.*timeout"):
        implicitize(coordinates, (u, v))
    with pytest.raises(TimeLimitError, match="does not fit timeout=1"):
        implicitize(coordinates, (u, v), timeout=1)


def test_timeout_is_honoured():
    coordinates = bezier(random_net(3, 3, 6, size=10**9))
    start = time.monotonic()
    with pytest.raises(TimeoutError, match="no answer within timeout"):
        implicitize(coordinates, (u, v), timeout=0.3)
    assert time.monotonic() - start < 10
