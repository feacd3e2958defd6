"""Each kernel is compiled once: a second version, for arrays of another layout, is a wait that nobody asked for."""

import os
import subprocess
import sys

JOURNEYS = """
import sys
import numpy as np
import implicit, parametric
some = np.random.default_rng(1).random
for text in ("x", "y", "z", "x y", "x^2+y^2+z^2-1", "x^2 y+z", "x^6+y^2-z^3-1/3", "max(x,y)-z/2", "sin(x)+cos(y)+z"):
    surface = implicit.Surface(text)
    for bounds in (1.1, implicit.Ball(1)):
        implicit.polygonize(surface, bounds, resolution=12, method="marching")
    for points in (some((5, 3)), some((3, 5)).T):
        surface(points), surface.gradient(points), implicit.classify(surface, points)
for text in ("x^2+y^2-z^2", "x^3+y^3+z^3-1/4", "x^2-y^2 z"):
    implicit.singularities(implicit.Surface(text), 1)
mesh = implicit.polygonize(implicit.sphere(1), 1.5, resolution=10)
tube = parametric.revolve(parametric.circle(0.5, center=(0, 2, 0)))
for points in (some((9, 3)), some((3, 9)).T):
    implicit.classify(mesh, points), implicit.classify(tube, points)
parametric.tessellate(parametric.teapot(), tolerance=0.05)
for shape in ((2, 2, 3), (4, 3, 3)):
    patch = parametric.BezierSurface(some(shape))
    patch(0.1, 0.2), patch(some(50), some(50)), patch.normal(0.1, 0.2)
    patch(np.arange(5)[:, None] / 5, np.arange(6) / 6)
for home, module in list(sys.modules.items()):
    if home.split(".")[0] in ("implicit", "parametric"):
        for name, kernel in list(vars(module).items()):
            if hasattr(kernel, "py_func") and kernel.__module__ == home and len(kernel.signatures) > 1:
                print(home, name, kernel.signatures)
"""


def test_each_kernel_is_compiled_once(tmp_path) -> None:
    """With an empty cache: what comes from a cache is not listed unless it was called from Python."""
    home = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-c", JOURNEYS], capture_output=True, text=True, timeout=900, check=False, env=home
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout == ""
