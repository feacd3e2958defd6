"""B-spline basis functions and knot vectors: the theorems of the textbook, for random knots and degrees."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from parametric import KnotVector
from parametric.splines.knots import to_knots
from parametric.textbook.algorithms import basis_function

QUICK = settings(max_examples=30, deadline=None)


@st.composite
def knot_vectors(draw):
    """Clamped, open or closed, with inner knots of any allowed multiplicity."""
    degree = draw(st.integers(1, 6))
    kind = draw(st.sampled_from(["clamped", "open", "closed", "array"]))
    if kind != "array":
        return to_knots(kind, degree, draw(st.integers(degree + 1, degree + 7)))
    inner = draw(st.lists(st.integers(1, 9), max_size=8).map(sorted))
    inner = [k for i, k in enumerate(inner) if inner[:i].count(k) < degree]
    return KnotVector([0] * (degree + 1) + [k / 10 for k in inner] + [1] * (degree + 1), degree)


def places(knots, seed=0):
    low, high = knots.domain
    return np.concatenate([low + (high - low) * np.random.default_rng(seed).random(20), knots.breaks])


@given(knot_vectors())
@QUICK
def test_partition_of_unity_and_non_negativity(knots):
    design = knots.design(places(knots))
    assert design.min() >= -1e-16
    np.testing.assert_allclose(design.sum(axis=1), 1, rtol=0, atol=1e-13)


@given(knot_vectors())
@QUICK
def test_agrees_with_scipy(knots):
    t = places(knots)[:20]
    first, weights = knots.weights(t)
    dense = np.zeros((t.size, knots.functions))
    np.put_along_axis(dense, first[:, None] + np.arange(knots.degree + 1), weights, axis=1)
    expected = BSpline.design_matrix(t, knots.values, knots.degree).toarray()
    np.testing.assert_allclose(dense, expected, rtol=0, atol=1e-13)


@given(knot_vectors(), st.integers(1, 4))
@QUICK
def test_derivatives_agree_with_scipy(knots, order):
    t = places(knots)[:20]
    first, weights = knots.weights(t, order)
    dense = np.zeros((t.size, knots.functions))
    np.put_along_axis(dense, first[:, None] + np.arange(knots.degree + 1), weights, axis=1)
    expected = BSpline(knots.values, np.eye(knots.functions), knots.degree)(t, nu=order)
    np.testing.assert_allclose(dense, expected, rtol=0, atol=1e-12 * max(1, np.abs(expected).max()))


@given(knot_vectors())
@QUICK
def test_local_support(knots):
    t = places(knots)[:20]
    p = knots.degree
    for i in range(knots.functions):
        outside = (t < knots.values[i]) | (t >= knots.values[i + p + 1])
        unit = np.eye(knots.functions)[i]
        first, weights = knots.weights(t)
        values = np.einsum("nk,nk->n", weights, unit[first[:, None] + np.arange(p + 1)])
        assert np.all(values[outside] == 0)


def test_recursion_in_exact_arithmetic():
    knots = [0, 0, 0, 0, Fraction(1, 5), Fraction(1, 2), Fraction(1, 2), 1, 1, 1, 1]
    vector = KnotVector([float(k) for k in knots], 3)
    for t in (Fraction(0), Fraction(1, 7), Fraction(1, 2), Fraction(3, 4), Fraction(1)):
        expected = [float(basis_function(knots, i, 3, t)) for i in range(7)]
        np.testing.assert_allclose(vector.design([float(t)])[0], expected, rtol=0, atol=1e-15)


def test_the_three_kinds_divide_the_unit_interval():
    assert to_knots("clamped", 2, 5).values.tolist() == pytest.approx([0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1])
    assert to_knots("open", 2, 5).values.tolist() == pytest.approx([-2 / 3, -1 / 3, 0, 1 / 3, 2 / 3, 1, 4 / 3, 5 / 3])
    closed = to_knots("closed", 2, 5)
    assert closed.values.tolist() == pytest.approx([-0.4, -0.2, 0, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4])
    assert (closed.count, closed.functions, closed.domain) == (5, 7, (0, 1))


def test_knots_are_taken_as_they_stand():
    knots = KnotVector([-3, -3, 2, 7, 7], 1)
    assert knots.values.tolist() == [-3, -3, 2, 7, 7]
    assert knots.domain == (-3, 7)


def test_values_cannot_be_changed_and_the_argument_is_not():
    given_knots = np.array([0.0, 0, 1, 1])
    knots = KnotVector(given_knots, 1)
    given_knots[0] = -1
    assert knots.values[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        knots.values[0] = -1
    with pytest.raises(AttributeError, match="cannot be changed"):
        knots.degree = 2


def test_equal_knot_vectors_are_equal():
    one, other = KnotVector([0, 0, 1, 1], 1), KnotVector([0, 0, 1, 1.0], 1)
    assert one == other
    assert hash(one) == hash(other)
    assert one != KnotVector([0, 0, 2, 2], 1)
    assert "degree=1" in repr(one)


@pytest.mark.parametrize(
    ("values", "degree", "message"),
    [
        ([0, 0, 1], 1, "degree 1 needs at least 4 knots"),
        ([0, 0, 0.5, 0.4, 1, 1], 1, "must not decrease: number 2 is 0.5, number 3 is 0.4"),
        ([0, 0, 0, 0], 1, r"domain \[0, 0\] without inside"),
        ([0, 0, 0.5, 0.5, 0.5, 1, 1], 1, "knot 0.5 occurs 3 times, more than degree . 1 = 2"),
        ([0, 0, np.nan, 1], 1, "knots must be finite"),
        ([0, 0, 1, 1], 0, "degree must be an integer of at least 1, got 0"),
        ([0, 0, 1, 1], 1.5, "degree must be an integer"),
    ],
)
def test_wrong_knots(values, degree, message):
    with pytest.raises(ValueError, match=message):
        KnotVector(values, degree)


def test_wrong_closed_knots():
    with pytest.raises(ValueError, match="closed knots must repeat their steps after 4 knots"):
        KnotVector([-2, -1, 0, 1, 2, 3, 4, 5.5, 6], 2, closed=True)
    with pytest.raises(ValueError, match="closed B-spline of degree 2 needs more than 2 control points, got 2"):
        KnotVector([-2, -1, 0, 1, 2, 3, 4], 2, closed=True)


@pytest.mark.parametrize(
    ("knots", "degree", "count", "message"),
    [
        ("natural", 3, 4, "knots must be one of clamped, closed, open or an array, got 'natural'"),
        ("clamped", 3, 3, "degree 3 needs at least 4 control points, got 3"),
        ([0, 0, 1, 1], 1, 3, "3 control points of degree 1 need 5 knots, got 4"),
        (KnotVector([0, 0, 1, 1], 1), 2, 2, "knots are of degree 1, but the degree asked for is 2"),
    ],
)
def test_wrong_choice_of_knots(knots, degree, count, message):
    with pytest.raises(ValueError, match=message):
        to_knots(knots, degree, count)
