"""Polygonizing against what users write today, in one run: processor seconds, ratios, memory, triangles, errors.

(a) lambdify(cse=True) on a full meshgrid, then scikit-image's marching cubes
(b) lambdify(cse=True) on open axes in slabs of 8 planes, then VTK's flying edges without a transposed copy
(c) libfive and Bloomenthal's polygonizer: not run

Our time includes building the mesh with vertices on the surface and unit normals from the gradient; the peers' includes
neither. Building the surface, and lambdify itself, are left out on both sides. The method is "marching": "auto" looks
for singular points of polynomials first. `python -m tests.benchmarks.polygonize 64,256 sphere,torus` chooses.
"""

import gc
import sys
from collections.abc import Callable
from statistics import geometric_mean
from typing import Any

import numpy as np
import sympy as sp

from implicit import Surface, polygonize, x, y, z
from tests.benchmarks.measure import Measured, markdown, measure
from tests.benchmarks.models import NAMES, SMOOTH, SOLIDS, model

_SIZES = (64, 128, 256)
_MOST_A = 256
_MOST_B = 256
_SLOW_TO_COMPILE = ("CSG of 100",)


def _full(f: Callable[..., Any], half: float, cells: int) -> int:
    from skimage.measure import marching_cubes

    axis = np.linspace(-half, half, cells + 1)
    volume = f(*np.meshgrid(axis, axis, axis, indexing="ij"))
    return len(marching_cubes(volume, 0.0, spacing=(axis[1] - axis[0],) * 3)[1])


def _slabs(f: Callable[..., Any], half: float, cells: int) -> int:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    axis = np.linspace(-half, half, cells + 1)
    volume = np.empty((cells + 1,) * 3)
    for first in range(0, cells + 1, 8):
        part = slice(first, first + 8)
        volume[part] = f(axis[part, None, None], axis[None, :, None], axis[None, None, :])
    image = vtkImageData()
    image.SetDimensions(*volume.shape)
    image.SetSpacing((axis[1] - axis[0],) * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.ravel(), deep=0))
    filter_ = vtkFlyingEdges3D()
    filter_.SetInputData(image)
    filter_.SetValue(0, 0.0)
    filter_.ComputeNormalsOff()
    filter_.ComputeGradientsOff()
    filter_.ComputeScalarsOff()
    filter_.Update()
    return int(filter_.GetOutput().GetNumberOfPolys())


def _error(surface: Surface, vertices: np.ndarray) -> str:
    """Median and largest |f| / |grad f|."""
    f, g = surface.field.gradients(vertices)
    length = np.linalg.norm(g, axis=1)
    distance = np.abs(f[length > 0]) / length[length > 0]
    return f"{np.median(distance):.0e} / {distance.max():.0e}"


def _memory(measured: Measured) -> str:
    return "?" if measured.memory is None else f"{measured.memory / 1e6:.0f}"


def rows(names: tuple[str, ...], sizes: tuple[int, ...], repeat: int = 5) -> list[list[object]]:
    """One row per surface and size."""
    found = []
    for name in names:
        expression, half = model(name)
        surface = Surface(expression)
        f = None if name in _SLOW_TO_COMPILE else sp.lambdify((x, y, z), expression, "numpy", cse=True)
        for cells in sizes:
            polygonize(surface, half, resolution=min(cells, 64), method="marching")
            gc.collect()
            ours = measure(lambda: polygonize(surface, half, resolution=cells, method="marching"), repeat)  # noqa: B023
            mesh = ours.result
            row = [name, cells, f"{ours.seconds:.4f}", len(mesh.faces), _memory(ours), _error(surface, mesh.vertices)]
            ratios: list[float | None] = []
            for peer, most in ((_full, _MOST_A), (_slabs, _MOST_B)):
                if f is None or cells > most or (name == "CSG of 20" and cells > 128 and peer is _full):
                    row += ["-", "-"]
                    ratios.append(None)
                    continue
                theirs = measure(lambda: peer(f, half, cells), repeat if cells <= 128 else min(repeat, 3))  # noqa: B023
                row += [f"{theirs.seconds:.3f} ({_memory(theirs)})", f"{theirs.seconds / ours.seconds:.1f}x"]
                ratios.append(theirs.seconds / ours.seconds)
            found.append(row + ratios)
            print(" ".join(str(cell) for cell in row), file=sys.stderr, flush=True)
    return found


def table(names: tuple[str, ...] = NAMES, sizes: tuple[int, ...] = _SIZES, repeat: int = 5) -> str:
    """Measure, and write the table and its means."""
    found = rows(names, sizes, repeat)
    header = ["surface", "cells", "ours s", "triangles", "MB", "error median / max", "(a) s (MB)", "against (a)"]
    lines = [markdown([*header, "(b) s (MB)", "against (b)"], [row[:-2] for row in found])]
    for cells in sizes:
        for label, group in (("first six", SMOOTH), ("solids", SOLIDS)):
            for peer, place in (("a", -2), ("b", -1)):
                ratios = [row[place] for row in found if row[1] == cells and row[0] in group and row[place]]
                if ratios:
                    mean, least = geometric_mean(ratios), min(ratios)
                    lines.append(f"{cells} cells, {label}, against ({peer}): mean {mean:.1f}x, least {least:.1f}x")
    return lines[0] + "\n\n" + "\n".join(f"- {line}" for line in lines[1:])


if __name__ == "__main__":
    wanted = tuple(int(size) for size in sys.argv[1].split(",")) if len(sys.argv) > 1 else _SIZES
    chosen = tuple(sys.argv[2].split(",")) if len(sys.argv) > 2 else NAMES
    print(table(chosen, wanted))
