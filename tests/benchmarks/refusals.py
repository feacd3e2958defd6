"""Fifty singular sets damaged at random: a point or curve missing or displaced must be refused, every time.

A curve that is displaced a little may also be put right: arcs are moved onto the singular set before they are used.
"""

from collections import Counter
from dataclasses import replace

import numpy as np

from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.assemble import MARGIN
from implicit.polygonizers.conforming.grid import Grid
from implicit.singular import SingularLocus, singularities
from tests.benchmarks.measure import markdown
from tests.singular_cases import case_of, residual, topology, truth_of

_CASES = (
    *("double_cone", "dingdong", "source_1", "source_2_intended", "source_2_printed", "whitney", "cayley", "A2"),
    *("D4p", "A3m", "cuspidal_edge", "two_spheres_crossing", "spindle_torus"),
)
_RESOLUTION = 24


def damaged(locus: SingularLocus, rng: np.random.Generator) -> tuple[str, SingularLocus]:
    """The locus with one part missing or displaced by a hundred-thousandth to a tenth, and what was done."""
    parts = len(locus.points) + len(locus.curves)
    chosen = int(rng.integers(parts))
    points, curves = list(locus.points), list(locus.curves)
    missing = bool(rng.random() < 0.4)
    way = rng.normal(size=3)
    way *= 10.0 ** rng.uniform(-5, -1) / np.linalg.norm(way)
    if chosen < len(points):
        point = points.pop(chosen)
        if not missing:
            points.append(replace(point, position=point.position + way, exact=None))
    else:
        curve = curves.pop(chosen - len(points))
        if not missing:
            moved = replace(curve, polyline=curve.polyline + way, expression=None, special=curve.special + way)
            curves.append(moved)
    kind = "point" if chosen < len(locus.points) else "curve"
    return f"{kind} {'missing' if missing else 'displaced'}", replace(locus, points=tuple(points), curves=tuple(curves))


def table(count: int = 50) -> str:
    """How many of each kind were refused, raised an error, were put right, or passed."""
    hows = ("refused", "raised", "put right", "passed")
    found: dict[str, Counter[str]] = {how: Counter() for how in hows}
    for seed in range(count):
        name = _CASES[seed % len(_CASES)]
        surface, ball = case_of(name)
        locus = singularities(surface, Grid.over(ball, _RESOLUTION, MARGIN).box)
        kind, wrong = damaged(locus, np.random.default_rng(seed))
        try:
            mesh = conforming(surface, ball, _RESOLUTION, wrong)
        except ValueError:
            found["raised"][kind] += 1
            continue
        if mesh.unresolved is not None and len(mesh.unresolved) > 0:
            found["refused"][kind] += 1
            continue
        shape = topology(mesh)
        right = shape.pop("crowded") == 0 and shape == truth_of(name) and residual(surface, mesh) < 1e-10
        found["put right" if right else "passed"][kind] += 1
    kinds = sorted(set().union(*found.values()))
    return markdown(["what is wrong", *found], [[kind, *(found[how][kind] for how in found)] for kind in kinds])
