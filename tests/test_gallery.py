"""The catalogue is true, the page has every surface, and one that fails does not stop the others."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from math import pi
from pathlib import Path

import numpy as np
import pytest

from gallery import cards, sheet
from gallery.__main__ import main
from gallery.beside import plain_mesh
from gallery.cards import (
    Card,
    Job,
    contradictions,
    entry_bounds,
    implicit_card,
    make_card,
    make_surface,
    parametric_card,
)
from gallery.catalog import Entry, Facts, catalog, find
from gallery.measure import distance_to_triangles, implicit_distance, parametric_distance
from gallery.page import write_page
from gallery.typeset import typeset
from implicit import Ball, Box, Mesh, Surface, polygonize

ENTRIES = catalog()
IMPLICIT = [entry for entry in ENTRIES.values() if entry.kind == "implicit"]
PARAMETRIC = [entry for entry in ENTRIES.values() if entry.kind == "parametric"]
MANDATORY = {
    *("chapter_node", "chapter_a5", "chapter_line", "hyperbolic_paraboloid", "dupin_cyclide", "sphere", "torus"),
    *("gyroid", "cayley_cubic", "clebsch_cubic", "barth_sextic", "whitney_umbrella", "teapot", "bezier_patch"),
    *("bspline_surface", "coons_patch", "ruled_surface", "revolved_vase", "swept_knot", "csg_solid"),
}


def ids(entries: list[Entry]) -> list[str]:
    return [entry.name for entry in entries]


def test_the_catalogue_holds_what_it_should() -> None:
    assert ENTRIES.keys() >= MANDATORY
    assert len(ENTRIES) >= 24


@pytest.mark.parametrize("entry", IMPLICIT, ids=ids(IMPLICIT))
def test_the_facts_of_an_implicit_surface(entry: Entry) -> None:
    """Degree, singular points and their types, singular curves; closed and Euler characteristic of the mesh."""
    card, _ = implicit_card(entry, "draft")
    assert not contradictions(card, entry.facts)
    if entry.facts.degree is not None:
        assert card.degree == entry.facts.degree
    if entry.facts.singular_points == 0 and not entry.facts.singular_curves:
        assert card.complete, "that there are no singular points is proved"


@pytest.mark.parametrize("entry", PARAMETRIC, ids=ids(PARAMETRIC))
def test_the_facts_of_a_parametric_surface(entry: Entry) -> None:
    """Closed or not and the Euler characteristic; the tolerance is kept at points the mesh was not made from."""
    card, things = parametric_card(entry, "draft")
    assert not contradictions(card, entry.facts)
    assert card.distance <= cards.TOLERANCE["draft"] * card.diagonal * 1.02
    mesh = things[0]
    assert isinstance(mesh, Mesh)
    assert mesh.report().oriented or entry.name == "moebius_strip"


@pytest.mark.parametrize("entry", [e for e in IMPLICIT if e.facts.volume is not None], ids=lambda e: e.name)
def test_volumes_are_those_of_theory_to_second_order(entry: Entry) -> None:
    """Halving the cells divides the error of the volume by four."""
    assert entry.facts.volume is not None
    surface, bounds = make_surface(entry), entry_bounds(entry)
    volumes = [polygonize(surface, bounds, resolution=n).volume for n in (24, 48, 96)]
    errors = np.abs(np.array(volumes) - entry.facts.volume) / entry.facts.volume
    assert errors[-1] < 2e-3
    assert np.all(errors[:-1] / errors[1:] > 3)


def test_the_cylinder_of_revolution_and_torus_have_the_volumes_of_pappus() -> None:
    assert find("torus").facts.volume == pytest.approx(2 * pi * 2 * pi)
    assert find("sphere").facts.volume == pytest.approx(4 * pi / 3)


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))
def test_every_entry_has_a_title_a_source_and_a_formula_that_can_be_set(entry: Entry) -> None:
    assert entry.title
    assert entry.source
    html = typeset(entry.formula)
    assert html.count("<sup>") == html.count("</sup>")
    assert "^" not in html
    assert "*" not in html
    assert re.fullmatch(r"[a-z][a-z0-9_]*", entry.name)


def test_names_that_are_nearly_right_are_recognised() -> None:
    with pytest.raises(ValueError, match="did you mean whitney_umbrella"):
        find("whitney_umbrela")
    with pytest.raises(ValueError, match="`gallery list` names them all"):
        find("qqqqqq")


@pytest.mark.parametrize(
    ("formula", "html"),
    [
        ("x^2 + y^2 = z", "<i>x</i><sup>2</sup> + <i>y</i><sup>2</sup> = <i>z</i>"),
        ("-x^(u + 1)", "−<i>x</i><sup><i>u</i> + 1</sup>"),
        ("7/4 x", "<sup>7</sup>⁄<sub>4</sub><i>x</i>"),
        ("sqrt(5 - q)", "√(5 − <i>q</i>)"),
        ("sin(x) < 2", "sin(<i>x</i>)&lt;2"),
        ("B_i3(u)", "<i>B</i><sub>i3</sub>(<i>u</i>)"),
    ],
)
def test_formulas_are_set_as_people_write_them(formula: str, html: str) -> None:
    assert typeset(formula) == html


def test_the_distance_of_a_sphere_from_its_mesh_is_its_sagitta() -> None:
    """A regular octahedron in the unit sphere comes within 1/sqrt(3) of the centre: at the middles of its faces."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    distance = implicit_distance(Mesh(vertices, faces), Surface("x^2 + y^2 + z^2 = 1"))
    assert distance == pytest.approx(1 - 1 / np.sqrt(3), abs=1e-6)


def test_the_distance_from_a_mesh_is_that_of_the_nearest_triangle() -> None:
    """Against a search through all triangles, on a mesh of very uneven ones."""
    from parametric import BezierSurface

    surface = BezierSurface([[(i, j, (i * j) % 3) for j in range(3)] for i in range(3)])
    u, v = np.meshgrid(np.array([0, 0.02, 0.05, 0.5, 1]), np.array([0, 0.9, 1]), indexing="ij")
    index = np.arange(15).reshape(5, 3)
    a, b, c, d = (index[i : i + 4, j : j + 2].ravel() for i in (0, 1) for j in (0, 1))
    mesh = Mesh(surface(u, v).reshape(-1, 3), np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)]))
    share = (np.arange(10) + 0.5) / 10
    points = surface(*np.meshgrid(share, share)).reshape(-1, 3)
    triangles = mesh.vertices[mesh.faces]
    brute = [distance_to_triangles(np.tile(p, (len(triangles), 1)), triangles).min() for p in points]
    assert parametric_distance(mesh, (surface,), 10) == pytest.approx(max(brute), rel=1e-12)


def test_the_poster_has_the_pictures_in_rows(tmp_path: Path) -> None:
    from PIL import Image

    made = sheet.render_sheet(["sphere", "torus", "bezier_patch"], Job(tmp_path, (80, 60), "draft"))
    sheet.write_poster(made, tmp_path, tmp_path / "poster.png", columns=2)
    poster = Image.open(tmp_path / "poster.png")
    assert poster.size == (80, 60)
    assert poster.getpixel((79, 59)) == (255, 255, 255)  # the fourth place is empty
    with pytest.raises(ValueError, match="at least one picture"):
        sheet.write_poster([Card("sphere", failure="no")], tmp_path, tmp_path / "none.png")


class Tags(HTMLParser):
    """What tags a page has, and whether they are balanced."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attributes)))
        if tag not in {"meta", "img", "link", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_stands_alone(tmp_path: Path) -> None:
    """No script, nothing from the network, every picture beside it, every card with its facts."""
    assert main(["render", "sphere", "coons_patch", "--out", str(tmp_path), "--quality", "draft", "--size", "80x60",
                 "--jobs", "1"]) == 0  # fmt: skip
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    tags = Tags()
    tags.feed(page)
    assert not tags.open
    assert "script" not in {tag for tag, _ in tags.seen}
    links = [value for _, attributes in tags.seen for name, value in attributes.items() if name in ("src", "href")]
    assert set(links) == {"sphere.png", "coons_patch.png"}
    assert all((tmp_path / str(link)).stat().st_size > 500 for link in links)
    assert "http" not in page
    assert "prefers-color-scheme: dark" in page
    for word in ("Sphere", "Coons patch", "degree", "singular points", "triangles", "closed", "distance", "seconds"):
        assert word in page
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert [card["name"] for card in report["cards"]] == ["sphere", "coons_patch"]


def test_a_surface_that_fails_is_a_red_card_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = replace(find("sphere"), formula="x^2 + y^2 + z^2 + 5 = 0", title="Nowhere")
    wrong = replace(find("torus"), facts=Facts(degree=5))
    entries = {**ENTRIES, "sphere": broken, "torus": wrong}
    for module in ("gallery.catalog", "gallery.page", "gallery.commands"):
        monkeypatch.setattr(f"{module}.catalog", lambda: entries)
    names = ["sphere", "torus", "coons_patch"]
    assert main(["render", *names, "--out", str(tmp_path), "--quality", "draft", "--size", "80x60", "--jobs", "1"]) == 3
    error = capsys.readouterr().err
    assert "sphere: ValueError: there is nothing to draw" in error
    assert "torus: degree should be 5, found 4" in error
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count('class="bad"') == 2
    assert (tmp_path / "coons_patch.png").exists()
    assert not (tmp_path / "sphere.png").exists()


def test_two_processes_make_the_same_cards_as_one(tmp_path: Path) -> None:
    names = ["sphere", "bezier_patch", "ruled_surface"]
    alone, beside = (sheet.render_sheet(names, Job(tmp_path / str(n), (80, 60), "draft"), n) for n in (1, 2))
    for one, two in zip(alone, beside, strict=True):
        assert replace(one, seconds=0) == replace(two, seconds=0)


def test_text_from_surfaces_cannot_break_the_page(tmp_path: Path) -> None:
    write_page([Card("sphere", failure="<script>alert(1)</script>")], Job(tmp_path))
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


@pytest.mark.parametrize(
    "path", sorted((Path(cards.__file__).parent / "notebooks").glob("*.ipynb")), ids=lambda p: p.stem
)
def test_notebooks_run(path: Path) -> None:
    """Every notebook runs from the top, shows at least one picture, and is kept without its output."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    NotebookClient(notebook, timeout=200, kernel_name="python3").execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not [output for output in outputs if output.get("name") == "stderr"]


def test_a_plain_marching_cubes_stands_beside_singular_surfaces(tmp_path: Path) -> None:
    job = Job(tmp_path, (160, 120), "draft", "matplotlib")
    card = make_card("cayley_cubic", job)
    assert card.good and (tmp_path / card.beside).stat().st_size > 0
    write_page([card], job)
    assert card.beside in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_the_mesh_beside_looks_outward() -> None:
    mesh = plain_mesh(Surface("x^2 + y^2 + z^2 = 1"), Box((-1.2,) * 3, (1.2,) * 3), 20)
    assert mesh.report().closed and mesh.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    cut = plain_mesh(Surface("z"), Ball(1), 20)
    assert np.linalg.norm(cut.vertices, axis=1).max() <= 1 + 1e-12
