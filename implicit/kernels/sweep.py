"""Tapes swept over bricks of samples, or over points with their gradients: one kernel, as it takes long to compile."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from implicit.kernels.adjoint import differentiate
from implicit.kernels.elementary import INNER, OPTIONS, Floats, Indices, Longs, Rows
from implicit.kernels.values import EVERYTHING, SIDE, WIDTH, evaluate, spread
from implicit.tape import Tape

_CHUNK = SIDE**3  # points handled together
_NONE = np.empty(0, np.int64)


@njit(**INNER, inline="always")
def _place(planes: Floats, job: int, jobs: Rows, part: Floats) -> np.int64:
    """Read the planes of a brick; the axes, in the bits of a mask, along which it differs from the brick before."""
    moved = np.int64(0)
    for axis in range(3):
        for k in range(SIDE):
            part[axis, k] = planes[axis, 7 * jobs[job, axis] + k]
        if job > 0 and jobs[job, axis] != jobs[job - 1, axis]:
            moved |= 4 >> axis
    if job == 0 or jobs[job, 3] != jobs[job - 1, 3] or jobs[job, 4] != jobs[job - 1, 4]:
        moved = np.int64(EVERYTHING)
    return moved


@njit(**INNER, inline="always")
def _collect(tapes: Rows, order: Longs, starts: Longs, index: int, members: Longs) -> tuple[int, int]:
    """List the points of all that comes from `index` on with the same tape; where that ends, and their number."""
    many, first = 0, order[index]
    while (
        index < len(order) and tapes[order[index], 3] == tapes[first, 3] and tapes[order[index], 4] == tapes[first, 4]
    ):
        for k in range(starts[order[index]], starts[order[index] + 1]):
            members[many] = k
            many += 1
        index += 1
    return index, many


@njit(**OPTIONS)
def _sweep(
    code: Rows,
    arguments: Indices,
    constants: Floats,
    tapes: Rows,
    order: Longs,
    starts: Longs,
    members: Longs,
    places: Floats,
    registers: Floats,
    adjoints: Floats,
    room: Floats,
    values: Floats,
    gradients: Floats,
) -> None:
    """Sweep tapes (n, 5), whose first row and number of rows are in columns 3 and 4.

    Without an order they belong to bricks, columns 0 to 2, of a lattice with planes `places` (3, ...): their samples go
    to values (512 n,). Else to the points from starts[i] on among places (3, m), and the order has those with equal
    tapes together: their values go to values (m,), and their gradients, unless there are no adjoints, to
    gradients (3, m). To work in: members (m,), room (9, WIDTH).
    """
    scratch, part, slopes, index, bricks = room[:3], room[3:6], room[6:], 0, len(order) == 0
    while index < (len(tapes) if bricks else len(order)):
        job, many, points, moved = (index if bricks else order[index]), 1, np.int64(0), np.int64(EVERYTHING)
        start, count = np.int64(tapes[job, 3]), np.int64(tapes[job, 4])
        if bricks:
            moved = _place(places, job, tapes, part)
            index += 1
        else:
            index, many = _collect(tapes, order, starts, index, members)
        for base in range(0, many, _CHUNK):
            if not bricks:
                points = np.int64(many - base if many - base < _CHUNK else _CHUNK)
                for axis in range(3):
                    for k in range(points):
                        part[axis, k] = places[axis, members[base + k]]
            evaluate(code, start, count, arguments, constants, part, points, moved, registers, scratch)
            result = registers[count - 1]
            if bricks:
                own = np.int64(code[start + count - 1, 3])
                spread(values[512 * job : 512 * job + 512], result, own, np.int64(7))
                continue
            for k in range(points):
                values[members[base + k]] = result[k]
            if len(adjoints):
                differentiate(code, start, count, arguments, constants, points, registers, adjoints, slopes, scratch)
                for axis in range(3):
                    for k in range(points):
                        gradients[axis, members[base + k]] = slopes[axis, k]


@dataclass(frozen=True, eq=False)
class Pool:
    """Tapes in rows of `code`, with the operands of their MIN and MAX in `arguments`, and the numbers they share."""

    code: Rows
    arguments: Indices
    constants: Floats

    @classmethod
    def of(cls, tape: Tape) -> "Pool":
        """One tape; copies, as kernels are compiled for arrays that can be written to."""
        return cls(tape.code.copy(), tape.arguments.copy(), tape.constants)

    def fill(self, bricks: Rows, planes: Floats, samples: Floats) -> None:
        """Write the samples (n, 512) of bricks (n, 5): a place in the lattice, first row and rows of a tape."""
        registers = np.empty((int(bricks[:, 4].max(initial=1)), WIDTH))
        none = np.empty((0, 0))
        _sweep(
            self.code, self.arguments, self.constants, bricks, _NONE, _NONE, _NONE, planes, registers, none,
            np.empty((9, WIDTH)), samples.reshape(-1), none,
        )  # fmt: skip

    def values(self, tapes: Rows, starts: Longs, points: Floats) -> Floats:
        """Values (n,) at points (3, n): from starts[i] on by the tape of row i, which names it like a brick's."""
        return self._at(tapes, starts, points, False)[0]

    def gradients(self, tapes: Rows, starts: Longs, points: Floats) -> tuple[Floats, Floats]:
        """Values (n,) and gradients (3, n), as `values`."""
        return self._at(tapes, starts, points, True)

    def _at(self, tapes: Rows, starts: Longs, points: Floats, slopes: bool) -> tuple[Floats, Floats]:
        rows, m = int(tapes[:, 4].max(initial=1)), points.shape[1]
        registers, adjoints = np.empty((rows, WIDTH)), np.empty((rows if slopes else 0, WIDTH))
        values, gradients = np.empty(m), np.empty((3, m if slopes else 0))
        _sweep(
            self.code, self.arguments, self.constants, tapes, np.argsort(tapes[:, 3]), starts, np.empty(m, np.int64),
            np.ascontiguousarray(points), registers, adjoints, np.empty((9, WIDTH)), values, gradients,
        )  # fmt: skip
        return values, gradients
