"""Surfaces whose singular sets are known by construction: all of it is found, and it is said that that is all."""

from dataclasses import dataclass, field

import numpy as np
import pytest
import sympy

from implicit import SingularLocus, Surface, singularities
from implicit.singular.twist import t
from tests.singular_catalog import box_of, surface_of
from tests.test_singular_points import turned

root = sympy.sqrt


@dataclass(frozen=True)
class Known:
    """Points (x, y, z, type), how many curves, which leaves, and all special points of them."""

    formula: str
    points: list[tuple[object, ...]] = field(default_factory=list)
    curves: int = 0
    leaves: tuple[int, ...] = ()
    special: list[tuple[float, ...]] = field(default_factory=list)


KNOWN = {
    "plane and sphere": Known("(x + 2y - 1)(x^2 + y^2 + z^2 - 4)", [], 1, (4,)),
    "spheres": Known("(x^2 + y^2 + z^2 - 4)((x - 1)^2 + y^2 + z^2 - 4)", [], 1, (4,)),
    "equal cylinders": Known("(x^2 + y^2 - 1)(y^2 + z^2 - 1)", [], 2, (4,), [(0, 1, 0), (0, -1, 0)] * 2),
    "cylinders": Known("(x^2 + y^2 - 1)(y^2 + z^2 - 2)", [], 2, (4,)),
    "three planes and a sphere": Known(
        "x y z (x^2 + y^2 + z^2 - 1)",
        [],
        6,
        (4,),
        [(0, 0, 0)] * 3 + [(s * a, s * b, s * c) for a, b, c in np.eye(3) for s in (1, -1) for _ in range(3)],
    ),
    "tangents of a twisted cubic": Known("(x y - z)^2 - 4 (x^2 - y)(y^2 - x z)", [], 1, (2,)),
    "x y = g": Known("x y = (z - 1)^2 (z + 1)^3 z", [(0, 0, 1, "A1"), (0, 0, -1, "A2")]),
    "irrational x^2 + y^2 = g": Known(
        "x^2 + y^2 = (z^2 - 2)^2 (z^2 - 3)^3",
        [(0, 0, s * root(n), kind) for n, kind in ((2, "A1"), (3, "A2")) for s in (1, -1)],
    ),
    "pullback of an umbrella": Known("(x^2 - 1)^2 = y^2 z", [], 2, (0, 4), [(1, 0, 0), (-1, 0, 0)]),
    "plane and isotropic cone": Known("x^3 + y^3 + z^3 - 3 x y z", [], 1, (0,), [(0, 0, 0)]),
    "cone over a cusp": Known("y^2 z = x^3", [], 1, (2,), [(0, 0, 0)]),
    "nodes that are a cusp at one place": Known("x^3 + x^2 (z - 1/3)^2 = y^2", [], 1, (4,), [(0, 0, 1 / 3)]),
    "cusps that are a tacnode at one place": Known("x^2 + (y - 1/3)^2 z^3 = z^4", [], 1, (2,), [(0, 1 / 3, 0)]),
    "cusps that turn over": Known("x^2 = (y - 1/3) z^3 + z^5", [], 1, (2,), [(0, 1 / 3, 0)]),
    "three sheets that touch at one place": Known(
        "(x^2 - (y - 1/3)^2 z^2) (x + 2 z) + z^4", [], 1, (6,), [(0, 1 / 3, 0), (0, -5 / 3, 0)]
    ),
    "nodes round a circle, a cusp at its start": Known(
        "z^2 = (x^2 + y^2 - 1)^2 (x^2 + y^2 + x)", [], 1, (4,), [(-1, 0, 0)]
    ),
    "cusps round a circle, sharper at its start": Known(
        "z^2 = (x^2 + y^2 - 1)^3 (x + 1) + (x^2 + y^2 - 1)^5", [], 1, (2,), [(-1, 0, 0)]
    ),
    "cone over a smooth cubic": Known("y^2 z - x^3 + x z^2", [(0, 0, 0, "P8")]),
    "cone over a smooth quartic": Known("x^4 + y^4 - z^4", [(0, 0, 0, None)]),
    "real point of complex lines": Known("(x^2 + y^2)^2 + z^2", [(0, 0, 0, None)]),
    "tangent spheres": Known("(x^2 + y^2 + z^2 - 1)((x - 2)^2 + y^2 + z^2 - 1)", [(1, 0, 0, None)]),
    "solitary circle": Known("z^2 + (x^2 + y^2 - 1)^2", [], 1, (0,)),
    "tangent sheets at a cusp": Known("(x^2 + y^2 - z^3)^2 = (x - y)^4 (z + 2)", [], 1, (4,), [(0, 0, 0)]),
    "elliptic curve": Known("(y^2 - x^3 + x)^2 = z^2", [], 2, (4,)),
    "half solitary elliptic curve": Known("(y^2 - x^3 + x)^2 = z^2 (x - 1/2)", [], 2, (0, 4)),
    "nodal cubic": Known("(y^2 - x^3 - x^2)^2 = z^2", [], 1, (4,), [(0, 0, 0)]),
    "cuspidal cubic": Known("(y^2 - x^3)^2 = z^2", [], 1, (4,), [(0, 0, 0)]),
    "cuspidal edge with cusps": Known("(x^2 - y^3)^2 = (z^2 - y^2)^3", [], 2, (2,), [(0, 0, 0)] * 2),
    "solitary axes": Known("x^2 y^2 + y^2 z^2 + x^2 z^2", [], 3, (0,), [(0, 0, 0)] * 3),
    "cuspidal parabola": Known("x^2 + (z + y^2)^3", [], 1, (2,)),
    "plane and paraboloid twice": Known("(x^2 + y^2 - z)^2 (x + y)", [], 1, (4,)),
    "irrational node": Known("(x - sqrt(2))^2 + (y - sqrt(3))^2 = z^2", [(root(2), root(3), 0, "A1")]),
    "four nodes of degree four": Known(
        "(x^2 - 2)^2 + (y^2 - 3)^2 = z^2", [(a * root(2), b * root(3), 0, "A1") for a in (1, -1) for b in (1, -1)]
    ),
    "parallel irrational lines": Known("((x + y)^2 - 2)^2 = z^2", [], 2, (4,)),
    "lines that cross irrationally": Known("(x^2 - 2 x y - y^2)^2 = z^2 (z + 3)", [], 2, (4,), [(0, 0, 0)] * 2),
    "whiskers without nodal Hessians": Known(
        "x^4 y^2 + x^2 y^4 - x^2 y^2 + z^6",
        [],
        2,
        (0, 4),
        [(0, 0, 0), (0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)],
    ),
    "three sheets in a quartic": Known("x y z = x^4 + y^4 + z^4", [(0, 0, 0, None)]),
    "lemon": Known("x^2 + z^2 = y^3 (1 - y)^3", [(0, 0, 0, "A2"), (0, 1, 0, "A2")]),
    "windy": Known("x^2 = y^4 + z^4 - x y z", [(0, 0, 0, "X9")]),
    "D6": Known("x^2 - y^2 z + z^5", [(0, 0, 0, "D6")]),
    "spindle": Known("(x^2 + y^2 + z^2)^2 = x^2 + y^2", [(0, 0, 0, "A3")]),
}


def _sorted(rows: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    return sorted(tuple(float(np.round(float(c), 5)) + 0.0 for c in row[:3]) for row in rows)


@pytest.mark.parametrize("name", KNOWN)
def test_what_was_built_in_is_found_and_nothing_else(name: str) -> None:
    known, locus = KNOWN[name], singularities(Surface(KNOWN[name].formula), 2)
    assert _sorted([tuple(p.position) for p in locus.points]) == _sorted(known.points)
    assert sorted(str(p.type) for p in locus.points) == sorted(str(row[3]) for row in known.points)
    assert len(locus.curves) == known.curves
    assert {int(n) for c in locus.curves for n in c.leaves} == set(known.leaves)
    assert _sorted([tuple(s) for c in locus.curves for s in c.special]) == _sorted(known.special)
    assert locus.complete and not len(locus.undecided)


def test_pairs_of_irrational_lines_have_one_parametrization_each() -> None:
    locus = singularities(Surface("(x^2 - 2 x y - y^2)^2 = z^2 (z + 3)"), 2)
    for curve in locus.curves:
        assert curve.expression is not None
        at = [sympy.lambdify(t, c)(curve.polyline[0, 0]) for c in curve.expression]
        assert np.allclose(at, curve.polyline[0], rtol=0, atol=1e-12)


def test_vertices_lie_on_curves_that_need_many_nodes() -> None:
    """The twisted cubic (s, s^2, s^3), whose projection nearly turns back."""
    (curve,) = singularities(Surface("(x y - z)^2 - 4 (x^2 - y)(y^2 - x z)"), 2).curves
    x, y, z = curve.polyline.T
    error = np.maximum(np.abs(y - x**2), np.abs(z - x**3))
    assert error[1:-1].max() < 1e-10 and error.max() < 4e-6  # the ends are cut from chords
    assert x.max() == pytest.approx(2 ** (1 / 3), abs=1e-6)


def test_a_curve_that_touches_the_bounds_from_outside_is_a_point() -> None:
    """Enneper's self-intersections end in pinch points on the faces z = +-3 of the box."""
    locus = singularities(surface_of("enneper"), box_of("enneper"))
    assert _sorted([tuple(p.position) for p in locus.points]) == [(0, 0, -3), (0, 0, 3)]
    assert len(locus.curves) == 2 and locus.complete


CURVED = ["source_cubic_line", "whitney_umbrella", "steiner_roman", "boy_apery", "taubin_heart", "klein_bottle"]


def _special(locus: SingularLocus) -> list[np.ndarray]:
    return [s for curve in locus.curves for s in curve.special]


@pytest.mark.parametrize(
    ("name", "seed"), [*((name, 1) for name in CURVED), ("limao", 2), ("crixxi", 3), ("helix", 2), ("hunt", 1)]
)
def test_curves_turn_with_the_surface(name: str, seed: int) -> None:
    surface, matrix, shift = turned(surface_of(name), seed)
    box = box_of(name).corners
    reach = float(np.linalg.norm(np.abs(box).max(axis=0)) + np.linalg.norm(shift))
    there, here = singularities(surface_of(name), 2 * reach), singularities(surface, 2 * reach)
    assert here.complete and there.complete
    assert len(here.curves) == len(there.curves) and len(here.points) == len(there.points)
    for old, new in zip((p.position for p in there.points), _matched(there, here, matrix, shift), strict=True):
        assert np.abs(old - new).max() < 1e-9
    assert sorted(str(p.type) for p in here.points) == sorted(str(p.type) for p in there.points)
    assert {int(n) for c in here.curves for n in c.leaves} == {int(n) for c in there.curves for n in c.leaves}
    assert len(_special(here)) == len(_special(there))
    for s in _special(here):
        assert min(np.abs(matrix @ s + shift - other).max() for other in _special(there)) < 1e-6
    assert sum(c.expression is None for c in here.curves) == sum(c.expression is None for c in there.curves)


def _matched(there: SingularLocus, here: SingularLocus, matrix: np.ndarray, shift: np.ndarray) -> list[np.ndarray]:
    images = [matrix @ p.position + shift for p in here.points]
    return [min(images, key=lambda q, p=p: float(np.abs(q - p.position).max())) for p in there.points]  # type: ignore[misc]


@pytest.mark.parametrize("formula", ["(x + 2y - 1)(x^2 + y^2 + z^2 - 4)", "(x^2 - 1)^2 - y^2 z", "x y (x - z^2)"])
def test_curves_of_expanded_and_factored_input_agree(formula: str) -> None:
    factored = Surface(formula)
    first, second = (singularities(s, 2) for s in (factored, Surface(sympy.expand(factored.expression))))
    assert [c.expression for c in first.curves] == [c.expression for c in second.curves]
    assert [c.special.tolist() for c in first.curves] == [c.special.tolist() for c in second.curves]
    assert first.complete and second.complete
