"""Shells: tessellation of the teapot, and classification near a torus, against libigl on a mesh of it."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

from implicit import classify
from implicit.mesh import Mesh
from implicit.sides.winding import MeshWinding
from parametric import Shell, teapot, tessellate
from tests.benchmarks.measure import markdown, measure
from tests.solids import torus_patches

DISTANCES = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12, 1e-14)


def table() -> str:
    """Tables of tessellation, speed, answers and compile time."""
    return "\n\n".join([_tessellation(), _speed(), _answers(), _compilation()])


def _tessellation() -> str:
    pot = teapot()
    rng = np.random.default_rng(11)
    samples = np.concatenate([s(*rng.uniform(size=(2, 3125))) for s in pot.surfaces])
    rows = []
    for tolerance, certified in ((1e-2, False), (1e-3, False), (1e-3, True), (1e-4, False)):
        timed = measure(lambda t=tolerance, c=certified: tessellate(pot, tolerance=t, certified=c), 3)
        mesh, report = timed.result, timed.result.report()
        outside = int(np.count_nonzero(~MeshWinding(mesh).within(samples, tolerance)))
        name = f"{tolerance:g}{', certified' if certified else ''}"
        rows.append([name, f"{timed.seconds:.2f}", len(mesh.faces), outside, report.nonmanifold_edges])
    header = ["teapot, tolerance", "s", "triangles", "of 100,000 samples beyond it", "non-manifold edges"]
    return markdown(header, rows)


def _near(distance: float, count: int, seed: int = 0) -> tuple[Any, Any]:
    """Points at a distance from the torus R = 1, r = 0.4, and on which side they are (extended precision)."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0, 2 * np.pi, (2, count)).astype(np.longdouble)
    reach = np.longdouble(0.4) + distance * np.where(np.arange(count) % 2, 1, -1)
    ring = 1 + reach * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), reach * np.sin(b)], 1).astype(float)
    return points, _side(points)


def _side(points: Any) -> Any:
    x, y, z = points.T.astype(np.longdouble)
    return np.sign(np.hypot(np.hypot(x, y) - 1, z) - np.longdouble(0.4)).astype(int)


def _igl(mesh: Mesh) -> Callable[[Any], Any] | None:
    """libigl's fast winding number, its tree built beforehand; None without libigl."""
    try:
        import igl
    except ImportError:
        return None
    prepared = igl.FastWindingNumberBVH()
    prepared.init(np.array(mesh.vertices), np.array(mesh.faces), 2)
    return lambda points: prepared.winding_number(points, 2.0)


def _speed() -> str:
    shell = Shell(torus_patches())
    mesh = tessellate(shell, tolerance=1e-4)
    igl = _igl(mesh)
    rng = np.random.default_rng(0)
    scattered = rng.uniform(-1.5, 1.5, (100_000, 3)) * (1, 1, 0.4)
    cases = [("random", scattered, _side(scattered))]
    cases += [(f"at {d:g}", *_near(d, 10_000)) for d in DISTANCES]
    classify(shell, scattered[:10])
    rows = []
    for name, points, side in cases:
        ours = measure(lambda p=points: classify(shell, p), 3)
        codes = ours.result
        row = [name, f"{ours.seconds / len(points) * 1e6:.2f}", f"{100 * np.mean(codes == side):.2f}%"]
        row.append(int(np.count_nonzero((codes != side) & (codes != 0))))
        if igl is not None:
            theirs = measure(lambda p=points: igl(p), 3)
            right = np.mean((theirs.result > 0.5) == (side < 0))
            row += [f"{theirs.seconds / len(points) * 1e6:.2f}", f"{100 * right:.2f}%"]
            row.append(f"{theirs.seconds / ours.seconds:.2f}")
        rows.append(row)
    header = ["torus, points", "us each", "right", "wrong"]
    if igl is None:
        return markdown(header, rows) + "\n\nlibigl is not installed: its columns are left out."
    return markdown([*header, f"libigl, {len(mesh.faces)} triangles", "right", "its time / ours"], rows)


def _answers() -> str:
    shell = Shell(torus_patches())
    axis = np.linspace(-1.5, 1.5, 47)
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    cases = [("lattice 47^3", lattice, _side(lattice))]
    cases += [(f"at 1e-{k}", *_near(10.0**-k, 75_000, k)) for k in range(3, 15)]
    rows, total, wrong, undecided = [], 0, 0, 0
    for name, points, side in cases:
        codes = classify(shell, points)
        bad, unsure = int(np.sum((codes != 0) & (codes != side))), int(np.sum((codes == 0) & (side != 0)))
        total, wrong, undecided = total + len(points), wrong + bad, undecided + unsure
        rows.append([name, len(points), bad, unsure])
    rows.append(["all", total, wrong, undecided])
    return markdown(["torus, points", "number", "wrong", 'called "on", though not on'], rows)


_COMPILE = """
import time
from parametric import Shell
from tests.solids import box_patches
shell = Shell(box_patches())
start = time.process_time()
shell.classify_points([(0.5, 0.5, 0.5)])
print(time.process_time() - start)
"""


def _compilation() -> str:
    with tempfile.TemporaryDirectory() as cache:
        settings = {**os.environ, "NUMBA_CACHE_DIR": cache}
        runs = [
            subprocess.run([sys.executable, "-c", _COMPILE], env=settings, check=True, capture_output=True, text=True)
            for _ in range(2)
        ]
    rows = [[name, f"{float(run.stdout):.2f}"] for name, run in zip(("ever", "in a later process"), runs)]
    return markdown(["first classification", "s"], rows)
