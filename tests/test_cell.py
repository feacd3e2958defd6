"""The cube's tables, which are derived: every property here holds for all 256 patterns."""

import numpy as np
import pytest

from implicit.polygonizers.cell import CORNERS, EDGES, FACES, LOOPS, TRIANGLE_COUNT, TRIANGLES, triangulate


def crossed(pattern):
    return {e for e, (a, b) in enumerate(EDGES) if (pattern >> a ^ pattern >> b) & 1}


def test_numbering():
    assert [4 * a + 2 * b + c for a, b, c in CORNERS] == list(range(8))
    for number, (a, b) in enumerate(EDGES):
        assert np.flatnonzero(np.subtract(CORNERS[b], CORNERS[a])).tolist() == [number // 4]


@pytest.mark.parametrize("face", FACES)
def test_faces_are_counter_clockwise_from_outside(face):
    a, b, c, d = (np.array(CORNERS[corner]) for corner in face)
    normal = np.cross(b - a, c - b)
    assert normal @ ((a + b + c + d) / 4 - 0.5) > 0


def test_loops_pass_each_crossed_edge_once():
    for pattern in range(256):
        edges = [edge for loop in LOOPS[pattern] for edge in loop]
        assert len(edges) == len(set(edges)) and set(edges) == crossed(pattern)


def test_triangles_fill_the_loops():
    for pattern in range(256):
        assert TRIANGLE_COUNT[pattern] == sum(len(loop) - 2 for loop in LOOPS[pattern])
        sides = {}
        for a, b, c in TRIANGLES[pattern][: 3 * TRIANGLE_COUNT[pattern]].reshape(-1, 3):
            for side in ((a, b), (b, c), (c, a)):
                sides[side] = sides.get(side, 0) + 1
        assert all(count == 1 for count in sides.values())
        rim = {side for side in sides if side[::-1] not in sides}
        assert rim == {(a, b) for loop in LOOPS[pattern] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)}


def test_one_inside_corner_gives_a_triangle_that_faces_away():
    for corner in range(8):
        middle = [np.mean([CORNERS[c] for c in EDGES[e]], axis=0) for e in triangulate(LOOPS[1 << corner][0])[0]]
        normal = np.cross(middle[1] - middle[0], middle[2] - middle[0])
        assert normal @ (0.5 - np.array(CORNERS[corner])) > 0


def test_no_diagonal_lies_in_a_face():
    faces = [{e for e, ends in enumerate(EDGES) if set(ends) <= set(face)} for face in FACES]
    for pattern in range(256):
        for loop in LOOPS[pattern]:
            around = {frozenset(pair) for pair in zip(loop, loop[1:] + loop[:1], strict=True)}
            for a, b, c in triangulate(loop):
                for pair in ({a, b}, {b, c}, {c, a}):
                    assert frozenset(pair) in around or not any(pair <= face for face in faces)


def test_neighbours_agree_on_their_common_face():
    """The segments on a face seen from both sides run in opposite directions, for all patterns of two cubes."""
    for axis in range(3):
        bit = 4 >> axis
        high = {e for e, ends in enumerate(EDGES) if all(c & bit for c in ends)}
        for pattern in range(256):
            upper = {(a, b) for loop in LOOPS[pattern] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)}
            upper = {(a, b) for a, b in upper if {a, b} <= high}
            shared = sum((pattern >> c & 1) << (c & ~bit) for c in range(8) if c & bit)
            low_edge = {e: EDGES.index(tuple(c & ~bit for c in EDGES[e])) for e in high}
            for rest in range(256):
                other = shared | sum((rest >> c & 1) << c for c in range(8) if c & bit)
                sides = {(a, b) for loop in LOOPS[other] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)}
                lower = {(b, a) for a, b in sides if {a, b} <= set(low_edge.values())}
                assert {(low_edge[a], low_edge[b]) for a, b in upper} == lower
