"""How far the middles of triangles are from the surface: conforming meshes and scikit-image's marching cubes.

Both have cells of the same size. Distances are in cells, to where Newton's steps along the gradient end on the surface;
next to singular points they are upper bounds. Triangles of marching cubes count if their middle is in the bounds.
Quantiles are over triangles, and once more over area, so that many small triangles near singular points say no more
than a few large ones.
`python -m tests.benchmarks.conforming_distance 64 whitney,cayley` chooses.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from implicit import Ball, Surface
from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.assemble import MARGIN
from implicit.polygonizers.conforming.grid import Grid
from tests.benchmarks.measure import markdown
from tests.singular_cases import CASES, case_of

Floats = NDArray[np.float64]

_STEPS = 40
_SHARES = (0.5, 0.99)


def distances(surface: Surface, points: Floats) -> Floats:
    """How far (n,) points (n, 3) move until they are on the surface."""
    moved = points
    for _ in range(_STEPS):
        values, slopes = surface.field.gradients(moved)
        steep = np.maximum(np.einsum("ij,ij->i", slopes, slopes), 1e-300)
        moved = moved - (values / steep)[:, None] * slopes
    return np.asarray(np.linalg.norm(moved - points, axis=1))


def cubes(surface: Surface, ball: Ball, step: float) -> Floats:
    """The triangles (n, 3, 3) that scikit-image finds in the bounds."""
    from skimage.measure import marching_cubes

    count = int(np.ceil(2 * ball.radius / step)) + 1
    axes = [center + step * (np.arange(count + 1) - count / 2) for center in ball.center]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    volume = surface.field.values(lattice.reshape(-1, 3)).reshape(lattice.shape[:3])
    vertices, faces, _, _ = marching_cubes(volume, 0.0, spacing=(step,) * 3)
    triangles = (vertices.astype(float) + [axis[0] for axis in axes])[faces]
    return np.asarray(triangles[np.linalg.norm(triangles.mean(axis=1) - ball.center, axis=1) <= ball.radius])


def quantiles(surface: Surface, triangles: Floats) -> Floats:
    """Median and 99th percentile of the distances of the middles, over triangles and over area (4,)."""
    away = distances(surface, triangles.mean(axis=1))
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    found = [np.quantile(away, _SHARES, weights=w, method="inverted_cdf") for w in (np.ones(len(away)), areas)]
    return np.concatenate(found)


def table(resolution: int = 64, names: tuple[str, ...] = tuple(CASES)) -> str:
    """A row for each case: numbers of triangles, and four quantiles of ours, of marching cubes, and their ratio."""
    lines = []
    for name in names:
        surface, ball = case_of(name)
        step = Grid.over(ball, resolution, MARGIN).step
        mesh = conforming(surface, ball, resolution)
        both = (np.array(mesh.vertices)[mesh.faces], cubes(surface, ball, step))
        ours, theirs = (quantiles(surface, triangles) / step for triangles in both)
        pairs = [f"{a:.4f} / {b:.4f} = {a / b if b else np.nan:.2f}" for a, b in zip(ours, theirs, strict=True)]
        lines.append([name, *map(len, both), *pairs])
    header = ["case", "triangles", "cubes", "median", "99 %", "median of area", "99 % of area"]
    return f"Distances in cells, resolution {resolution}.\n\n" + markdown(header, lines)


if __name__ == "__main__":
    _, *given = sys.argv
    print(table(*(int(given[0]), tuple(given[1].split(","))) if len(given) > 1 else map(int, given)))
