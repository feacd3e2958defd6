"""The catalogue of singular surfaces: what is found, whether it is proved to be all, and how long it takes."""

import time
from collections import Counter
from statistics import median

from implicit import SingularLocus, Surface, singularities
from tests.singular_catalog import NAMES, box_of, entry_of, surface_of


def table() -> str:
    """CPU seconds of one core, reading of the formula not counted; medians of three where under a second."""
    singularities(Surface("x^2 + y^2 = z^2"), 1)
    lines = [
        "| surface | degree | points | known | curves | leaves | undecided boxes | proved | s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in NAMES:
        surface, entry = surface_of(name), entry_of(name)
        assert surface.polynomial is not None
        times, locus = _measure(surface, name)
        points = _count(dict(Counter(point.type or "?" for point in locus.points)))
        curves = len(locus.curves)
        leaves = sorted({int(n) for curve in locus.curves for n in curve.leaves})
        lines.append(
            f"| {name} | {surface.degree} | {points} | {_count(entry['points'])} | {curves or '-'} "
            f"| {', '.join(map(str, leaves)) or '-'} | {len(locus.undecided)} | {'yes' if locus.complete else 'no'} "
            f"| {median(times):.3f} |"
        )
    return "\n".join(lines)


def _measure(surface: Surface, name: str) -> tuple[list[float], SingularLocus]:
    times: list[float] = []
    while not times or (len(times) < 3 and times[0] < 1):
        start = time.process_time()
        locus = singularities(surface, box_of(name), timeout=60)
        times.append(time.process_time() - start)
    return times, locus


def _count(types: dict[str, int]) -> str:
    return ", ".join(f"{number} {kind}" for kind, number in sorted(types.items())) or "-"
