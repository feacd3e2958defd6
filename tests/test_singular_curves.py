"""Singular curves: parametrized exactly where they are lines and conics, traced elsewhere, special points named."""

import numpy as np
import pytest
import sympy

from implicit import Ball, Box, Surface, singularities
from implicit.language.trees import x, y, z
from implicit.singular.conic import t
from tests.singular_catalog import box_of, entry_of, surface_of

PARAMETRIZED = ["source_cubic_asprinted", "source_cubic_line", "whitney_umbrella", "limao", "helix", "klein_bottle"]


@pytest.mark.parametrize("name", [*PARAMETRIZED, "taubin_heart", "steiner_roman"])
def test_the_catalogue_is_found_and_that_is_all(name: str) -> None:
    locus, entry = singularities(surface_of(name), box_of(name)), entry_of(name)
    wanted = {tuple(sympy.sympify(c, locals={"t": t}) for c in curve["expression"]) for curve in entry["curves"]}
    assert {curve.expression for curve in locus.curves} == wanted
    special = sorted(tuple(s) for curve in entry["curves"] for s in curve["special"])
    found = np.array(sorted(tuple(s) for c in locus.curves for s in (c.special + 0.0).round(12).tolist())).reshape(
        -1, 3
    )
    assert np.allclose(found, np.array(special, dtype=float).reshape(-1, 3), rtol=0, atol=1e-9)
    assert sum(entry["points"].values()) == len(locus.points)
    assert locus.complete and not len(locus.undecided)


@pytest.mark.parametrize("name", [*PARAMETRIZED, "taubin_heart"])
def test_parametrizations_satisfy_the_equations(name: str) -> None:
    surface = surface_of(name)
    for curve in singularities(surface, box_of(name)).curves:
        assert curve.expression is not None
        at = dict(zip((x, y, z), curve.expression, strict=True))
        for g in (surface.expression, *(surface.expression.diff(v) for v in (x, y, z))):
            assert sympy.simplify(g.subs(at, simultaneous=True)) == 0


def test_the_third_surface_of_the_chapter() -> None:
    """Sheets cross on the y axis for |y| < 1; beyond the pinch points at y = +-1 the line is all there is."""
    (curve,) = singularities(surface_of("source_cubic_line"), 2).curves
    middles = (curve.polyline[1:, 1] + curve.polyline[:-1, 1]) / 2
    assert np.array_equal(curve.leaves, np.where(np.abs(middles) < 1, 4, 0))
    assert {2.0, -2.0} == set(curve.polyline[[0, -1], 1])


@pytest.mark.parametrize("name", ["hunt", "taubin_heart", "source_cubic_line"])
def test_polylines_stay_on_the_curve(name: str) -> None:
    surface, size = surface_of(name), box_of(name).size
    for curve in singularities(surface, box_of(name)).curves:
        line = np.concatenate([curve.polyline, curve.polyline[:1]]) if curve.closed else curve.polyline
        chords = np.linalg.norm(np.diff(line, axis=0), axis=1)
        assert chords.max() < 0.05 * size
        scale = np.abs(surface.gradient(line + 0.1 * size)).max()
        assert np.abs(surface.gradient(line)).max() < 1e-9 * scale
        for point in curve.special:
            assert (curve.polyline == point).all(axis=1).any()


def test_a_circle_is_traced_to_a_millionth() -> None:
    """Two unit spheres cross in a circle of radius sqrt(3)/2 in the plane x = 1/2."""
    locus = singularities(Surface("(x^2 + y^2 + z^2 - 1) ((x - 1)^2 + y^2 + z^2 - 1)"), 2)
    (curve,) = locus.curves
    assert curve.closed and curve.expression == (
        sympy.Rational(1, 2),
        sympy.sqrt(3) * sympy.cos(t) / 2,
        sympy.sqrt(3) * sympy.sin(t) / 2,
    )
    middles = (curve.polyline + np.roll(curve.polyline, 1, axis=0)) / 2
    for points in (curve.polyline, middles):
        assert np.abs(np.hypot(points[:, 1], points[:, 2]) - np.sqrt(0.75)).max() < 4e-6
        assert np.abs(points[:, 0] - 0.5).max() < 1e-12
    assert set(curve.leaves) == {4} and locus.complete


def test_hunts_surface_has_two_closed_edges_and_two_nodes() -> None:
    locus = singularities(surface_of("hunt"), box_of("hunt"))
    assert [curve.closed for curve in locus.curves] == [True, True]
    for curve in locus.curves:
        a, b, c = curve.polyline.T
        assert np.abs(a**2 + b**2 + c**2 - 13).max() < 1e-6
        assert np.abs(3 * a**2 + b**2 - 4 * c**2 - 12).max() < 1e-6
        assert set(curve.leaves) == {2}
    assert sorted(p.position[1] for p in locus.points) == pytest.approx([-(10**0.5), 10**0.5], abs=1e-14)
    assert locus.complete


def test_boys_surface_has_one_closed_curve_through_its_triple_point() -> None:
    locus = singularities(surface_of("boy_apery"), box_of("boy_apery"))
    (curve,) = locus.curves
    assert curve.closed and set(curve.leaves) == {4}
    assert np.allclose(curve.special, [[0, 0, 1]], rtol=0, atol=1e-9)
    assert np.count_nonzero((curve.polyline == curve.special[0]).all(axis=1)) == 3
    assert locus.complete


def test_curves_are_cut_at_the_boundary() -> None:
    inside = singularities(Surface("x^2 = y^2 z"), Ball(0.5, (0, 0, 0.25))).curves[0].polyline
    assert sorted(inside[[0, -1], 2]) == pytest.approx([-0.25, 0.75], abs=1e-12)
    (arc,) = singularities(Surface("z^2 = (x^2 + y^2 - 1)^2"), Box((0, -2, -1), (2, 2, 1))).curves
    assert not arc.closed and np.allclose(np.abs(arc.polyline[[0, -1]]), [[0, 1, 0]] * 2, atol=1e-6)


def test_planes_that_cross() -> None:
    locus = singularities(Surface("x y z"), 1)
    assert {curve.expression for curve in locus.curves} == {(t, 0, 0), (0, t, 0), (0, 0, t)}
    assert all(np.array_equal(curve.special, [[0, 0, 0]]) for curve in locus.curves)
    assert locus.complete


def test_a_solitary_line() -> None:
    (curve,) = singularities(Surface("x^2 + y^2"), 1).curves
    assert curve.expression == (0, 0, t) and set(curve.leaves) == {0}


def test_repeated_factors_are_named() -> None:
    locus = singularities(Surface("(x^2 + y^2 + z^2 - 1)^2 z"), 2)
    assert locus.repeated == (x**2 + y**2 + z**2 - 1,)
    assert [curve.expression for curve in locus.curves] == [(sympy.cos(t), sympy.sin(t), 0)]


def test_turned_lines_and_conics_stay_exact() -> None:
    from tests.test_singular_points import turned

    for name in ("source_cubic_line", "whitney_umbrella"):
        surface, matrix, shift = turned(surface_of(name), 1)
        locus = singularities(surface, 2)
        (curve,) = locus.curves
        assert curve.expression is not None and locus.complete
        assert np.abs((curve.polyline @ matrix.T + shift)[:, 0]).max() < 1e-12


def test_coefficients_beyond_1e100_do_not_overflow() -> None:
    """Turned and moved by floats, an umbrella has integral coefficients so large that their products are none."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    offset = np.array([2.15353362, 5.11997464, 2.05914324])
    exact = [sympy.Matrix([sympy.Rational(float(v)) for v in values]) for values in (*turn, offset)]
    a, b, c = (row.dot(sympy.Matrix([x, y, z]) - exact[3]) for row in exact[:3])
    (curve,) = singularities(Surface(sympy.expand(a**2 - b**2 * c)), Ball(1, offset)).curves
    assert np.abs(curve.special - offset).max() < 1e-12
    assert set(curve.leaves) == {0, 4}


def test_an_arc_that_bends_sharply_in_its_projection() -> None:
    """One arc bends so sharply that its interval has to be halved more than ten times."""
    frames = (
        (((-1005, -269, 426), (766, -484, 161), (48, 547, 864)), (-49, 216, -377)),
        (((-776, -713, -91), (-501, 371, 676), (-467, 78, -913)), (-269, -239, 315)),
    )
    quadrics = []
    for matrix, center in frames:
        place = sympy.Matrix([x, y, z]) - sympy.Matrix(center) / 1000
        quadrics.append((sympy.Matrix(matrix) * place / 1000).dot(sympy.Matrix(matrix) * place / 1000) - 1)
    locus = singularities(Surface(sympy.expand(quadrics[0] * quadrics[1])), 2.6)
    assert [curve.closed for curve in locus.curves] == [True]
    assert locus.complete


def test_nodes_of_one_special_point_are_no_curve() -> None:
    locus = singularities(Surface("(x^2 + y^2 - 1)*(z - x*y)*(z + x)"), 1.4)
    assert locus.complete
    assert all(np.ptp(curve.polyline, axis=0).max() > 0.1 for curve in locus.curves)
    for point in ((0, 1, 0), (0, -1, 0)):  # where the cylinder meets both others
        assert min(np.linalg.norm(curve.special - point, axis=1).min(initial=9) for curve in locus.curves) < 1e-9
