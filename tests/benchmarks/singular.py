"""The catalogue of singular surfaces: what is found, whether it is proved to be all, and how long it takes.

Then the same for ten random rational turns and shifts of each surface of degree 6 or less, in a ball around the turned
box: in how many of them the answer is the same up to the map, and proved.
"""

import time
from collections import Counter
from statistics import median

import numpy as np
from numpy.typing import NDArray

from implicit import Ball, SingularLocus, Surface, singularities
from tests.singular_catalog import NAMES, box_of, entry_of, surface_of
from tests.test_singular_points import turned

Floats = NDArray[np.float64]


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
            f"| {name} | {surface.polynomial.degree} | {points} | {_count(entry['points'])} | {curves or '-'} "
            f"| {', '.join(map(str, leaves)) or '-'} | {len(locus.undecided)} | {'yes' if locus.complete else 'no'} "
            f"| {median(times):.3f} |"
        )
    return "\n".join([*lines, "", *_turned_table()])


def _turned_table() -> list[str]:
    lines = ["| surface, turned | same | proved | median s | longest s |", "|---|---|---|---|---|"]
    for name in NAMES:
        polynomial = surface_of(name).polynomial
        if polynomial is None or polynomial.degree > 6:
            continue
        rows = [_turn(name, seed) for seed in range(1, 11)]
        same, proved = sum(row[0] for row in rows), sum(row[1] for row in rows)
        times = [row[2] for row in rows]
        lines.append(f"| {name} | {same}/10 | {proved}/10 | {median(times):.3f} | {max(times):.3f} |")
    return lines


def _turn(name: str, seed: int) -> tuple[bool, bool, float]:
    surface, matrix, shift = turned(surface_of(name), seed)
    assert surface.polynomial is not None
    box = box_of(name).corners
    center = np.linalg.solve(matrix, box.mean(axis=0) - shift)
    radius = float(np.linalg.norm(box[1] - box[0])) / 2
    start = time.process_time()
    here = singularities(surface, Ball(radius, tuple(center)), timeout=60)
    seconds = time.process_time() - start
    there = singularities(surface_of(name), Ball(radius, tuple(box.mean(axis=0))), timeout=60)
    return _summary(here, matrix, shift) == _summary(there, np.eye(3), np.zeros(3)), here.complete, seconds


def _summary(locus: SingularLocus, matrix: Floats, shift: Floats) -> tuple[object, ...]:
    def rounded(points: list[Floats]) -> list[tuple[float, ...]]:
        return sorted(tuple((matrix @ p + shift).round(4) + 0.0) for p in points)

    kinds = sorted(str(point.type) for point in locus.points)
    special = rounded([s for curve in locus.curves for s in curve.special])
    leaves = sorted({int(n) for curve in locus.curves for n in curve.leaves})
    exact = sum(curve.expression is not None for curve in locus.curves)
    return kinds, rounded([p.position for p in locus.points]), len(locus.curves), exact, special, leaves


def _measure(surface: Surface, name: str) -> tuple[list[float], SingularLocus]:
    times: list[float] = []
    while not times or (len(times) < 3 and times[0] < 1):
        start = time.process_time()
        locus = singularities(surface, box_of(name), timeout=60)
        times.append(time.process_time() - start)
    return times, locus


def _count(types: dict[str, int]) -> str:
    return ", ".join(f"{number} {kind}" for kind, number in sorted(types.items())) or "-"
