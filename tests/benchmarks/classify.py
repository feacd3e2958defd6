"""Classification: right and wrong answers near the surface, and time against plain numpy signs and mesh libraries.

Points at a distance d are offset from points of the torus along its normal, half to each side; their true side is the
exact rational sign of f. libigl's fast winding number of a mesh is measured where it is installed.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import sympy
from numpy.typing import NDArray

import parametric
from implicit import Surface, classify, polygonize
from tests.benchmarks.measure import markdown, measure

TORUS = "(x^2 + y^2 + z^2 + 21/25)^2 - 4 (y^2 + z^2)"
CLEBSCH = (
    "81 (x^3+y^3+z^3) - 189 (x^2 y + x^2 z + y^2 x + y^2 z + z^2 x + z^2 y) + 54 x y z + 126 (x y + x z + y z)"
    " - 9 (x^2+y^2+z^2) - 9 (x+y+z) + 1"
)
GYROID = "sin(x) cos(y) + sin(y) cos(z) + sin(z) cos(x)"
Floats = NDArray[np.float64]


def near(distance: float, count: int, seed: int = 0) -> tuple[Floats, NDArray[np.int8]]:
    """Points near the torus and the sides they are meant to be on."""
    random = np.random.default_rng(seed)
    a, b = random.uniform(0, 2 * np.pi, (2, count))
    side = np.where(np.arange(count) % 2, 1, -1).astype(np.int8)
    radius = 0.4 + side * distance
    ring = 1 + radius * np.cos(b)
    return np.stack([radius * np.sin(b), ring * np.cos(a), ring * np.sin(a)], axis=1), side


def exact(points: Floats) -> NDArray[np.int8]:
    """The sign of f for the torus in rational numbers."""
    out = []
    for point in points.tolist():
        x, y, z = map(Fraction, point)
        s = y * y + z * z
        value = (s + x * x + Fraction(21, 25)) ** 2 - 4 * s
        out.append((value > 0) - (value < 0))
    return np.array(out, dtype=np.int8)


def naive(text: str) -> Callable[[Floats], Floats]:
    """What a user writes: the sign of a lambdified formula."""
    f = sympy.lambdify(sympy.symbols("x y z", real=True), Surface(text).expression, "numpy")
    return lambda points: np.sign(f(*points.T))


def table() -> str:
    """Accuracy, speed, exact points, and the peers."""
    return "\n\n".join([_accuracy(), _speed(), _exact_points(), _agreement(), _compile()])


def _accuracy() -> str:
    torus, plain, rows = Surface(TORUS), naive(TORUS), []
    mesh = polygonize(torus, 1.5, resolution=96)
    shell = parametric.Shell([parametric.revolve(parametric.circle(0.4, (0, 1, 0)))])
    for distance in (1e-3, 1e-6, 1e-9, 1e-12, 1e-14, 1e-16):
        points, _ = near(distance, 5000)
        true = exact(points)
        done = measure(lambda p=points: classify(torus, p), 3)
        by_shell = classify(shell, points)
        rows.append(
            (
                f"{distance:g}",
                int((done.result != true).sum()),
                f"{done.seconds / len(points) * 1e6:.2f}",
                f"{(plain(points) == true).mean():.4f}",
                f"{(classify(mesh, points) == true).mean():.4f}",
                int((by_shell * true < 0).sum()),
                f"{(by_shell == 0).mean():.4f}",
            )
        )
    lattice = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 25)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    wrong = int((classify(torus, lattice) != exact(lattice)).sum())
    header = ("distance", "wrong of 5000", "us/point", "numpy right", "mesh right", "shell wrong", "shell says on")
    return markdown(header, rows) + f"\n\nsymmetric lattice 25^3: {wrong} wrong"


def _speed() -> str:
    rows = []
    random = np.random.default_rng(1)
    for name, text in (("sphere", "x^2 + y^2 + z^2 - 1"), ("torus", TORUS), ("Clebsch", CLEBSCH), ("gyroid", GYROID)):
        surface, plain = Surface(text), naive(text)
        for count, allowed in ((10**6, 1.7), (10**5, 4)):
            points = random.uniform(-1.5, 1.5, (count, 3))
            classify(surface, points[:10])
            ours = measure(lambda s=surface, p=points: classify(s, p), 9)
            theirs = measure(lambda f=plain, p=points: f(p), 9)
            ratio = ours.seconds / theirs.seconds
            rows.append(
                (name, count, f"{ours.seconds * 1e3:.1f}", f"{theirs.seconds * 1e3:.1f}", f"{ratio:.2f}", allowed)
            )
    return markdown(("surface", "points", "certified ms", "numpy sign ms", "ratio", "at most"), rows)


def _exact_points() -> str:
    """Integer points on spheres, and their neighbours one unit in the last place in and out."""
    right = total = plain_right = 0
    for a, b, c in ((1, 2, 2), (2, 3, 6), (12, 24, 41), (3, 4, 12), (8, 9, 12), (2, 10, 11)):
        text = f"x^2 + y^2 + z^2 - {a * a + b * b + c * c}"
        heights = [np.nextafter(c, 0), float(c), np.nextafter(c, 99)]
        points = np.array([(a, b, h) for h in heights])
        right += int((classify(Surface(text), points, tolerance=0) == [-1, 0, 1]).sum())
        plain_right += int((naive(text)(points) == [-1, 0, 1]).sum())
        total += 3
    return f"on-points and both neighbours: {right} of {total} right, numpy {plain_right}"


def _agreement() -> str:
    """The implicit and the parametric answer for one solid, and speed against libigl."""
    torus = Surface(TORUS)
    shell = parametric.Shell([parametric.revolve(parametric.circle(0.4, (0, 1, 0)))])
    points = np.random.default_rng(2).uniform(-1.5, 1.5, (10**6, 3))
    by_sign = classify(torus, points)
    done = measure(lambda: classify(shell, points), 1)
    decided = done.result != 0
    lines = [
        f"implicit and parametric agree on {(by_sign == done.result)[decided].mean():.6%} of {decided.sum()} points; "
        f"the shell takes {done.seconds:.2f} us a point"
    ]
    mesh = polygonize(torus, 1.5, resolution=300)
    meshed = measure(lambda: classify(mesh, points[:100_000]), 1)
    lines.append(f"our winding number of a mesh of {len(mesh.faces)} triangles: {meshed.seconds * 10:.2f} us a point")
    try:
        import igl
    except ImportError:
        lines.append("libigl: not installed")
    else:
        theirs = measure(lambda: igl.fast_winding_number(mesh.vertices, mesh.faces, points[:100_000]), 1)
        lines.append(f"libigl's fast winding number of it: {theirs.seconds * 10:.2f} us a point, tree included")
    return "\n".join(lines)


def _compile() -> str:
    """Processor seconds of the very first answer, nothing compiled before, against the second run."""
    program = (
        "import time; import numpy, sympy; from implicit import Surface, classify; start = time.process_time();"
        f"classify(Surface({TORUS!r}), (0, 0, 0)); print(time.process_time() - start)"
    )
    seconds = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
            run = subprocess.run(
                [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment
            )
            seconds.append(float(run.stdout))
    return f"first use ever: {seconds[0]:.1f} s (at most 15), every later process: {seconds[1]:.2f} s"
