"""Exact algebra in coordinates of small coefficients: the same surface, and small where a turn had made it large."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, fmpq, fmpq_mat, fmpq_mpoly
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import Ball, Surface, singularities
from implicit.singular.center import center
from implicit.singular.form import Form
from implicit.singular.harmonic import harmonics, product
from implicit.singular.homogeneous import (
    affine_matrix,
    content,
    homogeneous,
    identity,
    moved,
    order,
    primitive,
    size,
    terms_of,
)
from implicit.singular.placement import Placement, place
from implicit.singular.proof import integral
from implicit.singular.rotation import _matrices, _turns, unturned
from implicit.singular.translation import unmoved
from tests.singular_catalog import NAMES, box_of, entry_of, surface_of
from tests.test_singular_points import turned

SMOOTH = ["sphere", "torus", "cyclide_ring", "clebsch", "tanglecube", "monkey_saddle"]
LOW = [n for n in NAMES if (f := surface_of(n).polynomial) is not None and f.degree <= 4 and "field" not in entry_of(n)]
ODD = [3, 5, 7, 11, 13, 17, 31, 97]
PRIMES = [p for p in range(2, 1000) if all(p % q for q in range(2, p))]

entries = st.integers(-7, 7)
quaternions = st.tuples(entries, entries, entries, entries).filter(any)
shifts = st.tuples(*[st.fractions(-2, 2, max_denominator=11)] * 3)


def _placed(surface: Surface) -> Placement:
    assert surface.polynomial is not None
    return place(integral(Form.of(surface.polynomial)))


def _digits(form: Form) -> int:
    return max(int(a.p).bit_length() for c in integral(form).terms.values() for a in c.coeffs())


def _polynomial(name: str) -> fmpq_mpoly:
    polynomial = surface_of(name).polynomial
    assert polynomial is not None
    return primitive(homogeneous(integral(Form.of(polynomial))))


def _rotation(quaternion: tuple[int, ...]) -> fmpq_mat:
    rows = _matrices(np.array(quaternion, dtype=np.int64)[:, None])[0]
    norm = sum(q * q for q in quaternion)
    return fmpq_mat([[fmpq(int(e), norm) for e in row] for row in rows])


def _column(values: tuple[Fraction, ...]) -> fmpq_mat:
    return fmpq_mat([[fmpq(v.numerator, v.denominator)] for v in values])


def _turned(f: fmpq_mpoly, turn: fmpq_mat) -> fmpq_mpoly:
    return moved(f, affine_matrix(turn, fmpq_mat(3, 1)))


@given(quaternions, shifts, st.sampled_from(LOW))
@settings(max_examples=60, deadline=None)
def test_the_center_turns_and_moves_with_the_surface(
    quaternion: tuple[int, ...], shift: tuple[Fraction, ...], name: str
) -> None:
    """M takes the center of f(M X + s) to the center of f, less s."""
    f, turn, by = _polynomial(name), _rotation(quaternion), _column(shift)
    there = turn * center(moved(f, affine_matrix(turn, by))) + by
    assert there == center(f)


def test_the_center_of_a_sphere_and_of_a_cone() -> None:
    for formula, at in (("(x-1)^2 + (2y-3)^2 + (z+5)^2 = 7", (1, 3, -5)), ("(x-1)^3 + 2 y^3 = (3 z-2)^3", (1, 0, 2))):
        polynomial = Surface(formula).polynomial
        assert polynomial is not None
        found = center(homogeneous(Form.of(polynomial)))
        scale = (1, 2, 1) if at[1] else (1, 1, 3)
        assert [found[r, 0] for r in range(3)] == [fmpq(at[r], scale[r]) for r in range(3)]


@given(quaternions, st.sampled_from(LOW))
@settings(max_examples=30, deadline=None)
def test_rotations_keep_harmonic_parts_and_their_squares(quaternion: tuple[int, ...], name: str) -> None:
    f, turn = _polynomial(name), _rotation(quaternion)
    here, there = harmonics(_turned(f, turn)), [_turned(part, turn) for part in harmonics(f)]
    for a, b in zip(here, there, strict=True):
        assert sum((a.derivative(n).derivative(n) for n in range(3)), start=a * 0) == 0
        assert a in (primitive(b), -primitive(b))
        assert product(a, a) == product(b, b) / content(b) ** 2


@pytest.mark.parametrize("p", ODD)
def test_there_is_one_turn_for_each_line_of_isotropic_vectors(p: int) -> None:
    matrices, lines = _turns(p)
    x, y = np.mgrid[0:p, 0:p].reshape(2, -1)
    assert len(matrices) == p + 1
    assert (matrices @ matrices.transpose(0, 2, 1) == p * p * np.eye(3, dtype=np.int64)).all()
    assert (np.linalg.det(matrices / p) > 0).all()
    isotropic = {(1, int(b), int(c)) for b, c in zip(x, y, strict=True) if (1 + b * b + c * c) % p == 0}
    isotropic |= {(0, 1, int(c)) for c in range(p) if (1 + c * c) % p == 0}
    assert {(int(a), int(b), int(c)) for a, b, c in lines} == isotropic
    assert (np.cross(matrices, lines[:, :, None], axis=1) % p == 0).all()


@given(quaternions, st.sampled_from(LOW), st.sampled_from([3, 5, 7, 11]))
@settings(max_examples=25, deadline=None)
def test_at_most_one_turn_makes_coefficients_smaller_and_none_in_the_end(
    quaternion: tuple[int, ...], name: str, p: int
) -> None:
    """The order of the coefficients is concave on the tree of turns; all p + 1 are tried here."""
    f = _turned(_polynomial(name), _rotation(quaternion))
    assert len(_gaining(f, p)) <= 1
    assert not _gaining(_turned(f, unturned(f, [p])), p)


def _gaining(f: fmpq_mpoly, p: int) -> list[int]:
    parts = harmonics(f)
    turns = [fmpq_mat([[fmpq(int(e), p) for e in row] for row in m]) for m in _turns(p)[0]]
    gains = [sum(order(content(_turned(part, turn)), p) for part in parts) for turn in turns]
    return [n for n, gain in enumerate(gains) if gain > 0]


@given(quaternions, st.sampled_from(["cayley_cubic", "kummer", "steiner_roman", "hunt", "barth_sextic", "limao"]))
@settings(max_examples=30, deadline=None)
def test_a_rotation_is_undone_up_to_an_exchange_of_coordinates(quaternion: tuple[int, ...], name: str) -> None:
    """Unless the surface itself could be turned to smaller coefficients: it could not, and only these turns keep it."""
    f, turn = _polynomial(name), _rotation(quaternion)
    rest = turn * unturned(_turned(f, turn), PRIMES)
    assert all(rest[r, c] in (-1, 0, 1) for r in range(3) for c in range(3))


@given(shifts, st.sampled_from(["kummer", "boy_apery", "klein_bottle", "barth_sextic"]))
@settings(max_examples=40, deadline=None)
def test_a_translation_is_undone_up_to_an_integral_one(shift: tuple[Fraction, ...], name: str) -> None:
    """Also where the center has denominators, 260 and 3: the least common denominator of s and the shift found is 1."""
    f, by = _polynomial(name), _column(shift)
    here = primitive(moved(f, affine_matrix(identity(3), by)))
    rest = by + unmoved(here, center(here), PRIMES)
    assert all(rest[r, 0].q == 1 for r in range(3))


@given(quaternions, shifts, st.sampled_from(["hunt", "boy_apery", "kummer", "helix", "klein_bottle"]))
@settings(max_examples=20, deadline=None)
def test_coefficients_are_as_small_after_any_turn(
    quaternion: tuple[int, ...], shift: tuple[Fraction, ...], name: str
) -> None:
    """As many digits as without the turn, or fewer."""
    f, polynomial = _polynomial(name), surface_of(name).polynomial
    assert polynomial is not None
    here = primitive(moved(f, affine_matrix(_rotation(quaternion), _column(shift))))
    placed = place(Form(terms_of(here), Form.of(polynomial).field)).form
    assert size(primitive(homogeneous(placed))) <= size(f)


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 10**6), st.sampled_from(["cayley_cubic", "steiner_roman", "whitney_umbrella", "boy_apery"]))
def test_a_placement_is_the_same_surface(seed: int, name: str) -> None:
    """f(M X + s) is a multiple of the form in X: where one is zero, so is the other."""
    surface = turned(surface_of(name), seed)[0]
    placement = _placed(surface)
    matrix, shift = placement.floats
    values = placement.form.nested()
    inside = np.random.default_rng(seed).normal(size=(6, 3))
    ours = np.array([float(values(*(arb(float(c)) for c in p)).mid()) for p in inside])
    theirs = surface(inside @ matrix.T + shift)
    ratio = theirs / ours
    assert np.allclose(ratio, np.median(ratio), rtol=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["steiner_roman", "boy_apery", "source_cubic_A5"])
def test_a_turn_is_undone(name: str, seed: int) -> None:
    surface = surface_of(name)
    here = turned(surface, seed)[0]
    assert surface.polynomial is not None and here.polynomial is not None
    before, turn = (_digits(Form.of(s.polynomial)) for s in (surface, here) if s.polynomial is not None)
    assert turn > 2 * before
    assert _digits(_placed(here).form) <= before + 2


def test_unstable_forms_and_cones_come_to_an_end() -> None:
    for formula in ("x^2 = y^2 z", "x^3 + 49 y^3 + 7 z^3", "x^2 + 25 y^2", "z = 7^9 x^2 + y^5"):
        matrix, _ = _placed(Surface(formula)).floats
        assert np.linalg.cond(matrix) < 31


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", SMOOTH)
def test_turned_smooth_surfaces_are_proved_smooth(name: str, seed: int) -> None:
    locus = singularities(turned(surface_of(name), seed)[0], 15)
    assert locus.complete and not locus.points and not locus.curves


@pytest.mark.parametrize(("name", "seed"), [("hunt", 2), ("hunt", 10), ("boy_apery", 8)])
def test_turned_sextics_have_the_same_singularities_proved(name: str, seed: int) -> None:
    surface, matrix, shift = turned(surface_of(name), seed)
    low, high = box_of(name).corners
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    there = singularities(surface_of(name), Ball(radius, tuple(middle)))
    here = singularities(surface, Ball(radius, tuple(np.linalg.solve(matrix, middle - shift))))
    assert here.complete and there.complete
    assert sorted(str(p.type) for p in here.points) == sorted(str(p.type) for p in there.points)
    assert len(here.curves) == len(there.curves)
    back = {tuple((matrix @ p.position + shift).round(6) + 0.0) for p in here.points}
    assert back == {tuple(p.position.round(6) + 0.0) for p in there.points}
