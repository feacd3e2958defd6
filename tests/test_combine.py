"""Solids from solids: signs, moves, blends that touch where they should, offsets at the right distance."""

import pickle
import time

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Surface, blend, box, capsule, cone, cylinder, offset, plane, sphere, torus
from implicit.tape import make_tape

RNG = np.random.default_rng(7)
POINTS = RNG.uniform(-2, 2, (400, 3))
A, B = sphere(1), box((2, 1, 1), (0.5, 0, 0.2))


def test_signs_are_those_of_sets():
    a, b = A(POINTS) < 0, B(POINTS) < 0
    assert np.array_equal((A | B)(POINTS) < 0, a | b)
    assert np.array_equal((A & B)(POINTS) < 0, a & b)
    assert np.array_equal((A - B)(POINTS) < 0, a & ~b)
    assert np.array_equal((~A)(POINTS) < 0, ~a)
    assert np.array_equal((~(~A | ~B))(POINTS), (A & B)(POINTS))  # De Morgan


def test_combinations_are_flat_and_not_simplified():
    chain = A | B | sphere(2, (1, 0, 0)) | A
    assert isinstance(chain.expression, sympy.Min) and len(chain.expression.args) == 3
    assert ~~A == A and (A | A) == A


def test_only_surfaces_combine():
    with pytest.raises(TypeError, match="got 3"):
        A | 3


def test_a_hundred_parts_are_built_in_a_moment():
    def build():
        solid = sphere(1)
        for n in range(100):
            part = [sphere(0.2), box(0.3), cylinder(0.2, 0.5), torus(0.3, 0.1)][n % 4].translate(
                tuple(RNG.uniform(-1, 1, 3))
            )
            solid = solid - part if n % 5 == 4 else solid | part
        return solid

    build()
    begin = time.process_time()
    solid = build()
    tape = make_tape(solid.expression)
    copy = pickle.loads(pickle.dumps(solid))
    assert time.process_time() - begin < 10  # hours, if sympy simplified; measured 0.6
    assert len(tape) > 500 and copy == solid and np.array_equal(copy(POINTS), solid(POINTS))
    assert "operations" in repr(solid)


# moves ---------------------------------------------------------------------------------------------------------------

SOLIDS = [A, B, torus(1, 0.3), A - B, capsule((0, 0, 0), (1, 1, 0), 0.3), Surface("sin(x) + y z")]


@pytest.mark.parametrize("solid", SOLIDS, ids=str)
def test_moves_carry_points_along(solid):
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert np.allclose(solid.translate((1, -2, 0.5))(POINTS + [1, -2, 0.5]), solid(POINTS))
    assert np.allclose(solid.rotate(np.pi / 2)(POINTS @ turn.T), solid(POINTS))
    assert np.allclose(solid.rotate(1, (1, 2, 3), (1, 0, 0)).rotate(-1, (1, 2, 3), (1, 0, 0))(POINTS), solid(POINTS))
    assert np.allclose(solid.scale(2, (1, 0, 0))([1, 0, 0] + 2 * (POINTS - [1, 0, 0])), solid(POINTS))
    assert np.allclose(solid.scale((1, 2, -0.5))(POINTS * [1, 2, -0.5]), solid(POINTS))
    shear = np.array([[1, 0.5, 0, 1], [0, 1, 0.25, 2], [0, 0, 2, 3], [0, 0, 0, 1.0]])
    moved = POINTS @ shear[:3, :3].T + shear[:3, 3]
    assert np.allclose(solid.transform(shear)(moved), solid(POINTS))


def test_quarter_turns_and_sympy_angles_are_exact():
    surface = Surface("x^2 + 2y^2 + 3z^2 = 1")
    assert surface.rotate(np.pi / 2).polynomial == Surface("y^2 + 2x^2 + 3z^2 = 1").polynomial
    turned = Surface("x = 1").rotate(sympy.pi / 4)
    assert turned.polynomial == Surface("(x + y)/sqrt(2) = 1").polynomial


@pytest.mark.parametrize(
    ("move", "message"),
    [
        (lambda s: s.scale(0), "flatten"),
        (lambda s: s.scale((1, 0, 1)), "flatten"),
        (lambda s: s.transform(np.zeros((3, 3))), "determinant 0"),
        (lambda s: s.transform(np.eye(2)), "shape"),
        (lambda s: s.transform(np.ones((4, 4))), "last row"),
        (lambda s: s.rotate(1, (0, 0, 0)), "axis"),
        (lambda s: s.translate((1, 2)), "three numbers"),
        (lambda s: s.translate((1, 2, np.nan)), "finite"),
        (lambda s: s.scale(np.inf), "finite"),
        (lambda s: s.scale("2"), "three numbers, got '2'"),
        (lambda s: s.scale(2, 1), "center must be three numbers, got 1"),
        (lambda s: s.translate(1), "three numbers, got 1"),
        (lambda s: s.translate("abc"), "finite real number, got 'a'"),
        (lambda s: s.rotate(np.nan), "angle must be a finite real number, got nan"),
        (lambda s: s.rotate(np.inf), "angle must be a finite real number, got inf"),
        (lambda s: s.rotate("1"), "angle must be a finite real number, got '1'"),
        (lambda s: s.rotate(sympy.Symbol("a")), "angle must be a finite real number, got a"),
        (lambda s: s.rotate(1, None), "axis must be three numbers, got None"),
        (lambda s: s.transform(1), "shape"),
        (lambda s: s.transform([["a", 0, 0], [0, 1, 0], [0, 0, 1]]), "finite real number, got 'a'"),
    ],
)
def test_wrong_moves_are_refused(move, message):
    with pytest.raises(ValueError, match=message):
        move(A)


# blends --------------------------------------------------------------------------------------------------------------

PAIRS = [
    (plane((1, 0, 0)), plane((0, 1, 0))),
    (cylinder(0.7), plane((0, 0, 1))),
    (sphere(1), cylinder(0.4)),
    (box(1), sphere(0.5, (0.5, 0.5, 0.5))),
    (Surface("x^2 + 4y^2 + z^2 = 1"), Surface("sin(x) + z = 1/2")),
]


@pytest.mark.parametrize("pair", PAIRS, ids=str)
@pytest.mark.parametrize("kind", ["union", "intersection", "difference"])
def test_blends_change_nothing_far_from_the_other_part(pair, kind):
    radius = 0.2
    plain = {"union": pair[0] | pair[1], "intersection": pair[0] & pair[1], "difference": pair[0] - pair[1]}[kind]
    blended = blend(*pair, radius, kind)
    points = RNG.uniform(-1.5, 1.5, (4000, 3))
    gaps = [np.abs(s(points)) / np.linalg.norm(s.gradient(points), axis=1) for s in pair]
    if all(s.distance for s in pair):
        gaps = [np.abs(Surface.from_expression(s.distance.expression)(points)) for s in pair]
        far = np.maximum(*gaps) >= radius
    else:
        far = np.maximum(*gaps) >= 1.1 * radius
    assert np.array_equal(np.sign(blended(points))[far], np.sign(plain(points))[far])
    assert (np.sign(blended(points)) != np.sign(plain(points))).any()
    sign = -1 if kind == "union" else 1
    assert (sign * (np.sign(blended(points)) - np.sign(plain(points))) >= 0).all()  # a union only grows


@given(st.floats(0.05, 0.5))
@settings(max_examples=15, deadline=None)
def test_right_angles_are_rounded_by_a_quarter_circle(radius):
    """Of planes x = 0 and y = 0 the solid x < 0 or y < 0 gets a fillet about (radius, radius)."""
    rounded = blend(*PAIRS[0], radius)
    angle = np.linspace(np.pi, 1.5 * np.pi, 9)
    circle = np.stack([radius + radius * np.cos(angle), radius + radius * np.sin(angle), 0 * angle], axis=1)
    assert np.abs(rounded(circle)).max() < 1e-14
    inward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert np.allclose(rounded.normal(circle[1:-1]), -inward[1:-1])  # unit normals along the radii


def test_blends_are_tangent_to_both_parts():
    """Along the way from one part over the fillet to the other the normal turns without a jump."""
    a, b, radius = *PAIRS[1], 0.2
    rounded = blend(a, b, radius)
    for place, part in [((0.7, 0, radius), a), ((0.7 + radius, 0, 0), b)]:
        assert abs(rounded(place)) < 1e-15
        step = 1e-7
        for delta in np.array([[0, 0, step], [0, 0, -step], [step, 0, 0], [-step, 0, 0]]):
            assert np.allclose(rounded.normal(np.add(place, delta)), part.normal(place), atol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((A, B, 0), "positive"),
        ((A, B, -1), "positive"),
        ((A, B, np.nan), "positive"),
        ((A, B, "1"), "finite real number, got '1'"),
        ((A, B, 1, "sum"), "kind must be"),
    ],
)
def test_wrong_blends_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        blend(*arguments)


def test_functions_cannot_be_blended():
    with pytest.raises(ValueError, match="no formula"):
        blend(A, Surface.from_function(lambda p: p[:, 0]), 0.1)


# offsets -------------------------------------------------------------------------------------------------------------


def nearest(surface, points):
    """The distance to a surface by sampling it, a naive oracle for points outside or inside."""
    cloud = RNG.uniform(-2, 2, (60000, 3))
    for _ in range(30):
        f, g = surface.field.gradients(cloud)
        cloud -= np.clip(f / (g**2).sum(axis=1), -0.2, 0.2)[:, None] * g
    cloud = cloud[np.abs(surface(cloud)) < 1e-9]
    return np.array([np.linalg.norm(cloud - p, axis=1).min() for p in points])


@pytest.mark.parametrize(
    "solid",
    [sphere(1), torus(1, 0.4), box((1, 1.5, 2)), capsule((0, 0, -0.5), (0.5, 0, 0.5), 0.4), cylinder(0.8, 1.5)],
    ids=str,
)
def test_offsets_lie_at_their_distance(solid):
    points = RNG.uniform(-1.5, 1.5, (60, 3))
    found = nearest(solid, points)
    for distance in (0.3, -0.2):
        moved = offset(solid, distance)
        wanted = np.sign(solid(points)) * found - distance
        clear = np.abs(wanted) > 0.05
        assert np.array_equal(np.sign(moved(points))[clear], np.sign(wanted)[clear])
        assert np.abs(moved(points) - wanted).max() < 0.05


def test_offsets_follow_moves_and_unions():
    both = sphere(1) | sphere(1, (1.5, 0, 0))
    assert np.allclose(
        offset(both, 0.5).field.values(POINTS),
        offset(sphere(1), 0.5).field.values(POINTS).clip(max=offset(sphere(1, (1.5, 0, 0)), 0.5)(POINTS)),
    )
    grown = offset(box(1).rotate(0.7, (1, 1, 0)).scale(3), 0.25)
    assert np.isclose(grown(np.zeros(3)), -1.5 - 0.25)


@pytest.mark.parametrize("distance", ["1", None, np.nan, np.inf])
def test_offsets_are_by_a_finite_distance(distance):
    with pytest.raises(ValueError, match=f"distance of an offset must be a finite real number, got {distance!r}"):
        offset(A, distance)


@pytest.mark.parametrize(
    ("solid", "distance", "side"),
    [
        (Surface("x^4 + y^4 = 1"), 0.1, "outside"),
        (sphere(1) | sphere(1, (1, 0, 0)), -0.1, "inside"),
        (sphere(1) & sphere(1, (1, 0, 0)), 0.1, "outside"),
        (cone(1, 1), 0.1, "outside"),
        (sphere(1).scale((1, 1, 2)), 0.1, "outside"),
        (blend(sphere(1), plane(), 0.1), 0.1, "outside"),
    ],
    ids=str,
)
def test_offsets_that_would_be_wrong_are_refused(solid, distance, side):
    with pytest.raises(ValueError, match=f"not known on its {side}"):
        offset(solid, distance)
