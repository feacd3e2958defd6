"""Exact polynomials over Q and over real number fields."""

import pickle
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import NotPolynomialError, Surface, x, y, z
from implicit.algebra.factor import divide, gcd
from implicit.algebra.numberfield import make_field
from implicit.algebra.polynomial import Polynomial

numbers = st.sampled_from([0, 1, -1, 2, sympy.Rational(1, 3), sympy.sqrt(5), (1 + sympy.sqrt(5)) / 2])
monomials = st.tuples(*[st.integers(0, 2)] * 3)
polynomials = st.dictionaries(monomials, numbers, min_size=1, max_size=5).map(
    lambda terms: sympy.Add(*(c * x**i * y**j * z**k for (i, j, k), c in terms.items()))
)


def same(polynomial, expression):
    return sympy.expand(polynomial.to_sympy() - expression, deep=True) == 0


@given(polynomials, polynomials)
@settings(max_examples=40, deadline=None)
def test_arithmetic_is_that_of_sympy(a, b):
    p, q = Polynomial.from_sympy(a), Polynomial.from_sympy(b)
    assert same(p + q, a + b) and same(p - q, a - b) and same(p * q, a * b)
    assert same(p.derivative(1), sympy.diff(a, y))
    assert p == Polynomial.from_sympy(sympy.expand(a)) and hash(p) == hash(pickle.loads(pickle.dumps(p)))
    assert pickle.loads(pickle.dumps(p)) == p


@given(polynomials, polynomials)
@settings(max_examples=25, deadline=None)
def test_square_free_part_and_factors(a, b):
    p, q = Polynomial.from_sympy(a), Polynomial.from_sympy(b)
    product = p * p * q
    if product.is_zero or product.degree == 0:
        return
    rebuilt = Polynomial.from_sympy(sympy.Integer(1))
    distinct = rebuilt
    for factor, power in product.factors():
        rebuilt, distinct = rebuilt * factor**power, distinct * factor
    assert proportional(rebuilt, product)
    assert proportional(distinct, product.square_free)


def proportional(p, q):
    first = max(q.terms)
    ratio = [
        sympy.Poly(f.to_sympy(), x, y, z, extension=True).coeff_monomial(x ** first[0] * y ** first[1] * z ** first[2])
        for f in (p, q)
    ]
    return sympy.expand(p.to_sympy() * ratio[1] - q.to_sympy() * ratio[0]) == 0


@pytest.mark.parametrize(
    ("text", "powers"),
    [
        ("(x - sqrt(2)y)^2 (x + y + z)^3 (x^2 + sqrt(2)y^2 - z)", [1, 2, 3]),
        ("(x^2 - 2)(sqrt(2)y - 1)", [1, 1, 1]),
        ("(x^2 - y^2/3)(x + 2^(1/3)y)^2", [1, 2]),
        ("((sqrt(2) + sqrt(3))x^2 - y)^2 (z - sqrt(6))", [1, 2]),
        ("x^2 - 2y^2", [1]),
        ("(x^2 + y^2)(x^2 + y^2 - 1)", [1, 1]),
    ],
)
def test_factors_over_the_field_of_the_coefficients(text, powers):
    assert sorted(power for _, power in Surface(text).polynomial.factors()) == powers


def test_gcd_over_a_field():
    root = sympy.sqrt(7)
    common, a, b = (Polynomial.from_sympy(e) for e in (x * y + root * z**2, x - root * y, x + z + root))
    found = gcd(a * common, b * common)
    assert divide(common, found)[1].is_zero and found.degree == common.degree


@pytest.mark.parametrize(
    "number",
    [
        sympy.sqrt(5),
        sympy.cbrt(2),
        sympy.GoldenRatio,
        sympy.sqrt(2 + sympy.sqrt(3)),
        sympy.cos(sympy.pi / 7),
        1 / (1 + sympy.sqrt(2)),
    ],
)
def test_field_holds_its_generator(number):
    field, _ = make_field([number])
    w = field.enclosure(300)
    assert abs(float(w) - float(number)) < 1e-14
    assert sum(c * w**n for n, c in enumerate(field.minimal)).contains(0)
    assert field.interval[0] < Fraction(str(number.evalf(30))) < field.interval[1]


def test_zero_coefficients_vanish_exactly():
    p = Surface("(sqrt(2)sqrt(3) - sqrt(6)) x^5 + (sqrt(2) x - y)(sqrt(2) x + y)").polynomial
    assert p.degree == 2 and p.field is None
    assert Surface("(1 + sqrt(5))^2/4 x^9 - (3 + sqrt(5))/2 x^9 + y").degree == 1


@given(polynomials)
@settings(max_examples=30, deadline=None)
def test_float_coefficients_lie_within_their_bounds(a):
    p = Polynomial.from_sympy(a)
    with mpmath.workdps(60):
        for e, c, error in zip(p.exponents.tolist(), p.coefficients, p.coefficient_errors, strict=True):
            exact = sympy.Poly(sympy.expand(a), x, y, z).coeff_monomial(x ** e[0] * y ** e[1] * z ** e[2])
            off = abs(mpmath.mpf(str(sympy.N(exact, 55))) - mpmath.mpf(float(c)))
            assert off <= mpmath.mpf(float(error)) * (1 + mpmath.mpf(10) ** -30) and error <= abs(c) * 2.0**-52
            assert error > 0 or exact == sympy.Rational(float(c))


def test_shift_is_exact():
    p = Surface("(x^2 + y^2 + z^2 - 1)^3 - sqrt(3) x y").polynomial
    moved = p.shifted((Fraction(1, 3), -2, 0.5))
    assert moved.shifted((Fraction(-1, 3), 2, -0.5)) == p
    assert not moved.coefficients.flags.writeable


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sin(x)", "sin"),
        ("1/x", "1/x"),
        ("max(x, y)", "Max"),
        ("x^y", "occurs"),
        ("sqrt(x)", "sqrt"),
        ("pi x", "algebraic"),
        ("(x+y+z+1)^300", "200000 terms"),
    ],
)
def test_what_is_no_polynomial_is_named(text, message):
    with pytest.raises(NotPolynomialError, match=message):
        Polynomial.from_sympy(Surface(text).expression)
    assert Surface(text).polynomial is None


def test_degree_without_algebraic_coefficients():
    assert Surface("pi x^2 + e y = 1").degree == 2
    assert Surface("sin(1) x^3 + y").degree == 3
    assert Surface("x^200 + y^200 + z^200 = 1").degree == 200
    assert Surface("sin(x) = y").degree is None


def test_fields_do_not_mix():
    with pytest.raises(ValueError, match="one number field"):
        Surface("sqrt(2) x").polynomial + Surface("sqrt(3) x").polynomial


def test_degrees_and_terms():
    p = Surface("3x^2 y - z^4/7 + 1").polynomial
    assert p.degrees == (2, 1, 4) and p.degree == 4
    assert p.terms == {(0, 0, 0): (1,), (0, 0, 4): (Fraction(-1, 7),), (2, 1, 0): (3,)}
    assert np.array_equal(p.exponents, [[0, 0, 0], [0, 0, 4], [2, 1, 0]])
    assert Polynomial.from_terms({e: c[0] for e, c in p.terms.items()}) == p
