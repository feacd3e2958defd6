"""From the samples of bricks to vertices on lattice edges and triangles between them.

Bricks come in descending order of x, y, z. A brick owns the edges that start at its points 0 to 6 along each axis (to
the last plane in the last brick) and takes the numbers of the edges on its upper faces from its three upper
neighbours, which have left them behind. So every vertex has one number from the start, and nothing is merged. Where no
brick is swept beyond a face, the edges on it are the brick's own.

f < 0 is inside and f = 0 is outside. A brick without a sample inside, or without one outside, has no edge that
crosses, on its faces neither; its neighbours never ask for it.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from implicit.kernels.elementary import INNER, OPTIONS
from implicit.polygonizers.cell import EDGES, TRIANGLE_COUNT, TRIANGLES

VERTICES_PER_BRICK = 3 * 8 * 8 * 8
TRIANGLES_PER_BRICK = 5 * 7 * 7 * 7

_STEP = (64, 8, 1)
EDGE_PLACE = np.array(
    [512 * (number // 4) + sum(_STEP[axis] * (low >> 2 - axis & 1) for axis in range(3))
     for number, (low, _) in enumerate(EDGES)]
)  # fmt: skip
"""Where the number of each edge of the first cell of a brick is kept: direction 512 + x 64 + y 8 + z."""

_PLACES = np.pad(EDGE_PLACE[TRIANGLES], ((0, 0), (0, 1))).astype(np.uint16).ravel()
_COUNT = TRIANGLE_COUNT.astype(np.uint8)

_U = np.uint64
_PACK = _U(0x0102040810204080)
_DE_BRUIJN = 0x03F79D71B4CB0A89
_BIT = np.zeros(64, np.uint8)
_BIT[[((_DE_BRUIJN << bit) & (2**64 - 1)) >> 58 for bit in range(64)]] = np.arange(64)
_HASH = _U(_DE_BRUIJN)
_LARGEST = np.finfo(float).max
_Y_LOW, _Y_HIGH = _U(0xFF), _U(0xFF << 56)
_Z_LOW, _Z_HIGH = _U(0x0101010101010101), _U(0x8080808080808080)


@njit(**INNER, inline="always")
def _lowest_bit(word: Any) -> Any:
    return _BIT[((word & (~word + _U(1))) * _HASH) >> _U(58)]


@njit(**INNER)
def _pack_signs(f: Any, signs: Any, eights: Any, words: Any) -> bool:
    """Set bit 8 j + k of words[i] where f[64 i + 8 j + k] < 0; whether all of f is finite."""
    bad = np.uint8(0)
    for k in range(512):
        signs[k] = np.uint8(f[k] < 0.0)
        bad |= np.uint8(not (abs(f[k]) <= _LARGEST))
    for i in range(8):
        word = _U(0)
        for j in range(8):
            word |= ((eights[8 * i + j] * _PACK) >> _U(56)) << _U(8 * j)
        words[i] = word
    return bad == 0


@njit(**INNER, inline="always")
def _number(mask: Any, key: int, first: int, codes: Any, n: int, numbers: Any) -> int:
    """Number the edges that have their bit in `mask`, by their codes key + bit; the next free place."""
    while mask != _U(0):
        code = key + _lowest_bit(mask)
        mask &= mask - _U(1)
        codes[n] = code
        numbers[code & 2047] = first + n
        n += 1
    return n


@njit(**INNER, inline="always")
def _mixed(words: Any, face: Any) -> bool:
    """Whether the samples of a face differ in sign; `face` has the bits of its samples in each plane."""
    some, every = _U(0), face
    for i in range(8):
        some |= words[i] & face
        every &= words[i]
    return some != _U(0) and every != face


@njit(**INNER)
def _fetch(words: Any, numbers: Any, points: Any, low_x: Any, low_y: Any, low_z: Any) -> None:
    """Take the numbers on the upper faces from the lower faces of the neighbours there.

    A brick with 8 planes of its own along an axis is the last there: what a neighbour would have left is not its own.
    """
    if points[0] != 8 and words[7] != _U(0) and words[7] != ~_U(0):
        for a in range(64):
            numbers[512 + 448 + a] = low_x[a]
            numbers[1024 + 448 + a] = low_x[64 + a]
    if points[1] != 8 and _mixed(words, _Y_HIGH):
        for a in range(8):
            for b in range(8):
                numbers[64 * a + 56 + b] = low_y[8 * a + b]
                numbers[1024 + 64 * a + 56 + b] = low_y[64 + 8 * a + b]
    if points[2] != 8 and _mixed(words, _Z_HIGH):
        for a in range(64):
            numbers[8 * a + 7] = low_z[a]
            numbers[512 + 8 * a + 7] = low_z[64 + a]


@njit(**INNER)
def _leave(words: Any, numbers: Any, low_x: Any, low_y: Any, low_z: Any) -> None:
    """Leave the numbers on the three lower faces behind for the neighbours there."""
    if words[0] != _U(0) and words[0] != ~_U(0):
        for a in range(64):
            low_x[a] = numbers[512 + a]
            low_x[64 + a] = numbers[1024 + a]
    if _mixed(words, _Y_LOW):
        for a in range(8):
            for b in range(8):
                low_y[8 * a + b] = numbers[64 * a + b]
                low_y[64 + 8 * a + b] = numbers[1024 + 64 * a + b]
    if _mixed(words, _Z_LOW):
        for a in range(64):
            low_z[a] = numbers[8 * a]
            low_z[64 + a] = numbers[512 + 8 * a]


@njit(**INNER)
def _join(words: Any, planes: int, row: Any, numbers: Any, corners: Any, t: int) -> Any:
    """Write the triangles of the cells of a brick, three numbers each, from place 3 t on; the next free triangle.

    Two or all five triangles are written whether a cell has them or not: what is too much is overwritten.
    """
    p = _U(3 * t)
    for i in range(planes):
        a, c = words[i], words[i + 1]
        some, every = a | c, a & c
        some |= some >> _U(8)
        every &= every >> _U(8)
        some |= some >> _U(1)
        every &= every >> _U(1)
        mixed = some & ~every & row
        while mixed != _U(0):
            bit = _lowest_bit(mixed)
            mixed &= mixed - _U(1)
            base = (64 * i + bit) & 511
            q, r = a >> _U(bit), c >> _U(bit)
            pattern = (q & _U(3)) | ((q >> _U(6)) & _U(12)) | ((r & _U(3)) << _U(4)) | ((r >> _U(2)) & _U(192))
            place = pattern << _U(4)
            for e in range(6):
                corners[p + _U(e)] = numbers[_PLACES[place + _U(e)] + base]
            count = 3 * _COUNT[pattern]
            if count > 6:
                for e in range(6, 15):
                    corners[p + _U(e)] = numbers[_PLACES[place + _U(e)] + base]
            p += _U(count)
    return np.int64(p // _U(3))


@njit(**INNER)
def _rows(count: int, width: int) -> Any:
    """The bits 8 j + k with j < count and k < width."""
    word = _U(0)
    for j in range(count):
        word |= ((_U(1) << _U(width)) - _U(1)) << _U(8 * j)
    return word


class Room(NamedTuple):
    """What `extract` works in: the signs of a brick, as bytes and eight at a time, with a word for each plane and one
    that stays 0; the numbers of its edges; and how many cells and points are its own.
    """

    signs: Any
    eights: Any
    words: Any
    numbers: Any
    counts: Any

    @classmethod
    def make(cls) -> "Room":
        """New room."""
        signs = np.zeros(512, np.uint8)
        words, numbers = np.zeros(9, np.uint64), np.zeros(2048, np.int32)
        return cls(signs, signs.view(np.uint64), words, numbers, np.zeros((2, 3), np.int64))


@njit(**OPTIONS)
def extract(
    samples: Any, bricks: Any, ends: Any, begin: int, cells: Any, low_x: Any, low_y: Any, low_z: Any, first: int,
    codes: Any, starts: Any, corners: Any, t: int, room: Any,
) -> tuple[int, int, int, bool]:  # fmt: skip
    """Extract bricks (n, 3) with samples (n, 512) from `begin` on, while there is room in `codes` and `corners`.

    ends (n, 3): whether no brick is swept beyond along each axis; cells (3,) of the lattice; low_x (2, ., ., 128),
    low_y (2, ., 128), low_z (128,) numbers left behind on lower faces; `first` is the number of the next vertex. Fills
    codes: 2048 brick + 512 axis + 64 x + 8 y + z for the edge of each vertex, the place in it where each brick starts
    in starts (n + 1,), and the three corners of each triangle from triangle t on. Returns where it stopped, the number
    of vertices found, the next triangle, and whether all was finite; if not, it stopped at a brick with a sample that
    is not. room: see `Room`.
    """
    signs, eights, words, numbers, counts = room
    own, points = counts[0], counts[1]
    n = 0
    end, finite = len(bricks), True
    for index in range(begin, len(bricks)):
        starts[index] = n
        if n + VERTICES_PER_BRICK > len(codes) or 3 * (t + TRIANGLES_PER_BRICK) > len(corners):
            end = index
            break
        if not _pack_signs(samples[index], signs, eights, words):
            end, finite = index, False
            break
        some, every = words[0], words[0]
        for i in range(1, 8):
            some |= words[i]
            every &= words[i]
        if some == _U(0) or every == ~_U(0):
            continue
        for axis in range(3):
            start = 7 * bricks[index, axis]
            left = cells[axis] - start
            own[axis] = left if left < 7 else 7
            points[axis] = own[axis] + ends[index, axis]
        whole, cut_y = _rows(points[1], points[2]), _rows(own[1], points[2])
        cut_z, cut_both = _rows(points[1], own[2]), _rows(own[1], own[2])
        bx, by, bz = bricks[index, 0], bricks[index, 1], bricks[index, 2]
        _fetch(words, numbers, points, low_x[1 - (bx & 1), by, bz], low_y[1 - (by & 1), bz], low_z)
        for i in range(points[0]):
            word, key = words[i], (index << 11) + 64 * i
            for axis in range(3):
                if axis == 0:
                    crossed = (word ^ words[i + 1]) & whole if i < own[0] else _U(0)
                elif axis == 1:
                    crossed = (word ^ (word >> _U(8))) & cut_y
                else:
                    crossed = (word ^ (word >> _U(1))) & cut_z
                n = _number(crossed, key + 512 * axis, first, codes, n, numbers)
        _leave(words, numbers, low_x[bx & 1, by, bz], low_y[by & 1, bz], low_z)
        t = _join(words, own[0], cut_both, numbers, corners, t)
    starts[end] = n
    return end, n, t, finite
