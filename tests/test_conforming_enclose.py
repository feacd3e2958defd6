"""Signs along segments and over triangles against theory and against dense samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface
from implicit.domain import to_bounds
from implicit.polygonizers.conforming.enclose import changes, plain
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local

STEINER = "x^2*y^2 + y^2*z^2 + z^2*x^2 - x*y*z"
SEXTIC = "4*(2.618*x^2 - y^2)*(2.618*y^2 - z^2)*(2.618*z^2 - x^2) - 4.236*(x^2 + y^2 + z^2 - 1)^2"


def lay(formula: str) -> Local:
    surface = Surface(formula)
    return Local(surface.field, Grid.over(to_bounds(1.5), 32, 7), ())


def edges(rng: np.random.Generator, count: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    middle, way = rng.uniform(10, 36, (count, 3)), rng.normal(size=(count, 3)) * size
    return middle - way, middle + way


@settings(max_examples=60)
@given(st.lists(st.floats(0.01, 0.99), min_size=1, max_size=5), st.integers(0, 2))
def test_as_many_changes_as_roots_between(roots, axis):
    """On a segment of length 2 in the direction of an axis, f is the product of t - r; roots apart count each."""
    roots = sorted(roots)
    if len(roots) > 1 and min(np.diff(roots)) < 0.05:
        return
    name = "xyz"[axis]
    inside = lay("*".join(f"({name} - ({2 * root - 1!r}))" for root in roots))
    ends = np.full((2, 1, 3), 0.3)
    ends[:, 0, axis] = -1, 1
    a, b = inside.grid.to_units(ends)
    found = changes(inside, a, b)
    assert found.sure.all() and found.counts.tolist() == [len(roots)]
    assert ((found.low <= np.array(roots) + 1e-9) & (np.array(roots) - 1e-9 <= found.high)).all()
    if len(roots) > 1:
        assert roots[0] <= found.beyond[0] <= roots[1]


@pytest.mark.parametrize("formula", ["x^2 + y^2 - z^2", STEINER, SEXTIC])
@pytest.mark.parametrize("size", [1.5, 4.0])
def test_no_change_is_missed_and_none_invented(formula, size):
    inside = lay(formula)
    a, b = edges(np.random.default_rng(1), 4000, size)
    found = changes(inside, a, b)
    seen = np.stack([inside.values(a + (b - a) * t) < 0 for t in np.linspace(0, 1, 1001)], axis=1)
    dense = np.count_nonzero(np.diff(seen, axis=1), axis=1)
    sure = np.ones(len(a), bool)
    sure[found.owner[~found.sure]] = False
    more = found.counts - dense  # two changes within a thousandth of a segment escape the samples
    assert sure.mean() > 0.999 and (more >= 0).all() and (more[sure] % 2 == 0).all() and (more == 0).mean() > 0.999
    twice = (dense == 2) & (found.counts == 2)
    assert twice.sum() > 5
    between = inside.values(a + (b - a) * found.beyond[:, None]) < 0
    assert (between != seen[:, 0])[twice & sure].all()


def test_f_that_is_nothing_but_rounding_has_nothing_to_decide():
    plane = lay("x")
    ends = plane.grid.to_units(np.array([[[0.0, -1, 0]], [[0.0, 1, 0]]]))
    assert changes(plane, *ends).counts[0] <= 1


@pytest.mark.parametrize("formula", ["x^2 + y^2 - z^2", STEINER, SEXTIC])
def test_plain_triangles_hold_no_closed_curve_and_one_arc_at_most(formula):
    inside = lay(formula)
    rng = np.random.default_rng(2)
    corners = rng.uniform(10, 36, (1500, 1, 3)) + rng.normal(size=(1500, 3, 3)) * 0.8
    proved = plain(inside, corners)
    assert proved.mean() > 0.9
    sides = [changes(inside, corners[:, i], corners[:, (i + 1) % 3]).counts for i in range(3)]
    simple = proved & (np.max(sides, axis=0) <= 1)
    assert (np.sum(sides, axis=0)[simple] % 2 == 0).all()
    # one arc or none: along lines through a corner, f changes once at most where its ends differ, else never or twice
    shares = rng.dirichlet(np.ones(3), (len(corners), 40))
    values = inside.values(np.einsum("nkb,nbc->nkc", shares, corners)) < 0
    uncrossed = simple & (np.sum(sides, axis=0) == 0)
    assert (values[uncrossed] == values[uncrossed][:, :1]).all()


def test_a_small_sphere_inside_a_triangle_is_not_plain():
    ball = lay("x^2 + y^2 + z^2 - 0.01")
    corners = ball.grid.to_units(np.array([[[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]]))
    assert not plain(ball, corners)[0]


def test_of_what_is_no_polynomial_samples_tell():
    wave = lay("sin(6*x) + y")
    ends = wave.grid.to_units(np.array([[[-1.4, 0.0, 0]], [[1.4, 0.0, 0]]]))
    found = changes(wave, *ends)
    assert found.counts.tolist() == [5]  # at multiples of pi / 6
    assert -1.2 < -1.4 + 2.8 * found.beyond[0] < -np.pi / 6
    small = wave.grid.to_units(np.array([[[0.0, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0.0]]]))
    large = wave.grid.to_units(np.array([[[0.0, -1.4, 0], [1.4, 1.4, 0], [-1.4, 1.4, 0.0]]]))
    assert plain(wave, small)[0] and not plain(wave, large)[0]


def test_segments_lost_in_rounding_are_not_heard() -> None:
    field = Surface("(x - 1/3)^2 + (y - 1/7)^2*(x + 5)").field
    local = Local(field, Grid.over(to_bounds(1.0), 16, 6), ())
    place = local.grid.to_units(np.array([[1 / 3, 1 / 7, 0.2]]))
    way = np.array([[1.0, 0.3, 0.0]])
    for size, heard in ((1.0, True), (1e-3, True), (1e-9, False)):
        assert changes(local, place + size * way, place + size * way[:, [1, 0, 2]]).loud.tolist() == [heard]
