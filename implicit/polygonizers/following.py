"""Following a surface from seed points, so that the work is proportional to the surface and no bounds are needed.

From the bricks round the seeds the surface is followed into every neighbour across a face where f changes sign. Then
the bricks that were visited are meshed like any others, and the connected pieces that the seeds lie on are kept.

Source: Bloomenthal, Polygonization of implicit surfaces, 1988, doi:10.1016/0167-8396(88)90013-1.
"""

import numpy as np
from numpy.typing import NDArray

from implicit.evaluate import Field
from implicit.polygonizers.lattice import CELLS, Lattice, in_order
from implicit.polygonizers.marching import refuse
from implicit.polygonizers.samples import Sampler, sampler_of
from implicit.polygonizers.steps import step_onto
from implicit.topology import components

FloatArray = NDArray[np.float64]
BrickArray = NDArray[np.int32]
IntArray = NDArray[np.int64]

LIMIT = 2048
"""Without bounds a surface is followed as far as so many cells from its seeds along each axis."""

_ALL_ROUND = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)], np.int32)


def lattice_round(seeds: FloatArray, cell: float) -> Lattice:
    """A lattice of cells of the given size that reaches LIMIT cells beyond the seeds on every side."""
    low = np.floor(seeds.min(axis=0) / cell).astype(int) - LIMIT
    high = np.ceil(seeds.max(axis=0) / cell).astype(int) + LIMIT
    x, y, z = (np.arange(a, b + 1) * cell for a, b in zip(low, high, strict=True))
    return Lattice((x, y, z))


def to_surface(field: Field, seeds: FloatArray, reach: float) -> FloatArray:
    """Seeds (n, 3) moved to the surface by Newton's steps along the gradient, each at most `reach` in all.

    Raises ValueError naming the first seed that is farther away.
    """
    points = step_onto(field, seeds, reach)
    missed = ~(np.linalg.norm(points - seeds, axis=1) <= reach)
    if missed.any():
        index = int(np.flatnonzero(missed)[0])
        raise ValueError(
            f"seed {index} at {tuple(seeds[index].tolist())} has no point of the surface within {reach:.6g} "
            "along the gradient; give a seed nearer to the surface"
        )
    return points


def follow(field: Field, lattice: Lattice, seeds: FloatArray, bounded: bool) -> Sampler:
    """Visit all bricks that the surface reaches from the seeds.

    Raises ValueError when no brick at a seed is crossed, and, if not `bounded`, when the surface leaves the lattice.
    """
    counts = np.array(lattice.bricks)
    origin = np.array([axis[0] for axis in lattice.axes])
    step = np.array([axis[1] - axis[0] for axis in lattice.axes])
    home = np.clip((seeds - origin) / (CELLS * step), 0, counts - 1).astype(np.int32)
    seen = np.zeros(lattice.bricks, bool)
    frontier = np.unique((home[:, None] + _ALL_ROUND).reshape(-1, 3), axis=0)
    frontier = frontier[((frontier >= 0) & (frontier < counts)).all(axis=1)]
    seen[tuple(frontier.T)] = True
    sampler = sampler_of(field, lattice, frontier)
    visited = []
    while len(frontier):
        crossed, reached = _visit(sampler, frontier, bounded)
        visited.append(frontier[crossed])
        reached = reached[~seen[tuple(reached.T)]]
        frontier = np.unique(reached, axis=0)
        seen[tuple(frontier.T)] = True
    bricks = np.concatenate(visited)
    if not len(bricks):
        raise ValueError("no cell near the seeds is crossed by the surface; give seeds on it, or a higher resolution")
    low, high = bricks.min(axis=0), bricks.max(axis=0) + 1
    x, y, z = (axis[CELLS * a : CELLS * b + 1] for axis, a, b in zip(lattice.axes, low, high, strict=True))
    part = Lattice((x, y, z))
    return sampler_of(field, part, in_order((bricks - low).astype(np.int32)))


def _visit(sampler: Sampler, bricks: BrickArray, bounded: bool) -> tuple[NDArray[np.bool_], BrickArray]:
    """Which bricks are crossed, and the bricks behind the faces where they are."""
    crossed = np.zeros(len(bricks), bool)
    reached = []
    lattice, counts = sampler.lattice, np.array(sampler.lattice.bricks)
    for first in range(0, len(bricks), 256):
        part = np.ascontiguousarray(bricks[first : first + 256])
        samples = np.empty((len(part), 512))
        sampler.sample(part, samples)
        if not np.isfinite(samples).all():
            row = int(np.flatnonzero(~np.isfinite(samples).all(axis=1))[0])
            refuse(lattice.brick_points(part[row : row + 1])[0], samples[row])
        inside = (samples < 0).reshape(-1, 8, 8, 8)
        crossed[first : first + 256] = _mixed(inside)
        for axis in range(3):
            for side in (0, 7):
                beyond = part[_mixed(np.take(inside, side, axis=1 + axis))]
                beyond[:, axis] += 1 if side else -1
                stays = (beyond[:, axis] >= 0) & (beyond[:, axis] < counts[axis])
                if not (bounded or stays.all()):
                    raise ValueError(
                        f"the surface goes on more than {LIMIT} cells from the seeds; give bounds, or fewer cells"
                    )
                reached.append(beyond[stays])
    return crossed, np.concatenate(reached)


def _mixed(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    flat = inside.reshape(len(inside), -1)
    return np.asarray(flat.any(axis=1) & ~flat.all(axis=1))


def drop_pieces(vertices: FloatArray, faces: IntArray, seeds: FloatArray, reach: float) -> None:
    """Flatten, in `faces` itself, those of the connected pieces that do not come within `reach` of a seed."""
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    label = components(links, len(vertices))
    wanted = []
    for seed in seeds:
        distance = np.linalg.norm(vertices - seed, axis=1)
        nearest = int(np.argmin(distance))
        if distance[nearest] <= reach:
            wanted.append(label[nearest])
    faces[~np.isin(label[faces[:, 0]], wanted)] = 0
