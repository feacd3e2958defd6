"""Implicitization: kernel seconds with the proof over the integers, against sympy's Groebner bases and Singular.

Kernel time is from the homogeneous integer coordinates to the proved polynomial; reading and writing sympy expressions
is left out on our side, and so is building the ideal on the other. sympy runs in a child process and is stopped after
`_LIMIT` processor seconds; Singular is measured where it is installed.
"""

import resource
import shutil
import subprocess
import time
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import sympy
from sympy import cos, cosh, sin, sinh

from implicit.implicitize.clock import Clock
from implicit.implicitize.homogeneous import Coordinates, read_coordinates
from implicit.implicitize.matrix import matrix_form
from implicit.implicitize.solve import solve
from parametric import teapot
from tests.benchmarks.measure import markdown, measure
from tests.rational import bezier, random_net, u, v

_LIMIT = 10  # seconds for a peer
_N = 1 + u**2 + v**2
_DEN = 5 - 3 * cos(u) * cos(v)


def _revolved() -> tuple[Any, ...]:
    x, y, _ = bezier([[(1, 0, 0), (3, 1, 0), (0, 2, 0), (2, 4, 0)]])
    return x * cos(u), x * sin(u), y


CASES: dict[str, tuple[tuple[Any, ...], float]] = {  # name: coordinates, the most seconds allowed
    "sphere, trigonometric": ((cos(u) * cos(v), sin(u) * cos(v), sin(v)), 0.002),
    "sphere, stereographic": ((2 * u / _N, 2 * v / _N, (u**2 + v**2 - 1) / _N), 0.002),
    "cone": ((v * cos(u), v * sin(u), v), 0.002),
    "hyperboloid of one sheet": ((cos(u) - v * sin(u), sin(u) + v * cos(u), v), 0.002),
    "hyperboloid of two sheets": ((sinh(v) * cos(u), sinh(v) * sin(u), cosh(v)), 0.002),
    "elliptic paraboloid": ((v * cos(u), 2 * v * sin(u), v**2), 0.002),
    "hyperbolic paraboloid": ((u, v, u * v), 0.002),
    "torus": (((2 + cos(v)) * cos(u), (2 + cos(v)) * sin(u), sin(v)), 0.01),
    "ring cyclide": (
        ((4 * (3 - 5 * cos(u) * cos(v)) + 16 * cos(u)) / _DEN, 4 * sin(u) * (5 - 4 * cos(v)) / _DEN,
         4 * sin(v) * (3 * cos(u) - 4) / _DEN), 0.01),
    "Steiner": ((2 * v / _N, 2 * u / _N, 2 * u * v / _N), 0.01),
    "cross-cap": ((2 * u * v / _N, 2 * u / _N, (1 - v**2) / _N), 0.01),
    "Moebius strip": (((1 + v * cos(u / 2)) * cos(u), (1 + v * cos(u / 2)) * sin(u), v * sin(u / 2)), 0.05),
    "ruled by two cubics": (
        bezier([[(0, 0, 0), (1, 2, 0), (2, -1, 1), (3, 1, 2)], [(0, 0, 3), (1, -1, 4), (2, 3, 2), (4, 1, 3)]]), 0.05),
    "revolution of a cubic": (_revolved(), 0.05),
    "Enneper": ((u - u**3 / 3 + u * v**2, v - v**3 / 3 + v * u**2, u**2 - v**2), 0.1),
    "generic biquadratic": (bezier(random_net(2, 2, 1)), 0.1),
    "generic 2 x 3": (bezier(random_net(2, 3, 2)), 1.0),
    "generic bicubic": (bezier(random_net(3, 3, 4)), 10.0),
}  # fmt: skip


def _ideal(coordinates: Coordinates) -> tuple[list[sympy.Expr], tuple[sympy.Symbol, ...]]:
    s, t, e, x, y, z = names = sympy.symbols("s t e x y z")
    parts = [sum(c[0] * s**i * t**j for (i, j), c in terms.items()) for terms in coordinates.terms]
    return [w * parts[3] - p for w, p in zip((x, y, z), parts[:3], strict=True)] + [1 - e * parts[3]], names


def _groebner(equations: list[sympy.Expr], names: tuple[sympy.Symbol, ...], pipe: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_LIMIT, _LIMIT + 1))
    s, t, e, *xyz = names
    start = time.process_time()
    basis = sympy.groebner(equations, e, s, t, *xyz, order="lex")
    found = any(not p.free_symbols & {s, t, e} for p in basis.exprs)
    pipe.send((time.process_time() - start, found))


def _sympy_seconds(coordinates: Coordinates) -> str:
    ours, theirs = get_context("fork").Pipe(duplex=False)
    child = get_context("fork").Process(target=_groebner, args=(*_ideal(coordinates), theirs))
    child.start()
    theirs.close()
    try:
        seconds, found = ours.recv()
        text = f"{seconds:.2f}" if found else "fails"
    except EOFError:
        text = f"> {_LIMIT}"
    child.join()
    return text


def _singular_seconds(coordinates: Coordinates) -> str:
    if shutil.which("Singular") is None:
        return "not installed"
    equations, _ = _ideal(coordinates)
    listed = ",".join(str(sympy.expand(q)).replace("**", "^") for q in equations)
    program = f"ring r=0,(s,t,e,x,y,z),dp; ideal i={listed}; ideal j=eliminate(i,s*t*e); size(j); quit;"
    start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    try:
        subprocess.run(
            ["Singular", "-q"], input=program, text=True, capture_output=True, timeout=4 * _LIMIT, check=True
        )
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return "not finished"
    return f"{resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - start:.2f}"


def table() -> str:
    """All cases, the 32 patches of the teapot, and the matrix form."""
    rows: list[tuple[object, ...]] = []
    for name, (expressions, allowed) in CASES.items():
        coordinates = read_coordinates(expressions, (u, v))
        done = measure(lambda c=coordinates: solve(c, Clock()), 3 if allowed > 0.5 else 9)
        found, certificate = done.result
        facts = (certificate.degree, certificate.map_degree, len(found.terms), certificate.proof)
        peers = (_sympy_seconds(coordinates), _singular_seconds(coordinates))
        rows.append((name, *facts, f"{done.seconds:.4f}", f"{allowed:g}", *peers))
    patches = [read_coordinates(p.expressions(), (u, v), 1e-9) for p in teapot().surfaces]
    done = measure(lambda: [solve(c, Clock()) for c in patches], 1)
    degrees = sorted(certificate.degree for _, certificate in done.result)
    proofs = {certificate.proof for _, certificate in done.result}
    name = f"teapot, 32 patches ({degrees[0]} to {degrees[-1]})"
    rows.append((name, "", "", "", "/".join(proofs), f"{done.seconds:.1f}", "30", "", ""))
    header = ("surface", "degree", "of the map", "terms", "proof", "s", "at most", "sympy groebner s", "Singular s")
    return markdown(header, rows) + "\n\n" + _matrix_form()


def _matrix_form() -> str:
    expressions = bezier(random_net(3, 3, 4))
    built = measure(lambda: matrix_form(expressions, (u, v)), 3)
    form = built.result
    generator = np.random.default_rng(0)
    parameters = generator.random((20000, 2))
    points = np.stack(sympy.lambdify((u, v), expressions)(*parameters.T), axis=1)
    form(points[:10])
    evaluated = measure(lambda: form(points + 0.01), 5)
    inverted = measure(lambda: form.invert(points[:2000]), 3)
    error = np.abs(inverted.result - parameters[:2000]).max()
    rows = [
        ("build (reading included)", f"{built.seconds * 1e3:.0f} ms", ""),
        ("evaluate a point", f"{evaluated.seconds / len(points) * 1e6:.2f} us", "2 us"),
        ("invert a point", f"{inverted.seconds / 2000 * 1e6:.0f} us", ""),
        ("largest error of the parameters", f"{error:.1e}", "1e-10"),
    ]
    return markdown(("matrix form of the generic bicubic", "ours", "at most"), rows)
