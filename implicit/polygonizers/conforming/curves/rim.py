"""Rims: where the sheets along a stretch of a singular curve leave its zone, in the order along the curve."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.zone import RIM, Stretch, ZoneRim, Zones
from implicit.topology import renumbered

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

_BACK = 0.3
"""Along a rim the length along the curve grows; where it falls its vertices are moved, by at most so many cells."""
_GAP = 0.02
"""The least growth from one vertex to the next, in cells."""
_SHORT = 1.5
"""At an open end a rim may end so many cells early."""


class Ragged(Exception):
    """The rims round a stretch of an arc are not what its sheets should leave."""

    def __init__(self, arc: int, reason: str) -> None:
        super().__init__(f"arc {arc}: {reason}")
        self.arc = arc


@dataclass(frozen=True, eq=False)
class Rim:
    """Vertices (n,) along the rim of a sheet, with growing lengths (n,) along the curve; turned: whether the faces
    of the mesh lie on their right. Closed rims begin and end in the same vertex.
    """

    stretch: int
    names: IntArray
    lengths: FloatArray
    turned: bool


def find_rims(rim: ZoneRim, vertices: FloatArray, faces: IntArray, fixed: Flags) -> list[Rim]:
    """The rims of all sheets."""
    zones = rim.zones
    names, edge = renumbered(_open_edges(faces, len(vertices)), len(vertices))
    feet = zones.measure(rim.local.grid.to_units(vertices[names]))
    owner, along, depth = feet.owner, feet.along, feet.depth
    close = np.abs(depth) < RIM
    for row, stretch in enumerate(zones.stretches):
        if not stretch.closed:
            ends = stretch.lengths[[0, -1]]
            for there, free in zip(ends, stretch.open, strict=True):
                if free:
                    close &= (owner != row) | (along != there)
    edge = edge[close[edge].all(axis=1)]
    return [_rim(zones, owner[chain], names[chain], along[chain]) for chain in _chains(edge, fixed[names])]


def _open_edges(faces: IntArray, size: int) -> IntArray:
    """The directed edges (n, 2) of the faces, over `size` vertices, whose opposite is no edge of them."""
    start, stop = np.concatenate(faces.T), np.concatenate([faces[:, 1], faces[:, 2], faces[:, 0]])
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    keys = np.sort((low * size + high) * 2 + (start > stop))
    pair, back = keys // 2, keys % 2
    last = np.append(pair[1:] != pair[:-1], True)[: len(keys)]
    first = np.append(True, last[:-1])[: len(keys)]
    whole = np.repeat(back[first] == back[last], np.diff(np.flatnonzero(first), append=len(keys)))
    low, high, back = pair[whole] // size, pair[whole] % size, back[whole]
    return np.column_stack([np.where(back, high, low), np.where(back, low, high)])


def _chains(edges: IntArray, stops: Flags) -> list[IntArray]:
    """The edges (n, 2) put one behind the other, from vertices where others end, begin or meet, or round."""
    goes = edges[~stops[edges[:, 0]]]
    after = np.full(len(stops), -1)
    after[goes[:, 0]] = goes[:, 1]
    entered = np.zeros(len(stops), bool)
    entered[edges[:, 1]] = True
    follow = after.tolist()
    chains = [_chain(pair, follow) for pair in edges[(stops | ~entered)[edges[:, 0]]].tolist()]
    return chains + [_chain([a, follow[a]], follow) for a in goes[:, 0].tolist() if follow[a] >= 0]


def _chain(chain: list[int], follow: list[int]) -> IntArray:
    """A chain of vertices, from its first two on; what follows each vertex, -1 for nothing, is used up."""
    follow[chain[0]] = -1
    while (ahead := follow[chain[-1]]) >= 0:
        follow[chain[-1]] = -1
        chain.append(ahead)
    return np.array(chain)


def _rim(zones: Zones, owner: IntArray, names: IntArray, along: FloatArray) -> Rim:
    """The rim through these vertices."""
    row = int(owner[0])
    if (owner != row).any():
        raise Ragged(zones.stretches[row].course.number, "two rims in one")
    stretch = zones.stretches[row]
    if stretch.closed:
        length = stretch.lengths[-1]
        steps = (np.diff(along) + length / 2) % length - length / 2
        ahead = steps * np.sign(steps.sum())
        first = int(np.argmax(np.minimum(ahead, np.roll(ahead, 1))))  # begin where the rim is in order
        names = np.concatenate([names[first:-1], names[: first + 1]])
        along = along[first] + np.append(0.0, np.cumsum(np.roll(steps, -first)))
    backwards = bool(along[-1] < along[0])
    if backwards:
        names, along = names[::-1], along[::-1]
    return Rim(row, names, along, backwards)


def in_order(
    rim: ZoneRim, vertices: FloatArray, normals: FloatArray, rims: list[Rim], fixed: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray, list[Rim]]:
    """Vertices, normals and rims; vertices that are not `fixed` are moved along the curve where a rim went back."""
    result, moved, shifts = [], [np.zeros(0, np.int64)], [np.zeros(0)]
    for part in rims:
        even = _GAP * np.arange(len(part.names))
        rest = part.lengths - even
        lengths = even + (np.maximum.accumulate(rest) + np.minimum.accumulate(rest[::-1])[::-1]) / 2
        stretch = rim.zones.stretches[part.stretch]
        held = ((part.lengths <= stretch.lengths[0]) | (part.lengths >= stretch.lengths[-1])) & (not stretch.closed)
        held[[0, -1]] |= stretch.closed  # one vertex
        held |= fixed[part.names]
        lengths = np.where(held, part.lengths, lengths)
        shift = lengths - part.lengths
        if np.abs(shift).max() > _BACK:
            raise Ragged(stretch.course.number, "a rim goes back")
        rows = np.flatnonzero(shift)
        moved.append(part.names[rows])
        shifts.append(shift[rows])
        result.append(replace(part, lengths=lengths))
    names, shift = np.concatenate(moved), np.concatenate(shifts)
    grid = rim.local.grid
    units = grid.to_units(vertices[names])
    units = units + shift[:, None] * rim.zones.measure(units).way
    vertices, normals = vertices.copy(), normals.copy()
    vertices[names], normals[names] = rim.reach(grid.to_points(units))
    return vertices, normals, result


def fault(stretch: Stretch, rims: list[Rim], curve: IntArray) -> str:
    """What keeps the sheets of a stretch from having one rim each, from end to end; nothing if they do."""
    ends = stretch.lengths[[0, -1]]
    if stretch.closed:
        rounds = [(part.lengths[-1] - part.lengths[0]) / ends[1] for part in rims]
        whole = all(part.names[0] == part.names[-1] for part in rims) and abs(sum(rounds) - stretch.sheets) < 1e-6
        return "" if whole else "rims do not go round"
    if len(rims) != stretch.sheets:
        return f"{len(rims)} rims of {stretch.sheets} sheets"
    for side, free in zip((0, -1), stretch.open, strict=True):
        if free and any(abs(part.lengths[side] - ends[side]) > _SHORT for part in rims):
            return "rims end too early"
        if not free and any(part.names[side] != curve[side] for part in rims):
            return "rims end beside the curve"
    return ""
