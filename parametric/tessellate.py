"""Surfaces and shells as meshes: conforming, without cracks, within a tolerance."""

import numpy as np
from numpy.typing import NDArray

from implicit.mesh import Mesh, area_weighted_normals
from parametric.parameters import Array
from parametric.shell import Shell
from parametric.surface import ParametricSurface
from parametric.tessellation.batch import evaluator
from parametric.tessellation.cells import Cells, first_splits
from parametric.tessellation.deviation import corner_places, line_deviations, triangle_deviations
from parametric.tessellation.triangulation import Triangulation

Ints = NDArray[np.int64]

_SAMPLED = 0.96
"""Samples miss the farthest point of a curved triangle by a few hundredths; this part of the tolerance is aimed at."""


class SurfaceMesh(Mesh):
    """A mesh that knows where its vertices lie on the surfaces it was made from.

    vertex_surfaces (V,) and parameters (V, 2): a surface through each vertex, and (u, v) there. A vertex on an edge
    of a shell lies on several; the first is named. face_surfaces (F,): the surface of each triangle.
    """

    vertex_surfaces: Ints
    parameters: Array
    face_surfaces: Ints

    def __init__(
        self,
        vertices: Array,
        faces: Ints,
        normals: Array,
        vertex_surfaces: Ints,
        parameters: Array,
        face_surfaces: Ints,
    ) -> None:
        super().__init__(vertices, faces, normals)
        named = {"vertex_surfaces": vertex_surfaces, "parameters": parameters, "face_surfaces": face_surfaces}
        for name, array in named.items():
            kept = np.array(array)
            kept.flags.writeable = False
            object.__setattr__(self, name, kept)


def tessellate(surface: ParametricSurface | Shell, *, tolerance: float, certified: bool = False) -> SurfaceMesh:
    """Mesh of a surface or shell that lies nowhere farther than `tolerance` from it.

    Every edge of a shell has one list of samples, shared by the surfaces that meet there, so there are no cracks and
    no vertex lies inside another triangle's side. A closed shell gives a closed mesh of positive volume. Normals
    (unit, at vertices) come from the surfaces and look to the outer side of the triangles; where surfaces meet at an
    angle the normal is their mean.

    Parameters
    ----------
    surface : ParametricSurface or Shell
    tolerance : float
        The largest distance of the surface from the mesh, a length. It is tested at three points of every line and
        four of every triangle, which bounds smooth surfaces in practice but proves nothing.
    certified : bool
        Prove the bound, for surfaces with Bezier pieces: a piece lies in the convex hull of its control points, so
        none of it is farther from a triangle than they are. About a third more triangles.

    Examples
    --------
    >>> from parametric import BezierSurface
    >>> saddle = BezierSurface([[(0, 0, 0), (0, 1, 1)], [(1, 0, 1), (1, 1, 0)]])
    >>> tessellate(saddle, tolerance=0.01).report().boundary_edges > 0
    True
    """
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance must be a positive length, got {tolerance!r}")
    shell = surface if isinstance(surface, Shell) else Shell([surface])
    cells = Cells(shell, [first_splits(s, tolerance) for s in shell.surfaces])
    cells.build()
    net = Triangulation(cells, evaluator(shell))
    refine(net, tolerance, certified)
    return to_mesh(net)


def refine(net: Triangulation, tolerance: float, certified: bool) -> None:
    """Split lines until all lines and triangles are within tolerance, and none is another's double.

    Each line and triangle is measured once.
    """
    measure, limit = triangle_deviations, _SAMPLED * tolerance
    if certified:
        from parametric.tessellation.certificate import certified_deviations

        measure, limit = certified_deviations, tolerance
    lines, triangles = np.arange(len(net.lines.home)), np.arange(len(net.triangles.home))
    waiting = np.ones(len(net.triangles.home), bool)
    while True:
        marked = np.zeros(len(net.lines.home), bool)
        marked[lines] = line_deviations(net, lines) > limit
        calm = waiting & ~marked[net.triangles.lines].any(axis=1)
        triangles = np.flatnonzero(calm)
        bad = triangles[measure(net, triangles) > limit]
        waiting &= ~calm
        ends = net.vertices[net.lines.ends[net.triangles.lines[bad]]]
        longest = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).argmax(axis=1)
        marked[net.triangles.lines[bad, longest]] = True
        if not marked.any():
            marked = _doubled(net)
        _mark_slivers(net, marked)
        if not marked.any():
            return
        beside = marked[net.triangles.lines].any(axis=1)
        lines, triangles = net.split(marked)
        waiting = np.concatenate([waiting[~beside], np.ones(triangles.size, bool)])


def _doubled(net: Triangulation) -> NDArray[np.bool_]:
    """The lines to split lest two of them be one edge of the mesh, with the triangles of both beside it.

    At a corner of the shell each of two surfaces may cut off the same three vertices of their common edges: the chords
    across are two lines with the same ends. Their middles are vertices of their own. A line on an edge of the shell
    may stay if only lines across have its ends.
    """
    marked = np.zeros(len(net.lines.home), bool)
    live = np.unique(net.triangles.lines)
    ends = np.sort(net.lines.ends[live], axis=1)
    _, group = np.unique(ends[:, 0] * np.int64(len(net.vertices)) + ends[:, 1], return_inverse=True)
    on_edge = net.lines.edge[live] >= 0
    several = np.bincount(group)[group] > 1
    marked[live] = several & ~(on_edge & (np.bincount(group, on_edge)[group] == 1))
    return marked


def _mark_slivers(net: Triangulation, marked: NDArray[np.bool_]) -> None:
    """Mark the longest side, in the domain, of slivers that have a marked side.

    Cut in a shorter side only, they could leave thinner slivers for ever; cut in all, slivers of the same shape.
    """
    while True:
        sides = marked[net.triangles.lines]
        some = np.flatnonzero(sides.any(axis=1) & ~sides.all(axis=1))
        area, lengths = _domain_sizes(net, some)
        longest = net.triangles.lines[some, lengths.argmax(axis=1)]
        new = longest[(area < 0.02 * lengths.max(axis=1, initial=0.0)) & ~marked[longest]]
        if not new.size:
            return
        marked[new] = True


def _domain_sizes(net: Triangulation, which: Ints) -> tuple[Array, Array]:
    """Twice the areas (n,), and squared lengths (n, 3) of the sides, in the domain, its sides taken as equally long."""
    sizes = np.array([np.ptp(surface.domain, axis=1) for surface in net.shell.surfaces])
    places = corner_places(net, which) / sizes[net.triangles.home[which], None]
    sides = np.roll(places, -1, axis=1) - places
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    return area, np.einsum("nkc,nkc->nk", sides, sides)


def to_mesh(net: Triangulation) -> SurfaceMesh:
    """The triangles as a mesh, turned as the shell is."""
    t, shell = net.triangles, net.shell
    corners = t.corners.copy()
    turned = shell.turns[t.home] < 0
    corners[turned] = corners[turned][:, ::-1]
    normals = vertex_normals(net)
    a, b, c = (net.vertices[corners[:, k]] for k in range(3))
    if shell.closed and np.einsum("nc,nc->", a - net.vertices.mean(axis=0), np.cross(b - a, c - a)) < 0:
        corners, normals = corners[:, ::-1], -normals
    lost = ~(np.linalg.norm(normals, axis=1) > 0.5)
    if lost.any():
        normals[lost] = area_weighted_normals(net.vertices, corners)[lost]
    used = np.unique(corners)
    number = np.full(len(net.vertices), -1)
    number[used] = np.arange(used.size)
    return SurfaceMesh(
        net.vertices[used], number[corners], normals[used], net.vertex_home[used], net.vertex_place[used], t.home
    )


def vertex_normals(net: Triangulation) -> Array:
    """At each vertex the mean of the unit normals of the surfaces round it; 0 where they have none."""
    t = net.triangles
    home, vertex, place = np.repeat(t.home, 3), t.corners.ravel(), t.places.reshape(-1, 2)
    _, first = np.unique(home * np.int64(len(net.vertices)) + vertex, return_index=True)
    total = np.zeros((len(net.vertices), 3))
    order = first[np.argsort(home[first], kind="stable")]
    numbers, starts = np.unique(home[order], return_index=True)
    for k, rows in zip(numbers, np.split(order, starts[1:])):
        normals = net.shell.surfaces[k].normal(place[rows, 0], place[rows, 1], undefined="nan")
        np.add.at(total, vertex[rows], np.nan_to_num(normals) * net.shell.turns[k])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 1e-6)
