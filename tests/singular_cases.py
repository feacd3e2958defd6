"""The known topology of singular surfaces, and what a mesh says of it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from implicit import Ball, Surface
from implicit.mesh import Mesh

CASES: dict[str, Any] = json.loads((Path(__file__).parent / "cases" / "singular_truth.json").read_text())["cases"]

Ints = NDArray[np.int64]


def case_of(name: str) -> tuple[Surface, Ball]:
    """The surface and the bounds of a case."""
    case = CASES[name]
    return Surface(sympy.sympify(case["f"])), Ball(case["clip_ball_radius"])


def truth_of(name: str) -> dict[str, Any]:
    """Euler characteristic, components, pieces after cutting at the singular set, links and sheets of a case."""
    case = CASES[name]
    return {
        "euler": case["chi"],
        "components": case["components"],
        "pieces": case["pieces_after_cutting_at_S"],
        "links": sorted((link["components"], link["chi"]) for link in case["links"] for _ in range(link["count"])),
        "sheets": {curve["sheets"] for curve in case["curves"]},
    }


def _pieces(pairs: Ints, size: int) -> int:
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
    return int(connected_components(graph, directed=False)[0])


def _link(faces: Ints, vertex: int) -> tuple[int, int]:
    """Components and Euler characteristic of the edges opposite a vertex."""
    near = faces[(faces == vertex).any(axis=1)]
    edges = near[near != vertex].reshape(-1, 2)
    if not len(edges):
        return 0, 0
    used, renamed = np.unique(edges, return_inverse=True)
    return _pieces(renamed.reshape(-1, 2), len(used)), len(used) - len(edges)


def topology(mesh: Mesh) -> dict[str, Any]:
    """What `truth_of` says, read off a mesh: counts of its faces alone, solitary points and curves left out."""
    faces = mesh.faces
    sides = np.sort(np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]]), axis=1)
    edges, number, uses = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    used, renamed = np.unique(edges, return_inverse=True)
    lines = [np.sort(np.column_stack([curve[:-1], curve[1:]]), axis=1) for curve in mesh.curves]
    size = len(mesh.vertices)
    singular = np.concatenate([np.zeros((0, 2), np.int64), *lines])
    keys = singular @ [size, 1]
    on = np.isin(edges @ [size, 1], keys)
    owner = np.tile(np.arange(len(faces)), 3)[np.argsort(number.ravel(), kind="stable")]
    first = np.cumsum(uses) - uses
    pair = first[(uses == 2) & ~on]
    count = dict(zip((edges @ [size, 1]).tolist(), uses.tolist(), strict=True))
    return {
        "euler": len(used) - len(edges) + len(faces),
        "components": _pieces(renamed.reshape(-1, 2), len(used)),
        "pieces": _pieces(np.column_stack([owner[pair], owner[pair + 1]]), len(faces)),
        "links": sorted(_link(faces, vertex) for vertex in mesh.points),
        "sheets": {count.get(key, 0) for key in keys.tolist()},
        "crowded": int(((uses > 2) & ~on).sum()),
    }


def residual(surface: Surface, mesh: Mesh) -> float:
    """The largest |f| / |grad f| at vertices off the singular set."""
    regular = np.ones(len(mesh.vertices), bool)
    for indices in (mesh.points, *mesh.curves):
        regular[indices] = False
    values, gradients = surface.field.gradients(np.array(mesh.vertices)[regular])
    return float((np.abs(values) / np.linalg.norm(gradients, axis=1)).max())
