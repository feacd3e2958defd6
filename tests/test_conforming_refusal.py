"""A singular set that is wrong or incomplete is never passed off as right."""

import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from implicit.mesh import Mesh
from implicit.polygonizers.conforming import conforming
from implicit.singular import SingularCurve, SingularLocus, SingularPoint
from tests.singular_cases import case_of, topology, truth_of

Floats = NDArray[np.float64]


def _line(direction: tuple[float, ...], special: tuple[tuple[float, ...], ...] = ()) -> SingularCurve:
    nodes = np.linspace(-3, 3, 601)[:, None] * np.array(direction)
    return SingularCurve(nodes, False, None, np.array(special, float).reshape(-1, 3))


def _locus(points: tuple[tuple[float, ...], ...] = (), curves: tuple[SingularCurve, ...] = ()) -> SingularLocus:
    return SingularLocus(tuple(SingularPoint(np.array(p, float)) for p in points), curves, np.zeros((0, 2, 3)), True)


def _refused(mesh: Mesh) -> bool:
    return mesh.unresolved is not None and len(mesh.unresolved) > 0


X, Y, Z, O = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)  # noqa: E741
WRONG = {
    "A2": _locus(),
    "A3m": _locus(),
    "source_2_intended": _locus(),
    "cayley": _locus(((1, -1, -1), (-1, 1, -1), (-1, -1, 1))),
    "whitney": _locus(curves=(_line(Z),)),
    "cuspidal_edge": _locus(),
    "source_2_printed": _locus(),
    "three_planes": _locus(curves=(_line(X, (O,)), _line(Y, (O,)))),
}


@pytest.mark.parametrize("name", WRONG)
def test_points_or_curves_that_are_missing_are_noticed(name: str) -> None:
    surface, ball = case_of(name)
    assert _refused(conforming(surface, ball, 24, WRONG[name]))


def test_a_right_locus_is_accepted() -> None:
    surface, ball = case_of("whitney")
    mesh = conforming(surface, ball, 24, _locus(curves=(_line(Z, (O,)),)))
    assert not _refused(mesh)
    found = topology(mesh)
    assert found.pop("crowded") == 0
    assert found == truth_of("whitney")


@pytest.mark.parametrize("seed", range(6))
def test_displaced_points_are_noticed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    surface, ball = case_of("double_cone")
    away = rng.normal(size=3)
    away *= 10.0 ** rng.uniform(-5, -1) / np.linalg.norm(away)
    assert _refused(conforming(surface, ball, 20, _locus((tuple(away),))))


@pytest.mark.parametrize("away", [(0.05, 0.08, 0.0), (-0.02, -0.06, 0.07), (0.4, 0.3, 0.0)])
def test_curves_that_are_far_from_the_singular_set_are_refused(away: tuple[float, ...]) -> None:
    surface, ball = case_of("cuspidal_edge")
    edge = _line(Z)
    assert _refused(conforming(surface, ball, 24, _locus(curves=(replace(edge, polyline=edge.polyline + away),))))


def test_nodes_that_are_given_twice_do_no_harm() -> None:
    surface, ball = case_of("whitney")
    handle = _line(Z, (O,))
    mesh = conforming(surface, ball, 20, _locus(curves=(replace(handle, polyline=handle.polyline.repeat(2, axis=0)),)))
    found = topology(mesh)
    assert not _refused(mesh)
    assert found.pop("crowded") == 0 and found == truth_of("whitney")


def _part(curve: SingularCurve, first: int, last: int) -> SingularCurve:
    return replace(curve, polyline=curve.polyline[first:last])


HANDLE = _line(Z, (O,))
TWICE = {
    "the same": (HANDLE, HANDLE),
    "reversed": (HANDLE, replace(HANDLE, polyline=HANDLE.polyline[::-1])),
    "a part": (_part(HANDLE, 250, 400), HANDLE),
    "other nodes": (HANDLE, replace(HANDLE, polyline=np.linspace(-3, 3, 487)[:, None] * np.array(Z))),
    "there and back": (replace(HANDLE, polyline=np.concatenate([HANDLE.polyline, HANDLE.polyline[-2::-1]])),),
}


@pytest.mark.parametrize("how", TWICE)
def test_curves_that_are_given_twice_do_no_harm(how: str) -> None:
    surface, ball = case_of("whitney")
    mesh = conforming(surface, ball, 20, _locus(curves=TWICE[how]))
    found = topology(mesh)
    assert not _refused(mesh)
    assert found.pop("crowded") == 0 and found == truth_of("whitney")


@pytest.mark.parametrize("points", [(O, O), (O,)])
def test_points_that_are_given_twice_do_no_harm(points: tuple[tuple[float, ...], ...]) -> None:
    for name, curves in (("whitney", (HANDLE,)), ("double_cone", ())):
        surface, ball = case_of(name)
        mesh = conforming(surface, ball, 20, _locus((O, *points), curves))
        found = topology(mesh)
        assert not _refused(mesh)
        assert found.pop("crowded") == 0 and found == truth_of(name)


EDGE = _line(Z)
UNCLEAR = {
    "overlap": (_part(EDGE, 0, 400), _part(EDGE, 250, 601)),
    "short overlap": (_part(EDGE, 0, 303), _part(EDGE, 300, 601)),
    "near": (EDGE, replace(EDGE, polyline=EDGE.polyline + (1e-5, 0, 0))),
    "beside": (EDGE, replace(EDGE, polyline=EDGE.polyline + (5e-3, 0, 0))),
}


@pytest.mark.parametrize("how", UNCLEAR)
def test_curves_that_nearly_repeat_others_are_refused_soon(how: str) -> None:
    surface, ball = case_of("cuspidal_edge")
    start = time.process_time()
    assert _refused(conforming(surface, ball, 20, _locus(curves=UNCLEAR[how])))
    assert time.process_time() - start < 30


@pytest.mark.parametrize("near", [(0, 0, 1e-4), (1e-4, 0, 0), (0, 1e-6, 1e-6)])
def test_points_that_nearly_repeat_others_are_refused_soon(near: tuple[float, ...]) -> None:
    start = time.process_time()
    for name, curves in (("whitney", (HANDLE,)), ("double_cone", ())):
        surface, ball = case_of(name)
        assert _refused(conforming(surface, ball, 20, _locus((O, near), curves)))
    assert time.process_time() - start < 30
