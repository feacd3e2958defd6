"""The parts of implicitization: fractions from remainders, three methods, the proof, the certificate."""

from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import implicitize
from implicit.implicitize.clock import Clock
from implicit.implicitize.degree import count
from implicit.implicitize.eliminate import Implicit, lift, null_space_image
from implicit.implicitize.homogeneous import read_coordinates, simplest
from implicit.implicitize.modular import Remainders, split_primes
from implicit.implicitize.planes import minors_image, square_image
from implicit.implicitize.proof import prove_identity, prove_irreducible
from implicit.implicitize.solve import _prove
from tests.rational import OTHERS, bezier, random_net, u, v


def test_floats_are_exact_binary_fractions_or_simple_ones():
    exact = implicitize((0.1 * u, v, u * v), (u, v))
    assert exact.polynomial.terms[0, 0, 1][0] / exact.polynomial.terms[1, 1, 0][0] == -Fraction(0.1)
    assert implicitize((0.1 * u, v, u * v), (u, v), rationalize=1e-9) == implicitize((u / 10, v, u * v), (u, v))


@given(st.fractions(), st.fractions(min_value=Fraction(1, 10**9), max_value=1))
def test_simplest_fraction_in_an_interval(middle, radius):
    found = simplest(middle - radius, middle + radius)
    assert abs(found - middle) <= radius
    for denominator in range(1, min(found.denominator, 200)):
        below = (middle + radius) * denominator // 1
        assert below < (middle - radius) * denominator


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(-(10**30), 10**30), min_size=2, max_size=6).filter(any), st.integers(1, 10**20))
def test_fractions_come_back_from_remainders(numbers, denominator):
    remainders, stream, found = Remainders(), split_primes((0, 1)), None
    for _ in range(20):
        p, _ = next(stream)
        inverse = pow(denominator, -1, p)
        remainders.add([n * inverse % p for n in numbers], p)
        found = remainders.fractions()
    content = np.gcd.reduce(np.array(numbers, dtype=object))
    assert found == [n // content for n in numbers]


def test_without_time_for_the_proof_the_answer_is_modular():
    coordinates = read_coordinates(bezier(random_net(2, 2, 3)), (u, v))
    counted = count(coordinates)
    found = lift(coordinates, 8, square_image(8, Clock()), Clock())
    certificate = _prove(coordinates, counted, found, "moving planes", Clock(0.0))
    assert certificate.proof == "modular"
    assert 0 < certificate.chance < 1e-5
    assert _prove(coordinates, counted, found, "moving planes", Clock()).proof == "exact"


def test_the_proof_refuses_a_wrong_polynomial():
    coordinates = read_coordinates((u, v, u * v), (u, v))
    wrong = Implicit(2, {(1, 1, 0): (1,), (0, 0, 1): (-1,), (0, 0, 0): (2**31 - 1,)}, 1)
    assert not prove_identity(coordinates, wrong, Clock())
    square = Implicit(2, {(2, 0, 0): (1,), (0, 2, 0): (-1,)}, 1)
    assert not prove_irreducible(coordinates, square, Clock())
    product = Implicit(4, {(4, 0, 0): (1,), (0, 4, 0): (-1,), (0, 0, 1): (0,)}, 1)
    assert not prove_irreducible(coordinates, product, Clock(), attempts=40)


def test_three_methods_find_the_same_polynomial():
    for coordinates in (bezier(random_net(2, 2, 8)), OTHERS["torus"][0], OTHERS["Moebius strip"][0]):
        read = read_coordinates(coordinates, (u, v))
        counted = count(read)
        d, k = counted.degree, counted.map_degree
        images = [null_space_image(d), minors_image(d, k, Clock()), square_image(d, Clock())]
        found = [lift(read, d, image, Clock()) for image in images]
        assert (found[2] is None) == (d == 4 or k == 2)
        terms = [{m: Fraction(e[0], max(f.terms.items())[1][0]) for m, e in f.terms.items()} for f in found if f]
        assert all(t == terms[0] for t in terms)
