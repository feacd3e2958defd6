"""What a picture shows: triangles with normals and colours, and an eye that frames them.

Both renderers draw the same pieces: `show.py` with PyVista, `paint.py` without a graphics library.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Vector
from implicit.mesh import Mesh

Points: TypeAlias = NDArray[np.float64]
Faces: TypeAlias = NDArray[np.int64]
Color: TypeAlias = tuple[float, float, float]

Shape: TypeAlias = tuple[Points, Faces, Points]
"""Vertices, faces, normals."""
Image: TypeAlias = NDArray[np.uint8]

SUPERSAMPLING = 2
"""Both renderers draw this many times larger and average, which smooths every edge."""

RED: Color = (0.86, 0.07, 0.09)
DARK: Color = (0.13, 0.14, 0.17)


@dataclass(frozen=True)
class Look:
    """How a picture is taken.

    outside, inside    colours (red, green, blue) from 0 to 1 of the two sides of the surface
    triangles          "smooth", or "random": every triangle in a colour of its own
    edges              whether the edges of the triangles are drawn
    view, up           from the surface to the eye, and the direction that points up in the picture
    angle              the opening of the lens in radians
    background         colours at the top and at the bottom; None is transparent
    """

    outside: Color = (0.16, 0.42, 0.68)
    inside: Color = (0.96, 0.70, 0.30)
    triangles: Literal["smooth", "random"] = "smooth"
    edges: bool = False
    view: Vector = (1.0, -1.7, 1.0)
    up: Vector = (0.0, 0.0, 1.0)
    angle: float = 0.4
    background: tuple[Color, Color] | None = ((1.0, 1.0, 1.0), (0.90, 0.92, 0.94))


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles of a picture: vertices (V, 3), faces (F, 3), normals (V, 3) and a colour for each side.

    `outside` is one colour or one for each face, (F, 3).
    """

    vertices: Points
    faces: Faces
    normals: Points
    outside: Points
    inside: Points
    edges: bool = False


@dataclass(frozen=True)
class Eye:
    """Where the picture is taken from: a position, the point looked at, and the upward direction."""

    position: Points = field(compare=False)
    focus: Points = field(compare=False)
    up: Points = field(compare=False)
    angle: float
    """The vertical opening of the lens in radians."""

    @property
    def axes(self) -> Points:
        """Rows: right, up and towards the eye, orthonormal."""
        back = _unit(self.position - self.focus)
        right = _unit(np.cross(self.up, back))
        return np.array([right, np.cross(back, right), back])


def frame(points: Points, look: Look, aspect: float, margin: float = 0.1) -> Eye:
    """The eye from which `points` (n, 3) just fill a picture of width / height = `aspect`.

    In the eye's axes a point (a, b, c) is inside the picture if |a - a0| <= s (c0 - c) and |b - b0| <= t (c0 - c),
    which are linear in the eye's place (a0, b0, c0): the smallest c0 that holds for all points is a maximum.
    """
    back = _unit(np.array(look.view))
    right = _unit(np.cross(look.up, back))
    axes = np.array([right, np.cross(back, right), back])
    tall = np.tan(look.angle / 2) * (1 - margin)
    place, distance = np.zeros(3), []
    local = (points if len(points) else np.array([[-1.0] * 3, [1.0] * 3])) @ axes.T
    depth = local[:, 2]
    for axis, slope in ((0, tall * aspect), (1, tall)):
        high, low = np.max(local[:, axis] + slope * depth), np.max(slope * depth - local[:, axis])
        place[axis] = (high - low) / 2
        distance.append((high + low) / (2 * slope))
    place[2] = max(max(distance), depth.max() + 1e-6 * (1 + abs(depth.max())))
    focus = np.array([place[0], place[1], (depth.min() + depth.max()) / 2])
    return Eye(place @ axes, focus @ axes, axes[1], look.angle)


def average(image: Points) -> Points:
    """Blocks of `SUPERSAMPLING` by `SUPERSAMPLING` pixels of an image (height, width, channels) become one."""
    height, width, channels = image.shape
    blocks = image.reshape(height // SUPERSAMPLING, SUPERSAMPLING, width // SUPERSAMPLING, SUPERSAMPLING, channels)
    return np.asarray(blocks.mean(axis=(1, 3)))


def compose(meshes: Sequence[Mesh], look: Look) -> list[Piece]:
    """The pieces of a picture of `meshes`: surfaces with thin dark rims, then in red singular curves and points and
    the boxes that could not be decided.
    """
    used = [_used(mesh) for mesh in meshes]
    if not any(map(len, used)):
        raise ValueError("there is nothing to draw: every mesh is empty")
    size = float(np.linalg.norm(np.ptp(np.concatenate(used), axis=0)))
    pieces = [_surface(mesh, look, seed) for seed, mesh in enumerate(meshes) if len(mesh.faces)]
    for mesh in meshes:
        rims = mesh.vertices[_rims(mesh.faces)]
        pieces += [_plain(rods(rims, 0.0015 * size), DARK)] if len(rims) else []
        pieces += [_plain(tube(mesh.vertices[curve], 0.004 * size), RED) for curve in mesh.curves if len(curve) > 1]
        pieces += [_plain(ball(mesh.vertices[index], 0.011 * size), RED) for index in mesh.points]
        boxes = () if mesh.unresolved is None else mesh.unresolved
        pieces += [_plain(_block(box), RED) for box in boxes]
    return pieces


def corners(pieces: Sequence[Piece]) -> Points:
    """All corners (n, 3) of the faces of `pieces`."""
    return np.concatenate([piece.vertices[_mark(len(piece.vertices), piece.faces)] for piece in pieces])


def _used(mesh: Mesh) -> Points:
    """The vertices (n, 3) that something is drawn at."""
    return mesh.vertices[_mark(len(mesh.vertices), mesh.faces, mesh.points, *mesh.curves)]


def _mark(size: int, *indices: Faces) -> NDArray[np.bool_]:
    marked = np.zeros(size, dtype=bool)
    for index in indices:
        marked[index] = True
    return marked


def _rims(faces: Faces) -> Faces:
    """The edges (n, 2) that belong to one face only."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(sides.T)
    sides = sides[order]
    same = (sides[1:] == sides[:-1]).all(axis=1)
    alone = np.ones(len(sides), dtype=bool)
    alone[1:] &= ~same
    alone[:-1] &= ~same
    return np.asarray(sides[alone])


def _surface(mesh: Mesh, look: Look, seed: int) -> Piece:
    vertices, faces, normals = split_sheets(mesh)
    outside, inside = np.array(look.outside), np.array(look.inside)
    if look.triangles == "random":
        outside = inside = np.random.default_rng(seed).uniform(0.15, 1.0, (len(faces), 3))
    return Piece(vertices, faces, normals, outside, inside, look.edges)


def _plain(shape: Shape, color: Color) -> Piece:
    return Piece(*shape, np.array(color), np.array(color))


def split_sheets(mesh: Mesh, crease: float = 0.7) -> Shape:
    """Vertices, faces and normals with one copy of a vertex for every direction the surface has there.

    Where sheets meet, on singular curves and points, a vertex has no normal of its own: each corner takes the mean
    normal of the same triangle's other corners. So it does where the normal is more than `crease` radians off the
    triangle.
    """
    vertices, faces, normals = mesh.vertices, mesh.faces, mesh.normals
    flat = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    flat = _unit(flat)[:, None]
    special = _mark(len(vertices), mesh.points, *mesh.curves)
    corner = normals[faces]
    lost = special[faces] | (np.sum(corner * flat, axis=2) < np.cos(crease))
    kept = np.where(lost[:, :, None], 0.0, corner)
    others = kept.sum(axis=1, keepdims=True)
    others = np.where(lost.all(axis=1)[:, None, None], flat, others)
    corner = np.where(lost[:, :, None], _unit(others), corner)
    index = faces.copy()
    index[lost] = len(vertices) + np.arange(int(lost.sum()))
    return (
        np.concatenate([vertices, vertices[faces[lost]]]),
        index,
        np.concatenate([normals, corner[lost]]),
    )


def tube(line: Points, radius: float, sides: int = 10) -> Shape:
    """A round tube along a polyline (n, 3): vertices, faces, normals. Its rings turn as little as they can."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line = line[np.concatenate([[True], steps > 1e-9 * radius])]
    along = _unit(np.gradient(line, axis=0)) if len(line) > 1 else np.array([[0.0, 0.0, 1.0]])
    across = _unit(np.cross(along[0], np.eye(3)[np.argmin(abs(along[0]))]))
    rings = []
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    for direction in along:
        across = _unit(across - direction * (across @ direction))
        rings.append(np.cos(angles) * across + np.sin(angles) * np.cross(direction, across))
    normals = np.array(rings)
    start = (np.arange(len(line) - 1)[:, None] * sides + np.arange(sides)).ravel()
    after = (np.arange(len(line) - 1)[:, None] * sides + (np.arange(sides) + 1) % sides).ravel()
    faces = np.concatenate(
        [np.column_stack([start, after, after + sides]), np.column_stack([start, after + sides, start + sides])]
    )
    return (line[:, None] + radius * normals).reshape(-1, 3), faces, normals.reshape(-1, 3)


def rods(segments: Points, radius: float, sides: int = 6) -> Shape:
    """Round rods along segments (n, 2, 3)."""
    along = _unit(segments[:, 1] - segments[:, 0])
    across = _unit(np.cross(along, np.eye(3)[np.argmin(abs(along), axis=1)]))
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None, None]
    ring = np.cos(angles) * across + np.sin(angles) * np.cross(along, across)  # (sides, n, 3)
    normals = np.stack([ring, ring])
    vertices = segments.transpose(1, 0, 2)[:, None] + radius * normals
    count = len(segments)
    start = np.arange(sides * count)
    after = np.roll(start, -count)
    above = sides * count
    faces = [np.column_stack([start, after, after + above]), np.column_stack([start, after + above, start + above])]
    return vertices.reshape(-1, 3), np.concatenate(faces), normals.reshape(-1, 3)


def ball(center: Points, radius: float, rings: int = 12) -> Shape:
    """A sphere of 2 `rings` meridians: vertices, faces, normals."""
    height, turn = np.meshgrid(
        np.linspace(np.pi, 0, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij"
    )
    normals = np.stack([np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)], axis=-1)
    row = np.arange(rings)[:, None] * (2 * rings + 1) + np.arange(2 * rings)
    a, b = row.ravel(), row.ravel() + 2 * rings + 1
    faces = np.concatenate([np.column_stack([a, a + 1, b + 1]), np.column_stack([a, b + 1, b])])
    normals = normals.reshape(-1, 3)
    return center + radius * normals, faces, normals


def _block(box: Points) -> Shape:
    """The six faces of a box (2, 3), each with its own normal."""
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    vertices, normals = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            square = np.insert(unit if side else unit[::-1], axis, side, axis=1)
            square = square if axis != 1 else square[::-1]
            vertices.append(box[0] + square * (box[1] - box[0]))
            normals.append(np.tile(np.eye(3)[axis] * (2 * side - 1), (4, 1)))
    first = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    return np.concatenate(vertices), faces, np.concatenate(normals)


def _unit(vectors: Points) -> Points:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
