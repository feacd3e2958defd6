"""Ordinary solids: where they are, what they are as polynomials, and that their distances are distances."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from implicit import box, capsule, cone, cylinder, plane, sphere, torus
from implicit.surface import Surface

RNG = np.random.default_rng(11)
POINTS = RNG.uniform(-3, 3, (3000, 3))
ROUND = np.hypot(POINTS[:, 0], POINTS[:, 1])
X, Y, Z = POINTS.T

SHAPES = [
    (sphere(2), ROUND**2 + Z**2 < 4),
    (sphere(1, (1, 0, -1)), (X - 1) ** 2 + Y**2 + (Z + 1) ** 2 < 1),
    (torus(2, 0.5), (ROUND - 2) ** 2 + Z**2 < 0.25),
    (cylinder(1.5), ROUND < 1.5),
    (cylinder(1.5, 2), (ROUND < 1.5) & (np.abs(Z) < 1)),
    (cone(1, 2), (Z > 0) & (Z < 2) & (ROUND < (2 - Z) / 2)),
    (cone(0.5, None), 0.5 * np.abs(Z) > ROUND),
    (box((1, 2, 3)), (np.abs(X) < 0.5) & (np.abs(Y) < 1) & (np.abs(Z) < 1.5)),
    (box(2, (1, 1, 1)), (np.abs(POINTS - 1) < 1).all(axis=1)),
    (plane((1, 2, 2), (1, 1, 1)), (POINTS - 1) @ [1, 2, 2] < 0),
]


@pytest.mark.parametrize(("solid", "inside"), SHAPES, ids=lambda value: str(value)[:40])
def test_inside_is_negative(solid, inside):
    assert np.array_equal(solid(POINTS) < 0, inside)


def test_capsule_is_a_swept_ball():
    a, b = np.array([-1, 0, 0.5]), np.array([1, 1, 0])
    share = np.clip((POINTS - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    gap = np.linalg.norm(POINTS - a - share[:, None] * (b - a), axis=1)
    assert np.array_equal(capsule(tuple(a), tuple(b), 0.75)(POINTS) < 0, gap < 0.75)
    assert capsule((1, 1, 1), (1, 1, 1), 2) == sphere(2, (1, 1, 1))


def test_exact_shapes_are_polynomials():
    degrees = [sphere(1), torus(1, 0.5), cylinder(1), cone(1, None), plane()]
    assert [shape.degree for shape in degrees] == [2, 4, 2, 2, 1]
    assert sphere(2) == Surface("x^2 + y^2 + z^2 = 4")
    assert all(shape.degree is None for shape in (box(1), cylinder(1, 1), cone(1, 1), capsule()))


def test_numbers_of_every_kind_are_taken_as_they_are():
    third = Surface("x^2 + y^2 + z^2 = 1/9")
    assert sphere(Fraction(1, 3)) == sphere(sympy.Rational(1, 3)) == third
    assert sphere(1).scale(Fraction(1, 3)) == sphere(1).scale(sympy.Rational(1, 3))
    assert box(np.int64(2)) == box(np.float32(2)) == box(Fraction(2)) == box((2, 2, 2))
    assert sphere(1, np.zeros(3)) == sphere(1, sympy.zeros(3, 1)) == sphere(1)


@pytest.mark.parametrize(("solid", "inside"), [*SHAPES, (capsule(), None)], ids=lambda value: str(value)[:40])
def test_known_distances_are_distances(solid, inside):
    """The same sign as f, a gradient of length 1, and the surface at just that distance along it."""
    if solid.distance is None:
        return
    gap = Surface.from_expression(solid.distance.expression)
    values, slopes = gap.field.gradients(POINTS)
    assert np.array_equal(np.sign(values), np.sign(solid(POINTS)))
    assert np.allclose(np.linalg.norm(slopes, axis=1), 1)
    for side, right in ((values > 0, solid.distance.outside), (values < 0, solid.distance.inside)):
        foot = (POINTS - values[:, None] * slopes)[side]
        if right:
            assert np.abs(gap(foot)).max(initial=0) < 1e-12


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sphere(0), "radius must be positive"),
        (lambda: sphere(-1), "radius must be positive"),
        (lambda: sphere(np.nan), "finite"),
        (lambda: torus(1, 2), "minor <= major"),
        (lambda: cylinder(1, 0), "height must be positive"),
        (lambda: cone(1, -1), "height must be positive"),
        (lambda: box((1, 2)), "three numbers"),
        (lambda: box((1, 2, 0)), "side must be positive"),
        (lambda: plane((0, 0, 0)), "normal other than"),
        (lambda: sphere(1, (1, 2)), "three numbers"),
        (lambda: sphere(1, 0), "center must be three numbers, got 0"),
        (lambda: sphere("1"), "radius must be a finite real number, got '1'"),
        (lambda: sphere(sympy.Symbol("r", positive=True)), "radius must be a finite real number, got r"),
        (lambda: torus(None, 1), "major must be a finite real number, got None"),
        (lambda: torus(2, 1, None), "center must be three numbers, got None"),
        (lambda: cylinder(1, "2"), "height must be a finite real number, got '2'"),
        (lambda: cylinder(1, 2, 3), "center must be three numbers, got 3"),
        (lambda: cone(1j), "radius must be a finite real number, got 1j"),
        (lambda: cone(1, 2, 3), "center must be three numbers, got 3"),
        (lambda: box(None), "sides must be three numbers, got None"),
        (lambda: box(1, 1), "center must be three numbers, got 1"),
        (lambda: capsule(0), "start must be three numbers, got 0"),
        (lambda: capsule(end=(0, 0, "a")), "each number of end must be a finite real number, got 'a'"),
        (lambda: capsule(radius=np.ones(2)), "radius must be a finite real number"),
        (lambda: plane(1), "normal must be three numbers, got 1"),
        (lambda: plane((0, 0, 1), np.inf), "point must be three numbers, got inf"),
    ],
)
def test_wrong_measures_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
