"""Pictures without a graphics library: triangles sorted by depth, the nearest painted last."""

import numpy as np
from numpy.typing import NDArray

from implicit.pictures.look import Look
from implicit.pictures.scene import SUPERSAMPLING, Eye, Image, Piece, Points, average

_LARGEST = 0.05
_LIGHT = np.array([-0.5, 0.8, 0.9]) / np.sqrt(1.7)


def paint(pieces: list[Piece], eye: Eye, look: Look, size: tuple[int, int]) -> Image:
    """The picture (height, width, 3 or 4) of `pieces`; triangles that cut each other are sorted by their middles."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    corners, colors, depth = _project(pieces, eye)
    order = np.argsort(depth)[::-1]
    width, height = (side * SUPERSAMPLING for side in size)
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    figure.patch.set_alpha(0)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set(xlim=(-size[0] / size[1], size[0] / size[1]), ylim=(-1, 1))
    edges = "face" if not any(piece.edges for piece in pieces) else (0.1, 0.1, 0.1, 0.6)
    axes.add_collection(
        PolyCollection(
            list(corners[order]), facecolors=list(colors[order]), edgecolors=edges, linewidths=0.4, antialiased=False
        )
    )
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return _over_background(np.asarray(canvas.buffer_rgba(), dtype=float), look)


def _project(pieces: list[Piece], eye: Eye) -> tuple[Points, Points, Points]:
    """Corners (F, 3, 2) in the picture, where up to down is 1 to -1, shaded colours (F, 3) and depths (F,)."""
    corners, colors, depths = [], [], []
    for piece in pieces:
        vertices, normals = (piece.vertices - eye.position) @ eye.axes.T, piece.normals @ eye.axes.T
        flat, triangles, lights, base = _cut(
            piece, vertices[piece.faces], normals[piece.faces], 1 / np.tan(eye.angle / 2)
        )
        middle = triangles.mean(axis=1)
        light = lights.mean(axis=1)
        light = np.where((np.sum(light * middle, axis=1) < 0)[:, None], light, -light)
        colors.append(_shade(base, light / np.maximum(np.linalg.norm(light, axis=1, keepdims=True), 1e-12)))
        corners.append(flat)
        depths.append(-middle[:, 2] - piece.raised)
    return np.concatenate(corners), np.concatenate(colors), np.concatenate(depths)


def _cut(piece: Piece, triangles: Points, lights: Points, lens: float) -> tuple[Points, Points, Points, Points]:
    """Corners in the picture (F, 3, 2) and in space, normals (F, 3, 3) and colours of triangles whose longest side is
    halved until none is longer in the picture than `_LARGEST`: small ones are sorted rightly and shaded smoothly.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    front = np.sum(normal * triangles.mean(axis=1), axis=1) < 0
    base = np.where(front[:, None], piece.outside, piece.inside)
    while True:
        flat = lens * triangles[..., :2] / -triangles[..., 2:]
        sides = np.linalg.norm(np.roll(flat, -1, axis=1) - flat, axis=2)
        large = np.max(sides, axis=1, initial=0.0) > _LARGEST
        if piece.edges or not large.any():
            return flat, triangles, lights, base
        first = np.argmax(sides[large], axis=1)
        triangles = np.concatenate([triangles[~large], _halves(triangles[large], first)])
        lights = np.concatenate([lights[~large], _halves(lights[large], first)])
        base = np.concatenate([base[~large], np.tile(base[large], (2, 1))])


def _halves(corners: Points, first: NDArray[np.int64]) -> Points:
    """The two parts (2F, 3, n) of triangles (F, 3, n) cut at the middle of the side that begins at corner `first`."""
    row = np.arange(len(corners))
    a, b, c = (corners[row, (first + step) % 3] for step in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _shade(base: Points, normals: Points) -> Points:
    """Colours by Lambert's law, with a soft light from the eye and a highlight."""
    half = _LIGHT + np.array([0.0, 0.0, 1.0])
    shine = np.clip(normals @ (half / np.linalg.norm(half)), 0, 1) ** 30
    bright = 0.25 + 0.6 * np.clip(normals @ _LIGHT, 0, 1) + 0.25 * np.clip(normals[:, 2], 0, 1)
    return np.clip(base * bright[:, None] + 0.2 * shine[:, None], 0, 1)


def _over_background(image: Points, look: Look) -> Image:
    """The large picture with opacity (height, width, 4) averaged down and laid over the background."""
    opacity = image[..., 3:] / 255
    alpha, color = average(opacity), average(image[..., :3] * opacity)
    if look.background is None:
        color = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
        return np.rint(np.concatenate([color, 255 * alpha], axis=2)).astype(np.uint8)
    down = np.linspace(0, 1, len(color))[:, None, None]
    top, bottom = (255 * np.array(end) for end in look.background)
    return np.rint(color + (1 - alpha) * (top * (1 - down) + bottom * down)).astype(np.uint8)
