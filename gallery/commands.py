"""What each command of the command line does; every verb returns the exit status."""

import json
import re
import sys
from argparse import Namespace
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from gallery.catalog import Entry, catalog, find, known

if TYPE_CHECKING:
    from implicit.domain import Bounds
    from implicit.mesh import Mesh
    from implicit.pictures.look import Look


def say(text: object) -> None:
    """A line on stdout."""
    sys.stdout.write(f"{text}\n")


def warn(text: object) -> None:
    """A line on stderr."""
    sys.stderr.write(f"gallery: {text}\n")


def render(options: Namespace) -> int:
    """Draw surfaces on one page."""
    from gallery.cards import Job
    from gallery.sheet import render_sheet, write_poster

    names = list(dict.fromkeys(find(name).name for name in options.names)) or list(catalog())
    job = Job(options.out, options.size, options.quality)
    cards = render_sheet(names, job, min(options.jobs, len(names)))
    bad = [card for card in cards if not card.good]
    for card in bad:
        for text in filter(None, (card.failure, *card.contradictions)):
            warn(f"{card.name}: {text}")
    if options.poster is not None:
        write_poster(cards, options.out, options.poster)
    say(options.out / "index.html")
    return 3 if bad else 0


def list_entries(options: Namespace) -> int:
    """Print the catalogue."""
    entries = catalog().values()
    if options.json:
        keys = ("name", "title", "kind", "formula", "source")
        rows = [{**{key: getattr(entry, key) for key in keys}, "facts": asdict(entry.facts)} for entry in entries]
        say(json.dumps(rows, indent=1, ensure_ascii=False))
        return 0
    width = max(len(entry.name) for entry in entries)
    for entry in entries:
        facts = entry.facts
        items = [f"degree {facts.degree}"] if facts.degree else []
        items += [f"{facts.types} singular"] if facts.singular_points else []
        items += [f"singular curves: {facts.singular_curves}"] if facts.singular_curves else []
        say(f"{entry.name:{width}}  {entry.kind:10}  " + ", ".join([entry.title, *items]))
    return 0


def show(options: Namespace) -> int:
    """Show one surface in a window, or draw it into a file."""
    from implicit.show import render as draw
    from implicit.show import show as open_window

    if options.out is not None and options.out.suffix.lower() != ".png":
        raise ValueError(f"a picture is saved as .png, got {options.out.name!r}")
    things, look = make(options)
    if options.out is None:
        open_window(*things, look=look, size=options.size)
    else:
        draw(things, options.out, look=look, size=options.size)
        say(options.out)
    return 0


def mesh(options: Namespace) -> int:
    """Save the triangles of one surface."""
    from implicit.files import check_suffix, save

    check_suffix(options.out)
    made: Any = make(options)[0][0]
    if options.separate:
        made = made.separate()
    save(made, options.out)
    say(made.report())
    return 0


def doctor(options: Namespace) -> int:
    """Say what this machine has and lacks."""
    from gallery.doctor import examine

    sick = False
    for finding in examine():
        say(f"{finding.what:14}{finding.value}")
        if finding.advice:
            say(f"{'':14}! {finding.advice}")
            sick = True
    return 4 if sick else 0


def make(options: Namespace) -> "tuple[list[object], Look]":
    """The mesh of the surface asked for, with what else belongs in its picture, and how it is looked at."""
    from gallery.cards import implicit_card, parametric_card

    text = options.surface
    if not known(text) and re.fullmatch(r"[a-z][a-z_0-9]{3,}", text):
        find(text)  # meant as a name: the error says which are near
    if not known(text):
        from implicit.pictures.look import Look

        return [formula_mesh(text, options.parameter, options.bounds, options.resolution or 96)], Look()
    entry = with_parameters(find(text), options.parameter)
    if entry.kind == "parametric":
        return parametric_card(entry, "normal")[1], entry.look
    entry = replace(entry, bounds=options.bounds or entry.bounds)
    return implicit_card(entry, "normal", options.resolution)[1], entry.look


def with_parameters(entry: Entry, parameters: list[str]) -> Entry:
    """The entry with other values of its parameters. Raises ValueError for a name that it does not have."""
    texts = [item.partition("=")[2] for item in parameters]
    given = {parameter_value(item)[0]: text for item, text in zip(parameters, texts, strict=True)}
    unknown = sorted(set(given) - set(entry.parameters))
    if unknown:
        there = f"its parameters are {', '.join(entry.parameters)}" if entry.parameters else "it has none"
        raise ValueError(f"{entry.name} has no parameter {', '.join(unknown)}; {there}")
    return replace(entry, parameters={**entry.parameters, **given})


def formula_mesh(text: str, parameters: list[str], bounds: "Bounds | None", resolution: int) -> "Mesh":
    """The mesh of a formula. Raises ValueError when there is no surface within the bounds."""
    from implicit.domain import to_bounds
    from implicit.polygonize import polygonize
    from implicit.surface import Surface

    values = dict(parameter_value(item) for item in parameters)
    region = bounds or to_bounds(2.0)
    made = polygonize(Surface(text, **values), region, resolution=resolution)
    if not len(made.vertices):
        raise ValueError(f"no surface found within {region}; give other --bounds or a higher --resolution")
    if made.report().boundary_edges:
        warn(f"the surface leaves {region} and has a rim there; --bounds R looks further")
    return made


def parameter_value(text: str) -> tuple[str, object]:
    """Name and value of a parameter given as name=value; the value is a formula such as (1+sqrt(5))/2."""
    from implicit.formula import parse

    name, sign, value = text.partition("=")
    if not sign or not name.strip().isidentifier():
        raise ValueError(f"a parameter is given as name=value, such as a=2; got {text!r}")
    return name.strip(), parse(value)
