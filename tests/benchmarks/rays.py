"""Rays: seconds and misses against numpy's roots, against samples of a lambdified formula, and against VTK on a mesh.

Rays start round the surface and look into a ball of it. "samples" is what is written most often: f at 200 places on
each ray, and halving between the first two of different sign. VTK looks for the triangles of our mesh of a box with the
origins, 128 cells across the ball.
"""

import numpy as np
import sympy
import vtk
from numpy.typing import NDArray

from implicit import Surface, cast_rays, polygonize, x, y, z
from tests.benchmarks.measure import Measured, markdown, measure

Floats = NDArray[np.float64]
SURFACES = {
    "sphere": ("x^2 + y^2 + z^2 = 1", 1.2),
    "torus": ("(x^2 + y^2 + z^2 + 0.84)^2 = 4 (x^2 + y^2)", 1.5),
    "Barth sextic": ("4 (2.618 x^2 - y^2) (2.618 y^2 - z^2) (2.618 z^2 - x^2) - 4.236 (x^2 + y^2 + z^2 - 1)^2", 1.5),
    "thin torus": ("(x^2 + y^2 + z^2 + 0.9999)^2 = 4 (x^2 + y^2)", 1.5),
    "gyroid": ("sin(4 x) cos(4 y) + sin(4 y) cos(4 z) + sin(4 z) cos(4 x)", 1.5),
    "block": ("max(abs(x) - 1, abs(y) - 0.7, abs(z) - 0.5)", 1.5),
}


def rays_into(radius: float, count: int) -> tuple[Floats, Floats]:
    """Origins on a sphere of twice the radius, and unit directions towards places in a ball of it."""
    rng = np.random.default_rng(0)
    starts = rng.normal(size=(count, 3))
    starts *= 2 * radius / np.linalg.norm(starts, axis=1, keepdims=True)
    ways = radius * rng.uniform(-0.6, 0.6, (count, 3)) - starts
    return starts, ways / np.linalg.norm(ways, axis=1, keepdims=True)


def by_roots(surface: Surface, starts: Floats, ways: Floats, far: float) -> Floats:
    """The least real root of the polynomial on each ray, by numpy."""
    terms = sympy.Poly(surface.expression, x, y, z).terms()
    result = np.full(len(starts), np.nan)
    for row, (o, d) in enumerate(zip(starts, ways, strict=True)):
        line = [np.poly1d([b, a]) for a, b in zip(o, d, strict=True)]
        roots = sum(float(c) * line[0] ** i * line[1] ** j * line[2] ** k for (i, j, k), c in terms).roots
        ahead = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= 0)]
        result[row] = ahead.min(initial=np.inf)
    return np.where(result <= far, result, np.nan)


def by_samples(surface: Surface, starts: Floats, ways: Floats, far: float) -> Floats:
    """The first change of sign between 200 samples, halved 50 times."""
    f = sympy.lambdify((x, y, z), surface.expression, "numpy")
    steps = np.linspace(0, far, 200)
    inside = f(*np.moveaxis(starts + steps[:, None, None] * ways, -1, 0)) < 0
    change = inside[1:] != inside[:-1]
    first, rows = change.argmax(axis=0), np.flatnonzero(change.any(axis=0))
    low, high = steps[first[rows]], steps[first[rows] + 1]
    begins = inside[first[rows], rows]
    for _ in range(50):
        middle = (low + high) / 2
        same = (f(*(starts[rows] + middle[:, None] * ways[rows]).T) < 0) == begins
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    result = np.full(len(starts), np.nan)
    result[rows] = low
    return result


def locator(surface: Surface, radius: float) -> vtk.vtkStaticCellLocator:
    """VTK's search for the triangles of a mesh of all that the rays may meet."""
    found = vtk.vtkStaticCellLocator()
    found.SetDataSet(polygonize(surface, 2 * radius, resolution=256, method="marching").to_pyvista())
    found.BuildLocator()
    return found


def by_locator(found: vtk.vtkStaticCellLocator, starts: Floats, ways: Floats, far: float) -> Floats:
    """The first triangle on each ray."""
    result = np.full(len(starts), np.nan)
    t, place, inner, part = vtk.reference(0.0), [0.0] * 3, [0.0] * 3, vtk.reference(0)
    for row, (start, end) in enumerate(zip(starts.tolist(), (starts + far * ways).tolist(), strict=True)):
        if found.IntersectWithLine(start, end, 0.0, t, place, inner, part):
            result[row] = t.get() * far
    return result


def table() -> str:
    """Processor microseconds for a ray, rays answered differently, and the largest distance of ours from f = 0."""
    rows = []
    for name, (formula, radius) in SURFACES.items():
        surface = Surface(formula)
        many, far = rays_into(radius, 20_000), 4 * radius
        few = tuple(part[:500] for part in many)
        cast_rays(surface, *few, limit=far)
        ours = measure(lambda s=surface, r=many, far=far: cast_rays(s, *r, limit=far), 3)
        values, slopes = surface.field.gradients(many[0] + ours.result[:, None] * many[1])
        off = np.nanmax(np.abs(values) / np.linalg.norm(slopes, axis=1))
        finder = locator(surface, radius)
        peers = [
            (measure(lambda s=surface, r=few, far=far: by_roots(s, *r, far), 1), 500) if surface.degree else None,
            (measure(lambda s=surface, r=many, far=far: by_samples(s, *r, far), 1), 20_000),
            (measure(lambda f=finder, r=many, far=far: by_locator(f, *r, far), 1), 20_000),
        ]
        cells = [_compared(ours.result, ours.seconds / 20_000, *peer) if peer else "-" for peer in peers]
        rows.append([name, f"{ours.seconds / 20_000 * 1e6:.1f}", f"{off:.0e}", *cells])
    header = ["surface", "us for a ray", "off f = 0", "numpy's roots", "samples", "VTK on a mesh"]
    return markdown(header, rows)


def _compared(ours: Floats, seconds: float, peer: Measured, count: int) -> str:
    other, mine = peer.result, ours[:count]
    wrong = np.isnan(other) != np.isnan(mine)
    wrong |= np.abs(other - mine) > 1e-2
    return f"{peer.seconds / count / seconds:.1f}x, {np.mean(wrong):.2%} other"
