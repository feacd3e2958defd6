"""The sheet: many cards made side by side, then one page and one report."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from gallery.cards import Card, Job, make_card
from gallery.page import write_page


def render_sheet(names: Sequence[str], job: Job, workers: int = 1) -> list[Card]:
    """Make the cards of `names` in `workers` processes, and write pictures, index.html and report.json.

    A progress bar runs on stderr if that is a terminal.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    job.folder.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    cards: dict[str, Card] = {}
    with Progress(*columns, console=console, transient=False, disable=not console.is_terminal) as progress:
        task = progress.add_task("gallery", total=len(names))
        for card in _cards(names, job, workers):
            cards[card.name] = card
            progress.update(task, advance=1, description=card.name)
        progress.update(task, description="gallery")
    ordered = [cards[name] for name in names]
    if any(card.renderer == "matplotlib" for card in ordered):
        console.print("no working OpenGL library (such as libEGL): pictures are drawn by matplotlib; `gallery doctor`")
    write_page(ordered, job)
    report = {"schema": 1, "quality": job.quality, "cards": [asdict(card) for card in ordered]}
    (job.folder / "report.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return ordered


def _cards(names: Sequence[str], job: Job, workers: int) -> Iterator[Card]:
    """The cards as they are ready. If a process dies, the rest are made one by one, so that only its surface fails."""
    if workers == 1:
        yield from (make_card(name, job) for name in names)
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = list(names)
    try:
        for card in Parallel(n_jobs=workers, return_as="generator_unordered")(
            delayed(make_card)(n, job) for n in names
        ):
            left.remove(card.name)
            yield card
    except TerminatedWorkerError as error:
        reason = f"the process that drew the surfaces died: {str(error).splitlines()[0]}"
        yield from (Card(name, failure=reason) for name in left)


def write_poster(cards: Sequence[Card], folder: Path, path: Path, columns: int = 4) -> None:
    """Put the pictures of `cards`, made in `folder`, side by side into one PNG, at half their size."""
    from PIL import Image

    pictures = [Image.open(folder / card.picture) for card in cards if card.picture]
    if not pictures:
        raise ValueError("a poster needs at least one picture, and no surface was drawn")
    width, height = (side // 2 for side in pictures[0].size)
    rows = -(-len(pictures) // columns)
    poster = Image.new("RGB", (min(columns, len(pictures)) * width, rows * height), "white")
    for place, picture in enumerate(pictures):
        small = picture.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
        poster.paste(small, (place % columns * width, place // columns * height))
    poster.save(path, "png", optimize=True)
