"""How the parts of a mesh hang together: edges, fans round vertices, components."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a set of faces.

    keys      (E,) lower * size + higher vertex of each edge, ascending
    uses      (E,) number of faces at each edge
    balance   (E,) uses from the lower to the higher vertex, less uses the other way
    sides     (3F,) the sides of all faces, side s = face 3 + corner (from that corner to the next), sorted by edge
    """

    keys: IntArray
    uses: IntArray
    balance: IntArray
    sides: IntArray
    size: int

    @property
    def count(self) -> int:
        """The number of edges."""
        return len(self.keys)

    @property
    def boundary(self) -> int:
        """The number of edges with one face."""
        return int(np.count_nonzero(self.uses == 1))

    @property
    def crowded(self) -> int:
        """The number of edges with more than two faces."""
        return int(np.count_nonzero(self.uses > 2))

    @property
    def oriented(self) -> bool:
        """Whether each edge is used at most once in each direction more than in the other."""
        paired = np.where(self.uses % 2 == 0, self.balance == 0, np.abs(self.balance) == 1)
        return bool(paired.all())

    @property
    def balanced(self) -> bool:
        """Whether each edge is used equally often in both directions: the faces bound a solid."""
        return not self.balance.any()


def renumbered(faces: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """The vertices, of `size`, that `faces` (F, 3) use, ascending, and the faces in numbers of these."""
    used = np.zeros(size, np.bool_)
    used[faces.ravel()] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[faces]


def with_others(faces: IntArray, stay: NDArray[np.bool_], others: IntArray) -> IntArray:
    """The faces (F, 3) that stay, and others behind them: large arrays are written once."""
    rows = np.flatnonzero(stay)
    result = np.empty((len(rows) + len(others), 3), np.int64)
    np.take(faces, rows, axis=0, out=result[: len(rows)], mode="clip")  # several times as fast as by the mask itself
    result[len(rows) :] = others
    return result


def find_edges(faces: IntArray, size: int) -> Edges:
    """The edges of `faces` (F, 3) over `size` vertices; a side from a vertex to itself is no edge."""
    start, stop = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    sides = np.flatnonzero(start != stop)
    start, stop = start[sides], stop[sides]
    keys = np.minimum(start, stop) * size + np.maximum(start, stop)
    order = np.argsort(keys, kind="stable")
    keys, direction = keys[order], np.where(start < stop, 1, -1)[order]
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    uses = np.diff(first, append=len(keys))
    balance = np.add.reduceat(direction, first) if len(first) else np.zeros(0, np.int64)
    return Edges(keys[first], uses, balance, sides[order], size)


def curve_edges(curves: Sequence[IntArray], edges: Edges) -> IntArray:
    """The edges (n, 2) of the curves that are no edge of a face."""
    pairs = [np.sort(np.column_stack([curve[:-1], curve[1:]]), axis=1) for curve in curves if len(curve) > 1]
    if not pairs:
        return np.zeros((0, 2), np.int64)
    joined = np.unique(np.concatenate(pairs), axis=0)
    fresh = ~np.isin(joined[:, 0] * edges.size + joined[:, 1], edges.keys)
    return np.asarray(joined[fresh & (joined[:, 0] != joined[:, 1])])


def count_components(faces: IntArray, loose: IntArray, points: IntArray, size: int) -> tuple[int, int]:
    """How many vertices are in use, and how many connected pieces they form."""
    used = np.zeros(size, bool)
    for indices in (faces, loose, points):
        used[indices.ravel()] = True
    links = np.concatenate([faces[:, :2], faces[:, 1:], loose])
    label = components(links, size)
    return int(np.count_nonzero(used)), len(np.unique(label[used]))


def split_vertices(faces: IntArray, edges: Edges) -> IntArray:
    """The vertices whose faces form more than one fan.

    The corners of all faces are joined across every common edge; a vertex is split when its corners fall apart.
    """
    start = faces.ravel()
    side = edges.sides
    after = side - side % 3 + (side + 1) % 3
    low = np.where(start[side] < start[after], side, after)
    high = side + after - low
    same = np.repeat(np.arange(edges.count), edges.uses)
    joined = np.flatnonzero(np.diff(same) == 0)
    links = np.concatenate(
        [np.column_stack([low[joined], low[joined + 1]]), np.column_stack([high[joined], high[joined + 1]])]
    )
    label = components(links, len(start))
    count = int(label.max(initial=0)) + 1
    corners = np.sort(start * count + label)
    fans = corners[np.append(True, corners[1:] != corners[:-1])[: len(corners)]] // count
    return np.unique(fans[1:][np.diff(fans) == 0])


def components(links: IntArray, size: int) -> NDArray[np.int32]:
    """A number for each of `size` nodes, equal where links (n, 2) connect them."""
    from scipy.sparse import coo_array  # slow to import, and most meshes are made without
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(links), np.int8), (links[:, 0], links[:, 1])), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1])
