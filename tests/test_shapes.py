"""Ordinary solids: where they are, what they are as polynomials, and that their distances are distances."""

import numpy as np
import pytest

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
    ],
)
def test_wrong_measures_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
