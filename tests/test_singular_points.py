"""Isolated singular points: nodes of famous surfaces, all of them and no others, with proof."""

from collections import Counter

import numpy as np
import pytest
import sympy
from numpy.typing import NDArray

from implicit import Box, Surface, singularities
from implicit.algebra.numberfield import NumberField
from implicit.language.trees import x, y, z
from implicit.singular.form import Form
from implicit.singular.proof import Jet, integral, is_zero, polish, value_at, zero_gap
from implicit.singular.region import WHOLE, Deadline, Region
from implicit.singular.simple import simple_zeros
from implicit.singular.symmetry import fundamental_cuts, symmetries
from tests.singular_catalog import NAMES, box_of, entry_of, surface_of

LIGHT = [
    name
    for name in NAMES
    if entry_of(name)["curves"] == [] and name not in ("labs_septic", "barth_decic", "togliatti_quintic")
]


@pytest.mark.parametrize("name", LIGHT)
def test_the_catalogue_is_found_and_that_is_all(name: str) -> None:
    locus = singularities(surface_of(name), box_of(name))
    assert Counter(point.type or "?" for point in locus.points) == entry_of(name)["points"]
    assert locus.complete and not len(locus.undecided) and not locus.curves


@pytest.mark.parametrize("name", ["kummer", "barth_sextic", "togliatti_quintic", "cushion", "source_cubic_A5"])
def test_every_point_is_on_the_surface_and_its_gradient_vanishes(name: str) -> None:
    surface = surface_of(name)
    positions = np.array([point.position for point in singularities(surface, box_of(name)).points])
    size = np.abs(surface.gradient(positions + 0.1)).max()
    assert np.abs(surface(positions)).max() < 1e-12 * size
    assert np.abs(surface.gradient(positions)).max() < 1e-12 * size


def test_nodes_of_the_barth_sextic_have_golden_coordinates() -> None:
    phi = (1 + sympy.sqrt(5)) / 2
    locus = singularities(surface_of("barth_sextic"), box_of("barth_sextic"))
    exact = [point.exact for point in locus.points]
    assert all(triple is not None for triple in exact)
    for coordinate in {c for triple in exact if triple for c in triple}:
        minimal = sympy.minimal_polynomial(coordinate, x)
        assert sympy.degree(minimal, x) <= 2
        assert sympy.simplify(coordinate.subs(sympy.sqrt(5), 2 * phi - 1) - coordinate) == 0


def test_exact_coordinates_are_the_positions() -> None:
    for point in singularities(surface_of("kummer"), box_of("kummer")).points:
        assert point.exact is not None
        assert np.allclose([float(c.evalf(20)) for c in point.exact], point.position, rtol=0, atol=1e-15)


def turned(surface: Surface, seed: int) -> tuple[Surface, NDArray[np.float64], NDArray[np.float64]]:
    """The surface after a random rational rotation and translation: f(M p + b)."""
    a, b, c, d = np.random.default_rng(seed).integers(-5, 6, 4)
    a, n = a or 1, None
    n = a * a + b * b + c * c + d * d
    matrix = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    rows = [[sympy.Rational(int(e), int(n)) for e in row] for row in matrix]
    shift = [sympy.Rational(int(s), 7) for s in np.random.default_rng(seed + 100).integers(-4, 5, 3)]
    images = [sum((r * v for r, v in zip(row, (x, y, z), strict=True)), s) for row, s in zip(rows, shift, strict=True)]
    expression = surface.expression.subs(dict(zip((x, y, z), images, strict=True)), simultaneous=True)
    return Surface(expression), np.array(rows, dtype=float), np.array(shift, dtype=float)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["cayley_cubic", "kummer", "chmutov_cheb4", "source_cubic_A5", "sofa_e8", "cushion"])
def test_the_answer_turns_with_the_surface(name: str, seed: int) -> None:
    surface, matrix, shift = turned(surface_of(name), seed)
    there = singularities(surface_of(name), box_of(name)).points
    expected = np.array([np.linalg.solve(matrix, p.position - shift) for p in there])
    reach = float(np.abs(expected).max()) + 0.5
    locus = singularities(surface, reach)
    found = np.array([p.position for p in locus.points])
    order, other = np.lexsort(found.round(9).T), np.lexsort(expected.round(9).T)
    assert np.allclose(found[order], expected[other], rtol=0, atol=1e-12)
    assert [locus.points[n].type for n in order] == [there[n].type for n in other]
    assert locus.complete


def test_expanded_and_factored_input_agree() -> None:
    factored = surface_of("kummer")
    expanded = Surface(sympy.expand(factored.expression))
    first, second = (singularities(s, 1.5).points for s in (factored, expanded))
    assert [p.exact for p in first] == [p.exact for p in second]


def test_a_node_on_the_boundary_counts_and_one_outside_does_not() -> None:
    cone = Surface("x^2 + y^2 = z^2")
    assert len(singularities(cone, Box((0, 0, 0), (1, 1, 1))).points) == 1
    outside = singularities(cone, Box((1, 1, 1), (2, 2, 2)))
    assert not outside.points and outside.complete


def test_near_misses_are_not_singular() -> None:
    """The critical value 2^-60 is below every tolerance, and yet no zero."""
    near = Surface(x**2 + y**2 - z**2 + sympy.Rational(1, 2**60))
    locus = singularities(near, 1)
    assert not locus.points and locus.complete
    shifted = Surface((x - sympy.sqrt(2)) ** 2 + y**2 - z**2)
    assert len(singularities(shifted, 2).points) == 1


def test_the_gap_is_below_all_nonzero_critical_values() -> None:
    """Critical values of x^3 - 3 a x + b at x = +-sqrt(a): b -+ 2 a sqrt(a)."""
    form = integral(Form.of(Surface("x^3 - 3*2x + 5 + y^2 + z^2").polynomial))
    assert 2.0 ** -zero_gap(form) < 5.656854 - 5
    jet = Jet(form)
    point = polish(jet, np.array([1.4142, 0, 0]), 1.0)
    assert point is not None
    assert not is_zero(jet, point, zero_gap(form))
    assert abs(float(value_at(jet, point, 192)) - (5 - 4 * np.sqrt(2))) < 1e-12


def test_symmetries_are_those_of_the_surface() -> None:
    box = np.array([[-2.0] * 3, [2.0] * 3])
    assert len(symmetries(Form.of(surface_of("barth_sextic").polynomial), box)) == 24
    assert len(symmetries(Form.of(Surface("x^2 + 2y^2 + 3z^2 = 1").polynomial), box)) == 8
    assert len(symmetries(Form.of(Surface("x + y^2 + z^3 = 1").polynomial), box)) == 2


def test_coefficients_in_a_cubic_field() -> None:
    """(x - a)^2 + y^2 = z^2 with 7 a^3 + 7 a + 1 = 0: one node at (a, 0, 0)."""
    from fractions import Fraction

    from implicit.algebra.polynomial import Polynomial

    t = sympy.Symbol("t")
    field = NumberField((1, 7, 0, 7), (Fraction(-15, 100), Fraction(-14, 100)), sympy.CRootOf(7 * t**3 + 7 * t + 1, 0))
    one, zero = Fraction(1), Fraction(0)
    terms = {
        (2, 0, 0): [one, zero, zero],
        (1, 0, 0): [zero, -2 * one, zero],
        (0, 0, 0): [zero, zero, one],
        (0, 2, 0): [one, zero, zero],
        (0, 0, 2): [-one, zero, zero],
    }
    (point,) = singularities(Surface.from_polynomial(Polynomial.from_terms(terms, field)), 1).points
    assert abs(point.position[0] + 0.14010685498712477) < 1e-15 and point.type == "A1"


@pytest.mark.parametrize("name", ["sphere", "cone", "cayley_cubic", "ding_dong", "torus", "monkey_saddle"])
@pytest.mark.parametrize("folded", [False, True])
def test_the_short_search_finds_what_the_long_one_finds(name: str, folded: bool) -> None:
    form, asked = integral(Form.of(surface_of(name).polynomial)), box_of(name).corners
    region = Region(form, asked)
    if folded:
        region = Region(form, asked, fundamental_cuts(symmetries(form, asked), float(np.ptp(asked, axis=0).max())))
    boxes, roots, left, _ = region.search_long(WHOLE, 27, Deadline(None))
    short = simple_zeros(region.table, region.planes)
    assert short is not None and not len(left)
    assert np.array_equal(short[0], boxes)
    assert np.allclose(short[1] * region.half + region.middle, roots, rtol=0, atol=1e-12)


def test_the_short_search_gives_up_before_a_singular_curve() -> None:
    region = Region(integral(Form.of(Surface("x^2 y - z^2").polynomial)), Box([-1] * 3, [1] * 3).corners)
    assert simple_zeros(region.table, region.planes) is None
