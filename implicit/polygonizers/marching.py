"""Marching cubes over the bricks that a surface may meet.

Bricks are swept in descending order, in runs of whole layers of constant x that do not depend on the number of workers.
One worker sweeps run after run into the same arrays. Several take a run each, number its vertices from 0, and name
those of the run above by their place in its lowest layer; then the runs are put together. The batches are the same in
both cases, and so is the mesh, bit for bit.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from implicit.polygonizers.extract import TRIANGLES_PER_BRICK, VERTICES_PER_BRICK, Room, extract
from implicit.polygonizers.guess import FOUND_ROWS, guess
from implicit.polygonizers.roots import LANES, STATE_ROWS, TILE, finish, search, settle
from implicit.polygonizers.samples import Sampler
from implicit.work import Job, batches, check_memory, trimmed

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

BATCH = 128
"""Bricks that are sampled, extracted and refined at a time: their samples fit the processor's cache."""

_RUN = 8 * BATCH
"""A run has at least so many bricks."""

_ROOM = 64
"""Crossings per brick that a batch has room for at once; a batch with more goes in several steps."""

_APART = 72
"""Keeps the rows of scratch arrays from starting a multiple of 4096 bytes apart, where they would share cache lines."""

_BYTES_PER_BRICK = 60 * 48 + 120 * 24
"""Vertices with normals, and triangles, of one sheet through a brick."""


@dataclass(frozen=True, eq=False)
class Marched:
    """Vertices, unit normals, faces, the vertices at lattice points (ascending), and how many normals are 0."""

    vertices: FloatArray
    normals: FloatArray
    faces: IntArray
    pinned: IntArray
    flat: int


@dataclass(eq=False)
class _Run:
    """One or several runs in a row, from cut to cut, and what has been found in them."""

    sampler: Sampler
    job: Job
    cuts: list[int]

    @property
    def first(self) -> int:
        """The first brick."""
        return self.cuts[0]

    @property
    def last(self) -> int:
        """One after the last brick."""
        return self.cuts[-1]

    def __post_init__(self) -> None:
        _, rows, columns = self.sampler.lattice.bricks
        room = BATCH * _ROOM + VERTICES_PER_BRICK + _APART
        scratch = np.empty((2 * FOUND_ROWS + STATE_ROWS, room))  # one piece, as `_arrays` are
        self.found, self.part, self.state = np.split(scratch, (FOUND_ROWS, 2 * FOUND_ROWS))
        self.room, self.tile, self.marks = Room.make(), np.zeros(TILE), np.empty(LANES, np.uint8)
        self.codes = np.empty(room, np.int32)
        self.rows, self.at_points = np.empty(room, np.int64), np.empty(room, np.int64)
        self.begins = np.zeros(self.last - self.first + 1, np.int64)
        self.ends = self.sampler.lattice.ends(self.sampler.bricks[self.first : self.last]).view(np.uint8)
        self.samples = np.empty((min(BATCH, self.last - self.first), 512))
        self.starts = np.zeros(BATCH + 1, np.int64)
        self.low_x = np.empty((2, rows, columns, 128), np.int32)
        self.low_y = np.empty((2, columns, 128), np.int32)
        self.low_z = np.empty(128, np.int32)
        bricks = self.last - self.first
        self.vertices, self.normals, self.faces = _arrays(bricks * _ROOM)
        self.pinned: list[IntArray] = []
        self.n = self.t = self.flat = self.waiting = 0

    def __call__(self) -> "_Run":
        """Sweep the run."""
        _, rows, columns = self.sampler.lattice.bricks
        if self.first:
            top = int(self.sampler.bricks[self.first, 0]) + 1 & 1
            self.low_x[top] = -1 - np.arange(rows * columns * 128, dtype=np.int32).reshape(rows, columns, 128)
        for start, stop in pairwise(self.cuts):
            for first, last in batches(stop - start, BATCH):
                self._batch(start + first, start + last)
                self.job.advance(last - first)
            self._search(stop)
        self.vertices, self.normals = trimmed(self.vertices, self.n), trimmed(self.normals, self.n)
        self.faces = trimmed(self.faces, self.t)
        return self

    def _batch(self, first: int, last: int) -> None:
        sampler, lattice = self.sampler, self.sampler.lattice
        samples, bricks = self.samples[: last - first], np.ascontiguousarray(sampler.bricks[first:last])
        sampler.fill(first, last, samples)
        begin = 0
        while begin < len(bricks):
            self._make_room(0, TRIANGLES_PER_BRICK, first + begin)
            end, n, self.t, finite = extract(
                samples, bricks, self.ends[first - self.first :], begin, lattice.cells, self.low_x, self.low_y,
                self.low_z, self.n, self.codes, self.starts, self.faces.reshape(-1), self.t, self.room,
            )  # fmt: skip
            if not finite:
                refuse(lattice.brick_points(bricks[end : end + 1])[0], samples[end])
            place = first + begin - self.first
            self.begins[place : place + end - begin + 1] = self.n + self.starts[begin : end + 1]
            if n:
                guess(
                    self.codes, self.starts, begin, end, samples.reshape(-1), bricks, lattice.padded, lattice.cells,
                    self.found, self.tile, self.room.counts,
                )  # fmt: skip
                self._refine(first + begin, first + end, n, self.starts[begin : end + 1])
            begin = end

    def _make_room(self, vertices: int, faces: int, reached: int) -> None:
        """Let there be room for so many more vertices and faces.

        When an eighth of the bricks is `reached`, there is room for as many as all will need if they go on like this,
        so that little is copied, and seldom.
        """
        rows = max(self.n + vertices, (self.t + faces + 1) // 2)
        share = (reached - self.first) / (self.last - self.first)
        if share > 0.125:
            rows = max(rows, int(1.05 * rows / share))
        if rows <= len(self.vertices):
            return
        larger = _arrays(rows + rows // 8)
        larger[0][: self.n], larger[1][: self.n] = self.vertices[: self.n], self.normals[: self.n]
        larger[2][: self.t] = self.faces[: self.t]
        self.vertices, self.normals, self.faces = larger

    def _refine(self, first: int, last: int, n: int, starts: IntArray) -> None:
        """Take one step for the n crossings of bricks `first` to `last`; those that need more wait for `_search`."""
        if self.waiting + n > len(self.rows):
            self._search(first)
        self._make_room(n, 0, last)
        values, gradients = self.sampler.near(self.found[:3, :n], first, last, starts)
        self.waiting, count, flat = settle(
            self.found, values, gradients, n, self.sampler.lattice.precision, self.vertices, self.normals, self.n,
            self.rows, self.part, self.state, self.waiting, self.at_points, self.tile, self.marks,
        )  # fmt: skip
        self._note(count, flat)
        self.n += n

    def _search(self, stop: int) -> None:
        """Move the crossings that wait onto the surface; `stop` is one after the last brick with any."""
        if not self.waiting:
            return
        sampler, tolerance, rows = self.sampler, self.sampler.lattice.precision, self.rows[: self.waiting]
        first = self.first + int(np.searchsorted(self.begins[: stop - self.first], rows[0], "right")) - 1
        begins = self.begins[first - self.first : stop - self.first + 1]
        gradients = search(
            self.part, self.state, rows,
            lambda points, rows: sampler.near(points, first, stop, np.searchsorted(rows, begins)), tolerance,
        )  # fmt: skip
        self._note(*finish(self.part, gradients, rows, tolerance, self.vertices, self.normals, self.at_points))
        self.waiting = 0

    def _note(self, count: int, flat: int) -> None:
        """Keep the vertices that were found at lattice points, and count those without a normal."""
        if count:
            self.pinned.append(self.at_points[:count].copy())
        self.flat += flat


def _arrays(rows: int) -> tuple[FloatArray, FloatArray, IntArray]:
    """Room for vertices, normals, and twice as many faces; what is not written to takes no memory.

    It is one piece, which allocators keep for the next mesh where they would give three back to the system.
    """
    whole = np.empty((4, rows, 3))
    return whole[0], whole[1], whole[2:].reshape(-1, 3).view(np.int64)


def refuse(points: FloatArray, values: FloatArray) -> None:
    """Raise ValueError naming the first of the points (n, 3) whose value is not finite."""
    bad = int(np.flatnonzero(~np.isfinite(values))[0])
    place = ", ".join(f"{coordinate:.6g}" for coordinate in points[bad])
    raise ValueError(f"the formula has no finite value at ({place}): f = {values[bad]}")


def march(sampler: Sampler, job: Job) -> Marched:
    """The mesh of f = 0 over the sampler's bricks.

    Every vertex lies on a lattice edge with one end inside and one outside, at a root of f; the mesh is closed but for
    the faces of the lattice's box. Raises ValueError where f is not finite, MemoryError when the mesh cannot fit.
    """
    cuts = _cut(sampler.bricks[:, 0])
    alone = job.workers == 1 or len(cuts) < 3
    check_memory(
        len(sampler.bricks) * _BYTES_PER_BRICK * (1 if alone else 2),
        f"a mesh over {len(sampler.bricks)} bricks of 7 x 7 x 7 cells",
        "lower the resolution or take smaller bounds",
    )
    parts = [cuts] if alone else [list(pair) for pair in pairwise(cuts)]
    return _join(job.map(_Run.__call__, [_Run(sampler, job, part) for part in parts if len(part) > 1]))


def _cut(layers: NDArray[np.int32]) -> list[int]:
    """Where to cut bricks sorted by layer into runs of whole layers, each of at least a few batches."""
    cuts = [0]
    for start in np.flatnonzero(np.diff(layers)) + 1:
        if start - cuts[-1] >= _RUN:
            cuts.append(int(start))
    return [*cuts, len(layers)] if len(layers) else [0]


def _join(runs: list[_Run]) -> Marched:
    """One mesh from runs in descending order; each takes the numbers on its top from the run before."""
    if not runs:
        return Marched(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64), 0)
    offset = 0
    pinned = []
    for index, run in enumerate(runs):
        if index:
            before = runs[index - 1]
            below = before.low_x[int(before.sampler.bricks[before.last - 1, 0]) & 1].ravel()
            ahead = run.faces < 0
            names = -1 - run.faces[ahead]
            run.faces += offset
            run.faces[ahead] = below[names] + offset - before.n
        pinned += [part + offset for part in run.pinned]
        offset += run.n
    if len(runs) == 1:
        vertices, normals, faces = runs[0].vertices, runs[0].normals, runs[0].faces
    else:
        vertices, normals, faces = (
            np.concatenate([getattr(run, name) for run in runs]) for name in ("vertices", "normals", "faces")
        )
    at_points = np.sort(np.concatenate(pinned)) if pinned else np.zeros(0, np.int64)
    return Marched(vertices, normals, faces, at_points, sum(run.flat for run in runs))
