"""Exact algebra in coordinates of small coefficients: the same surface, and small where a turn had made it large."""

import numpy as np
import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface, singularities
from implicit.singular.form import Form
from implicit.singular.placement import Placement, place
from implicit.singular.proof import integral
from tests.singular_catalog import surface_of
from tests.test_singular_points import turned

SMOOTH = ["sphere", "torus", "cyclide_ring", "clebsch", "tanglecube", "monkey_saddle"]


def _placed(surface: Surface) -> Placement:
    assert surface.polynomial is not None
    return place(integral(Form.of(surface.polynomial)))


def _digits(form: Form) -> int:
    return max(int(a.p).bit_length() for c in integral(form).terms.values() for a in c.coeffs())


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 10**6), st.sampled_from(["cayley_cubic", "steiner_roman", "whitney_umbrella", "boy_apery"]))
def test_a_placement_is_the_same_surface(seed: int, name: str) -> None:
    """f(M X + s) is a multiple of the form in X: where one is zero, so is the other."""
    surface = turned(surface_of(name), seed)[0]
    placement = _placed(surface)
    matrix, shift = placement.floats
    values = placement.form.nested()
    inside = np.random.default_rng(seed).normal(size=(6, 3))
    ours = np.array([float(values(*(arb(float(c)) for c in p)).mid()) for p in inside])
    theirs = surface(inside @ matrix.T + shift)
    ratio = theirs / ours
    assert np.allclose(ratio, np.median(ratio), rtol=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["steiner_roman", "boy_apery", "source_cubic_A5"])
def test_a_turn_is_undone(name: str, seed: int) -> None:
    surface = surface_of(name)
    here = turned(surface, seed)[0]
    assert surface.polynomial is not None and here.polynomial is not None
    before, turn = (_digits(Form.of(s.polynomial)) for s in (surface, here) if s.polynomial is not None)
    assert turn > 2 * before
    assert _digits(_placed(here).form) <= before + 2


def test_unstable_forms_and_cones_come_to_an_end() -> None:
    for formula in ("x^2 = y^2 z", "x^3 + 49 y^3 + 7 z^3", "x^2 + 25 y^2", "z = 7^9 x^2 + y^5"):
        matrix, _ = _placed(Surface(formula)).floats
        assert np.linalg.cond(matrix) < 31


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", SMOOTH)
def test_turned_smooth_surfaces_are_proved_smooth(name: str, seed: int) -> None:
    locus = singularities(turned(surface_of(name), seed)[0], 15)
    assert locus.complete and not locus.points and not locus.curves
