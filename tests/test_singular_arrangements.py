"""Planes are singular along the lines where they meet: all of them are found, whatever their directions."""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from implicit import Ball, Box, Surface, polygonize, singularities
from implicit.topology import find_edges

Plane = tuple[Fraction, Fraction, Fraction, Fraction]
Line = tuple[NDArray[np.float64], NDArray[np.float64]]

NORMALS = st.tuples(*[st.integers(-3, 3)] * 3).filter(any)
HALF = 2.017


def plane(normal: tuple[int, ...], offset: int) -> Plane:
    """a x + b y + c z = d with the first coefficient that is not 0 made 1, so that equal planes are equal."""
    lead = next(n for n in normal if n)
    a, b, c, d = (Fraction(n, lead) for n in (*normal, offset))
    return a, b, c, d


def meeting(p: Plane, q: Plane) -> Line | None:
    """A point and the direction of the line where two planes meet, if it passes through the box of half side HALF."""
    rows = np.array([p, q], dtype=float)
    way = np.cross(rows[0, :3], rows[1, :3])
    if not way.any():
        return None
    way /= np.linalg.norm(way)
    point = np.linalg.solve([*rows[:, :3], way], [*rows[:, 3], 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort([(-HALF - point) / way, (HALF - point) / way], axis=0)
    still = way == 0
    inside = (np.abs(point[still]) < HALF).all() and ends[0, ~still].max() < ends[1, ~still].min() - 1e-6
    return (point, way) if inside else None


def lies_on(line: Line, polyline: NDArray[np.float64]) -> bool:
    """Whether all vertices are on the line."""
    return bool(np.linalg.norm(np.cross(polyline - line[0], line[1]), axis=1).max() < 1e-6)


def assert_all_found(planes: list[Plane]) -> None:
    """The curves of the product of the planes are the lines where two of them meet, no more and no less."""
    formula = "*".join(f"({a}*x + {b}*y + {c}*z - {d})" for a, b, c, d in planes)
    locus = singularities(Surface(formula), HALF)
    lines = [line for line in (meeting(p, q) for p, q in combinations(planes, 2)) if line is not None]
    assert locus.complete and not locus.points
    curves = [curve.polyline for curve in locus.curves]
    assert all(any(lies_on(line, curve) for curve in curves) for line in lines), formula
    assert all(any(lies_on(line, curve) for line in lines) for curve in curves), formula


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(NORMALS, st.integers(-1, 1)), min_size=2, max_size=4))
def test_random_planes(several: list[tuple[tuple[int, ...], int]]) -> None:
    assert_all_found(sorted({plane(normal, offset) for normal, offset in several}))


@pytest.mark.parametrize(
    "normals",
    [
        [(1, -1, 0), (1, 1, 0), (1, 0, -1), (0, 1, -1)],
        [(1, -1, 0), (1, 1, 0), (1, 0, -2), (0, 1, -3)],
        [(1, -1, 0), (1, 1, 0), (1, 0, -1), (1, 0, 1), (0, 1, -1), (0, 1, 1)],
    ],
)
def test_mirrors_of_a_tetrahedron_and_others_through_one_point(normals: list[tuple[int, ...]]) -> None:
    assert_all_found([plane(normal, 0) for normal in normals])


def test_the_mesh_of_four_planes_through_one_point_has_all_of_them() -> None:
    mesh = polygonize(Surface("(x - y)(x + y)(x - 2z)(y - 3z)"), 1.03, resolution=24)
    sides = 2.06**2 * np.array([np.sqrt(2), np.sqrt(2), np.sqrt(1.25), np.sqrt(1 + 1 / 9)])
    assert mesh.area == pytest.approx(sides.sum(), rel=1e-6) and len(mesh.points) == 1


@pytest.mark.parametrize("half", [1, 1.03])
@pytest.mark.parametrize(
    ("formula", "area"),
    [
        ("(x - y)(x + y)(x - z)", 12 * 2**0.5),
        ("x y (z - x)", 8 + 4 * 2**0.5),
        ("(x - y)(x + y)(x - z)(y - z)", 16 * 2**0.5),
    ],
)
def test_lines_may_leave_a_cube_through_its_edges_and_corners(formula: str, area: float, half: float) -> None:
    mesh = polygonize(Surface(formula), half, resolution=24)
    assert mesh.unresolved is not None and not len(mesh.unresolved)
    assert mesh.area == pytest.approx(area * half**2, rel=1e-6) and mesh.euler == 1


def test_lines_may_run_along_an_edge_of_the_bounds() -> None:
    mesh = polygonize(Surface("(x - 1)(y - 1)"), 1, resolution=24)
    assert mesh.unresolved is not None and not len(mesh.unresolved)
    assert mesh.area == pytest.approx(8, rel=1e-9) and mesh.euler == 1
    assert len(mesh.curves) == 1 and np.allclose(mesh.vertices[mesh.curves[0]][:, :2], 1, atol=1e-12)


def test_a_curved_cuspidal_edge_may_leave_through_an_edge_of_the_bounds() -> None:
    mesh = polygonize(Surface("(y - x^2)^2 = z^3"), 1, resolution=32)
    assert mesh.unresolved is not None and not len(mesh.unresolved) and mesh.euler == 1


@pytest.mark.parametrize(
    ("formula", "ball", "cells"),
    [
        ("x y z", Ball(0.5, (0.3, 0.5, 0.3)), 16),
        ("(x - y)(x + y)(x - z)", Ball(0.5, (0, 0, -1)), 16),
        ("(x - y)(x + y)(x - z)", Ball(1, (-1, -1, 0)), 25),
        ("(x - y)(x + y)(x - z)", Ball(1, (0.5, 0.5, -1)), 25),
    ],
)
def test_lines_may_meet_just_outside_the_bounds(formula: str, ball: Ball, cells: int) -> None:
    """The discs in which the planes meet the ball; their lines meet a few cells beyond."""
    normals = np.eye(3) if formula == "x y z" else np.array([(1, -1, 0), (1, 1, 0), (1, 0, -1)]) / np.sqrt(2)
    discs = np.pi * (ball.radius**2 - (normals @ ball.center) ** 2)
    mesh = polygonize(Surface(formula), ball, resolution=cells)
    assert mesh.unresolved is not None and not len(mesh.unresolved) and not mesh.report().degenerate_faces
    assert mesh.area == pytest.approx(discs[discs > 0].sum(), rel=0.02)


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(["x^2 + y^2 = z^2", "x^2 = y^2 z", "x^2 + y^2 + z^3", "(x^2 + y^2 - z^2)(z - 0.5)", "x^2 = y^3"]),
    *[st.tuples(*[st.sampled_from(ends)] * 3) for ends in ([-1.5, -1, -0.5, -1.03], [0.5, 1, 1.5, 1.11])],
    st.sampled_from([16, 20, 25]),
)
def test_cut_at_any_box_there_is_no_face_without_area_and_no_rim_inside(
    formula: str, lower: tuple[float, ...], upper: tuple[float, ...], cells: int
) -> None:
    surface, bounds = Surface(formula), Box(lower, upper)
    mesh = polygonize(surface, bounds, resolution=cells)
    assert mesh.unresolved is not None and not len(mesh.unresolved) and not mesh.report().degenerate_faces
    edges = find_edges(mesh.faces, len(mesh.vertices))
    rim = np.unique(np.stack(np.divmod(edges.keys[edges.uses == 1], edges.size)))
    rim = np.setdiff1d(rim, np.concatenate([mesh.points, *mesh.curves]))
    corners = bounds.corners
    assert bounds.contains(mesh.vertices).all()
    assert (np.minimum(mesh.vertices[rim] - corners[0], corners[1] - mesh.vertices[rim]).min(axis=1) == 0).all()
