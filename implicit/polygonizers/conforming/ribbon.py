"""Ribbons of triangles between a stretch of a singular curve and what is left of the mesh round its zone.

The mesh is cut where it enters the zone. Each sheet leaves a rim along the curve, from one end of the stretch to the
other, or round it; curve and rim are joined in the order of lengths along the curve, and wide triangles halved.
"""

#   p---p----p---p--p----p---p    rim
#   | / | \ / \ / \ | \ / \ / |
#   c---c-----c-----c-----c---c   curve

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import cut_along
from implicit.polygonizers.conforming.block import boundary
from implicit.polygonizers.conforming.inward import Mesh, split_fans, turned
from implicit.polygonizers.conforming.local import Local
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood
from implicit.polygonizers.conforming.zone import Stretch, ZoneRim, Zones, onto

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

_RIM = 0.3
"""The rim of a zone is less than so many cells away from its boundary."""
_BACK = 0.3
"""Along a rim the length along the curve grows; where it falls its vertices are moved, by at most so many cells."""
_GAP = 0.02
"""The least growth from one vertex to the next, in cells."""
_SHORT = 1.5
"""At an open end a rim may end so many cells early."""
_WIDE = 1.2
"""Triangles are halved that reach so many cells from the curve."""


class Ragged(Exception):
    """The rims round a stretch of an arc are not what its sheets should leave."""

    def __init__(self, arc: int, reason: str) -> None:
        super().__init__(f"arc {arc}: {reason}")
        self.arc = arc


@dataclass(frozen=True, eq=False)
class _Rim:
    """Vertices (n,) along the rim of a sheet, with growing lengths (n,) along the curve; turned: whether the faces
    of the mesh lie on their right. Closed rims begin and end in the same vertex.
    """

    stretch: int
    names: IntArray
    lengths: FloatArray
    turned: bool


def lay_ribbons(local: Local, mesh: Mesh, hood: Neighbourhood, numbers: list[IntArray], fixed: Flags) -> Mesh:
    """The mesh with ribbons along the stretches of a neighbourhood; numbers: the vertices at the stations of its
    courses; fixed (v,): the singular vertices.

    Only the vertices that faces use are looked at. Raises Ragged where the mesh round a stretch does not allow ribbons.
    """
    vertices, normals, faces = mesh
    fixed = np.append(fixed, np.zeros(len(vertices) - len(fixed), bool))
    used = np.zeros(len(vertices), bool)
    used[np.concatenate([faces.ravel(), *numbers])] = True
    names = np.flatnonzero(used)
    short = np.cumsum(used) - 1
    rows = [hood.courses.index(part.course) for part in hood.zones.stretches]
    curves = [short[part.within(numbers[row])] for row, part in zip(rows, hood.zones.stretches, strict=True)]
    small = vertices[names], normals[names], short[faces]
    more, upright, faces = _lay(ZoneRim(hood.zones, local), small, curves, fixed[names])
    vertices, normals = vertices.copy(), normals.copy()
    vertices[names], normals[names] = more[: len(names)], upright[: len(names)]
    names = np.append(names, len(vertices) + np.arange(len(more) - len(names)))
    fresh = slice(int(used.sum()), None)
    return np.concatenate([vertices, more[fresh]]), np.concatenate([normals, upright[fresh]]), names[faces]


def _lay(rim: ZoneRim, mesh: Mesh, curves: list[IntArray], fixed: Flags) -> Mesh:
    """A mesh near zones with ribbons; curves: the vertices at the stations of each stretch."""
    zones = rim.zones
    vertices, normals, faces = cut_along(rim, *mesh, fixed)
    fixed = np.append(fixed, np.zeros(len(vertices) - len(fixed), bool))
    rims = _rims(rim, vertices, faces, fixed)
    vertices, normals, rims = _in_order(rim, vertices, normals, rims)
    fans = [np.zeros((0, 3), np.int64)]
    for row, (stretch, curve) in enumerate(zip(zones.stretches, curves, strict=True)):
        mine = [part for part in rims if part.stretch == row]
        if reason := _fault(stretch, mine, curve):
            raise Ragged(stretch.course.number, reason)
        for part in mine:
            strip = _zip(part, *_unrolled(stretch, curve, part))
            fans.append(strip[:, [0, 2, 1]] if part.turned else strip)
    vertices, normals, ribbon = _halved(rim, (vertices, normals, np.concatenate(fans)))
    fixed = np.append(fixed, np.zeros(len(vertices) - len(fixed), bool))
    bad = turned(vertices, normals, fixed, ribbon)
    if bad.any():
        middle = vertices[ribbon[bad][:1]].mean(axis=1)
        nearest = zones.measure(rim.local.grid.to_units(middle)).owner[0]
        raise Ragged(zones.stretches[nearest].course.number, "turned over")
    return vertices, normals, np.concatenate([faces, ribbon])


def _rims(rim: ZoneRim, vertices: FloatArray, faces: IntArray, fixed: Flags) -> list[_Rim]:
    """The rims of all sheets."""
    zones = rim.zones
    edges = boundary(faces)
    names, inverse = np.unique(edges, return_inverse=True)
    feet = zones.measure(rim.local.grid.to_units(vertices[names]))
    owner, along, depth = feet.owner, feet.along, feet.depth
    edge = inverse.reshape(-1, 2)
    close = np.abs(depth) < _RIM
    for row, stretch in enumerate(zones.stretches):
        if not stretch.closed:
            ends = stretch.lengths[[0, -1]]
            for there, free in zip(ends, stretch.open, strict=True):
                if free:
                    close &= (owner != row) | (along != there)
    edge = edge[close[edge].all(axis=1)]
    return [_rim(zones, owner[chain], names[chain], along[chain]) for chain in _chains(edge, fixed[names])]


def _chains(edges: IntArray, stops: Flags) -> list[IntArray]:
    """The edges (n, 2) put one behind the other, from vertices where others end, begin or meet, or round."""
    follow = {a: b for a, b in edges.tolist() if not stops[a]}
    ends = {b for _, b in edges.tolist() if not stops[b]}
    begin = [(a, b) for a, b in edges.tolist() if stops[a] or a not in ends]
    chains = []
    for a, b in begin:
        chain = [a, b]
        if not stops[a]:
            del follow[a]
        while chain[-1] in follow:
            chain.append(follow.pop(chain[-1]))
        chains.append(np.array(chain))
    while follow:
        chain = list(follow.popitem())
        while chain[-1] in follow:
            chain.append(follow.pop(chain[-1]))
        chains.append(np.array(chain))
    return chains


def _rim(zones: Zones, owner: IntArray, names: IntArray, along: FloatArray) -> _Rim:
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
    return _Rim(row, names, along, backwards)


def _in_order(
    rim: ZoneRim, vertices: FloatArray, normals: FloatArray, rims: list[_Rim]
) -> tuple[FloatArray, FloatArray, list[_Rim]]:
    """Vertices, normals and rims with those vertices moved along the curve by which a rim went back."""
    result, moved, shifts = [], [np.zeros(0, np.int64)], [np.zeros(0)]
    for part in rims:
        even = _GAP * np.arange(len(part.names))
        rest = part.lengths - even
        lengths = even + (np.maximum.accumulate(rest) + np.minimum.accumulate(rest[::-1])[::-1]) / 2
        stretch = rim.zones.stretches[part.stretch]
        held = ((part.lengths <= stretch.lengths[0]) | (part.lengths >= stretch.lengths[-1])) & (not stretch.closed)
        held[[0, -1]] |= stretch.closed  # one vertex
        lengths = np.where(held, part.lengths, lengths)
        shift = lengths - part.lengths
        if np.abs(shift).max() > _BACK:
            raise Ragged(stretch.course.number, "a rim goes back")
        rows = np.flatnonzero(shift)
        moved.append(part.names[rows])
        shifts.append(shift[rows])
        result.append(_Rim(part.stretch, part.names, lengths, part.turned))
    names, shift = np.concatenate(moved), np.concatenate(shifts)
    grid = rim.local.grid
    units = grid.to_units(vertices[names])
    units = units + shift[:, None] * rim.zones.measure(units).way
    vertices, normals = vertices.copy(), normals.copy()
    vertices[names], normals[names] = rim.reach(grid.to_points(units))
    return vertices, normals, result


def _fault(stretch: Stretch, rims: list[_Rim], curve: IntArray) -> str:
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


def _unrolled(stretch: Stretch, numbers: IntArray, rim: _Rim) -> tuple[IntArray, FloatArray]:
    """The stations along a rim, and their lengths, which go on where the rim goes round."""
    if not stretch.closed:
        return numbers, stretch.lengths
    length = stretch.lengths[-1]
    rounds = round((rim.lengths[-1] - rim.lengths[0]) / length)
    names, lengths = numbers[:-1], stretch.lengths[:-1]
    first = int(np.searchsorted(lengths, rim.lengths[0] % length)) % len(names)
    row = first + np.arange(rounds * len(names) + 1)
    shift = np.floor((rim.lengths[0] - lengths[first]) / length + 0.5)
    return names[row % len(names)], lengths[row % len(names)] + (row // len(names) + shift) * length


def _zip(rim: _Rim, names: IntArray, lengths: FloatArray) -> IntArray:
    """Triangles (n, 3) between a rim and a curve, in the order of the middles of their edges; apexes come first."""
    outer, inner = ((s[1:] + s[:-1]) / 2 for s in (rim.lengths, lengths))
    outer = np.maximum.accumulate(outer)
    if rim.names[0] == names[0] and len(inner) > 1 and inner[1] <= outer[0]:
        outer[0] = (inner[0] + inner[1]) / 2
    if rim.names[-1] == names[-1] and len(inner) > 1 and inner[-2] >= outer[-1]:
        outer[-1] = (inner[-1] + inner[-2]) / 2
    to_curve = names[np.searchsorted(inner, outer)]
    to_rim = rim.names[np.searchsorted(outer, inner, side="right")]
    strip = np.concatenate(
        [np.column_stack([to_curve, rim.names[1:], rim.names[:-1]]), np.column_stack([to_rim, names[:-1], names[1:]])]
    )
    a, b, c = strip.T
    return strip[(a != b) & (b != c) & (c != a)]


def _halved(rim: ZoneRim, mesh: Mesh) -> Mesh:
    """Ribbons, all triangles with their apex first, with long sides towards apexes halved."""
    vertices, normals, fans = mesh
    spokes = np.sort(fans[:, [0, 1, 0, 2]].reshape(-1, 2), axis=1)
    length = np.linalg.norm(vertices[spokes[:, 0]] - vertices[spokes[:, 1]], axis=1)
    long = length > _WIDE * rim.cell
    found, inverse = np.unique(spokes[long], axis=0, return_inverse=True)
    places, directions = onto(rim.local, vertices[found].mean(axis=1))
    halves = fans[:, 1:].ravel()
    halves[long] = len(vertices) + inverse.ravel()
    parts = split_fans(fans, halves.reshape(-1, 2)).reshape(-1, 3)
    a, b, c = parts.T
    parts = parts[(a != b) & (b != c) & (c != a)]
    return np.concatenate([vertices, places]), np.concatenate([normals, directions]), parts
