"""What is true of a mesh: counts of its parts, and whether it is closed, manifold and oriented."""

from dataclasses import dataclass

import numpy as np

from implicit.mesh import Mesh, double_areas
from implicit.topology import Edges, count_components, curve_edges, split_vertices

_FLAT = 1e-12
"""A triangle is degenerate when twice its area is at most this share of its longest edge squared."""


@dataclass(frozen=True)
class MeshReport:
    """What is true of a mesh: counts of its parts, and whether it is closed, manifold and oriented.

    closed: there are faces and no boundary edge. manifold: no edge has more than two faces and the faces round each
    vertex form one fan. oriented: neighbours run through their common edge in opposite directions. `genus` is the
    sum over the components of a closed oriented manifold, otherwise None.
    """

    closed: bool
    manifold: bool
    oriented: bool
    vertices: int
    edges: int
    faces: int
    components: int
    euler: int
    genus: int | None
    boundary_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    degenerate_faces: int
    curves: int
    unresolved: int | None

    @property
    def empty(self) -> bool:
        """Whether there is nothing at all: no face, no curve, no point."""
        return self.vertices == 0

    def __str__(self) -> str:
        """A few readable lines."""
        if self.empty:
            return "empty mesh: no vertices, no faces"
        kind = [
            "closed" if self.closed else f"open ({self.boundary_edges} boundary edges)",
            "manifold" if self.manifold else "not manifold",
            "oriented" if self.oriented else "not oriented",
        ]
        lines = [
            f"{self.vertices} vertices, {self.edges} edges, {self.faces} faces: {', '.join(kind)}",
            f"{_count(self.components, 'component')}, Euler characteristic {self.euler}"
            + ("" if self.genus is None else f", genus {self.genus}"),
        ]
        wrong = {
            "edge(s) with more than two faces": self.nonmanifold_edges,
            "vertex or vertices where sheets touch": self.nonmanifold_vertices,
            "degenerate face(s)": self.degenerate_faces,
            "undecided box(es)": self.unresolved or 0,
        }
        lines += [f"{number} {what}" for what, number in wrong.items() if number]
        if self.curves:
            lines.append(_count(self.curves, "curve"))
        return "\n".join(lines)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def describe(mesh: Mesh, edges: Edges) -> MeshReport:
    """The report of a mesh with these edges."""
    loose = curve_edges(mesh.curves, edges)
    used, components = count_components(mesh.faces, loose, mesh.points, len(mesh.vertices))
    split = len(split_vertices(mesh.faces, edges))
    euler = used - (edges.count + len(loose)) + len(mesh.faces)
    closed = len(mesh.faces) > 0 and edges.boundary == 0
    manifold = edges.crowded == 0 and split == 0
    whole = closed and manifold and edges.oriented and not len(loose)
    return MeshReport(
        closed=closed,
        manifold=manifold,
        oriented=edges.oriented,
        vertices=used,
        edges=edges.count + len(loose),
        faces=len(mesh.faces),
        components=components,
        euler=euler,
        genus=components - euler // 2 if whole else None,
        boundary_edges=edges.boundary,
        nonmanifold_edges=edges.crowded,
        nonmanifold_vertices=split,
        degenerate_faces=_count_flat(mesh),
        curves=len(mesh.curves),
        unresolved=None if mesh.unresolved is None else len(mesh.unresolved),
    )


def _count_flat(mesh: Mesh) -> int:
    corners = mesh.vertices[mesh.faces]
    longest = np.max(np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=2), axis=1, initial=0.0)
    double = np.linalg.norm(double_areas(mesh.vertices, mesh.faces), axis=1)
    return int(np.count_nonzero(double <= _FLAT * longest))
