"""Singular points of the projective closure in the plane at infinity."""

from collections import Counter

import numpy as np
import pytest

from implicit import Surface, singularities
from tests.singular_catalog import box_of, surface_of


@pytest.mark.parametrize(("name", "count"), [("barth_sextic", 15), ("barth_decic", 45), ("cayley_cubic", 0)])
def test_the_nodes_that_are_missing_in_space_are_at_infinity(name: str, count: int) -> None:
    """Barth's sextic has 65 nodes and his decic 345."""
    locus = singularities(surface_of(name), box_of(name), infinity=True)
    assert locus.infinity is not None
    assert [p.type for p in locus.infinity] == ["A1"] * count


def test_a_projective_map_brings_points_back_from_infinity() -> None:
    """Cayley's cubic 1/x + 1/y + 1/z + 1/t = 0 has its nodes in the corners; three of them are at infinity."""
    locus = singularities(Surface("y z + x z + x y + x y z"), 1, infinity=True)
    assert locus.infinity is not None
    assert {p.exact for p in locus.infinity} == {(1, 0, 0), (0, 1, 0), (0, 0, 1)}
    assert Counter(p.type for p in (*locus.infinity, *locus.points)) == {"A1": 4}
    assert np.array_equal(sorted(tuple(p.position) for p in locus.infinity), np.eye(3)[::-1])


def test_types_at_infinity_are_those_of_the_closure() -> None:
    """z = x^2 + y^3 closes to z t^2 = x^2 t + y^3; where z = 1 that is (t - x^2/2)^2 = x^4/4 + y^3, an E6."""
    locus = singularities(Surface("z = x^2 + y^3"), 1, infinity=True)
    assert locus.infinity is not None and not locus.points
    (point,) = locus.infinity
    assert point.exact == (0, 0, 1) and (point.type, point.milnor) == ("E6", 6)


def test_who_does_not_ask_gets_no_answer() -> None:
    assert singularities(Surface("x^2 + y^2 = z^2"), 1).infinity is None


def test_curves_at_infinity_are_an_error() -> None:
    with pytest.raises(ValueError, match="finitely many singular points at infinity"):
        singularities(Surface("(x^2 + y^2 + z^2 + 3)^2 = 16 (x^2 + y^2)"), 4, infinity=True)
    with pytest.raises(ValueError, match="a polynomial was wanted"):
        singularities(Surface("sin(x) = y z"), 4, infinity=True)
