"""Pictures: framing, sheets at singular points, two sides, and the renderer without a graphics library."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from implicit.mesh import Mesh
from implicit.pictures import sticks
from implicit.pictures.look import DARK, RED, Look
from implicit.pictures.scene import Line, compose, corners, frame, split_sheets
from implicit.show import find_renderer, render, show, to_pyvista

RENDERERS = ("vtk", "matplotlib")
TETRAHEDRON = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def ball(radius: float = 1.0, center: tuple[float, float, float] = (0, 0, 0), rings: int = 24) -> Mesh:
    """A sphere; its seam and poles are not joined."""
    vertices, faces, normals = sticks.ball(np.array(center, dtype=float), radius, rings)
    return Mesh(vertices, faces, normals)


def cone(points: int = 40) -> Mesh:
    """Both halves of x^2 + y^2 = z^2 up to |z| = 1; vertex 0 is the apex, a singular point without a normal."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(points)], axis=1)
    vertices = np.concatenate([[[0, 0, 0]], ring, ring * [1, 1, -1]])
    normals = np.concatenate([[[0, 0, 0]], ring * [1, 1, -1], ring]) / np.sqrt(2)
    up, after = 1 + np.arange(points), 1 + np.roll(np.arange(points), -1)
    faces = np.concatenate([np.stack([0 * up, after, up], 1), np.stack([0 * up, up + points, after + points], 1)])
    return Mesh(vertices, faces, normals, points=[0])


def picture(things: object, path: Path, **options: object) -> np.ndarray:
    """The pixels (height, width, 3), from 0 to 1."""
    render(things, path, **options)  # type: ignore[arg-type]
    return np.asarray(Image.open(path).convert("RGB"), dtype=float) / 255


def share_of(image: np.ndarray, color: tuple[float, float, float]) -> float:
    """The share of pixels of about that hue."""
    wanted = np.array(color) / np.linalg.norm(color)
    length = np.linalg.norm(image, axis=2)
    alike = image @ wanted > 0.985 * length
    return float(np.mean(alike & (length > 0.15)))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=2, max_size=30),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 1)),
    st.floats(0.4, 2.5),
)
def test_the_eye_stands_where_everything_just_fits(points: list, view: tuple, aspect: float) -> None:
    cloud = np.array(points)
    look = Look(view=view, up=(0.3, 0.9, 0.0))
    eye = frame(cloud, look, aspect, margin=0.0)
    local = (cloud - eye.position) @ eye.axes.T
    slope = np.tan(look.angle / 2)
    reach = np.max(np.abs(local[:, :2]) / (slope * np.array([aspect, 1.0])), axis=1) + local[:, 2]
    assert reach.max() == pytest.approx(0, abs=1e-5 * (1 + np.abs(local).max()))


def test_the_apex_of_a_cone_is_lit_like_its_sides() -> None:
    """At a node no normal is right for all triangles: each corner takes its own, so light does not stain the apex."""
    vertices, faces, normals = split_sheets(cone())
    triangles = vertices[faces]
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.min(np.sum(normals[faces] * flat[:, None], axis=2)) > 0.99


def test_creases_keep_two_normals() -> None:
    """All corners of a tetrahedron take the normals of their faces."""
    vertices, faces, normals = split_sheets(TETRAHEDRON)
    triangles = vertices[faces]
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.allclose(np.sum(normals[faces] * flat[:, None], axis=2), 1)


def test_smooth_vertices_are_not_split() -> None:
    mesh = ball()
    vertices, faces, normals = split_sheets(mesh)
    assert np.array_equal(vertices[faces], mesh.vertices[mesh.faces])
    assert np.abs(np.sum(normals[faces] * mesh.normals[mesh.faces], axis=2) - 1).max() < 1e-12


@pytest.mark.parametrize(
    "shape",
    [
        sticks.tube(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 2, 1]]), 0.1),
        sticks.rods(np.array([[[0.0, 0, 0], [1, 2, 3]], [[0, 0, 1], [0, 1, 0]]]), 0.2),
        sticks.ball(np.array([1.0, 2, 3]), 0.7),
        sticks.block(np.array([[0.0, 1, 2], [3, 5, 7]])),
    ],
    ids=["tube", "rods", "ball", "block"],
)
def test_sticks_look_outward(shape: sticks.Shape) -> None:
    """Faces run counter-clockwise seen from where their normals point, which are of length 1."""
    vertices, faces, normals = shape
    triangles = vertices[faces]
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    thick = np.linalg.norm(flat, axis=1) > 1e-12
    assert (np.sum(flat * normals[faces].sum(axis=1), axis=1)[thick] > 0).all()
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)


def test_a_block_has_the_volume_of_its_box() -> None:
    vertices, faces, _ = sticks.block(np.array([[0.0, 1, 2], [3, 5, 7]]))
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(60)


def test_rims_curves_points_and_boxes_are_drawn() -> None:
    sheet = Mesh(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], curves=[[0, 1]], points=[2], unresolved=[[[0] * 3, [0.1] * 3]]
    )
    colors = [tuple(piece.outside) for piece in compose([sheet], Look())]
    assert colors == [Look().outside, DARK, RED]
    assert len(compose([TETRAHEDRON], Look())) == 1  # no rim, nothing special


@pytest.mark.parametrize("renderer", RENDERERS)
def test_outside_and_inside_have_their_colours(renderer: str, tmp_path: Path) -> None:
    look = Look(outside=(0.1, 0.3, 0.9), inside=(0.1, 0.9, 0.2))
    mesh = ball()
    image = picture(mesh, tmp_path / "a.png", size=(160, 120), look=look, renderer=renderer)
    turned = Mesh(mesh.vertices, mesh.faces[:, ::-1], -mesh.normals)
    inner = picture(turned, tmp_path / "b.png", size=(160, 120), look=look, renderer=renderer)
    assert image.shape == (120, 160, 3)
    assert share_of(image, look.outside) > 0.25 > 0.02 > share_of(image, look.inside)
    assert share_of(inner, look.inside) > 0.25 > 0.02 > share_of(inner, look.outside)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_the_sphere_fills_the_picture(renderer: str, tmp_path: Path) -> None:
    image = picture(ball(), tmp_path / "a.png", size=(160, 120), renderer=renderer)
    blue = image[..., 2] - image[..., 0] > 0.12
    rows = np.flatnonzero(blue.any(axis=1))
    assert 4 <= rows[0] <= 9
    assert 110 <= rows[-1] <= 116
    middle = np.flatnonzero(blue.any(axis=0)).mean()
    assert middle == pytest.approx(79.5, abs=1)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_singular_points_are_red(renderer: str, tmp_path: Path) -> None:
    image = picture(cone(), tmp_path / "a.png", size=(320, 240), renderer=renderer)
    plain = cone()
    plain = Mesh(plain.vertices, plain.faces, plain.normals)
    assert share_of(image, RED) > 5 * share_of(picture(plain, tmp_path / "b.png", size=(320, 240)), RED) + 1e-4


def test_both_renderers_draw_the_same_silhouette(tmp_path: Path) -> None:
    """Two independent pictures of one scene agree on which pixels are background."""
    masks = []
    for renderer in RENDERERS:
        things, look = [cone(), Line(np.array([[0.0, 0, 0], [1, 1, 1]]))], Look(background=None)
        render(things, tmp_path / "a.png", size=(480, 360), renderer=renderer, look=look)  # type: ignore[arg-type]
        masks.append(np.asarray(Image.open(tmp_path / "a.png"))[..., 3] > 127)
    both, either = np.logical_and(*masks).sum(), np.logical_or(*masks).sum()
    assert both / either > 0.97


def test_random_triangles_have_many_colours_and_the_same_ones_again(tmp_path: Path) -> None:
    look = Look(triangles="random")
    first = picture(ball(rings=8), tmp_path / "a.png", size=(160, 120), look=look)
    hue = np.round(first[30:90, 50:110] * 8).reshape(-1, 3)
    assert len(np.unique(hue, axis=0)) > 60
    second = picture(ball(rings=8), tmp_path / "b.png", size=(160, 120), look=look)
    assert np.abs(first - second).mean() < 0.01  # but for the grain of the shadows


def test_the_probe_of_a_machine_without_opengl_fails_quietly_and_matplotlib_draws(tmp_path: Path) -> None:
    """VTK kills the process where there is no EGL library; a child process finds out."""
    program = """
import warnings, sys
from implicit import show as _
module = sys.modules["implicit.show"]
module._PROBE = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
from implicit import Mesh, render
mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("default")
    for name in ("a.png", "b.png"):
        render(mesh, name, size=(80, 60))
print(len(caught), caught[0].message)
try:
    render(mesh, "c.png", renderer="vtk")
except RuntimeError as error:
    print(error)
"""
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    assert lines[0].startswith("1 ")
    assert "drawn by matplotlib" in lines[0]
    assert "renderer='matplotlib'" in lines[1]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]


@pytest.mark.skipif(sys.platform != "linux" or os.getuid() != 0, reason="hiding a library needs a mount of its own")
def test_a_picture_is_drawn_with_the_graphics_libraries_hidden(tmp_path: Path) -> None:
    hide = "for f in /usr/lib/*/libEGL*.so* /usr/lib/*/libOSMesa*.so*; do test -e $f && mount --bind /dev/null $f; done"
    draw = (
        "from implicit import Mesh, render; render(Mesh([(0,0,0),(1,0,0),(0,1,0)], [(0,1,2)]), 'a.png', size=(80, 60))"
    )
    command = f'{hide}; exec "{sys.executable}" -c "{draw}"'
    run = subprocess.run(
        ["unshare", "-m", "sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    if "unshare" in run.stderr or "mount" in run.stderr:
        pytest.skip("no mount namespaces here")
    assert run.returncode == 0, run.stderr
    assert "drawn by matplotlib" in run.stderr
    assert (tmp_path / "a.png").stat().st_size > 500


def test_drawing_says_nothing_and_leaves_the_environment_alone(tmp_path: Path) -> None:
    program = """
import os
before = dict(os.environ)
from implicit import Mesh, render
render(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), "a.png", size=(80, 60))
assert dict(os.environ) == before
"""
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    run = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        env=environment,
        check=False,
    )
    assert (run.returncode, run.stdout) == (0, "")
    if find_renderer() == "vtk":
        assert run.stderr == ""


def test_polydata_has_everything_the_mesh_has() -> None:
    data = to_pyvista(cone())
    assert np.array_equal(data.regular_faces, cone().faces)
    assert np.allclose(data.point_data["Normals"], cone().normals)
    assert data.verts.tolist() == [1, 0]
    line = to_pyvista(Mesh([(0, 0, 0), (1, 0, 0)], [], curves=[[0, 1]]))
    assert line.lines.tolist() == [2, 0, 1]
    assert to_pyvista(Mesh([], [])).n_points == 0


def test_a_surface_and_its_singular_points_are_drawn_without_more_words(tmp_path: Path) -> None:
    from implicit import Surface, singularities

    surface = Surface("x^2 + y^2 = z^2")
    image = picture([surface, singularities(surface, 1)], tmp_path / "a.png", size=(160, 120), bounds=1.0)
    assert share_of(image, RED) > 0


def test_nothing_to_draw_is_said(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nothing to draw"):
        render(Mesh([], []), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_drawn_is_named(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="got dict; tessellate"):
        render({}, tmp_path / "a.png")
    with pytest.raises(TypeError, match=r'got str; a formula becomes a surface by Surface\("'):
        render("x^2 + y^2 = 1", tmp_path / "a.png")
    with pytest.raises(TypeError, match="got int"):
        show(3)


@pytest.mark.parametrize(
    "size", [(-5, 10), (0, 10), (10, 8193), (10.5, 10), (10,), (10, 10, 10), (True, True), "a", "10", 10, None]
)
def test_a_size_is_two_positive_whole_numbers(size: object, tmp_path: Path) -> None:
    for draw in (lambda: render(ball(), tmp_path / "a.png", size=size), lambda: show(ball(), size=size)):
        with pytest.raises(ValueError, match="size must be two whole numbers of pixels from 1 to 8192, got"):
            draw()
    assert not list(tmp_path.iterdir())


def test_sizes_of_any_whole_numbers_are_drawn(tmp_path: Path) -> None:
    assert picture(ball(), tmp_path / "a.png", size=np.array([31, 17])).shape == (17, 31, 3)
    assert picture(ball(), tmp_path / "a.png", size=(1, 1), renderer="matplotlib").shape == (1, 1, 3)


def test_another_renderer_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="renderer must be one of auto, vtk, matplotlib, got 'vkt'"):
        render(ball(), tmp_path / "a.png", renderer="vkt")  # type: ignore[arg-type]


def test_a_window_needs_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("other systems always have one")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RuntimeError, match=r"render\(things, 'picture.png'\)"):
        show(ball())


def test_corners_are_those_of_faces_only() -> None:
    far = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (99, 0, 0)], [(0, 1, 2)])
    assert corners(compose([far], Look())).max() < 1.1
