"""Ribbons of triangles between a stretch of a singular curve and what is left of the mesh round its zone.

The mesh is cut where it enters the zone. Each sheet leaves a rim along the curve, from one end of the stretch to the
other, or round it; curve and rim are joined in the order of lengths along the curve, and wide triangles halved.
"""

#   p---p----p---p--p----p---p    rim
#   | / | \ / \ / \ | \ / \ / |
#   c---c-----c-----c-----c---c   curve

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.clip import cut_along
from implicit.polygonizers.conforming.curves.rim import Ragged, Rim, fault, find_rims, in_order
from implicit.polygonizers.conforming.curves.zone import Stretch, ZoneRim
from implicit.polygonizers.conforming.facing import turned
from implicit.polygonizers.conforming.local import Local, among, at_all, at_some, proper
from implicit.polygonizers.conforming.neighbourhood import Neighbourhood
from implicit.polygonizers.conforming.points.inward import Mesh, split_fans

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]

_OFF = 1e-9
"""Vertices are so near to f = 0, in cells."""
_SLIVER = 0.01
"""Triangles smaller than so many squares of a cell may face anywhere."""
_WIDE = 1.2
"""Triangles are halved that reach so many cells from the curve."""
_HALVINGS = 4
"""Spokes are halved so often at most: the longest reach across the widest zone."""


def lay_ribbons(local: Local, mesh: Mesh, hood: Neighbourhood, numbers: list[IntArray], fixed: Flags) -> Mesh:
    """The mesh with ribbons along the stretches of a neighbourhood; numbers: the vertices at the stations of its
    courses; fixed (v,): the singular vertices.

    Raises Ragged where the mesh round a stretch does not allow ribbons.
    """
    fixed = np.append(fixed, np.zeros(len(mesh[0]) - len(fixed), bool))
    curves = [part.within(numbers[hood.courses.index(part.course)]) for part in hood.zones.stretches]
    return _lay(ZoneRim(hood.zones, local), mesh, curves, fixed)


def _lay(rim: ZoneRim, mesh: Mesh, curves: list[IntArray], fixed: Flags) -> Mesh:
    """A mesh near zones with ribbons; curves: the vertices at the stations of each stretch."""
    zones = rim.zones
    vertices, normals, faces = cut_along(rim, *mesh, fixed)
    fixed = np.append(fixed, np.zeros(len(vertices) - len(fixed), bool))
    rims = find_rims(rim, vertices, faces, fixed)
    vertices, normals, rims = in_order(rim, vertices, normals, rims, fixed)
    fans = [np.zeros((0, 3), np.int64)]
    for row, (stretch, curve) in enumerate(zip(zones.stretches, curves, strict=True)):
        mine = [part for part in rims if part.stretch == row]
        if reason := fault(stretch, mine, curve):
            raise Ragged(stretch.course.number, reason)
        for part in mine:
            strip = _zip(part, *_unrolled(stretch, curve, part))
            fans.append(strip[:, [0, 2, 1]] if part.turned else strip)
    on_curve = np.zeros(len(vertices), bool)
    on_curve[np.concatenate(curves)] = True
    outer = [np.zeros((0, 2), np.int64), *(np.column_stack([part.names[:-1], part.names[1:]]) for part in rims)]
    vertices, normals, ribbon = _halved(rim, (vertices, normals, np.concatenate(fans)), on_curve, np.concatenate(outer))
    fixed = np.append(fixed, np.zeros(len(vertices) - len(fixed), bool))
    on_rim = np.zeros(len(vertices), bool)
    on_rim[np.concatenate([np.zeros(0, np.int64), *(part.names for part in rims)])] = True
    _check(rim, (vertices, normals, np.concatenate([ribbon, faces[at_some(on_rim, faces)]])), fixed)
    return vertices, normals, np.concatenate([faces, ribbon])


def _check(rim: ZoneRim, mesh: Mesh, fixed: Flags) -> None:
    """Raise Ragged if a vertex of some faces is not on f = 0, or one of them, but slivers, is turned over."""
    vertices, normals, faces = mesh
    used = np.zeros(len(vertices), bool)
    used[faces.ravel()] = True
    loose = np.flatnonzero(used & ~fixed)
    values, slopes = rim.local.field.gradients(vertices[loose])
    off = loose[np.abs(values) > _OFF * rim.cell * np.linalg.norm(slopes, axis=1)]
    bad = faces[turned(vertices, normals, fixed, faces)]
    a, b, c = (vertices[bad[:, k]] for k in range(3))
    bad = bad[np.linalg.norm(np.cross(b - a, c - a), axis=1) > _SLIVER * rim.cell**2]
    for places, reason in ((vertices[off], "off the surface"), (vertices[bad].mean(axis=1), "turned over")):
        if len(places):
            nearest = rim.zones.measure(rim.local.grid.to_units(places[:1])).owner[0]
            raise Ragged(rim.zones.stretches[nearest].course.number, reason)


def _unrolled(stretch: Stretch, numbers: IntArray, rim: Rim) -> tuple[IntArray, FloatArray]:
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


def _zip(rim: Rim, names: IntArray, lengths: FloatArray) -> IntArray:
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
    return proper(strip)


def _halved(rim: ZoneRim, mesh: Mesh, curve: Flags, outer: IntArray) -> Mesh:
    """Ribbons, all triangles with their apex first, with long spokes halved until they are short.

    Spokes lead from the curve, which has the vertices `curve` (v,), to the rims, whose edges (n, 2) are `outer`.
    """
    vertices, normals, fans = mesh
    done = []
    outer = np.sort(outer, axis=1)
    outer = outer[np.lexsort(outer.T[::-1])]
    for _ in range(_HALVINGS):
        ways = vertices[fans[:, 1:]] - vertices[fans[:, :1]]
        long = np.einsum("ijk,ijk->ij", ways, ways) > (_WIDE * rim.cell) ** 2
        fan, side = np.nonzero(long)
        ends = np.sort(np.column_stack([fans[fan, 0], fans[fan, 1 + side]]), axis=1)
        loose = ~(at_all(curve, ends) | among(ends @ [len(curve), 1], outer @ [len(curve), 1]))
        fan, side, ends = fan[loose], side[loose], ends[loose]
        if not len(fan):
            break
        keys, inverse = np.unique(ends @ [len(curve), 1], return_inverse=True)
        places, directions = rim.onto((vertices[keys // len(curve)] + vertices[keys % len(curve)]) / 2)
        halves = fans[:, 1:].copy()
        halves[fan, side] = len(vertices) + inverse
        vertices, normals = np.concatenate([vertices, places]), np.concatenate([normals, directions])
        on, cut = curve[fans[:, 0]], np.unique(fan)
        curve = np.append(curve, np.zeros(len(places), bool))
        tip, left, right = np.moveaxis(split_fans(fans[cut], halves[cut]), 1, 0)
        fans[cut], here = tip, on[cut]
        done += [left[here], right[here], fans[~on]]
        fans = proper(np.concatenate([fans[on], left[~here], np.roll(right[~here], -1, axis=1)]))
    return vertices, normals, proper(np.concatenate([*done, fans]))
