"""Singular points close together: as many as there are, none merged and none twice."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from flint import arb, fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Ball, Surface, polygonize, singularities
from implicit.language.trees import x, y, z
from implicit.singular.coincide import coincide
from implicit.singular.exact import ExactPoint
from implicit.singular.form import Form
from implicit.singular.proof import Jet, polish
from implicit.singular.region import WHOLE, Deadline, Region

RATIONALS = st.fractions(-1, 1, max_denominator=9)


def rational(number: Fraction) -> sympy.Rational:
    return sympy.Rational(number.numerator, number.denominator)


@settings(max_examples=12, deadline=None)
@given(st.integers(5, 12), st.lists(st.integers(-9, 9), min_size=2, max_size=3, unique=True), RATIONALS, RATIONALS)
def test_nodes_as_near_as_you_please(k: int, multiples: list[int], shift: Fraction, slope: Fraction) -> None:
    """x^2 + y^2 = prod (z - a)^2 has one node for each a, in any affine coordinates."""
    roots = [sympy.Rational(n, 10**k) for n in multiples]
    height, side = z - rational(shift), x - rational(slope) * y
    formula = side**2 + y**2 - sympy.prod((height - a) ** 2 for a in roots)
    locus = singularities(Surface(formula), 3)
    assert {p.exact for p in locus.points} == {(0, 0, a + rational(shift)) for a in roots}
    assert len(locus.points) == len(roots) and {p.type for p in locus.points} == {"A1"}
    assert locus.complete and not locus.curves


@pytest.mark.parametrize("k", [5, 7, 9, 12])
def test_conjugate_nodes_and_cusps_as_near_as_you_please(k: int) -> None:
    """x^2 + y^2 = (z^2 - 2 e^2)^n has two singular points, of type A(n - 1), at z = e sqrt(2) and -e sqrt(2)."""
    e = sympy.Rational(1, 10**k)
    for n in (2, 3):
        locus = singularities(Surface(x**2 + y**2 - (z**2 - 2 * e**2) ** n), 1)
        assert {p.exact for p in locus.points} == {(0, 0, e * sympy.sqrt(2)), (0, 0, -e * sympy.sqrt(2))}
        assert [p.type for p in locus.points] == [f"A{n - 1}"] * 2 and locus.complete


def test_bounds_do_not_matter_to_what_is_told_apart() -> None:
    surface = Surface("x^2 + y^2 = z^2 (z - 1e-9)^2")
    answers = [{p.exact for p in singularities(surface, bounds).points} for bounds in (None, 1, 100, Ball(1e-8))]
    assert all(answer == answers[0] and len(answer) == 2 for answer in answers)


def test_a_point_beside_a_degenerate_one() -> None:
    """x^2 + y^2 = z^3 (z - e)^2 has an A2 at the origin and an A1 at z = e."""
    for k in (4, 8):
        locus = singularities(Surface(f"x^2 + y^2 = z^3 (z - 1e-{k})^2"), 1)
        assert {(p.type, p.exact) for p in locus.points} == {
            ("A2", (0, 0, 0)),
            ("A1", (0, 0, sympy.Rational(1, 10**k))),
        }
        assert locus.complete


@pytest.mark.parametrize("k", [1, 6, 9])
def test_lone_points_of_complex_curves_are_counted_once(k: int) -> None:
    """f = x^2 (x - e)^2 + (y^2 + z^2)^2 is singular on lines y = i z and y = -i z over x = 0 and x = e."""
    e = sympy.Rational(1, 10**k)
    locus = singularities(Surface(x**2 * (x - e) ** 2 + (y**2 + z**2) ** 2), 2)
    positions = sorted(p.position.tolist() for p in locus.points)
    assert locus.complete and np.allclose(positions, [[0, 0, 0], [float(e), 0, 0]], rtol=0, atol=1e-14)
    crossing = singularities(Surface((x**2 + 2 * y**2) ** 2 + (x**2 + 3 * z**2) ** 2), 2)
    assert crossing.complete and len(crossing.points) == 1


@pytest.mark.parametrize("k", [2, 7])
def test_lone_points_beside_a_real_curve_and_on_it(k: int) -> None:
    """y^2 + z^2 is singular along the axis of x, x^2 + (y^2 + (z - e)^2)^2 at one real point."""
    e = sympy.Rational(1, 10**k)
    beside = singularities(Surface((y**2 + z**2) * (x**2 + (y**2 + (z - e) ** 2) ** 2)), 1)
    assert len(beside.curves) == 1 and len(beside.points) == 1
    assert np.allclose(beside.points[0].position, [0, 0, float(e)], rtol=0, atol=1e-14)
    on = singularities(Surface((x * y) ** 2 + (y**2 + z**2) ** 2), 1)
    assert len(on.curves) == 1 and not on.points and on.complete


def numbered(modulus: list[int], near: float, coordinate: list[int]) -> ExactPoint:
    """The point (c(theta), 0, 1) with the root theta of a modulus near a number."""
    zero, one = fmpq_poly([0]), fmpq_poly([1])
    return ExactPoint(fmpq_poly(modulus), arb(near, 0.1), (fmpq_poly(coordinate), zero, one), zero)


def test_exact_points_coincide_whatever_names_their_field_has() -> None:
    root, named = numbered([-2, 0, 1], 1.4142135, [0, 1]), numbered([-1, -2, 1], 2.4142135, [-1, 1])  # theta, theta - 1
    assert coincide(root, named) and coincide(named, root)
    assert not coincide(root, numbered([-2, 0, 1], -1.4142135, [0, 1]))
    assert coincide(root, numbered([-2, 0, 1], -1.4142135, [0, -1]))


@pytest.mark.parametrize("bits", [60, 600, 2000])
def test_exact_points_are_told_apart_at_any_distance(bits: int) -> None:
    zero, one = fmpq_poly([0]), fmpq_poly([1])
    points = [ExactPoint(fmpq_poly([0, 1]), arb(0), (fmpq_poly([c]), zero, one), zero) for c in (0, fmpq(1, 2**bits))]
    assert not coincide(*points) and coincide(points[1], points[1])


def test_newton_may_lead_out_of_a_box_and_then_the_box_stays_open() -> None:
    form = Form.of(Surface("x^2 + y^2 = z^2 (z - 1)^2").polynomial)
    region = Region(form, np.array([[-2.0] * 3, [2.0] * 3]))
    boxes, estimates, _, _ = region.search(WHOLE, 27, Deadline(None))
    points = [polish(Jet(form), estimate, region.width(box)) for box, estimate in zip(boxes, estimates, strict=True)]
    for n, box in enumerate(boxes):
        assert [p is not None and region.holds(box, p.position) for p in points].count(True) == 1
        assert points[n] is not None and region.holds(box, points[n].position)


def test_points_that_no_cell_tells_apart_do_no_harm_to_a_mesh() -> None:
    mesh = polygonize(Surface("x^2 + y^2 = z^2 (z - 1e-9)^2"), 1, resolution=24)
    assert len(mesh.faces) and np.isfinite(mesh.vertices).all()
