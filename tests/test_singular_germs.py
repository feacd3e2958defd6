"""Types of degenerate points: Arnold's normal forms, wherever they lie and however they are turned."""

import numpy as np
import pytest
import sympy
from flint import arb, fmpq_poly

from implicit import Surface, singularities
from implicit.language.trees import x, y, z
from implicit.singular.exact import ExactPoint
from implicit.singular.form import Form
from implicit.singular.germ import Germ
from implicit.singular.lonely import lonely_radius
from tests.test_singular_points import turned

NORMAL_FORMS = {
    "A1": (x**2 + y**2 - z**2, 1),
    "A2": (x**2 + y**2 + z**3, 2),
    "A4": (x**2 + y**2 + z**5, 4),
    "D4": (x**2 + y**2 * z - z**3, 4),
    "D5": (x**2 + y**2 * z + z**4, 5),
    "D6": (x**2 + y**2 * z + z**5, 6),
    "E6": (x**2 + y**3 + z**4, 6),
    "E7": (x**2 + y**3 + y * z**3, 7),
    "E8": (x**2 + y**3 + z**5, 8),
    "P8": (x**3 + y**3 + z**3, 8),
    "X9": (x**2 + y**4 + z**4, 9),
}


@pytest.mark.parametrize("name", NORMAL_FORMS)
def test_normal_forms_have_their_names(name: str) -> None:
    expression, milnor = NORMAL_FORMS[name]
    locus = singularities(Surface(expression), 1)
    (point,) = locus.points
    assert (point.type, point.milnor, point.exact) == (name, milnor, (0, 0, 0))
    assert locus.complete


@pytest.mark.parametrize("name", ["A4", "D5", "E6", "E8", "X9"])
def test_names_do_not_depend_on_coordinates(name: str) -> None:
    expression, milnor = NORMAL_FORMS[name]
    surface, matrix, shift = turned(Surface(expression), 3)
    locus = singularities(surface, 2)
    (point,) = locus.points
    assert (point.type, point.milnor) == (name, milnor)
    assert abs(matrix @ point.position + shift).max() < 1e-14
    assert locus.complete


def test_degenerate_points_with_irrational_coordinates() -> None:
    locus = singularities(Surface((x - 1) ** 2 + (y - 2) ** 3 + (z**2 - 2) ** 3), 4)
    assert sorted(float(p.position[2]) for p in locus.points) == pytest.approx([-(2**0.5), 2**0.5], abs=1e-15)
    assert {(p.type, p.milnor) for p in locus.points} == {("D4", 4)}
    assert {p.exact for p in locus.points} == {(1, 2, sympy.sqrt(2)), (1, 2, -sympy.sqrt(2))}
    assert locus.complete


def _origin(expression: sympy.Expr) -> Germ:
    zero = fmpq_poly([0])
    return Germ(Form.of(Surface(expression).polynomial), ExactPoint(fmpq_poly([0, 1]), arb(0), (zero,) * 3, zero))


def test_the_radius_of_loneliness_excludes_the_next_point() -> None:
    """x^2 + y^2 = z^3 (z - 1)^2: A2 at the origin and a node at distance 1."""
    radius, axes = lonely_radius(_origin(x**2 + y**2 - z**3 * (z - 1) ** 2))
    assert radius > 0
    assert not radius > abs(sympy.Matrix(axes).inv() * sympy.Matrix([0, 0, 1])).norm() * 1.0000001


def test_no_milnor_number_where_singular_points_are_not_isolated() -> None:
    assert _origin(x**2 - y**2 * z).milnor is None


def test_mu_and_tau_differ_for_singularities_that_are_not_quasihomogeneous() -> None:
    """x^4 y + x y^4 + x^2 y^3 + z^2 is no weighted homogeneous germ in any coordinates: tau < mu."""
    germ = _origin(x**4 + y**5 + x**2 * y**3 + z**2)
    tau = germ.dimension([*germ.gradient, germ.taylor])
    assert germ.milnor == 12 and tau is not None and tau[0] == 11


def test_axes_longer_than_all_floats_are_scaled():
    """A surface turned by floats has coefficients of many digits, and exact axes of hundreds."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    image = sympy.Matrix(np.vectorize(lambda v: sympy.Rational(float(v)))(turn).tolist()) * sympy.Matrix([x, y, z])
    surface = Surface((x**2 - y**2 + z**4).subs(dict(zip((x, y, z), image, strict=True)), simultaneous=True))
    (point,) = singularities(surface, 1).points
    assert point.type == "A3"
