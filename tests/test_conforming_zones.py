"""How wide zones along singular curves are, how their ribbons are divided, and how tetrahedra split: against theory."""

from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from implicit import Ball, Surface
from implicit.polygonizers.conforming.curves import ribbon, stretch
from implicit.polygonizers.conforming.curves.rim import Rim
from implicit.polygonizers.conforming.curves.ring import Circle, Circles
from implicit.polygonizers.conforming.curves.stations import _smooth
from implicit.polygonizers.conforming.curves.zone import ZoneRim, Zones
from implicit.polygonizers.conforming.grid import Grid
from implicit.polygonizers.conforming.local import Local, frame, pairs_of
from implicit.polygonizers.conforming.tetrahedra import cavity as cavity_room
from implicit.polygonizers.conforming.tetrahedra.cavity import Cavity, _holding, _replace, _volume, dead_vertices
from implicit.polygonizers.conforming.tetrahedra.refine import _shake
from implicit.polygonizers.conforming.tetrahedra.region import build_region, cells_round
from implicit.polygonizers.conforming.tetrahedra.sheets import find_roots

Floats = NDArray[np.float64]
SIZE = np.array([14, 12, 13])


def _local(formula: str, resolution: int = 64) -> Local:
    return Local(Surface(formula).field, Grid.over(Ball(1), resolution, 9), ())


def _radius(local: Local) -> float:
    """The radius of a zone round the z axis at the origin."""
    middle = local.grid.to_units(np.zeros((1, 3)))[0]
    circle = Circle(middle, *frame(np.array([0.0, 0, 1])), stretch._LEAST_RADIUS)
    return float(stretch._clear_of_cells(local, Circles.of([circle]))[0][0])


@pytest.mark.parametrize("slope", [0.2, 0.25, 0.4, 0.7, 1.0])
def test_zones_end_where_straight_sheets_are_a_gap_apart(slope: float) -> None:
    radius = _radius(_local(f"x^2 - {slope}^2*y^2"))
    angle = min(2 * np.arctan(slope), np.pi / 2)
    assert radius * np.sin(angle) == pytest.approx(max(stretch._GAP, stretch._LEAST_RADIUS * np.sin(angle)), rel=0.01)


@pytest.mark.parametrize("resolution", [40, 64, 256, 512])
def test_zones_end_where_the_sheets_of_a_cusp_are_a_gap_apart(resolution: int) -> None:
    """x^2 = y^3 is x^2 = h y^3 in cells of side h: where r^2 = x^2 + y^2 its sheets are 2 h^(1/2) y^(3/2) apart."""
    radius = _radius(_local("x^2 - y^3", resolution))
    y = np.linspace(0, radius, 100_000)
    x = np.sqrt(2 / resolution * y**3)
    row = np.searchsorted(np.hypot(x, y), radius)
    assert radius * np.sin(2 * np.arctan2(x[row], y[row])) == pytest.approx(stretch._GAP, rel=0.03)


def test_sheets_that_stay_too_near_have_no_zone() -> None:
    assert _radius(_local("x^2 - y^2/1000")) == np.inf


@given(st.lists(st.floats(0.2, 0.9), min_size=3, max_size=20), st.floats(1.3, 7), st.floats(0.2, 0.9))
def test_ribbons_are_halved_until_their_spokes_are_short(steps: list[float], width: float, gap: float) -> None:
    """Of a flat strip between a line and a rim: area and boundary stay, each side has its two triangles."""
    local = _local("z", 32)
    zone_rim = ZoneRim(Zones([]), local)
    s = np.append(0.0, np.cumsum(steps))
    t = np.linspace(0, s[-1], int(np.ceil(s[-1] / gap)) + 1)
    line, edge = (np.column_stack([a, np.full(len(a), y), 0 * a]) for a, y in ((s, 0.0), (t, width)))
    vertices = local.grid.step * np.concatenate([line, edge])
    outer = Rim(0, len(s) + np.arange(len(t)), t, False)
    strip = ribbon._zip(outer, np.arange(len(s)), s)
    sides = np.column_stack([outer.names[:-1], outer.names[1:]])
    on = np.arange(len(vertices)) < len(s)
    places, _, faces = ribbon._halved(zone_rim, (vertices, np.zeros_like(vertices), strip), on, sides)
    uses = Counter(map(tuple, np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).tolist()))
    alone = {side for side, count in uses.items() if count == 1}
    assert set(uses.values()) <= {1, 2}
    along = {(int(a), int(b)) for a, b in [*sides.tolist(), *zip(range(len(s) - 1), range(1, len(s)))]}
    assert along <= alone
    a, b, c = places[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(width * s[-1] * local.grid.step**2)
    spokes = [side for side in uses if (side[0] < len(s)) != (side[1] < len(s))]
    ends = places[np.array(spokes)]
    assert (np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) <= ribbon._WIDE * zone_rim.cell * (1 + 1e-9)).all()


@given(st.lists(st.tuples(st.floats(1e-3, 1), st.floats(1e-3, 2)), min_size=1, max_size=30))
def test_sizes_are_the_largest_that_change_so_slowly(pairs: list[tuple[float, float]]) -> None:
    h, steps = np.array(pairs).T
    s = np.cumsum(steps)
    naive = (h + 0.4 * np.abs(s[:, None] - s)).min(axis=1)
    assert _smooth(h, s) == pytest.approx(naive, abs=1e-12)


def test_spheres_that_hold_a_point_are_those_with_one_nearer_to_the_centre_than_the_corners() -> None:
    rng = np.random.default_rng(0)
    places = rng.uniform(0, 10, (300, 3))
    tetrahedra = np.array([rng.choice(250, 4, replace=False) for _ in range(500)])
    first, rest = places[tetrahedra[:, 0]], places[tetrahedra[:, 1:]]
    squares = (rest**2).sum(axis=2) - (first**2).sum(axis=1)[:, None]
    center = np.linalg.solve(2 * (rest - first[:, None]), squares[..., None])[..., 0]
    radius = np.linalg.norm(first - center, axis=1)
    points = places[250:]
    naive = np.linalg.norm(center[:, None] - points, axis=2).min(axis=1) < radius
    assert (_holding(places, tetrahedra, points) == naive).all()
    assert not _holding(places, tetrahedra, points[:0]).any()


def test_where_flat_tetrahedra_hinder_a_fit_those_around_are_replaced_and_not_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Vertices of a square lattice in a plane, but for rounding: always four on a circle."""
    rng = np.random.default_rng(0)
    along = np.linspace(-1.5, 1.5, 9)
    new = np.array([7.0, 6.0, 6.5]) + np.stack(np.meshgrid(along, along, [0.0]), axis=-1).reshape(-1, 3)
    new = rng.permutation(new) + 1e-12 * rng.normal(size=new.shape) * [0, 0, 1]
    region = build_region(cells_round(new, 2, SIZE), SIZE)
    tried = []

    def replace(places: Floats, gone: NDArray[np.int64], *rest: Any) -> tuple[NDArray[np.int64], bool]:
        found = _replace(places, gone, *rest)
        tried.append((len(gone), found[1]))
        return found

    monkeypatch.setattr(cavity_room, "_replace", replace)
    cavity = Cavity()
    for count in range(12, len(new) + 1, 6):
        stay, fresh, _, fits = cavity.fill(region, dead_vertices(region, np.zeros((0, 4)), new[:count]), new[:count])
        assert fits
    whole = _volume(np.concatenate([region.places, new])[np.concatenate([stay, fresh])]).sum()
    assert np.isclose(whole, _volume(region.places[region.tetrahedra]).sum())
    assert not all(fits for _, fits in tried)
    assert max(gone for gone, _ in tried) < len(region.tetrahedra) / 2


def test_a_vertex_on_an_edge_splits_it() -> None:
    """However short an edge is beside the others of its tetrahedra: the vertex moves along it alone."""
    rng = np.random.default_rng(4)
    first = np.array([6.0, 6, 6]) + rng.uniform(-1, 1, (6, 3))
    new = np.concatenate([first, first + 1e-4 * rng.normal(size=(6, 3))])
    region = build_region(cells_round(new, 2, SIZE), SIZE)
    cavity, none = Cavity(), np.zeros((0, 4))
    dead = dead_vertices(region, none, new)
    fresh = cavity.fill(region, dead, new)[1]
    places = np.concatenate([region.places, new])
    edges = pairs_of(fresh)
    length = np.linalg.norm(places[edges[:, 1]] - places[edges[:, 0]], axis=1)
    edges = edges[np.argsort(length)[:6]]
    ways = (places[edges[:, 1]] - places[edges[:, 0]]) / np.sort(length)[:6, None]
    middles = places[edges].mean(axis=1) + 0.02 * np.sort(length)[:6, None] * _shake(ways, rng)
    after = np.concatenate([new, middles])
    fresh, fits = (cavity.fill(region, dead | dead_vertices(region, none, middles), after)[k] for k in (1, 3))
    assert fits
    assert not set(map(tuple, edges.tolist())) & set(map(tuple, pairs_of(fresh).tolist()))


@pytest.mark.parametrize("power", [1, 3, 5])
def test_roots_on_edges_are_as_near_as_rounding_lets_them(power: int) -> None:
    """Of (x - 1/7)^power (x^2 + 1), where f is rounding alone at a distance of its power-th root."""
    local = _local(f"(x - 1/7)^{power}*(x^2 + 1)")
    rng = np.random.default_rng(power)
    a, b = rng.uniform(-0.9, 0.1, (20, 3)), rng.uniform(0.2, 0.9, (20, 3))
    found = local.grid.to_points(find_roots(local, local.grid.to_units(a), local.grid.to_units(b)))
    assert np.abs(found[:, 0] - 1 / 7).max() < 10 * np.finfo(float).eps ** (1 / power)
