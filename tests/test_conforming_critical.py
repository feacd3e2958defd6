"""The least critical value of the distance from a point on a surface, against geometry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface
from implicit.domain import to_bounds
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.points.critical import critical_radius

NONE = np.zeros((0, 3))


def least(formula: str, reach: float, singular: np.ndarray = NONE) -> float:
    """From the origin, in lengths of the formula."""
    surface = Surface(formula)
    grid = Grid.over(to_bounds(2), 64, 7)
    local = Local(surface.field, grid, ())
    units = grid.to_units(singular) if len(singular) else singular
    return critical_radius(local, grid.to_units(np.zeros(3)), reach / grid.step, units) * grid.step


@settings(max_examples=25, deadline=None)
@given(st.floats(0.1, 0.6), st.floats(0.05, 0.5), st.floats(0, 6.3))
def test_a_sphere_beside_is_critical_at_its_nearest_point(gap, radius, turn):
    middle = gap + radius
    x, y, z = (round(middle * float(v), 9) for v in (np.cos(turn), 0.6 * np.sin(turn), 0.8 * np.sin(turn)))
    assert least(f"(x - {x:.9f})^2 + (y - {y:.9f})^2 + (z - {z:.9f})^2 - {radius!r}^2", 0.8) == pytest.approx(
        gap, rel=1e-6
    )


@pytest.mark.parametrize("formula", ["x^2 + y^2 = z^2", "x^2 + y^2 = z^3", "x*y*z", "x^2 + y^3 - z^2"])
def test_what_is_homogeneous_by_weights_has_none(formula):
    axes = np.concatenate([np.outer(np.linspace(-1, 1, 801), e) for e in np.eye(3)])
    assert least(formula, 0.8, axes if formula == "x*y*z" else NONE) == np.inf


def test_of_several_the_least_counts_and_what_is_beyond_reach_does_not():
    spheres = "((x - 0.5)^2 + y^2 + z^2 - 0.01)*((y + 0.4)^2 + x^2 + z^2 - 0.01)"
    assert least(spheres, 0.6) == pytest.approx(0.3, rel=1e-6)
    assert least(spheres, 0.2) == np.inf
