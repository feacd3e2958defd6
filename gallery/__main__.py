"""The command line: render, list, show, mesh, doctor.

Exit status 0: well; 1: a fault of ours; 2: bad input; 3: a surface is not as it should be; 4: the machine lacks
something.
"""

import argparse
import os
import re
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from gallery import commands
from implicit.domain import Ball, Bounds, Box, to_bounds

COMMANDS = ("render", "list", "show", "mesh", "doctor")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or (words[0] not in COMMANDS and words[0] not in ("-h", "--help", "--version")):
        words.insert(0, "render")
    options = _parser().parse_args(_keep_minus(words) if words[0] in ("show", "mesh") else words)
    try:
        status = options.run(options)
    except (ValueError, OSError, MemoryError) as error:
        print(f"gallery: {error}", file=sys.stderr)
        return 2
    except (ImportError, RuntimeError) as error:
        print(f"gallery: {error}", file=sys.stderr)
        return 4
    except KeyboardInterrupt:
        print("gallery: stopped", file=sys.stderr)
        return 130
    return int(status or 0)


def _keep_minus(words: list[str]) -> list[str]:
    """The words, a formula that begins with a minus behind a space: argparse would take it for an option.

    -o, -h and -p a=2 stay options, and what follows an option that waits for its value is that value.
    """
    kept = words[:1]
    for before, word in pairwise(words):
        waits = re.fullmatch(r"-[op]|--[a-z]+", before) and not "--separate".startswith(before)
        formula = not waits and re.match(r"-(?!-|o|h|p\w*\s*=).*[xyz]", word, re.DOTALL)
        kept.append(f" {word}" if formula else word)
    return kept


def _parser() -> argparse.ArgumentParser:
    from implicit import __version__

    parser = argparse.ArgumentParser(prog="gallery", description="Surfaces, drawn and meshed.")
    parser.add_argument("--version", action="version", version=__version__)
    verbs = parser.add_subparsers(required=True, metavar="command")

    render = verbs.add_parser("render", help="draw all surfaces, or the named ones, on one page (the default)")
    render.add_argument("names", nargs="*", metavar="NAME")
    render.add_argument("--out", type=Path, default=Path("out/gallery"), help="folder for the page (%(default)s)")
    render.add_argument("--size", type=_size, default=(640, 480), metavar="WxH", help="of the pictures (640x480)")
    render.add_argument("--quality", choices=("draft", "normal", "fine"), default="normal", help="(%(default)s)")
    render.add_argument("--jobs", type=_count, default=_processors(), help="processes side by side (%(default)s)")
    render.add_argument("--poster", type=Path, metavar="FILE.png", help="all pictures side by side in one file")
    render.set_defaults(run=commands.render)

    listing = verbs.add_parser("list", help="the surfaces and what is known of them")
    listing.add_argument("--json", action="store_true", help="for programs")
    listing.set_defaults(run=commands.list_entries)

    show = verbs.add_parser("show", help="one surface in a window, or in a picture file")
    _add_surface(show)
    show.add_argument("--out", type=Path, metavar="FILE.png", help="draw into this file instead")
    show.add_argument("--size", type=_size, default=(1024, 768), metavar="WxH", help="(1024x768)")
    show.set_defaults(run=commands.show)

    mesh = verbs.add_parser("mesh", help="one surface as a file of triangles")
    _add_surface(mesh)
    mesh.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help=".stl .ply .obj .glb .vtp or .3mf")
    mesh.add_argument("--separate", action="store_true", help="a vertex for each sheet where sheets cross or touch")
    mesh.set_defaults(run=commands.mesh)

    doctor = verbs.add_parser("doctor", help="what this machine has and lacks")
    doctor.set_defaults(run=commands.doctor)
    return parser


def _add_surface(parser: argparse.ArgumentParser) -> None:
    what = "a name of the list, or a formula such as 'x^2+y^2=z' (after -- if it begins like an option)"
    parser.add_argument("surface", type=str.strip, metavar="NAME|FORMULA", help=what)
    parser.add_argument("--bounds", type=_bounds, help="R: |x|, |y|, |z| <= R; ball:R; box:x0,y0,z0,x1,y1,z1 (2)")
    parser.add_argument("--resolution", type=_count, help="cells along the longest side (96)")
    parser.add_argument("-p", "--parameter", action="append", default=[], metavar="a=2", help="value of a name")


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"wanted a whole number from 1, got {text!r}")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    size = _count(width), _count(height)
    if max(size) > 8000:
        raise argparse.ArgumentTypeError(f"a picture is at most 8000 pixels wide and high, got {text!r}")
    return size


def _bounds(text: str) -> Bounds:
    kind, _, numbers = text.rpartition(":")
    try:
        values = [float(number) for number in numbers.split(",")]
        if kind == "" and len(values) == 1:
            return to_bounds(values[0])
        if kind in ("ball", "sphere") and len(values) == 1:
            return Ball(values[0])
        if kind == "box" and len(values) == 6:
            return Box(values[:3], values[3:])
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{error} in {text!r}") from None
    raise argparse.ArgumentTypeError(f"wanted R, ball:R or box:x0,y0,z0,x1,y1,z1, got {text!r}")


if __name__ == "__main__":
    sys.exit(main())
