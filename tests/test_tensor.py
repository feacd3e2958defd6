"""Bezier, B-spline, NURBS and Hermite surfaces."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import NdBSpline
from scipy.spatial import ConvexHull

from parametric import BezierSurface, BSplineSurface, HermitePatch, u, v
from parametric.textbook.algorithms import de_boor_surface, de_casteljau_surface

QUICK = settings(max_examples=20, deadline=None)
U, V = np.random.default_rng(99).random((2, 40))
KINDS = ("clamped", "open", "closed")


@st.composite
def surfaces(draw, rational=True, kinds=KINDS, highest=4):
    degrees = draw(st.tuples(st.integers(1, highest), st.integers(1, highest)))
    counts = [d + draw(st.integers(1, 4)) for d in degrees]
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    weights = rng.random(counts) + 0.5 if rational and draw(st.booleans()) else None
    knots = draw(st.tuples(st.sampled_from(kinds), st.sampled_from(kinds)))
    return BSplineSurface(rng.normal(size=(*counts, 3)), degrees, knots, weights)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@given(surfaces())
@QUICK
def test_grids_and_scattered_points_agree(surface):
    a, b = np.sort(U[:7]), V[:5]
    grid = surface(a[:, None], b[None, :])
    assert grid.shape == (7, 5, 3)
    near(grid, surface(np.repeat(a, 5), np.tile(b, 7)).reshape(7, 5, 3))
    near(surface(a[None, :], b[:, None]), grid.transpose(1, 0, 2))
    near(surface(a, 0.5), surface(a, np.full(7, 0.5)))
    near(surface.grid(a, b), grid)
    for i, j in ((1, 0), (0, 1), (2, 1), (0, 5)):
        near(surface.derivative(a[:5], b, i, j), np.einsum("kkc->kc", surface.derivative(a[:5, None], b, i, j)), 1e-8)


def test_shapes_follow_broadcasting():
    surface = BezierSurface(np.random.default_rng(0).normal(size=(3, 4, 3)))
    a, b = np.random.default_rng(1).random((2, 2, 3, 4))
    assert surface(0.5, 0.5).shape == (3,)
    assert surface(a, b).shape == (2, 3, 4, 3)
    assert surface(a[:, :1, :1], b[:1]).shape == (2, 3, 4, 3)
    late, early = a[0, 0, :], b[0, :2, 0]
    mixed = surface(late[:, None, None, None], early[:, None])  # u along axis 0, v along axis 2 of (4, 1, 2, 1)
    assert mixed.shape == (4, 1, 2, 1, 3)
    near(mixed[3, 0, 1, 0], surface(late[3], early[1]))
    turned = surface(late, early[:, None])
    near(turned[1, 2], surface(late[2], early[1]))
    assert surface(np.empty(0), np.empty(0)).shape == (0, 3)


@given(surfaces(rational=False, kinds=("clamped", "open")))
@QUICK
def test_agrees_with_scipy_up_to_second_derivatives(surface):
    peer = NdBSpline(tuple(k.values for k in surface.knots), surface.points, surface.degrees)
    for order in ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)):
        expected = peer(np.stack([U, V], axis=-1), nu=order)
        near(surface.derivative(U, V, *order), expected, 1e-12 * max(1, np.abs(expected).max()))


@given(surfaces(rational=False))
@QUICK
def test_de_boor_agrees(surface):
    net = surface.knots[1].unwrap(surface.knots[0].unwrap(surface.points, 0), 1)
    knots = tuple(k.values.tolist() for k in surface.knots)
    for a, b in ((0.0, 0.0), (0.3, 0.8), (1.0, 0.5), (1.0, 1.0)):
        near(de_boor_surface(net, knots, surface.degrees, a, b), surface(a, b))


@pytest.mark.parametrize("shape", [(2, 2), (4, 3), (11, 11), (2, 9)])
def test_de_casteljau_agrees(shape):
    surface = BezierSurface(np.random.default_rng(0).normal(size=(*shape, 3)))
    for a, b in ((0.0, 1.0), (2 / 3, 1 / 3), (0.9, 0.1)):
        near(de_casteljau_surface(surface.points, a, b), surface(a, b), 1e-14)
        near(surface([a, a], [b, b]), [surface(a, b)] * 2, 1e-14)


def test_derivative_against_exact_arithmetic():
    net = np.array(
        [[[Fraction(i * j, 3), Fraction(i**2 - j), Fraction(1, i + j + 1)] for j in range(4)] for i in range(3)]
    )
    surface = BezierSurface(net.astype(float))
    a, b = Fraction(2, 7), Fraction(3, 5)
    exact = 2 * (de_casteljau_surface(net[1:], a, b) - de_casteljau_surface(net[:-1], a, b))
    near(surface.derivative(float(a), float(b), 1, 0), exact.astype(float), 1e-14)
    mixed = np.diff(np.diff(net, axis=0), axis=1) * 6
    near(surface.twist(float(a), float(b)), de_casteljau_surface(mixed, a, b).astype(float), 1e-14)


@given(surfaces())
@QUICK
def test_rational_derivatives_are_limits(surface):
    h = 1e-5
    inside = np.abs(U[:, None] - surface.breaks[0]).min(axis=1) > 2 * h
    inside &= np.abs(V[:, None] - surface.breaks[1]).min(axis=1) > 2 * h
    a, b = U[inside], V[inside]
    for i, j in ((1, 0), (2, 0), (1, 1)):
        limit = (surface.derivative(a + h, b, i - 1, j) - surface.derivative(a - h, b, i - 1, j)) / (2 * h)
        near(surface.derivative(a, b, i, j), limit, 1e-4 * max(1, np.abs(limit).max()))


@given(surfaces())
@QUICK
def test_jet_holds_every_derivative(surface):
    jet = surface.jet(U, V, 2)
    assert sorted(jet) == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0)]
    for (i, j), values in jet.items():
        near(values, surface.derivative(U, V, i, j), 1e-12 * max(1, np.abs(values).max()))


@given(surfaces())
@QUICK
def test_elevation_insertion_split_and_patches_leave_the_surface(surface):
    near(surface.elevate((1, 2))(U, V), surface(U, V))
    near(surface.insert_knot(u=0.31, v=0.61)(U, V), surface(U, V))
    for part in surface.split(u=0.4, v=0.7):
        (u0, u1), (v0, v1) = part.domain
        a, b = u0 + (u1 - u0) * U, v0 + (v1 - v0) * V
        near(part(a, b), surface(a, b))
    patches = iter(surface.bezier_patches())
    ends = surface.breaks
    for k in range(ends[0].size - 1):
        for m in range(ends[1].size - 1):
            (u0, u1), (v0, v1) = ends[0][k : k + 2], ends[1][m : m + 2]
            near(next(patches)(U, V), surface(np.minimum(u0 + (u1 - u0) * U, u1), np.minimum(v0 + (v1 - v0) * V, v1)))
    assert surface.bezier_patches() is surface.bezier_patches()


@given(surfaces())
@QUICK
def test_iso_curves(surface):
    near(surface.iso_u(0.3)(V), surface(0.3, V))
    near(surface.iso_v(0.3)(U), surface(U, 0.3))


@given(surfaces())
@QUICK
def test_affine_invariance(surface):
    matrix = np.vstack([np.random.default_rng(0).normal(size=(3, 4)), [0, 0, 0, 1]])
    near(surface.transform(matrix)(U, V), surface(U, V) @ matrix[:3, :3].T + matrix[:3, 3])


@given(surfaces(highest=3))
@QUICK
def test_strong_convex_hull(surface):
    for patch in surface.bezier_patches()[:4]:
        points = patch.points.reshape(-1, 3)
        if len(points) > 4:
            hull = ConvexHull(points)
            assert (patch(U, V) @ hull.equations[:, :3].T + hull.equations[:, 3]).max() < 1e-11


@given(surfaces(kinds=("clamped",)))
@QUICK
def test_corners_of_clamped_surfaces(surface):
    p = surface.points
    near(surface([0, 1, 0, 1], [0, 0, 1, 1]), [p[0, 0], p[-1, 0], p[0, -1], p[-1, -1]])


@pytest.mark.parametrize("kinds", [("closed", "clamped"), ("closed", "closed")])
def test_closed_surfaces_close_smoothly(kinds):
    surface = BSplineSurface(np.random.default_rng(0).normal(size=(7, 6, 3)), (3, 2), kinds)
    for order in range(3):
        near(surface.derivative(0.0, V, order, 0), surface.derivative(1.0, V, order, 0), 1e-10)
    if kinds[1] == "closed":
        near(surface.derivative(U, 0.0, 0, 1), surface.derivative(U, 1.0, 0, 1), 1e-10)


def test_local_modification():
    """A control point changes the surface on [u_i, u_(i+p+1)) x [v_j, v_(j+q+1)) and nowhere else."""
    surface = BSplineSurface(np.random.default_rng(0).normal(size=(8, 7, 3)), (3, 2))
    moved = surface.replace_point(3, 2, (9, 9, 9))
    (ku, kv) = surface.knots
    a, b = np.random.default_rng(1).random((2, 500))
    inside = (a > ku.values[3]) & (a < ku.values[7]) & (b > kv.values[2]) & (b < kv.values[5])
    changed = (surface(a, b) != moved(a, b)).any(axis=-1)
    np.testing.assert_array_equal(changed, inside)


def test_constant_weights_change_nothing():
    net = np.random.default_rng(0).normal(size=(4, 5, 3))
    near(BezierSurface(net, np.full((4, 5), 2.5))(U, V), BezierSurface(net)(U, V))


def test_elevating_a_surface_is_no_silent_no_op():
    """geomdl 5.4 returns the surface unchanged from `degree_operations`."""
    surface = BSplineSurface(np.random.default_rng(0).normal(size=(5, 4, 3)), (2, 3))
    raised = surface.elevate((1, 0))
    assert raised.degrees == (3, 3)
    near(raised(U, V), surface(U, V))


def test_knots_are_not_rescaled():
    """geomdl 5.4 silently maps every knot vector to [0, 1]."""
    surface = BSplineSurface(
        np.random.default_rng(0).normal(size=(3, 3, 3)), 2, ([-1, -1, -1, 4, 4, 4], [0, 1, 2, 3, 4, 5])
    )
    assert surface.domain == ((-1, 4), (2, 3))


def test_parameters_outside_the_domain_are_errors_on_open_and_closed_surfaces():
    """geomdl returns garbage, scipy extrapolates; `extrapolate="periodic"` is ignored there."""
    net = np.random.default_rng(0).normal(size=(5, 5, 3))
    for kind in KINDS:
        surface = BSplineSurface(net, 3, (kind, "clamped"))
        with pytest.raises(ValueError, match=r"parameter u must lie in \[0, 1\], got 1.5"):
            surface([0.5, 1.5], 0.5)
        with pytest.raises(ValueError, match=r"parameter v must lie in \[0, 1\], got -0.25"):
            surface(0.5, -0.25)
        with pytest.raises(ValueError, match="got nan"):
            surface(np.nan, 0.5)


def test_rounding_at_the_end_of_the_domain_is_forgiven():
    surface = BezierSurface(np.random.default_rng(0).normal(size=(3, 3, 3)))
    near(surface(np.nextafter(1, 2), 0.0), surface(1.0, 0.0), 0)


def test_hermite_patch_meets_its_sixteen_vectors_and_converts_back():
    data = np.random.default_rng(0).normal(size=(4, 2, 2, 3))
    patch = HermitePatch(*data)
    a, b = np.array([[0.0], [1.0]]), np.array([[0.0, 1.0]])
    for order, expected in zip(((0, 0), (1, 0), (0, 1), (1, 1)), data):
        near(patch.derivative(a, b, *order), expected)
    near(patch.data[2:, :2], data[1])
    back = HermitePatch.from_bezier(patch.to_bezier())
    near(back.points, patch.points)


def test_expressions_are_exact():
    surface = BezierSurface(np.random.default_rng(0).integers(-5, 5, size=(3, 3, 3)), [[1, 2, 1], [2, 3, 1], [1, 1, 2]])
    for e, k in zip(surface.expressions(), range(3)):
        assert float(e.subs({u: 0.25, v: 0.75})) == pytest.approx(surface(0.25, 0.75)[k], rel=1e-14)


def test_implicitize_a_bilinear_patch():
    surface = BezierSurface([[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]]).implicitize()
    assert surface.degree == 2
    assert surface(np.array([0.5, 0.5, 0.25])) == 0


def test_read_only_and_strided_parameters_do_not_compile_anew():
    from parametric.splines.basis import combine_points

    surface = BezierSurface(NET)
    expected = surface(U, V)
    compiled = len(combine_points.signatures)
    frozen, strided = U.copy(), np.repeat(V, 2)[::2]
    frozen.flags.writeable = False
    near(surface(frozen, strided), expected, 0)
    near(surface(U[:, None], np.tile(V[:, None], 3))[:, 1], expected, 0)
    assert len(combine_points.signatures) == compiled
    with pytest.raises(ValueError, match="read-only"):
        surface.breaks[0][0] = 1


def test_surfaces_cannot_be_changed():
    net = np.random.default_rng(0).normal(size=(3, 3, 3))
    surface = BezierSurface(net)
    copy = surface.points.copy()
    net[0] = 9
    np.testing.assert_array_equal(surface.points, copy)
    with pytest.raises(ValueError, match="read-only"):
        surface.points[0, 0] = 1
    with pytest.raises(AttributeError, match="a BezierSurface cannot be changed"):
        surface.points = copy


NET = np.random.default_rng(0).normal(size=(4, 4, 3))
ONES = np.ones((2, 2, 3))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: BezierSurface(NET[0]),
            r"must be points of shape \(m, n, 3\) or \(m, n, 2\), got shape",
        ),
        (lambda: BezierSurface(NET[:1]), "at least 2 x 2 points, got 1 x 4"),
        (lambda: BezierSurface(NET * np.nan), "control points must be finite"),
        (lambda: BezierSurface(NET, np.zeros((4, 4))), "weights must be positive and finite, got 0 to 0"),
        (lambda: BezierSurface(NET, np.ones(4)), r"shape \(4, 4\), got shape \(4,\)"),
        (lambda: BSplineSurface(NET, (3,)), "degrees and knots must be pairs"),
        (lambda: BSplineSurface(NET, (5, 2)), "degree 5 needs at least 6 control points, got 4"),
        (lambda: BSplineSurface(NET, 2, ("clamped", [0, 0, 0, 2, 1, 1, 1])), "must not decrease"),
        (
            lambda: BSplineSurface(NET, 2, ("clamped", [0, 0, 0, 1, 1, 1])),
            "of degree 2 need 7 v knots, got 6",
        ),
        (lambda: BezierSurface(NET).split(u=1.0), r"splits at u inside \[0, 1\], got 1"),
        (lambda: BezierSurface(NET).elevate((1, -1)), "raised by zero or more"),
        (lambda: BezierSurface(NET).restrict(u=(0.5, 0.5)), "the part must be two finite increasing numbers"),
        (lambda: BSplineSurface(NET, 2).expressions(), "4 pieces: take expressions of one of bezier_patches"),
        (lambda: BezierSurface(NET).replace_point(0, 0, (1, 2, 3, 4)), "point must be points of shape"),
        (lambda: BezierSurface(NET).with_points(NET[:2]), r"net has shape \(4, 4, 3\), got \(2, 4, 3\)"),
        (lambda: BezierSurface(NET).normal(0.5, 0.5, undefined="zero"), 'undefined must be "raise" or "nan"'),
        (lambda: HermitePatch(ONES, ONES, ONES[0], ONES), "tangents_v must be points of shape"),
        (lambda: HermitePatch(ONES, ONES, ONES, np.ones((3, 2, 3))), r"twists must have shape \(2, 2, 3\)"),
        (lambda: HermitePatch.from_bezier(BezierSurface(NET[:3])), r"bicubic polynomial, got degrees \(2, 3\)"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()
