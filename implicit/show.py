"""Pictures and windows; the only file that imports PyVista.

Without a working graphics library VTK ends the whole process, with no exception to catch. So a child process tries
first, once; where it fails, matplotlib draws the same picture with plainer light.
"""

import os
import subprocess
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import pyvista

from implicit.domain import Bounds
from implicit.mesh import Mesh
from implicit.pictures.look import Look
from implicit.pictures.scene import SUPERSAMPLING, Eye, Image, Piece, average, compose, corners, frame, gather

Renderer: TypeAlias = Literal["auto", "vtk", "matplotlib"]

_LARGEST = 16384 // SUPERSAMPLING  # pixels along a side; beyond OpenGL's widest buffers VTK draws noise, silently
_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
_PROBE = """
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
window, renderer, pixels = vtkRenderWindow(), vtkRenderer(), vtkUnsignedCharArray()
renderer.SetBackground(1, 0, 0)
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
window.AddRenderer(renderer)
window.Render()
window.GetPixelData(0, 0, 7, 7, 0, pixels, 0)
raise SystemExit(pixels.GetValue(0) != 255 or pixels.GetValue(1) != 0)
"""
# Lights in the eye's axes (right, up, towards the eye), with their strengths.
_LIGHTS = (((-0.5, 0.8, 0.9), 0.85), ((0.9, 0.1, 0.6), 0.30), ((0.0, -0.6, 0.8), 0.12))


def to_pyvista(mesh: Mesh) -> pyvista.PolyData:
    """`mesh` as PolyData: triangles with their normals, singular curves as lines, special points as vertices."""
    data = pyvista.PolyData(np.array(mesh.vertices))
    if len(mesh.faces):
        data.faces = np.insert(mesh.faces, 0, 3, axis=1).ravel()
    lines = [np.insert(curve, 0, len(curve)) for curve in mesh.curves if len(curve) > 1]
    if lines:
        data.lines = np.concatenate(lines)
    if len(mesh.points) or not len(mesh.vertices):
        data.verts = np.column_stack([np.ones_like(mesh.points), mesh.points]).ravel()
    data.point_data.active_normals = np.array(mesh.normals)
    return data


def show(
    *things: object,
    look: Look = Look(),  # noqa: B008
    size: tuple[int, int] = (1024, 768),
    bounds: Bounds | float = 2.0,
) -> None:
    """Show meshes, implicit surfaces and singular loci in a window that can be turned, or as a picture in a notebook.

    bounds: where to look at implicit surfaces. Raises RuntimeError without a display; `render` draws a file there.
    """
    size = _check_size(size)
    pieces = compose(gather(things, bounds), look)
    eye = frame(corners(pieces), look, size[0] / size[1])
    if _in_notebook():
        from IPython import display

        notebook: Any = display
        notebook.display(notebook.Image(_png(_draw(pieces, eye, look, size, "auto"))))
        return
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RuntimeError("show needs a display and found none; render(things, 'picture.png') draws a picture file")
    plotter = pyvista.Plotter(window_size=list(size), lighting="none")
    _fill(plotter, pieces, eye, look)
    plotter.show()


def render(
    things: object,
    path: str | os.PathLike[str],
    *,
    size: tuple[int, int] = (640, 480),
    look: Look = Look(),  # noqa: B008
    renderer: Renderer = "auto",
    bounds: Bounds | float = 2.0,
) -> None:
    """Draw a mesh, an implicit surface, a singular locus or several of them into the PNG file `path`.

    Each side of a surface has its colour, the light is smooth by the mesh's normals, rims are thin and dark, singular
    curves and points and boxes that could not be decided are red, and the eye stands where everything just fits.

    size      pixels across and down, from 1 to 8192
    renderer  "vtk"; "matplotlib", plainer, needs no graphics library; "auto", the first that works, with a warning
              when that is not vtk
    bounds    where to look at implicit surfaces that are no mesh yet

    Two pictures of the same things by "vtk" differ in the grain of the shadows, which VTK draws at random. Raises
    ValueError when there is nothing to draw and for another size or renderer, TypeError for what cannot be drawn and
    RuntimeError for "vtk" without an OpenGL library.
    """
    size = _check_size(size)
    if renderer not in get_args(Renderer):
        raise ValueError(f"renderer must be one of {', '.join(get_args(Renderer))}, got {renderer!r}")
    pieces = compose(gather(things if isinstance(things, Sequence) else [things], bounds), look)
    eye = frame(corners(pieces), look, size[0] / size[1])
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(_png(_draw(pieces, eye, look, size, renderer)))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _check_size(size: Any) -> tuple[int, int]:
    """Width and height. VTK ends the process where they are negative, and takes another size for 0."""
    sides = list(size) if isinstance(size, Sequence | np.ndarray) else []
    whole = all(isinstance(side, int | np.integer) and not isinstance(side, bool) for side in sides)
    if len(sides) != 2 or not whole or not all(1 <= side <= _LARGEST for side in sides):
        raise ValueError(f"size must be two whole numbers of pixels from 1 to {_LARGEST}, got {size!r}")
    return int(sides[0]), int(sides[1])


def find_renderer() -> Literal["vtk", "matplotlib"]:
    """The better renderer that works here. The first call tries VTK in a child process, which takes a second."""
    return "matplotlib" if _working_window() is None else "vtk"


@cache
def _working_window() -> str | None:
    """The VTK window class that draws without a screen, "" for the system's own, None if there is none."""
    names = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow") if sys.platform == "linux" else ("",)
    for name in names:
        environment = {**os.environ, _WINDOW: name} if name else dict(os.environ)
        child = subprocess.run([sys.executable, "-c", _PROBE], env=environment, capture_output=True, timeout=120)
        if child.returncode == 0:
            return name
    return None


def _draw(pieces: list[Piece], eye: Eye, look: Look, size: tuple[int, int], renderer: Renderer) -> Image:
    if renderer == "auto":
        renderer = find_renderer()
        if renderer != "vtk":
            _say_once()
    if renderer == "vtk":
        if _working_window() is None:
            raise RuntimeError("VTK finds no working OpenGL library (such as libEGL) here; use renderer='matplotlib'")
        return _draw_vtk(pieces, eye, look, size)
    from implicit.pictures.paint import paint

    return paint(pieces, eye, look, size)


@cache
def _say_once() -> None:
    warnings.warn("no working OpenGL library (such as libEGL): pictures are drawn by matplotlib", stacklevel=4)


def _draw_vtk(pieces: list[Piece], eye: Eye, look: Look, size: tuple[int, int]) -> Image:
    """The picture at twice the size, with ambient occlusion, averaged down."""
    large = [SUPERSAMPLING * side for side in size]
    with _window_class(_working_window()):
        plotter = pyvista.Plotter(off_screen=True, window_size=large, lighting="none")
    _fill(plotter, pieces, eye, look)
    reach = float(np.linalg.norm(np.ptp(corners(pieces), axis=0)))
    plotter.enable_ssao(radius=0.12 * reach, bias=0.004 * reach, kernel_size=32, blur=True)
    image = plotter.screenshot(return_img=True, transparent_background=look.background is None)
    plotter.close()
    return np.rint(average(np.asarray(image, dtype=float))).astype(np.uint8)


@contextmanager
def _window_class(name: str | None) -> Iterator[None]:
    """While a window is made, VTK makes one of this class, and says nothing of X servers."""
    before = os.environ.get(_WINDOW)
    if name:
        os.environ[_WINDOW] = name
    try:
        yield
    finally:
        if name and before is None:
            del os.environ[_WINDOW]
        elif name and before is not None:
            os.environ[_WINDOW] = before


def _fill(plotter: Any, pieces: list[Piece], eye: Eye, look: Look) -> None:
    """Put pieces, lights, background and camera into a plotter."""
    for piece in pieces:
        data = pyvista.PolyData(piece.vertices, np.insert(piece.faces, 0, 3, axis=1).ravel())
        data.point_data.active_normals = piece.normals
        options: dict[str, Any] = {"color": piece.outside, "backface_params": {"color": piece.inside}}
        if piece.outside.ndim == 2:
            data.cell_data["color"] = np.rint(255 * piece.outside).astype(np.uint8)
            options = {"scalars": "color", "rgb": True}
        plotter.add_mesh(
            data,
            **options,
            smooth_shading=True,
            split_sharp_edges=False,
            ambient=0.28,
            diffuse=0.8,
            specular=0.18,
            specular_power=22,
            show_edges=piece.edges,
            edge_color=(0.1, 0.1, 0.1),
            line_width=1,
            show_scalar_bar=False,
        )
    for position, strength in _LIGHTS:
        plotter.add_light(pyvista.Light(position=position, intensity=strength, light_type="camera light"))
    if look.background is not None:
        plotter.set_background(look.background[1], top=look.background[0])
    camera = plotter.camera
    camera.position, camera.focal_point, camera.up = eye.position, eye.focus, eye.up
    camera.view_angle = np.degrees(eye.angle)
    plotter.renderer.ResetCameraClippingRange()


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"


def _png(image: Image) -> bytes:
    from io import BytesIO

    from PIL import Image as Pillow

    stream = BytesIO()
    Pillow.fromarray(image).save(stream, "png", compress_level=4)
    return stream.getvalue()
