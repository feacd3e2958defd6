"""Marching cubes: closed, manifold, on the surface, the same as a plain dense sweep, and the same for any workers."""

from functools import partial
from itertools import product

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import implicit
from implicit import Ball, Box, Surface, x, y, z
from implicit.domain import to_bounds
from implicit.mesh import Mesh
from implicit.polygonizers.lattice import Lattice, in_order
from implicit.polygonizers.marching import march
from implicit.polygonizers.samples import choose_sampler
from implicit.polygonizers.tapes import _find_bricks, _find_leaves
from implicit.polygonizers.weld import weld
from implicit.topology import find_edges
from implicit.work import Job

polygonize = partial(implicit.polygonize, method="marching")

SPHERE = Surface("x^2 + y^2 + z^2 = 1")
TORUS = Surface("(x^2 + y^2 + z^2 + 1 - 0.16)^2 = 4 (x^2 + y^2)")
GENUS2 = Surface("2 y (y^2 - 3 x^2) (1 - z^2) + (x^2 + y^2)^2 = (9 z^2 - 1) (1 - z^2)")
TANGLE = Surface("x^4 - 5 x^2 + y^4 - 5 y^2 + z^4 - 5 z^2 + 11.8")
CAYLEY = Surface("4 x y z + x^2 + y^2 + z^2 = 1")
GYROID = Surface("sin(2 pi x) cos(2 pi y) + sin(2 pi y) cos(2 pi z) + sin(2 pi z) cos(2 pi x)")
BALLS = Surface("min(sqrt((x - 0.4)^2 + y^2 + z^2) - 0.5, abs(x + 0.5) + abs(y) + abs(z) - 0.4)")
BOUNDED = {
    "sphere": (SPHERE, 1.3, 2),
    "torus": (TORUS, 1.6, 0),
    "genus 2": (GENUS2, 2, -2),
    "tangle": (TANGLE, 2.7, -8),
}


def boundary(mesh):
    """The vertices on boundary edges."""
    size = len(mesh.vertices)
    edges = find_edges(mesh.faces, size)
    keys = edges.keys[edges.uses == 1]
    return mesh.vertices[np.unique(np.concatenate([keys // size, keys % size]))]


def distances(surface, mesh):
    """|f| / |grad f| at the vertices."""
    values, slopes = surface.field.gradients(mesh.vertices)
    return np.abs(values) / np.linalg.norm(slopes, axis=1)


def crossings(surface, half, cells):
    """How many vertices the sweep makes, before those at one lattice point are joined."""
    sampler = choose_sampler(surface, Lattice.over(to_bounds(half), cells))
    return len(march(sampler, Job(len(sampler.bricks))).vertices)


def dense(surface, half, cells):
    """How many lattice edges have ends of different sign, from all samples."""
    axis = np.linspace(-half, half, cells + 1)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    inside = surface.field.values(grid.reshape(-1, 3)).reshape(grid.shape[:3]) < 0
    return sum(np.count_nonzero(np.diff(inside, axis=a)) for a in range(3))


@pytest.mark.parametrize("name", BOUNDED)
@pytest.mark.parametrize("cells", [23, 64])
def test_closed_manifold_with_the_right_characteristic(name, cells):
    surface, half, euler = BOUNDED[name]
    mesh = polygonize(surface, half, resolution=cells)
    report = mesh.report()
    assert report.closed and report.manifold and report.oriented and report.degenerate_faces == 0
    assert report.euler == euler and mesh.volume > 0
    assert distances(surface, mesh).max() < 1e-10 * 2 * half
    exact = surface.field.gradients(mesh.vertices)[1]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert np.abs(mesh.normals - exact).max() < 1e-6


def test_volume_and_area_of_the_ball_converge_with_order_two():
    meshes = [polygonize(SPHERE, 1.3, resolution=n) for n in (16, 32, 64)]
    volume = np.array([4 * np.pi / 3 - mesh.volume for mesh in meshes])
    area = np.array([4 * np.pi - mesh.area for mesh in meshes])
    assert np.all(volume > 0) and np.all(area > 0)
    assert np.all(np.log2(volume[:-1] / volume[1:]) > 1.8) and np.all(np.log2(area[:-1] / area[1:]) > 1.6)


@settings(max_examples=20, deadline=None)
@given(
    st.tuples(*[st.floats(-0.2, 0.2)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 4),
    st.sampled_from([(SPHERE, 2), (TORUS, 0)]),
)
def test_closed_at_every_offset_and_rotation(offset, quaternion, case):
    surface, euler = case
    q = np.array(quaternion) + [1.5, 0, 0, 0]
    w, a, b, c = q / np.linalg.norm(q)
    turn = np.array(
        [
            [1 - 2 * (b * b + c * c), 2 * (a * b - c * w), 2 * (a * c + b * w)],
            [2 * (a * b + c * w), 1 - 2 * (a * a + c * c), 2 * (b * c - a * w)],
            [2 * (a * c - b * w), 2 * (b * c + a * w), 1 - 2 * (a * a + b * b)],
        ]
    )
    moved = sp.Matrix(turn) * sp.Matrix([x, y, z]) + sp.Matrix(offset)
    shifted = Surface(surface.expression.subs(dict(zip((x, y, z), moved, strict=True)), simultaneous=True))
    mesh = polygonize(shifted, 1.9, resolution=20)
    report = mesh.report()
    assert report.closed and report.manifold and report.oriented and report.euler == euler and mesh.volume > 0


@settings(max_examples=25, deadline=None)
@given(npst.arrays(np.int8, st.tuples(*[st.integers(2, 10)] * 3), elements=st.integers(-1, 1)))
def test_every_field_of_signs_gives_a_closed_manifold(signs):
    """Zeros on lattice points included: a field is known by its values on the lattice, outside all around."""
    size = np.array(signs.shape) + 1

    class Field:
        def values(self, points):
            index = np.rint(points).astype(int)
            inner = np.all((index >= 1) & (index <= signs.shape), axis=1)
            return np.where(inner, signs[tuple((np.clip(index, 1, signs.shape) - 1).T)], 1).astype(float)

        def gradients(self, points):
            low = np.floor(points).astype(int)
            share = points - low
            value, slope = np.zeros(len(points)), np.zeros((len(points), 3))
            for corner in product((0, 1), repeat=3):
                weight = np.where(corner, share, 1 - share)
                f = self.values(low + np.array(corner))
                value += f * weight.prod(axis=1)
                for axis in range(3):
                    rest = np.delete(weight, axis, axis=1).prod(axis=1)
                    slope[:, axis] += f * rest * (1 if corner[axis] else -1)
            return value, slope

        def ranges(self, boxes):
            return np.tile([-np.inf, np.inf], (len(boxes), 1))

    class Lookup:
        field = Field()

    axes = [np.arange(n + 1.0) for n in size]
    lattice = Lattice(tuple(axes))
    mesh = polygonize_lattice(Lookup(), lattice)
    report = mesh.report()
    if (signs < 0).any():
        assert report.closed and report.manifold and report.oriented and mesh.volume >= 0
    else:
        assert report.empty


def polygonize_lattice(surface, lattice):
    """The marching part of `polygonize` over a given lattice."""
    sampler = choose_sampler(surface, lattice)
    marched = march(sampler, Job(len(sampler.bricks)))
    vertices, _, faces = weld(marched.vertices, marched.normals, marched.faces, marched.pinned)
    return Mesh(vertices, faces)


@pytest.mark.parametrize("cells", [16, 64, 65])
@pytest.mark.parametrize(
    ("formula", "half"),
    [
        ("4 x y z + x^2 + y^2 + z^2 = 1", 2),
        ("x + y", 1),
        ("x + y + z", 1),
        ("x", 1),
        ("x^2 + y^2 = z^2", 1),
        ("x y z", 1),
    ],
)
def test_zeros_on_lattice_points_open_no_hole(formula, half, cells):
    mesh = polygonize(Surface(formula), half, resolution=cells)
    report = mesh.report()
    assert report.oriented and report.nonmanifold_edges == 0
    edge = np.abs(boundary(mesh)).max(axis=1)
    assert np.all(edge > half * (1 - 1e-12))


def test_plane_through_lattice_points_has_no_degenerate_face():
    mesh = polygonize(Surface("x + y"), 1, resolution=16)
    assert mesh.report().degenerate_faces == 0
    assert len(mesh.faces) == 2 * 16 * 16
    assert mesh.area == pytest.approx(4 * np.sqrt(2))


@pytest.mark.parametrize("surface", [SPHERE, TORUS, GENUS2, CAYLEY, GYROID, BALLS])
@pytest.mark.parametrize("cells", [7, 40])
def test_skipping_loses_nothing(surface, cells):
    """As many vertices as edges with ends of different sign among all samples."""
    half = 1.23
    assert crossings(surface, half, cells) == dense(surface, half, cells)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=20, max_size=20), st.integers(8, 30))
def test_skipping_loses_nothing_of_random_cubics(coefficients, cells):
    monomials = [x**i * y**j * z**k for i in range(4) for j in range(4 - i) for k in range(4 - i - j)]
    surface = Surface(sum(c * m for c, m in zip(coefficients, monomials, strict=True)) + x / 64)
    assert crossings(surface, 1.1, cells) == dense(surface, 1.1, cells)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3, st.floats(0.01, 0.4)), min_size=1, max_size=6))
def test_skipping_loses_nothing_of_random_solids(balls):
    parts = [sp.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) - r for a, b, c, r in balls]
    surface = Surface(sp.Min(*parts, evaluate=False) if len(parts) > 1 else parts[0])
    assert crossings(surface, 1.1, 21) == dense(surface, 1.1, 21)


def test_a_thin_sheet_is_found_where_the_lattice_sees_it():
    """A ball smaller than a cell round one lattice point, far from everything else."""
    mesh = polygonize(Surface("min(x^2 + y^2 + z^2 - 0.0001, 5 - x)"), 1, resolution=128)
    assert mesh.report().closed and len(mesh.faces) >= 8


@pytest.mark.parametrize("surface", [TANGLE, GYROID, BALLS])
def test_the_same_bytes_for_any_number_of_workers(surface):
    meshes = [polygonize(surface, 2.2, resolution=90, workers=workers) for workers in (1, 2, 5)]
    for mesh in meshes[1:]:
        for name in ("vertices", "faces", "normals"):
            assert getattr(mesh, name).tobytes() == getattr(meshes[0], name).tobytes()


def test_box_bounds_cut_on_the_box():
    box = Box((-0.5, -2, -1.2), (2, 0.3, 3))
    mesh = polygonize(SPHERE, box, resolution=30)
    report = mesh.report()
    assert not report.closed and report.manifold and report.oriented
    sides = np.minimum(np.abs(boundary(mesh) - box.lower), np.abs(boundary(mesh) - box.upper)).min(axis=1)
    assert sides.max() == 0
    assert report.euler == 1


@pytest.mark.parametrize("surface", [CAYLEY, GYROID, Surface("z"), Surface("x^2 + y^2 - z^2")])
def test_ball_bounds_cut_on_the_sphere(surface):
    ball = Ball(1.17, (0.1, 0, -0.2))
    mesh = polygonize(surface, ball, resolution=33)
    report = mesh.report()
    assert not report.closed and report.oriented and report.nonmanifold_edges == 0 and report.degenerate_faces == 0
    from_center = np.linalg.norm(mesh.vertices - ball.center, axis=1)
    assert from_center.max() < 1.17 * (1 + 1e-14)
    rim = np.linalg.norm(boundary(mesh) - ball.center, axis=1)
    assert np.abs(rim - 1.17).max() < 1e-14
    assert np.abs(surface.field.values(mesh.vertices)).max() < 1e-10


def test_a_disc_in_a_ball_has_its_area():
    mesh = polygonize(Surface("z"), Ball(1), resolution=64)
    assert mesh.report().euler == 1
    assert mesh.area == pytest.approx(np.pi, rel=2e-3)
    assert np.allclose(mesh.normals, (0, 0, 1))


def test_a_surface_inside_the_ball_stays_closed():
    assert polygonize(SPHERE, Ball(1.5), resolution=20).report().closed


@pytest.mark.parametrize("cells", [6, 7, 8, 14, 21, 28, 35])
@pytest.mark.parametrize("text", ["x^2 + y^2 = z^2/3 + 1/5", "3x + 2y + z = 1/4", "sin(3x) + cos(3y) + z = 1/9"])
def test_bricks_that_end_at_the_bounds_need_no_neighbour(text: str, cells: int) -> None:
    surface = Surface(text)
    mesh = polygonize(surface, 1, resolution=cells, method="marching")
    report = mesh.report()
    assert report.manifold and report.oriented and not report.degenerate_faces
    sides, uses = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0, return_counts=True)
    rim = mesh.vertices[sides[uses == 1]]
    assert np.isclose(np.abs(rim).max(axis=2), 1, atol=1e-12).all()
    assert np.abs(surface(mesh.vertices)).max() < 1e-9


def test_zeros_at_lattice_points_open_no_hole_in_cayleys_cubic() -> None:
    """With 65 samples per axis f is 0 at many of them; scikit-image leaves 738 open edges inside the box."""
    mesh = polygonize(Surface("4 (x^3 + y^3 + z^3 + 1) = (x + y + z + 1)^3"), 2, resolution=64, method="marching")
    assert mesh.report().manifold and mesh.report().oriented
    sides, uses = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0, return_counts=True)
    rim = mesh.vertices[sides[uses == 1]]
    assert np.isclose(np.abs(rim), 2, atol=1e-12).any(axis=2).all()


@given(st.floats(0.7, 1.6), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
@settings(max_examples=15, deadline=None)
def test_where_a_ball_cuts_no_triangle_but_slivers_is_turned_over(radius: float, dx: float, dy: float) -> None:
    surface = Surface("(x^2 + y^2 + z^2 + 0.75)^2 - 4*(x^2 + y^2)")
    mesh = implicit.polygonize(surface, Ball(radius, (dx, dy, 0.1)), resolution=30, method="marching")
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    ups = mesh.normals[mesh.faces].sum(axis=1)
    facing = np.einsum("ij,ij->i", across, ups)
    cell = 2 * radius / 30
    turned = facing <= 0
    assert turned.sum() <= 2 and (np.linalg.norm(across[turned], axis=1) < 0.05 * cell**2).all()


@pytest.mark.parametrize("cells", [(5, 9, 30), (100, 100, 100), (20, 350, 60)])
@pytest.mark.parametrize(
    "text",
    ["sin(4x) cos(4y) + sin(4y) cos(4z) + sin(4z) cos(4x) + 0.01", "exp(x y)/(z + 3) + sqrt(x + 2) - atan(z) - 1.7"],
)
def test_arrays_and_the_kernel_leave_the_same_bricks(text: str, cells: tuple[int, int, int]) -> None:
    tape = Surface(text).field.tape
    lattice = Lattice(tuple(np.linspace(-1.5, 1.5, n + 1) for n in cells))
    leaves = _find_leaves(tape, lattice)[2][:, :3]
    assert np.array_equal(_find_bricks(tape, lattice), in_order(leaves))
