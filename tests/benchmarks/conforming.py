"""All singular cases at full size: topology against the truth, refusals, and the cost beside plain marching.

Run as `python -m tests.benchmarks.conforming [resolution] [rotations]`.
"""

import sys
import time
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from implicit import Ball, Surface, polygonize
from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.assemble import MARGIN
from implicit.polygonizers.conforming.grid import Grid
from implicit.singular import singularities
from tests.singular_cases import CASES, case_of, residual, topology, truth_of

_NOWHERE = np.zeros(3)
_PATIENCE = 600.0
"""Seconds by the clock for a locus: turned sextics need 40 on a core of their own, more on one that is shared."""


def turned(surface: Surface, seed: int) -> Surface:
    """The surface turned at random about the origin; seed 0 leaves it as it is."""
    return moved(surface, seed, np.zeros(3))


def moved(surface: Surface, seed: int, offset: NDArray[np.float64]) -> Surface:
    """The surface turned at random about the origin and then moved by an offset."""
    names = sympy.symbols("x y z", real=True)
    image = sympy.Matrix(names) - sympy.Matrix([sympy.Rational(float(v)) for v in offset])
    if seed:
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        image = sympy.Matrix(np.vectorize(lambda v: sympy.Rational(float(v)))(turn).tolist()) * image
    return Surface(surface.expression.subs(dict(zip(names, image, strict=True)), simultaneous=True))


def row(name: str, resolution: int, seed: int, offset: NDArray[np.float64] = _NOWHERE) -> dict[str, Any]:
    """One case: what was found, whether it is the truth, and CPU seconds of locus, mesh and plain marching.

    The surface and its bounds are moved by the offset together.
    """
    surface, ball = case_of(name)
    surface, ball = moved(surface, seed, offset), Ball(ball.radius, offset)
    start = time.process_time()
    locus = singularities(surface, Grid.over(ball, resolution, MARGIN).box, timeout=_PATIENCE)
    found = time.process_time()
    mesh = conforming(surface, ball, resolution, locus)
    meshed = time.process_time()
    polygonize(surface, ball, resolution=resolution, method="marching")
    swept = time.process_time()
    shape = topology(mesh)
    crowded = shape.pop("crowded")
    return {
        "right": shape == truth_of(name) and crowded == 0,
        "unresolved": 0 if mesh.unresolved is None else len(mesh.unresolved),
        "residual": residual(surface, mesh) / ball.radius,
        "locus": found - start,
        "mesh": meshed - found,
        "marching": swept - meshed,
    }


def table(resolution: int = 64, turns: int = 0) -> str:
    """A row for each case, unturned and turned at random."""
    lines = [
        "| case | turn | right | unresolved | residual | locus | mesh | marching |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in CASES:
        for seed in range(turns + 1):
            r = row(name, resolution, seed)
            right = "yes" if r["right"] else "NO"
            seconds = " | ".join(f"{r[key]:.2f}" for key in ("locus", "mesh", "marching"))
            lines.append(f"| {name} | {seed} | {right} | {r['unresolved']} | {r['residual']:.0e} | {seconds} |")
    return f"CPU seconds, resolution {resolution}.\n\n" + "\n".join(lines)


if __name__ == "__main__":
    print(table(*(int(number) for number in sys.argv[1:])))
