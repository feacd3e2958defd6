"""Questions at the edge: no bounds, no polynomial, no time, nothing to find."""

import time

import numpy as np
import pytest

from implicit import Ball, Surface, singularities
from tests.singular_catalog import box_of, surface_of


def test_smooth_surfaces_are_proved_smooth() -> None:
    for formula in ("x^2 + y^2 + z^2 = 1", "(x^2 + y^2 + z^2 + 3)^2 = 16 (x^2 + y^2)", "x^3 - 3x y^2 = z", "z = 1"):
        locus = singularities(Surface(formula), 4)
        assert locus.complete and not locus.points and not locus.curves and locus.undecided.shape == (0, 2, 3)


def test_without_bounds_all_of_space_is_searched() -> None:
    locus = singularities(Surface("((x - 100)^2 + y^2 - z^2) (x + 1000) + (z - 3)^2 (y^2 - 2)"))
    assert locus.complete
    assert len(singularities(surface_of("cayley_cubic")).points) == 4
    assert singularities(Surface("x^2 + y^2 + z^2 = 1")).complete


def test_without_bounds_curves_ask_for_bounds() -> None:
    with pytest.raises(ValueError, match="bounds were wanted"):
        singularities(Surface("x^2 = y^2 z"))
    with pytest.raises(ValueError, match="no polynomial needs bounds"):
        singularities(Surface("sin(x) = y z"))


def test_other_formulas_are_searched_and_never_complete() -> None:
    locus = singularities(Surface("sin(x)^2 + sin(y)^2 - z^2"), Ball(4))
    assert len(locus.points) == 5 and not locus.complete
    assert np.array_equal(locus.undecided, [[[-4] * 3, [4] * 3]])
    assert all(np.abs(np.sin(p.position)).max() < 1e-12 for p in locus.points)


def test_zero_everywhere_is_an_error() -> None:
    with pytest.raises(ValueError, match="every point is singular"):
        singularities(Surface("(x + 1)^2 - x^2 - 2x - 1"), 1)


def test_degrees_have_a_limit() -> None:
    with pytest.raises(ValueError, match="degree at most 50"):
        singularities(Surface("x^60 + y^60 = z^60"), 1)


def test_a_constant_has_no_points() -> None:
    assert singularities(Surface("(x + 1)^2 - x^2 - 2x"), 1).complete


def test_time_is_kept_and_nothing_is_claimed() -> None:
    surface = surface_of("barth_decic")
    assert surface.polynomial is not None
    singularities(surface_of("cone"), 1)
    start = time.monotonic()
    locus = singularities(surface, box_of("barth_decic"), timeout=0.0)
    assert time.monotonic() - start < 5
    assert not locus.complete and len(locus.undecided)


@pytest.mark.parametrize("name", ["labs_septic", "enneper", "boy_apery"])
def test_hard_surfaces_keep_the_time_too(name: str) -> None:
    surface = surface_of(name)
    assert surface.polynomial is not None
    singularities(surface_of("cone"), 1)
    start = time.monotonic()
    locus = singularities(surface, box_of(name), timeout=0.3)
    assert time.monotonic() - start < 5
    assert locus.complete or len(locus.undecided)


def test_undecided_boxes_hold_what_was_not_found() -> None:
    everything = singularities(surface_of("kummer"), 1.5)
    locus = singularities(surface_of("kummer"), 1.5, timeout=0)
    assert not locus.complete
    low, high = locus.undecided[:, 0], locus.undecided[:, 1]
    for point in everything.points:
        assert np.all((low <= point.position) & (point.position <= high), axis=1).any()


def test_answers_cannot_be_changed() -> None:
    locus = singularities(surface_of("whitney_umbrella"), 1)
    with pytest.raises(ValueError, match="read-only"):
        locus.curves[0].polyline[0] = 0
    with pytest.raises(AttributeError):
        locus.complete = False  # type: ignore[misc]
