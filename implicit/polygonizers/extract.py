"""From the samples of bricks to vertices on lattice edges and triangles between them.

Bricks come in descending order of x, y, z. A brick owns the edges that start at its points 0 to 6 along each axis (to
the last plane in the last brick) and takes the numbers of the edges on its upper faces from its three upper
neighbours, which have left them behind. So every vertex has one number from the start, and nothing is merged.

f < 0 is inside and f = 0 is outside. A brick without a sample inside, or without one outside, has no edge that
crosses, on its faces neither; its neighbours never ask for it.
"""

from typing import Any

import numpy as np
from numba import njit

from implicit.polygonizers.cell import EDGES, TRIANGLE_COUNT, TRIANGLES

VERTICES_PER_BRICK = 3 * 8 * 8 * 8
TRIANGLES_PER_BRICK = 5 * 7 * 7 * 7

WINDOW_ROWS = 8
"""Rows of a first guess: 0-5 samples in a row, 6 the root of the straight line, 7 the start of the edge."""

_STEP = (64, 8, 1)
EDGE_PLACE = np.array(
    [512 * (number // 4) + sum(_STEP[axis] * (low >> 2 - axis & 1) for axis in range(3))
     for number, (low, _) in enumerate(EDGES)]
)  # fmt: skip
"""Where the number of each edge of the first cell of a brick is kept: direction 512 + x 64 + y 8 + z."""

_PLACES = EDGE_PLACE[TRIANGLES]

_U = np.uint64
_PACK = _U(0x0102040810204080)
_DE_BRUIJN = 0x03F79D71B4CB0A89
_BIT = np.zeros(64, np.int64)
_BIT[[((_DE_BRUIJN << bit) & (2**64 - 1)) >> 58 for bit in range(64)]] = np.arange(64)
_HASH = _U(_DE_BRUIJN)
_LARGEST = np.finfo(float).max


@njit(cache=True, nogil=True, inline="always")
def _lowest_bit(word: Any) -> Any:
    return _BIT[((word & (~word + _U(1))) * _HASH) >> _U(58)]


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, inline="always")
def _look(f: Any, place: int, step: int, at: int, cells: int, window: Any, n: int) -> None:
    """Keep what a first guess needs: six samples in a row, where a straight line vanishes, and where the edge starts.

    `at` counts samples along the axis, `cells` the cells that the brick has along it. Where there are not as many, six
    values on the straight line through the two ends.
    """
    a, b = f[place], f[place + step]
    first = 0.0
    if cells < 5:
        for row in range(6):
            window[row, n] = a + row * (b - a)
    else:
        start = min(max(at - 2, 0), cells - 5)
        base = place + (start - at) * step
        for row in range(6):
            window[row, n] = f[base + row * step]
        first = float(at - start)
    window[6, n] = first + a / (a - b)
    window[7, n] = first


@njit(cache=True, nogil=True, error_model="numpy")
def _guess(found: Any, window: Any, n: int) -> None:
    """Move crossings to where the polynomial of degree 5 through their six samples vanishes.

    Two of Newton's steps from the straight line, on the form d0 + t (d1 + (t - 1)/2 (d2 + ...)), in a loop that
    vectorises; where they do not end within the edge, the straight line.
    """
    w0, w1, w2, w3 = window[0, :n], window[1, :n], window[2, :n], window[3, :n]
    w4, w5, line = window[4, :n], window[5, :n], window[6, :n]
    for k in range(n):
        g0, a1, a2, a3, a4, a5 = w0[k], w1[k] - w0[k], w2[k] - w1[k], w3[k] - w2[k], w4[k] - w3[k], w5[k] - w4[k]
        b2, b3, b4, b5 = a2 - a1, a3 - a2, a4 - a3, a5 - a4
        c3, c4, c5 = b3 - b2, b4 - b3, b5 - b4
        d4 = c4 - c3
        e5 = ((c5 - c4) - d4) * 0.2
        t = line[k]
        u4, u3, u2, u1 = t - 4.0, (t - 3.0) * 0.25, (t - 2.0) * (1.0 / 3.0), (t - 1.0) * 0.5
        p4 = d4 + u4 * e5
        p3, s3 = c3 + u3 * p4, 0.25 * p4 + u3 * e5
        p2, s2 = b2 + u2 * p3, (1.0 / 3.0) * p3 + u2 * s3
        p1, s1 = a1 + u1 * p2, 0.5 * p2 + u1 * s2
        t = t - (g0 + t * p1) / (p1 + t * s1)
        u4, u3, u2, u1 = t - 4.0, (t - 3.0) * 0.25, (t - 2.0) * (1.0 / 3.0), (t - 1.0) * 0.5
        p4 = d4 + u4 * e5
        p3, s3 = c3 + u3 * p4, 0.25 * p4 + u3 * e5
        p2, s2 = b2 + u2 * p3, (1.0 / 3.0) * p3 + u2 * s3
        p1, s1 = a1 + u1 * p2, 0.5 * p2 + u1 * s2
        w5[k] = t - (g0 + t * p1) / (p1 + t * s1)
    for k in range(n):
        share = w5[k] - window[7, k]
        if not 0.0 < share < 1.0:
            share = line[k] - window[7, k]
        low, high = found[3, k], found[4, k]
        found[int(found[7, k]), k] = low + (high - low) * share


@njit(cache=True, nogil=True, error_model="numpy")
def _cross(
    mask: Any, i: int, axis: int, start: Any, own: Any, axes: Any, f: Any, first: int, found: Any, window: Any, n: int,
    numbers: Any,
) -> int:  # fmt: skip
    """Number the edges along `axis` that start at plane i and have their bit in `mask`; the next free column.

    found rows: x, y, z (of the start of the edge), the two ends of the edge, f there, the axis.
    """
    step = 64 if axis == 0 else (8 if axis == 1 else 1)
    while mask != _U(0):
        bit = _lowest_bit(mask)
        mask &= mask - _U(1)
        j, k = bit >> 3, bit & 7
        place = 64 * i + bit
        at = i if axis == 0 else (j if axis == 1 else k)
        found[0, n] = axes[0, start[0] + i]
        found[1, n] = axes[1, start[1] + j]
        found[2, n] = axes[2, start[2] + k]
        found[3, n] = found[axis, n]
        found[4, n] = axes[axis, start[axis] + at + 1]
        found[5, n] = f[place]
        found[6, n] = f[place + step]
        found[7, n] = axis
        _look(f, place, step, at, own[axis], window, n)
        numbers[512 * axis + place] = np.int32(first + n)
        n += 1
    return n


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _fetch(numbers: Any, points: Any, low_x: Any, low_y: Any, low_z: Any) -> None:
    """Take the numbers on the upper faces from the lower faces of the neighbours there.

    A brick with 8 planes of its own along an axis is the last there: what a neighbour would have left is not its own.
    """
    for a in range(64):
        if points[0] != 8:
            numbers[512 + 448 + a] = low_x[a]
            numbers[1024 + 448 + a] = low_x[64 + a]
    for a in range(8):
        for b in range(8):
            if points[1] != 8:
                numbers[64 * a + 56 + b] = low_y[8 * a + b]
                numbers[1024 + 64 * a + 56 + b] = low_y[64 + 8 * a + b]
            if points[2] != 8:
                numbers[64 * a + 8 * b + 7] = low_z[8 * a + b]
                numbers[512 + 64 * a + 8 * b + 7] = low_z[64 + 8 * a + b]


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _leave(numbers: Any, low_x: Any, low_y: Any, low_z: Any) -> None:
    """Leave the numbers on the three lower faces behind for the neighbours there."""
    for a in range(64):
        low_x[a] = numbers[512 + a]
        low_x[64 + a] = numbers[1024 + a]
    for a in range(8):
        for b in range(8):
            low_y[8 * a + b] = numbers[64 * a + b]
            low_y[64 + 8 * a + b] = numbers[1024 + 64 * a + b]
            low_z[8 * a + b] = numbers[64 * a + 8 * b]
            low_z[64 + 8 * a + b] = numbers[512 + 64 * a + 8 * b]


@njit(cache=True, nogil=True, error_model="numpy")
def _join(words: Any, planes: int, row: Any, numbers: Any, faces: Any, t: int) -> int:
    """Write the triangles of the cells of a brick; the next free row of `faces`."""
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
            p, q = a >> _U(bit), c >> _U(bit)
            low = (p & _U(3)) | ((p >> _U(6)) & _U(12))
            high = ((q & _U(3)) << _U(4)) | ((q >> _U(2)) & _U(192))
            pattern = np.intp(low | high)
            base = 64 * i + bit
            for e in range(TRIANGLE_COUNT[pattern]):
                for corner in range(3):
                    faces[t, corner] = numbers[_PLACES[pattern, 3 * e + corner] + base]
                t += 1
    return t


@njit(cache=True, nogil=True, error_model="numpy")
def _rows(count: int, width: int) -> Any:
    """The bits 8 j + k with j < count and k < width."""
    word = _U(0)
    for j in range(count):
        word |= ((_U(1) << _U(width)) - _U(1)) << _U(8 * j)
    return word


@njit(cache=True, nogil=True, error_model="numpy")
def extract(
    samples: Any, bricks: Any, begin: int, axes: Any, cells: Any, low_x: Any, low_y: Any, low_z: Any, first: int,
    found: Any, window: Any, starts: Any, faces: Any, t: int,
) -> tuple[int, int, int, bool]:  # fmt: skip
    """Extract bricks (n, 3) with samples (n, 512) from `begin` on, while there is room in `found`.

    axes (3, ...) padded planes and cells (3,) of the lattice; low_x (2, ., ., 128), low_y (2, ., 128), low_z (128,)
    numbers left behind on lower faces; `first` is the number of the next vertex. Fills found (8, ...), the column
    where each brick starts in starts (n + 1,), and faces from row t on; window (8, ...) is scratch.
    Returns where it stopped, the number of vertices found, the next row of faces, and whether all was finite; if not,
    it stopped at a brick with a sample that is not.
    """
    signs = np.zeros(512, np.uint8)
    eights = signs.view(np.uint64)
    words = np.zeros(9, np.uint64)
    numbers = np.zeros(1536, np.int32)
    start = np.zeros(3, np.int64)
    own = np.zeros(3, np.int64)
    points = np.zeros(3, np.int64)
    n = 0
    end, finite = len(bricks), True
    for index in range(begin, len(bricks)):
        starts[index] = n
        if n + VERTICES_PER_BRICK > found.shape[1]:
            end = index
            break
        f = samples[index]
        if not _pack_signs(f, signs, eights, words):
            end, finite = index, False
            break
        some, every = words[0], words[0]
        for i in range(1, 8):
            some |= words[i]
            every &= words[i]
        if some == _U(0) or every == ~_U(0):
            continue
        for axis in range(3):
            start[axis] = 7 * bricks[index, axis]
            own[axis] = min(7, cells[axis] - start[axis])
            points[axis] = own[axis] + (start[axis] + own[axis] == cells[axis])
        whole, cut_y = _rows(points[1], points[2]), _rows(own[1], points[2])
        cut_z, cut_both = _rows(points[1], own[2]), _rows(own[1], own[2])
        bx, by, bz = bricks[index, 0], bricks[index, 1], bricks[index, 2]
        _fetch(numbers, points, low_x[1 - (bx & 1), by, bz], low_y[1 - (by & 1), bz], low_z)
        for i in range(points[0]):
            word = words[i]
            for axis in range(3):
                mask = (word ^ (word >> _U(1))) & cut_z
                if axis == 0:
                    mask = (word ^ words[i + 1]) & whole if i < own[0] else _U(0)
                elif axis == 1:
                    mask = (word ^ (word >> _U(8))) & cut_y
                n = _cross(mask, i, axis, start, own, axes, f, first, found, window, n, numbers)
        _leave(numbers, low_x[bx & 1, by, bz], low_y[by & 1, bz], low_z)
        t = _join(words, own[0], cut_both, numbers, faces, t)
    starts[end] = n
    _guess(found, window, n)
    return end, n, t, finite
