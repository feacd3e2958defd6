"""Ruled, lofted, Coons and Gordon surfaces: they contain the curves they were made from."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from parametric import (
    BezierCurve,
    BezierSurface,
    BSplineCurve,
    circle,
    continuity,
    coons,
    coons_triangle,
    gordon,
    line,
    loft,
    plane,
    ruled,
    u,
    v,
)

S = np.linspace(0, 1, 21)
SIDES = ("bottom", "top", "left", "right")
QUICK = settings(max_examples=15, deadline=None)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def boundary(seed=0, degree=3):
    """Four random Bezier curves that meet at the corners."""
    rng = np.random.default_rng(seed)
    c = rng.normal(size=(2, 2, 3))
    ends = ((c[0, 0], c[1, 0]), (c[0, 1], c[1, 1]), (c[0, 0], c[0, 1]), (c[1, 0], c[1, 1]))
    return [BezierCurve([a, *rng.normal(size=(degree - 1, 3)), b]) for a, b in ends]


def ribbons_of(surface):
    """Edges and derivatives across them of a Bezier surface, as curves."""
    along_u = [surface.iso_v(0), surface.iso_v(1)]
    along_v = [surface.iso_u(0), surface.iso_u(1)]
    m, n = surface.degrees
    p = surface.points
    across = [n * (p[:, 1] - p[:, 0]), n * (p[:, -1] - p[:, -2]), m * (p[1] - p[0]), m * (p[-1] - p[-2])]
    return [*along_u, *along_v], [BezierCurve(q) for q in across]


def meets(surface, sides, tolerance=1e-12):
    near(surface(S, 0.0), sides[0](S), tolerance)
    near(surface(S, 1.0), sides[1](S), tolerance)
    near(surface(0.0, S), sides[2](S), tolerance)
    near(surface(1.0, S), sides[3](S), tolerance)


@pytest.mark.parametrize("blend", ["linear", "cubic", (lambda t: 1 - t**3, lambda t: (1 - t) ** 2)])
def test_coons_patches_contain_their_edges(blend):
    sides = boundary()
    meets(coons(*sides, blend), sides)


@given(st.integers(0, 1000))
@QUICK
def test_bilinear_coons_is_the_sum_of_lofts_less_the_bilinear_patch(seed):
    bottom, top, left, right = boundary(seed)
    a, b = np.random.default_rng(seed).random((2, 20))
    corners = BezierSurface(np.stack([left([0.0, 1.0]), right([0.0, 1.0])]))
    expected = ruled(bottom, top)(a, b) + ruled(left, right)(b, a) - corners(a, b)
    near(coons(bottom, top, left, right)(a, b), expected)


@pytest.mark.parametrize("blend", ["linear", "cubic"])
def test_derivatives_and_tensor_form_agree(blend):
    patch = coons(*boundary(1), blend)
    tensor = patch.to_nurbs()
    a, b = np.random.default_rng(0).random((2, 30))
    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)):
        near(patch.derivative(a, b, i, j), tensor.derivative(a, b, i, j), 1e-10)


def test_blending_functions_may_be_formulas():
    t = sympy.Symbol("t")
    sides = boundary(2)
    one = coons(*sides, ((1 - t) ** 2 * (1 + 2 * t), 1 - t))
    two = coons(*sides, (lambda s: (1 - s) ** 2 * (1 + 2 * s), lambda s: 1 - s))
    near(one.grid(S, S), two.grid(S, S))
    near(one.derivative(S, S, 1, 1), two.derivative(S, S, 1, 1), 1e-7)
    meets(one, sides)


def test_coons_of_a_bilinear_surface_is_that_surface():
    surface = BezierSurface(np.random.default_rng(0).normal(size=(2, 2, 3)))
    edges, _ = ribbons_of(surface)
    near(coons(*edges).grid(S, S), surface.grid(S, S))


@pytest.mark.parametrize("seed", range(3))
def test_bicubic_patch_with_the_right_twists_is_the_bicubic_surface(seed):
    surface = BezierSurface(np.random.default_rng(seed).normal(size=(4, 4, 3)))
    edges, ribbons = ribbons_of(surface)
    corners = np.array([0.0, 1.0])
    patch = coons(*edges, ribbons=ribbons, twists=surface.twist(corners[:, None], corners))
    near(patch.grid(S, S), surface.grid(S, S))
    near(patch.incompatibility, 0, 1e-11)
    near(patch.twist_error, 0, 1e-11)
    near(coons(*edges, ribbons=ribbons, twists="gregory").grid(S, S), surface.grid(S, S))


def incompatible():
    """Edges of a bicubic surface with ribbons that ask for different twists at every corner."""
    edges, ribbons = ribbons_of(BezierSurface(np.random.default_rng(5).normal(size=(4, 4, 3))))
    bumps = np.random.default_rng(6).normal(size=(4, 2, 3))
    bent = [
        BezierCurve([r.points[0], r.points[1] + a, r.points[2] + b, r.points[3]]) for r, (a, b) in zip(ribbons, bumps)
    ]
    return edges, bent


def test_gregory_twists_keep_all_ribbons_where_constant_twists_cannot():
    edges, ribbons = incompatible()
    patch = coons(*edges, ribbons=ribbons, twists="gregory")
    assert patch.incompatibility.min() > 0.1
    meets(patch, edges)
    near(patch.derivative(S, 0.0, 0, 1), ribbons[0](S))
    near(patch.derivative(S, 1.0, 0, 1), ribbons[1](S))
    near(patch.derivative(0.0, S, 1, 0), ribbons[2](S))
    near(patch.derivative(1.0, S, 1, 0), ribbons[3](S))
    for twists in ("zero", "adini"):
        other = coons(*edges, ribbons=ribbons, twists=twists)
        meets(other, edges)
        assert np.abs(other.derivative(S, 0.0, 0, 1) - ribbons[0](S)).max() > 1e-3


def test_gregory_derivatives_are_limits():
    edges, ribbons = incompatible()
    patch = coons(*edges, ribbons=ribbons, twists="gregory")
    a, b = 0.02 + 0.96 * np.random.default_rng(0).random((2, 30))
    h = 1e-5
    for i, j in ((1, 0), (0, 1), (1, 1), (2, 0), (1, 2)):
        if i:
            limit = (patch.derivative(a + h, b, i - 1, j) - patch.derivative(a - h, b, i - 1, j)) / (2 * h)
        else:
            limit = (patch.derivative(a, b + h, i, j - 1) - patch.derivative(a, b - h, i, j - 1)) / (2 * h)
        near(patch.derivative(a, b, i, j), limit, 1e-4 * max(1, np.abs(limit).max()))


def test_adini_twists_are_those_of_the_bilinear_patch():
    edges, ribbons = incompatible()
    patch = coons(*edges, ribbons=ribbons, twists="adini")
    corners = np.array([0.0, 1.0])
    near(patch.corners[2:, 2:], coons(*edges).twist(corners[:, None], corners))


def test_the_twist_error_says_how_far_the_ribbons_are_missed():
    edges, ribbons = incompatible()
    zero = coons(*edges, ribbons=ribbons)
    asked = ribbons[0].derivative(0.0), ribbons[2].derivative(0.0)
    assert zero.twist_error[0, 0] == pytest.approx(max(np.linalg.norm(a) for a in asked))
    missed = np.linalg.norm(zero.derivative(S, 0.0, 0, 1) - ribbons[0](S), axis=-1).max()
    assert missed <= 4 / 27 * zero.twist_error[:, 0].sum() + 1e-12
    near(coons(*edges, ribbons=ribbons, twists="gregory").twist_error, 0)


def test_neighbours_with_a_common_ribbon_join_smoothly():
    """Two bicubically blended patches that share an edge and its ribbon are C1; bilinear ones are not."""
    whole = BezierSurface(np.random.default_rng(7).normal(size=(4, 4, 3)))
    left, right = whole.split(u=0.5)
    for twists in ("gregory",):
        parts = []
        for part in (left, right):
            edges, ribbons = ribbons_of(part)
            parts.append(coons(*edges, ribbons=ribbons, twists=twists))
        assert continuity(parts[0], "u1", parts[1], "u0").c1
    bilinear = [coons(*ribbons_of(part)[0]) for part in (left, right)]
    report = continuity(bilinear[0], "u1", bilinear[1], "u0")
    assert report.c0
    assert not report.g1


def test_partially_bicubic_neighbours_are_c1_only_if_boundary_tangents_match():
    whole = BezierSurface(np.random.default_rng(7).normal(size=(4, 4, 3)))
    parts = [coons(*ribbons_of(part)[0], "cubic") for part in whole.split(u=0.5)]
    assert continuity(parts[0], "u1", parts[1], "u0").c1
    bent = BezierSurface(whole.split(u=0.5)[1].points + np.array([0, 1, 0, 0])[:, None, None])
    assert not continuity(parts[0], "u1", coons(*ribbons_of(bent)[0], "cubic"), "u0").c1


def test_three_sided_patch_contains_its_sides():
    a, b, c = np.random.default_rng(0).normal(size=(3, 3))
    sides = [
        BezierCurve([p, np.random.default_rng(k).normal(size=3), q])
        for k, (p, q) in enumerate(((a, b), (a, c), (b, c)))
    ]
    for blend in (("linear", "cubic"), "linear", "cubic"):
        patch = coons_triangle(*sides, blend)
        meets(patch, [sides[0], lambda s: np.broadcast_to(c, (21, 3)), sides[1], sides[2]])


def test_three_sided_patch_has_the_tangent_plane_of_its_sides_at_the_apex():
    left, right = BezierCurve([(0, 0, 0), (0, 1, 2), (1, 2, 0)]), BezierCurve([(2, 0, 0), (3, 1, 1), (1, 2, 0)])
    patch = coons_triangle(BezierCurve([(0, 0, 0), (1, -1, 1), (2, 0, 0)]), left, right)
    normal = np.cross(right.derivative(1.0), left.derivative(1.0))
    near(np.abs(patch.normal(S, 1.0) @ normal), np.linalg.norm(normal))


def test_curves_of_any_kind_and_arguments_unchanged():
    """splipy's coons_patch reverses the caller's curves in place."""
    top = BSplineCurve([(0, 1, 0), (0.3, 1, 1), (0.7, 1, 1), (1, 1, 0)], 2)
    before = top.points.copy()
    patch = coons(
        [(0, 0, 0), (0.5, 0, 1), (1, 0, 0)], top, lambda t: (0, t, np.sin(np.pi * t)), line((1, 0, 0), (1, 1, 0))
    )
    np.testing.assert_array_equal(top.points, before)
    near(patch(0.5, 0.0), [0.5, 0, 1])
    near(patch(0.0, 0.5), [0, 0.5, 1])


def test_expressions_of_ruled_and_coons_surfaces():
    saddle = ruled(line((0, 0, 0), (1, 0, 0)), line((0, 1, 0), (1, 1, 1)))
    assert [sympy.simplify(a - b) for a, b in zip(saddle.expressions(), (u, v, u * v))] == [0, 0, 0]
    patch = coons(*(BezierCurve(np.round(4 * c.points)) for c in boundary(3)))
    value = [float(e.subs({u: 0.25, v: 0.5})) for e in patch.expressions()]
    near(value, patch(0.25, 0.5))


LINES = [line((0, 0, 0), (1, 0, 0)), line((0, 1, 0), (1, 1, 0)), line((0, 0, 0), (0, 1, 0)), line((1, 0, 0), (1, 1, 0))]
ACROSS = [
    line((0, 1, 0), (0, 1, 0)),
    line((0, 1, 0), (0, 1, 0)),
    line((1, 0, 0), (1, 0, 0)),
    line((1, 0, 0), (1, 0, 0)),
]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: coons(*LINES[:3], line((1, 0, 0), (1, 1, 0.5))),
            r"top and right do not meet at the corner \(u, v\) = \(1, 1\): .* are 0.5 apart",
        ),
        (lambda: coons(LINES[1], *LINES[1:]), r"bottom and left do not meet at the corner \(u, v\) = \(0, 0\)"),
        (lambda: coons(*LINES, blend="quintic"), 'blend must be "linear", "cubic" or a pair of functions'),
        (lambda: coons(*LINES, blend=(lambda t: t, lambda t: 1 - t)), "must be 1 at 0 and 0 at 1, got 0 and 1"),
        (lambda: coons(*LINES, ribbons=ACROSS[:3]), "ribbons are four, for bottom, top, left and right, got 3"),
        (
            lambda: coons(*LINES, ribbons=[line((0, 2, 0), (0, 1, 0)), *ACROSS[1:]]),
            r"ribbon across bottom ends with \[0.0, 2.0, 0.0\] where left has the derivative .* they are 1 apart",
        ),
        (lambda: coons(*LINES, ribbons=ACROSS, twists="flat"), 'twists must be "zero", "adini", "gregory"'),
        (lambda: coons(*LINES, ribbons=ACROSS, twists=np.zeros((4, 3))), r"twists must have shape \(2, 2, 3\)"),
        (lambda: coons(*LINES)(1.5, 0.0), r"parameter u must lie in \[0, 1\], got 1.5"),
        (lambda: coons(*LINES, blend=(np.cos, np.cos)), "must be 1 at 0 and 0 at 1"),
        (lambda: ruled(LINES[0], 3.0), "b must be a curve, a callable or the vertices of a polyline"),
        (lambda: plane((0, 0, 0), (1, 2, 0), (2, 4, 0)), "a plane needs two directions, but .* are parallel"),
        (lambda: loft(LINES[:1]), "at least two sections, got 1"),
        (lambda: loft(LINES[:2], [1, 0]), "v must be 2 increasing parameters"),
        (lambda: gordon(LINES[:1], LINES[2:]), "two curves each way, got 1 and 2"),
        (lambda: gordon(LINES[:2], LINES[2:], v=[0.1, 1]), "must reach from 0 to 1, got v from 0.1 to 1"),
        (lambda: gordon(LINES[:2], LINES[2:], u=[0, 0.9]), "must reach from 0 to 1, got u from 0 to 0.9"),
        (
            lambda: gordon(LINES[:2], [LINES[2], line((1, 0, 0), (1, 1, 0.25))]),
            r"u curve 1 at u = 1 and v curve 1 at v = 1 do not meet: they are 0.25 apart",
        ),
        (lambda: coons(*LINES, blend=(lambda t: 1 - t, lambda t: 1 - t)).to_nurbs(), "blended by arbitrary functions"),
        (lambda: ruled(circle(1), line((0, 0, 1), (1, 0, 1))).to_nurbs(), "rational curves of different weights"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()
