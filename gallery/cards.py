"""One surface of the catalogue made, measured, drawn, and held against its facts."""

import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gallery.catalog import Entry, Facts, find
from gallery.measure import implicit_distance, parametric_distance, sample
from implicit.domain import Bounds, to_bounds
from implicit.mesh import Mesh
from implicit.pictures.scene import Line

Quality = Literal["draft", "normal", "fine"]

RESOLUTION: dict[Quality, int] = {"draft": 40, "normal": 64, "fine": 160}
"""Cells along the longest side of the bounds."""
TOLERANCE: dict[Quality, float] = {"draft": 3e-3, "normal": 1e-3, "fine": 2e-4}
"""Chord distance as a share of the surface's diagonal."""


@dataclass(frozen=True)
class Job:
    """How every card of one run is made."""

    folder: Path
    size: tuple[int, int] = (640, 480)
    quality: Quality = "normal"
    renderer: Literal["auto", "vtk", "matplotlib"] = "auto"


@dataclass(frozen=True)
class Card:
    """What was found out about a surface.

    beside          the picture of scikit-image's mesh with the same cells
    conforming      whether the mesh has the singular points and curves as vertices and edges; else its topology near
                    them is the lattice's
    contradictions  what is not as the catalogue says
    failure         why there is no picture
    """

    name: str
    picture: str = ""
    beside: str = ""
    renderer: str = ""
    degree: int | None = None
    singular_points: int | None = None
    types: str = ""
    singular_curves: int | None = None
    complete: bool = True
    conforming: bool = True
    triangles: int = 0
    closed: bool = False
    euler: int = 0
    distance: float = 0.0
    diagonal: float = 1.0
    seconds: float = 0.0
    contradictions: tuple[str, ...] = ()
    failure: str = ""

    @property
    def good(self) -> bool:
        """Whether the surface was drawn and is as the catalogue says."""
        return not (self.failure or self.contradictions)


def make_card(name: str, job: Job) -> Card:
    """The card of the surface called `name`, with its picture in the job's folder. An error becomes a card as well."""
    start = time.perf_counter()
    try:
        card = _draw(find(name), job)
    except Exception as error:  # the other surfaces go on; the page shows this one in red
        where = traceback.extract_tb(error.__traceback__)[-1]
        failure = f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})"
        card = Card(name, failure=failure)
    return replace(card, seconds=time.perf_counter() - start)


def _draw(entry: Entry, job: Job) -> Card:
    from implicit.show import find_renderer, render

    renderer = find_renderer() if job.renderer == "auto" else job.renderer
    maker = implicit_card if entry.kind == "implicit" else parametric_card
    card, things = maker(entry, job.quality)
    picture = f"{entry.name}.png"
    render(things, job.folder / picture, size=job.size, look=entry.look, renderer=renderer)
    card = replace(card, picture=picture, renderer=renderer, contradictions=contradictions(card, entry.facts))
    if entry.beside:
        from gallery.beside import plain_mesh

        cells = round(RESOLUTION[job.quality] * entry.detail)
        mesh = plain_mesh(make_surface(entry), entry_bounds(entry), cells)
        card = replace(card, beside=f"{entry.name}_scikit_image.png")
        render([mesh], job.folder / card.beside, size=job.size, look=entry.look, renderer=renderer)
    return card


def implicit_card(entry: Entry, quality: Quality, resolution: int | None = None) -> tuple[Card, list[object]]:
    """The card without its picture, and what the picture shows."""
    from implicit.polygonize import polygonize
    from implicit.singular import singularities

    surface, bounds = make_surface(entry), entry_bounds(entry)
    cells = resolution or round(RESOLUTION[quality] * entry.detail)
    mesh = polygonize(surface, bounds, resolution=cells, method=entry.method)
    card = _mesh_card(entry, mesh, implicit_distance(mesh, surface))
    things: list[object] = [mesh]
    if surface.degree is not None:
        locus = singularities(surface, bounds, timeout=60)
        kinds = [point.type for point in locus.points]
        types = ", ".join(f"{kinds.count(kind)} {kind}".removeprefix("1 ") for kind in dict.fromkeys(kinds) if kind)
        card = replace(card, degree=surface.degree, singular_points=len(locus.points), types=types)
        card = replace(card, singular_curves=len(locus.curves), complete=locus.complete)
        if (locus.points or locus.curves or not locus.complete) and not len(mesh.points) and not mesh.curves:
            card = replace(card, conforming=False)
            things.append(locus)
    return card, things


def parametric_card(entry: Entry, quality: Quality) -> tuple[Card, list[object]]:
    """The card without its picture, and what the picture shows."""
    from parametric.tessellate import tessellate

    surface = make_surface(entry)
    parts = tuple(getattr(surface, "surfaces", (surface,)))
    rough = np.concatenate([sample(part, 9).reshape(-1, 3) for part in parts])
    size = float(np.linalg.norm(np.ptp(rough, axis=0)))
    mesh = tessellate(surface, tolerance=TOLERANCE[quality] * size / entry.detail)
    return _mesh_card(entry, mesh, parametric_distance(mesh, parts)), [mesh, *overlay(entry, surface)]


def overlay(entry: Entry, surface: Any) -> list[Line]:
    """The lines of constant u and v, and the control net, that an entry is drawn with."""
    lines = []
    (u0, u1), (v0, v1) = getattr(surface, "domain", ((0, 1), (0, 1)))
    steps_u, steps_v = entry.iso_lines
    fine = 129
    lines += [Line(surface(np.full(fine, u), np.linspace(v0, v1, fine))) for u in _steps(u0, u1, steps_u)]
    lines += [Line(surface(np.linspace(u0, u1, fine), np.full(fine, v))) for v in _steps(v0, v1, steps_v)]
    if entry.control_net:
        net = surface.points
        lines += [Line(row, dots=True) for row in net]
        lines += [Line(net[:, column]) for column in range(net.shape[1])]
    return lines


def make_surface(entry: Entry) -> Any:
    """The surface of an entry: an `implicit.Surface`, a parametric surface or a shell."""
    if entry.build is not None:
        return entry.build()
    from implicit.formula import parse
    from implicit.surface import Surface

    return Surface(entry.formula, **{name: parse(text) for name, text in entry.parameters.items()})


def entry_bounds(entry: Entry) -> Bounds:
    """The bounds of an implicit entry."""
    if entry.bounds is None:
        raise ValueError(f"{entry.name} is parametric and has no bounds")
    return to_bounds(entry.bounds)


def _steps(low: float, high: float, count: int) -> list[float]:
    return np.linspace(low, high, count + 1).tolist() if count else []


def contradictions(card: Card, facts: Facts) -> tuple[str, ...]:
    """Where the card is not as the facts say; a type that was not found out contradicts nothing."""
    names = ["degree", "singular_points", "types", "singular_curves"] + ["closed", "euler"] * card.conforming
    pairs = [(name, getattr(facts, name), getattr(card, name)) for name in names]
    return tuple(
        f"{name.replace('_', ' ')} should be {wanted}, found {found}"
        for name, wanted, found in pairs
        if wanted not in (None, "") and found != wanted and not (name == "types" and found == "")
    )


def _mesh_card(entry: Entry, mesh: Mesh, distance: float) -> Card:
    report = mesh.report()
    return Card(
        entry.name,
        triangles=len(mesh.faces),
        closed=report.closed,
        euler=surface_euler(mesh),
        distance=distance,
        diagonal=float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) if len(mesh.vertices) else 1.0,
    )


def surface_euler(mesh: Mesh) -> int:
    """The Euler characteristic of the triangles alone, without solitary curves and points."""
    return Mesh(mesh.vertices, mesh.faces).report().euler
