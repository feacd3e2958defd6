"""A surface seen to be smooth has no singular points; one with a singular point is never seen to be smooth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Ball, Surface, polygonize, singularities
from implicit.domain import to_bounds
from implicit.polygonizers.smooth import is_smooth

SMOOTH = ["x^2 + y^2 + z^2 - 1", "x^2 + y^2 - 1", "(x^2 + y^2 + z^2 + 3/4)^2 - 4 (x^2 + y^2)", "x^4 + y^4 + z^4 - 1/10"]
SINGULAR = ["x^2 + y^2 - z^2", "x^2 - y^2 z", "x y z", "(x + y + z - 1/3)^2", "x^3 + y^2 + z^2"]


@pytest.mark.parametrize("text", SMOOTH)
def test_smooth_surfaces_are_seen_to_be_smooth(text: str) -> None:
    assert is_smooth(Surface(text).field, to_bounds(1.5))


@pytest.mark.parametrize("text", SINGULAR)
@pytest.mark.parametrize("bounds", [1.0, Ball(0.7), 0.123])
def test_singular_surfaces_never_are(text: str, bounds: float | Ball) -> None:
    if text.endswith("1/3)^2") and bounds == 0.123:
        bounds = 0.2
    assert not is_smooth(Surface(text).field, to_bounds(bounds))


def test_a_singular_point_on_the_faces_of_the_bounds_counts() -> None:
    assert not is_smooth(Surface("(x - 1)^2 + y^2 - z^2").field, to_bounds(1))


def test_formulas_without_coefficients_are_left_to_the_search() -> None:
    assert not is_smooth(Surface("sin(x) + y + z").field, to_bounds(1))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(-3, 3), min_size=20, max_size=20))
def test_what_is_seen_to_be_smooth_has_nothing_singular(numbers: list[int]) -> None:
    terms = [f"x^{i} y^{j} z^{k}" for i in range(4) for j in range(4 - i) for k in range(4 - i - j)]
    text = " + ".join(f"({number}) {term}" for number, term in zip(numbers, terms, strict=True))
    if not any(numbers[1:]):
        return
    surface = Surface(text)
    if not is_smooth(surface.field, to_bounds(1)):
        return
    locus = singularities(surface, 1)
    assert locus.complete and not locus.points and not locus.curves


@pytest.mark.parametrize("text", SMOOTH)
def test_the_automatic_mesh_of_a_smooth_surface_is_the_marching_one(text: str) -> None:
    automatic, marching = (polygonize(Surface(text), 1.5, resolution=9, method=m) for m in ("auto", "marching"))
    assert np.array_equal(automatic.vertices, marching.vertices) and np.array_equal(automatic.faces, marching.faces)
