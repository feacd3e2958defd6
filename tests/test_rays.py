"""Rays: the first zero of f, against closed forms, roots of polynomials, slabs, and signs of f on the way."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from implicit import Box, Mesh, Surface, UndecidedError, cast_rays, classify, x, y, z

SPHERE = Surface("x^2 + y^2 + z^2 = 1")
GYROID = Surface("sin(4 x) cos(4 y) + sin(4 y) cos(4 z) + sin(4 z) cos(4 x)")
BARTH = Surface("4 (2.618 x^2 - y^2) (2.618 y^2 - z^2) (2.618 z^2 - x^2) - 4.236 (x^2 + y^2 + z^2 - 1)^2")
BLOCK = Surface("max(abs(x) - 1, abs(y) - 0.7, abs(z) - 0.5)")
COORDINATE = st.floats(-4, 4).map(lambda value: round(value, 3))
PLACE = st.tuples(COORDINATE, COORDINATE, COORDINATE)
WAY = PLACE.filter(lambda way: np.linalg.norm(way) > 0.1)
SEVERAL = settings(max_examples=60, deadline=None)


def random_rays(count, spread=3.0, seed=0):
    """Origins and unit directions (count, 3)."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    return spread * rng.normal(size=(count, 3)), way / np.linalg.norm(way, axis=1, keepdims=True)


@SEVERAL
@given(PLACE, WAY)
def test_a_sphere_is_met_where_the_quadratic_formula_says(origin, way):
    o, d = np.array(origin), np.array(way) / np.linalg.norm(way)
    half, rest = o @ d, o @ o - 1
    root = half * half - rest
    assume(abs(root) > 1e-6 and abs(rest) > 1e-6)
    places = [s for s in (-half - np.sqrt(max(root, 0)), -half + np.sqrt(max(root, 0))) if root > 0 and s >= 0]
    wanted = min(places, default=np.nan)
    assert cast_rays(SPHERE, origin, way) == pytest.approx(wanted, rel=1e-9, nan_ok=True)


@SEVERAL
@given(npst.arrays(np.int64, (4, 4, 4), elements=st.integers(-5, 5)), st.integers(0, 2**32 - 1))
def test_polynomials_are_met_at_the_least_root_on_the_ray(table, seed):
    table[np.indices(table.shape).sum(axis=0) > 4] = 0
    assume((table.ravel()[1:] != 0).any())
    surface = Surface(sum(int(c) * x**i * y**j * z**k for (i, j, k), c in np.ndenumerate(table)))
    starts, ways = random_rays(20, seed=seed)
    found = cast_rays(surface, starts, ways)
    for o, d, s in zip(starts, ways, found, strict=True):
        line = [np.polynomial.Polynomial([a, b]) for a, b in zip(o, d, strict=True)]
        poly = sum(c * line[0] ** i * line[1] ** j * line[2] ** k for (i, j, k), c in np.ndenumerate(table) if c)
        roots = poly.trim(1e-9).roots()
        ahead = roots[roots.real > -1e-3]
        apart = np.abs(roots[:, None] - ahead) + np.where(roots[:, None] == ahead, np.inf, 0)
        if (apart < 0.01 * np.abs(ahead)).any() or (np.abs(ahead) < 1e-3).any():
            continue  # numpy does not tell roots that are nearly the same, nor on which side of the origin they are
        wanted = min(ahead.real[ahead.imag == 0], default=np.nan)
        if wanted < 1e4 or not s < 1e4:
            assert s == pytest.approx(wanted, rel=1e-5, nan_ok=True)


@pytest.mark.parametrize("surface", [SPHERE, GYROID, BARTH, BLOCK], ids=["sphere", "gyroid", "Barth", "block"])
def test_the_place_is_on_the_surface_and_the_sign_changes_nowhere_before(surface):
    starts, ways = random_rays(300, spread=1.5)
    s = cast_rays(surface, starts, ways, limit=8)
    hit = np.isfinite(s)
    assert hit.sum() > 10
    values, slopes = surface.field.gradients(starts[hit] + s[hit, None] * ways[hit])
    assert (np.abs(values) <= 1e-12 * np.maximum(np.linalg.norm(slopes, axis=1), 1)).all()
    before = np.linspace(0, 1, 400, endpoint=False)[:, None] * np.where(hit, s, 8)
    on_the_way = surface(starts + before[..., None] * ways)
    assert ((on_the_way < 0) == (on_the_way[0] < 0)).all()


def test_what_is_met_parts_inside_from_outside():
    starts, ways = random_rays(500, spread=1.2, seed=3)
    s = cast_rays(BARTH, starts, ways)
    hit = np.isfinite(s)
    assert np.isnan(s).any()
    starts, ways, s = starts[hit], ways[hit], s[hit, None]
    assert np.array_equal(classify(BARTH, starts), classify(BARTH, starts + (1 - 1e-9) * s * ways))
    after = classify(BARTH, starts + (s + 1e-7) * ways)
    assert np.mean(classify(BARTH, starts) == -after) > 0.99  # the others leave at once through a thin part


def test_a_box_is_met_where_slabs_say():
    lower, upper = np.array([-0.3, -1, 0.2]), np.array([0.9, 0.5, 1.1])
    starts, ways = random_rays(400, spread=2)
    near, far = np.sort([(lower - starts) / ways, (upper - starts) / ways], axis=0)
    enter, leave = near.max(axis=1), far.min(axis=1)
    wanted = np.where(enter < leave, np.where(enter >= 0, enter, np.where(leave >= 0, leave, np.nan)), np.nan)
    solid = Surface("max(abs(x - 0.3) - 0.6, abs(y + 0.25) - 0.75, abs(z - 0.65) - 0.45)")
    assert np.allclose(cast_rays(solid, starts, ways), wanted, rtol=1e-12, atol=1e-12, equal_nan=True)


@pytest.mark.parametrize(
    ("formula", "origin", "way", "wanted"),
    [
        ("x^2 + y^2 + z^2 = 1", (-3, 1, 0), (1, 0, 0), 3),
        ("z^2", (0, 0, 3), (0, 0, -1), 3),
        ("(x^2 + y^2 - 1)^2 + z^2", (-3, 0, 0), (1, 0, 0), 2),
        ("x y z", (1, 0, 1), (1, 2, 3), 0),
        ("x^2 = y^2", (-2, -2, 5), (1, 1, 0), 0),
        ("abs(x) + abs(y) + abs(z) = 1", (-3, 0, 1), (1, 0, 0), 3),
        ("(sin(x) - 1)^2", (0, 0, 0), (1, 0, 0), np.pi / 2),
    ],
)
def test_touching_counts(formula, origin, way, wanted):
    assert cast_rays(Surface(formula), origin, way) == pytest.approx(wanted, abs=1e-6)


def test_rays_that_pass_by_miss():
    assert np.isnan(cast_rays(SPHERE, (-3, 1 + 1e-9, 0), (1, 0, 0)))
    assert np.isnan(cast_rays(Surface("z^2 + 0.000001"), (0, 0, 3), (0, 0, -1)))
    assert np.isnan(cast_rays(Surface("x^8 + y^2 = z"), (0, 0, -1), (0, 0, -1)))  # f has a zero at infinity there
    assert np.isnan(cast_rays(Surface("x^2 + y^2 = z^2"), (1, 0, 0), (1, 0, 1)))  # along the cone
    assert np.isnan(cast_rays(Surface("exp(x) = 0"), (0, 0, 0), (-1, 0, 0), limit=100))


def test_a_pole_is_no_place_of_the_surface():
    assert cast_rays(Surface("1/x = 1/2"), (-3, 0, 0), (1, 0, 0)) == pytest.approx(5, abs=1e-12)


@pytest.mark.parametrize("power", [-9, -3, 0, 3, 6, 9])
def test_size_does_not_matter(power):
    size = 10.0**power
    for origin in (0.0, -2.5 * size, -3e4 * size):
        s = cast_rays(Surface(f"x^2 + y^2 + z^2 = {size}^2"), (origin, 0, 0), (1, 0, 0))
        assert s == pytest.approx(size if origin == 0 else -size - origin, rel=1e-9)


@given(PLACE, WAY, st.floats(1e-6, 1e6), st.floats(0.01, 20))
@SEVERAL
def test_directions_have_no_length_and_limits_only_cut(origin, way, length, limit):
    s = cast_rays(SPHERE, origin, way)
    assert cast_rays(SPHERE, origin, np.array(way) * length) == pytest.approx(s, rel=1e-7, nan_ok=True)
    assume(not abs(s - limit) < 1e-6)
    cut = cast_rays(SPHERE, origin, way, limit=limit)
    assert cut == pytest.approx(s if s < limit else np.nan, rel=1e-7, nan_ok=True)


def test_the_limit_itself_belongs_to_the_ray():
    assert cast_rays(SPHERE, (-3, 0, 0), (1, 0, 0), limit=2) == 2
    assert cast_rays(SPHERE, (0, 1, 0), (1, 0, 0), limit=0) == 0
    assert np.isnan(cast_rays(SPHERE, (-3, 0, 0), (1, 0, 0), limit=0))


def test_shapes_follow_the_leading_axes():
    assert isinstance(cast_rays(SPHERE, (-3, 0, 0), (1, 0, 0)), float)
    assert cast_rays(SPHERE, np.zeros((4, 1, 3)), np.ones((5, 3))).shape == (4, 5)
    assert cast_rays(SPHERE, np.zeros((0, 3)), (1, 0, 0)).shape == (0,)


def test_more_rays_than_are_cast_at_once_give_the_same():
    starts, ways = random_rays(20_000)
    every = cast_rays(SPHERE, starts, ways)
    assert np.array_equal(every[9_000:9_100], cast_rays(SPHERE, starts[9_000:9_100], ways[9_000:9_100]), equal_nan=True)


def test_functions_need_a_constant():
    def distance(points):
        return np.linalg.norm(points, axis=1) - 1

    known = Surface.from_function(distance, bounds=Box((-9,) * 3, (9,) * 3), lipschitz=1.0)
    assert cast_rays(known, (-3, 0.1, 0), (1, 0, 0), limit=5) == pytest.approx(3 - np.sqrt(0.99), abs=1e-9)
    with pytest.raises(UndecidedError, match="lipschitz"):
        cast_rays(Surface.from_function(distance), (-3, 0, 0), (1, 0, 0))


def test_rays_through_what_is_not_finite_are_named():
    with pytest.raises(UndecidedError, match="ray 1, beyond a distance") as raised:
        cast_rays(Surface("log(x)"), [(3, 0, 0), (-3, 0, 0)], (1, 0, 0))
    assert list(raised.value.indices) == [1]


@pytest.mark.parametrize(
    ("origins", "directions", "limit", "message"),
    [
        ((0, 0), (1, 0, 0), 1, r"origins must have shape \(..., 3\), got \(2,\)"),
        ("here", (1, 0, 0), 1, "origins must be real numbers"),
        ((0, 0, 0), (0, 0, 0), 1, "directions must not be 0, but that of ray 0 is"),
        ((0, 0, 0), [(1, 0, 0), (np.nan, 0, 0)], 1, r"directions must be finite, but directions\[1\]"),
        (np.zeros((2, 3)), np.ones((3, 3)), 1, r"must go together, got shapes \(2, 3\) and \(3, 3\)"),
        ((0, 0, 0), (1, 0, 0), -1, "limit must be a distance of 0 or more, got -1"),
        ((0, 0, 0), (1, 0, 0), np.nan, "limit must be a distance of 0 or more"),
        ((0, 0, 0), (1, 0, 0), "far", "limit must be a distance, got 'far'"),
    ],
)
def test_errors_say_what_was_wanted(origins, directions, limit, message):
    with pytest.raises(ValueError, match=message):
        cast_rays(SPHERE, origins, directions, limit=limit)


def test_only_surfaces_have_rays():
    with pytest.raises(TypeError, match=r"Surface.*Mesh"):
        cast_rays(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), (0, 0, 0), (1, 0, 0))
