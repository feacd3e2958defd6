"""What a picture shows: triangles with normals and colours, and an eye that frames them.

Both renderers draw the same pieces: `show.py` with PyVista, `paint.py` without a graphics library.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.domain import Bounds
from implicit.mesh import Mesh, double_areas
from implicit.pictures.look import DARK, RED, Look
from implicit.pictures.sticks import Faces, Points, Shape, ball, block, merge, rods, tube, unit
from implicit.topology import find_edges

if TYPE_CHECKING:
    from implicit.singular import SingularLocus

Image: TypeAlias = NDArray[np.uint8]

SUPERSAMPLING = 2
"""Both renderers draw this many times larger and average, which smooths every edge."""


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline (n, 3) drawn as a thin dark line beside the meshes of a picture, with `dots` at its points."""

    points: Points
    dots: bool = False


Thing: TypeAlias = Mesh | Line


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles of a picture: vertices (V, 3), faces (F, 3), normals (V, 3) and a colour for each side.

    `outside` is one colour or one for each face, (F, 3). A renderer that sorts triangles may take the piece to be
    nearer by `raised`, a length, so that thin lines are not sunk in the surface they lie on.
    """

    vertices: Points
    faces: Faces
    normals: Points
    outside: Points
    inside: Points
    edges: bool = False
    raised: float = 0.0


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
        back = unit(self.position - self.focus)
        right = unit(np.cross(self.up, back))
        return np.array([right, np.cross(back, right), back])


def frame(points: Points, look: Look, aspect: float, margin: float = 0.1) -> Eye:
    """The eye from which `points` (n, 3) just fill a picture of width / height = `aspect`.

    In the eye's axes a point (a, b, c) is inside the picture if |a - a0| <= s (c0 - c) and |b - b0| <= t (c0 - c),
    which are linear in the eye's place (a0, b0, c0): the smallest c0 that holds for all points is a maximum.
    """
    back = unit(np.array(look.view))
    right = unit(np.cross(look.up, back))
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


def compose(things: Sequence[Thing], look: Look) -> list[Piece]:
    """The pieces of a picture: surfaces with thin dark rims, dark lines, and in red singular curves and points and the
    boxes that could not be decided.
    """
    meshes = [thing for thing in things if isinstance(thing, Mesh)]
    lines = [thing for thing in things if isinstance(thing, Line)]
    used = [_used(mesh) for mesh in meshes] + [line.points for line in lines]
    if not any(map(len, used)):
        raise ValueError("there is nothing to draw: every mesh is empty")
    size = float(np.linalg.norm(np.ptp(np.concatenate(used), axis=0)))
    pieces = [_surface(mesh, look, seed) for seed, mesh in enumerate(meshes) if len(mesh.faces)]
    dark = [rods(rim, 0.0015 * size) for rim in (mesh.vertices[_rims(mesh)] for mesh in meshes) if len(rim)]
    for line in lines:
        dark += [tube(line.points, 0.0012 * size)] if len(line.points) > 1 else []
        dark += [ball(point, 0.006 * size, 8) for point in line.points] if line.dots else []
    red = []
    for mesh in meshes:
        red += [tube(mesh.vertices[curve], 0.004 * size) for curve in mesh.curves if len(curve) > 1]
        red += [ball(mesh.vertices[index], 0.011 * size) for index in mesh.points]
        red += [block(box) for box in (() if mesh.unresolved is None else mesh.unresolved)]
    for shapes, color in ((dark, DARK), (red, RED)):
        pieces += [Piece(*merge(shapes), np.array(color), np.array(color), raised=0.004 * size)] if shapes else []
    return pieces


def gather(things: Sequence[object], bounds: Bounds | float) -> list[Thing]:
    """Meshes and lines as they are, singular loci as points and curves, implicit surfaces as their mesh in `bounds`.

    Raises TypeError for anything else.
    """
    return [_to_thing(thing, bounds) for thing in things]


def _to_thing(thing: object, bounds: Bounds | float) -> Thing:
    if isinstance(thing, Mesh | Line):
        return thing
    from implicit.singular import SingularLocus
    from implicit.surface import Surface

    if isinstance(thing, SingularLocus):
        return locus_mesh(thing)
    if isinstance(thing, Surface):
        from implicit.polygonize import polygonize

        return polygonize(thing, bounds)
    text = isinstance(thing, str)
    hint = 'a formula becomes a surface by Surface("...")' if text else "tessellate a parametric surface or shell first"
    raise TypeError(
        f"a picture is made of meshes, implicit surfaces, singular loci and lines, got {type(thing).__name__}; {hint}"
    )


def locus_mesh(locus: "SingularLocus") -> Mesh:
    """Singular points and curves as a mesh without faces."""
    positions = [np.reshape([point.position for point in locus.points], (-1, 3))]
    curves: list[Faces] = []
    start = len(locus.points)
    points = [np.arange(start)]
    for curve in locus.curves:
        positions += [curve.polyline, np.reshape(curve.special, (-1, 3))]
        curves.append(np.arange(start, start + len(curve.polyline)))
        start += len(curve.polyline) + len(curve.special)
        points.append(np.arange(start - len(curve.special), start))
    vertices = np.concatenate(positions)
    return Mesh(vertices, [], np.zeros_like(vertices), curves, np.concatenate(points), locus.undecided)


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


def _rims(mesh: Mesh) -> Faces:
    """The edges (n, 2) that belong to one face only."""
    edges = find_edges(mesh.faces, len(mesh.vertices))
    return np.stack(np.divmod(edges.keys[edges.uses == 1], max(edges.size, 1)), axis=1)


def _surface(mesh: Mesh, look: Look, seed: int) -> Piece:
    vertices, faces, normals = split_sheets(mesh)
    outside, inside = np.array(look.outside), np.array(look.inside)
    if look.triangles == "random":
        outside = inside = np.random.default_rng(seed).uniform(0.15, 1.0, (len(faces), 3))
    return Piece(vertices, faces, normals, outside, inside, look.edges)


def split_sheets(mesh: Mesh, crease: float = 0.7) -> Shape:
    """Vertices, faces and normals with one copy of a vertex for every direction the surface has there.

    Where sheets meet, on singular curves and points, a vertex has no normal of its own: each corner takes the mean
    normal of the same triangle's other corners. So it does where the normal is more than `crease` radians off the
    triangle.
    """
    vertices, faces, normals = mesh.vertices, mesh.faces, mesh.normals
    flat = unit(double_areas(vertices, faces))[:, None]
    special = _mark(len(vertices), mesh.points, *mesh.curves)
    corner = normals[faces]
    lost = special[faces] | (np.sum(corner * flat, axis=2) < np.cos(crease)) & flat.any(axis=2)
    kept = np.where(lost[:, :, None], 0.0, corner)
    others = kept.sum(axis=1, keepdims=True)
    others = np.where(lost.all(axis=1)[:, None, None], flat, others)
    corner = np.where(lost[:, :, None], unit(others), corner)
    index = faces.copy()
    index[lost] = len(vertices) + np.arange(int(lost.sum()))
    return (
        np.concatenate([vertices, vertices[faces[lost]]]),
        index,
        np.concatenate([normals, corner[lost]]),
    )
