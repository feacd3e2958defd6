"""Ribbons along singular curves: against tetrahedra, round curves whose sheets change places, and part by part."""

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from implicit import Ball, Mesh, Surface
from implicit.polygonizers.conforming import conforming, neighbourhood
from implicit.polygonizers.conforming.curves import ribbon
from implicit.polygonizers.conforming.curves.arc import Arc
from implicit.polygonizers.conforming.curves.rim import Ragged, Rim, _chains, fault
from implicit.polygonizers.conforming.curves.stations import Stations
from implicit.polygonizers.conforming.curves.zone import Stretch, ZoneRim, Zones
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local
from tests.benchmarks.conforming_sweep import verdict
from tests.singular_cases import case_of, residual, topology, truth_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

EXCHANGED = Surface("2*x*z*(x^2+y^2-1) - y*((x^2+y^2-1)^2 - z^2)")
"""Four sheets along the circle x^2 + y^2 = 1 that make half a turn round it: each continues the one opposite."""
LENS = st.lists(st.floats(0.1, 1.5), min_size=2, max_size=30)


def _along(mesh: Mesh) -> tuple[Counter[int], Counter[int]]:
    """How many faces edges of the mesh have: those of its curves, and the others."""
    sides = np.sort(np.concatenate([mesh.faces[:, (0, 1)], mesh.faces[:, (1, 2)], mesh.faces[:, (2, 0)]]), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    curves = {(min(p), max(p)) for curve in mesh.curves for p in zip(curve[:-1].tolist(), curve[1:].tolist())}
    on = [tuple(edge) in curves for edge in edges.tolist()]
    return Counter(uses[on].tolist()), Counter(uses[np.invert(on)].tolist())


@pytest.mark.parametrize("resolution", [41, 64])
@pytest.mark.parametrize(
    "name", ["two_spheres_crossing", "source_2_printed", "three_planes", "whitney", "cuspidal_edge"]
)
def test_ribbons_and_tetrahedra_agree(name: str, resolution: int, monkeypatch: pytest.MonkeyPatch) -> None:
    surface, ball = case_of(name)
    found: list[Any] = []
    find = neighbourhood.find_stretches
    monkeypatch.setattr(neighbourhood, "find_stretches", lambda *args: found.append(find(*args)) or found[-1])
    quick = conforming(surface, ball, resolution)
    monkeypatch.setattr(neighbourhood, "find_stretches", lambda *_: [])
    slow = conforming(surface, ball, resolution)
    assert any(found)
    for mesh in (quick, slow):
        shape = topology(mesh)
        assert not len(mesh.unresolved) and shape.pop("crowded") == 0 and shape == truth_of(name)  # type: ignore[arg-type]
        assert residual(surface, mesh) < 1e-10 * ball.radius


@pytest.mark.parametrize("resolution", [24, 41])
def test_sheets_may_change_places_round_a_closed_curve(resolution: int) -> None:
    mesh = conforming(EXCHANGED, Ball(1.5), resolution)
    on, off = _along(mesh)
    assert not len(mesh.unresolved)  # type: ignore[arg-type]
    assert set(on) == {4} and set(off) == {1, 2}
    sides = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, uses = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    ends = mesh.vertices[edges[uses == 1]]
    assert np.linalg.norm(ends, axis=-1) == pytest.approx(1.5)
    assert residual(EXCHANGED, mesh) < 1e-10


def test_where_ribbons_do_not_fit_there_are_tetrahedra(monkeypatch: pytest.MonkeyPatch) -> None:
    surface, ball = case_of("two_spheres_crossing")

    def ragged(*_: Any) -> Any:
        raise Ragged(0, "as if")

    monkeypatch.setattr(ribbon, "find_rims", ragged)
    mesh = conforming(surface, ball, 32)
    shape = topology(mesh)
    assert not len(mesh.unresolved)  # type: ignore[arg-type]
    assert shape.pop("crowded") == 0 and shape == truth_of("two_spheres_crossing")


@given(LENS, LENS, st.booleans(), st.booleans())
def test_a_strip_uses_each_edge_once(rim: list[float], curve: list[float], start: bool, end: bool) -> None:
    outer, inner = (np.append(0.0, np.cumsum(steps)) for steps in (rim, curve))
    outer *= inner[-1] / outer[-1]
    names = np.arange(len(inner))
    others = 100 + np.arange(len(outer))
    others[0], others[-1] = (0 if start else others[0]), (names[-1] if end else others[-1])
    strip = ribbon._zip(Rim(0, others, outer, False), names, inner)
    sides = Counter(map(tuple, strip[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    assert set(sides.values()) == {1}
    open_sides = {(a, b) for a, b in sides if (b, a) not in sides}
    wanted = set(zip(names[:-1].tolist(), names[1:].tolist())) | set(zip(others[1:].tolist(), others[:-1].tolist()))
    if not start:
        wanted.add((int(others[0]), 0))
    if not end:
        wanted.add((int(names[-1]), int(others[-1])))
    assert open_sides == wanted
    flat = [set(triangle) <= set(names.tolist()) for triangle in strip.tolist()]
    assert not any(flat) or len(names) == 2  # else a triangle would lie in the curve


@given(st.lists(st.integers(2, 9), min_size=1, max_size=5), st.randoms())
def test_edges_are_put_one_behind_the_other(sizes: list[int], random: Any) -> None:
    edges, first, paths = [], 2, []
    for kind, size in enumerate(sizes):
        path = list(range(first, first + size))
        first += size
        if kind % 3 == 0:
            path = [0, *path, 1]  # between two stops
        elif kind % 3 == 1 and size > 2:
            path.append(path[0])  # round
        paths.append(path)
        edges += pairwise(path)
    random.shuffle(edges)
    stops = np.zeros(first, bool)
    stops[:2] = True
    chains = [chain.tolist() for chain in _chains(np.array(edges), stops)]

    def steps(found: list[list[int]]) -> list[list[tuple[int, int]]]:
        return sorted(sorted(pairwise(path)) for path in found)

    assert steps(chains) == steps(paths)


def _stretch(lengths: Floats, opened: tuple[bool, bool]) -> Stretch:
    turn = lengths / 30
    places = 15 + 30 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) - np.array([30, 0, 0])
    local = Local(Surface("x^2 - y^2").field, Grid.over(Ball(1), 32, 6), ())
    course = Stations(0, Arc(local, places, False, -1, -1, 0), places, np.ones(len(places)), None, None, True)
    s = course.lengths
    far = np.full(len(s), np.inf)
    pointed = np.minimum(far if opened[0] else s, far if opened[1] else s[-1] - s)
    return Stretch(course, 0, course.last, 4, np.minimum(1.8, pointed), opened, (0, course.last))


@given(st.tuples(st.booleans(), st.booleans()), st.integers(0, 10**6))
@example((True, False), 504)
def test_zones_begin_in_a_station_and_are_as_wide_as_they_say(opened: tuple[bool, bool], seed: int) -> None:
    stretch = _stretch(np.linspace(0, 12, 21), opened)
    zones = Zones([stretch])
    ends = zones.depth(stretch.places[[0, -1]])
    assert ends == pytest.approx([1.8 if free else 0.0 for free in opened], abs=0)
    rng = np.random.default_rng(seed)
    a = rng.uniform(8, 28, (50, 3))
    b = a + rng.normal(size=(50, 3)) * 0.2
    assert (np.abs(zones.depth(a) - zones.depth(b)) <= 1.6 * np.linalg.norm(a - b, axis=1) + 1e-9).all()
    nearest = np.linalg.norm(a[:, None] - stretch.places, axis=2).min(axis=1)
    inside = zones.depth(a) > 0
    assert (nearest[inside] < 1.9).all()
    assert not inside[nearest > 1.9].any()


def test_rims_that_do_not_fit_a_stretch_are_named() -> None:
    stretch = _stretch(np.linspace(0, 12, 21), (True, False))
    curve = np.arange(21)
    ends = stretch.lengths[[0, -1]]
    good = [Rim(0, np.array([50 + k, 20]), ends, False) for k in range(4)]
    assert not fault(stretch, good, curve)
    assert fault(stretch, good[:3], curve) == "3 rims of 4 sheets"
    assert fault(stretch, [*good[:3], Rim(0, np.array([60, 20]), ends + [2, 0], False)], curve) == "rims end too early"
    assert fault(stretch, [*good[:3], Rim(0, np.array([60, 61]), ends, False)], curve) == "rims end beside the curve"


def test_ribbons_with_vertices_off_the_surface_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    surface, ball = case_of("two_spheres_crossing")
    onto = ZoneRim.onto

    def beside(self: ZoneRim, points: Floats) -> tuple[Floats, Floats]:
        places, normals = onto(self, points)
        return places + 1e-3 * self.cell * normals, normals

    monkeypatch.setattr(ZoneRim, "onto", beside)
    assert residual(surface, conforming(surface, ball, 32)) < 1e-10 * ball.radius


@pytest.mark.parametrize("seed", [1, 7])
def test_vertices_on_the_curve_stay_where_they_are(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rims end in vertices of the curve, which are no more moved than the others."""
    before: list[NDArray[np.float64]] = []

    def laid(local: Local, mesh: Any, hood: Any, numbers: Any, fixed: Any) -> Any:
        before.append(mesh[0][: len(fixed)][fixed])
        result = ribbon.lay_ribbons(local, mesh, hood, numbers, fixed)
        assert np.array_equal(result[0][: len(fixed)][fixed], before[-1])
        return result

    monkeypatch.setattr("implicit.polygonizers.conforming.draw.lay_ribbons", laid)
    assert verdict("steiner", 40, seed) == "right" and before
