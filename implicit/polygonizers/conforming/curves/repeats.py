"""Singular points and curves that are given twice, or so close together that no tetrahedra fit between them."""

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.conforming.curves.arc import Arc

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

CLOSE = 0.01
"""Places less than so many cells apart are not told apart."""
SAME = 1e-6
"""Places less than so many cells apart are the same."""
_LONGEST = 1.0
"""Over so many cells arcs may be close, as they are where they leave a special point side by side."""


def apart(points: FloatArray, least: float) -> Mask:
    """Which points (n, 3) are at least so far from all earlier ones that are."""
    result = np.ones(len(points), bool)
    for row, point in enumerate(points):
        earlier = points[:row][result[:row]]
        result[row] = (np.linalg.norm(earlier - point, axis=1) > least).all()
    return result


def beside_arcs(points: FloatArray, arcs: list[Arc]) -> Mask:
    """Which points (n, 3) are close to an arc although none ends there."""
    result = np.zeros(len(points), bool)
    for arc in arcs:
        result |= _close(points, arc)
    result[[end for arc in arcs for end in (arc.start, arc.end) if end >= 0]] = False
    return result


def without_repeats(arcs: list[Arc]) -> tuple[list[Arc], FloatArray]:
    """The arcs without those that follow longer ones, and the nodes (n, 3) of those that need not be the same: one of
    the two is not where it should be.
    """
    kept: list[int] = []
    doubtful = [np.zeros((0, 3))]
    for number in sorted(range(len(arcs)), key=lambda k: -arcs[k].lengths[-1]):
        arc, longer = arcs[number], [arcs[k] for k in kept]
        close = np.any([np.zeros(len(arc.nodes), bool), *(_close(arc.nodes, other) for other in longer)], axis=0)
        together = np.diff(arc.lengths)[close[:-1] & close[1:]].sum()
        if together <= min(_LONGEST, arc.lengths[-1] / 2):
            kept.append(number)
        else:
            beside = [other for other in longer if _close(arc.nodes, other).any()]
            same = np.any([_on(arc.nodes, other) for other in beside], axis=0).all()
            if not (same and all(_on(other.nodes, other).all() for other in beside)):
                doubtful.append(arc.nodes)
    return [arcs[k] for k in sorted(kept)], np.concatenate(doubtful)


def _close(points: FloatArray, arc: Arc) -> Mask:
    """Which points (n, 3) are close to the chords on both sides of the nearest node of an arc."""
    farthest = CLOSE + np.diff(arc.lengths).max()  # half a chord from the nearest of its ends would do
    nearest = arc.tree.query(points, distance_upper_bound=farthest)[1].astype(np.int64)
    result = np.zeros(len(points), bool)
    rows = np.flatnonzero(nearest < len(arc.nodes))
    points, nearest = points[rows], nearest[rows]
    for first in (nearest - 1, nearest):
        row = np.clip(first, 0, len(arc.nodes) - 2)
        start, way = arc.nodes[row], arc.nodes[row + 1] - arc.nodes[row]
        share = np.einsum("ij,ij->i", points - start, way) / np.einsum("ij,ij->i", way, way)
        foot = start + share.clip(0, 1)[:, None] * way
        result[rows] |= np.linalg.norm(points - foot, axis=1) < CLOSE
    return result


def _on(points: FloatArray, arc: Arc) -> Mask:
    """Which points (n, 3) are points of an arc, the nearest found by steps along its chords."""
    t = arc.tree.query(points)[1].astype(float)
    for _ in range(4):
        rest = points - arc.places(t)
        row = np.minimum(t.astype(np.int64), len(arc.nodes) - 2)
        length = np.linalg.norm(arc.nodes[row + 1] - arc.nodes[row], axis=1)
        t = t + np.einsum("ij,ij->i", rest, arc.tangents(t)) / length
        t = t % arc.last if arc.closed else t.clip(0, arc.last)
    return np.asarray(np.linalg.norm(points - arc.places(t), axis=1) < SAME)
