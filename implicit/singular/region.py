"""The search of one region: boxes in the coordinates of the surface, time limits, regions folded by symmetries."""

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from implicit.singular.form import Form
from implicit.singular.isolate import search
from implicit.singular.simple import middle_weights, simple_zeros

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# The searched box is larger than asked for by odd fractions, so that points of symmetric surfaces, which lie on
# planes of symmetry, do not lie on the faces of boxes.
_MARGINS = np.array([[0.0123, 0.0171, 0.0149], [0.0181, 0.0137, 0.0119]])
WHOLE = np.zeros((1, 4), np.int64)


class Deadline:
    """When to stop."""

    def __init__(self, seconds: float | None) -> None:
        self.end = np.inf if seconds is None else time.monotonic() + seconds

    @property
    def passed(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self.end

    @property
    def remaining(self) -> float:
        """Seconds left; infinite without a limit."""
        return float(self.end - time.monotonic())


@dataclass
class Region:
    """The boxes of one polynomial over an enlarged box [lower, upper]; `cuts` (n, 4) are half-spaces to stay in."""

    form: Form
    asked: Floats  # (2, 3)
    cuts: Floats = field(default_factory=lambda: np.zeros((0, 4)))

    def __post_init__(self) -> None:
        size = self.asked[1] - self.asked[0]
        self.lower = self.asked[0] - size * _MARGINS[0]
        self.upper = self.asked[1] + size * _MARGINS[1]
        self.middle, self.half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        high, low = self.form.in_box(self.lower, self.upper)
        self.table, self.high, self.low = high, high.ravel(), low.ravel()
        self.shape = np.array([*high.shape, high.shape[1] * high.shape[2], high.shape[2], 1])
        self.slopes = _slopes(high.shape)
        planes = self.cuts[:, :3] * self.half
        self.planes = np.column_stack([planes, self.cuts[:, 3] + self.cuts[:, :3] @ self.middle])

    def corners(self, boxes: Ints) -> Floats:
        """Lower and upper corners (K, 2, 3) of boxes, widened by rounding."""
        halvings = (boxes[:, :1] + 2 - np.arange(3)) // 3
        width = 2.0 / 2.0**halvings
        low = -1.0 + width * boxes[:, 1:]
        out = np.stack([low, low + width], axis=1) * self.half + self.middle
        pad = 4e-16 * (np.abs(self.middle) + self.half)
        return out + np.stack([-pad, pad])

    def holds(self, box: Ints, place: Floats) -> bool:
        """Whether a place lies in a box, and not on its faces to rounding."""
        low, high = self.corners(box[None])[0]
        pad = 1e-15 * (np.abs(self.middle) + self.half)
        return bool(np.all((place > low + pad) & (place < high - pad)))

    def width(self, box: Ints) -> float:
        """The shortest side of a box."""
        return float((self.half * 2 / 2.0 ** ((box[0] + 2 - np.arange(3)) // 3)).min())

    def search(self, starts: Ints, depth: int, deadline: Deadline) -> tuple[Ints, Floats, Ints, Ints]:
        """Boxes with one critical point, estimates of it, boxes left at `depth`, boxes there was no time for."""
        settled = simple_zeros(self.table, self.planes) if starts is WHOLE and not deadline.passed else None
        if settled is None:
            return self.search_long(starts, depth, deadline)
        return settled[0], settled[1] * self.half + self.middle, _boxes(0), _boxes(0)

    def search_long(self, starts: Ints, depth: int, deadline: Deadline) -> tuple[Ints, Floats, Ints, Ints]:
        """The same for a search of any length."""
        budget = max(300, 20_000_000 // self.high.size)
        size = self.high.size
        room = (_boxes(budget), np.empty((budget, 3)), _boxes(budget), _boxes(depth + 2))
        work = (np.empty((depth + 2, size)), np.empty(depth + 2), np.empty((2, max(size, 9))), np.empty((4, 3, 3)))
        data = (self.high, self.low, self.shape, self.slopes, self.planes)
        found, roots, left, rest = [_boxes(0)], [np.zeros((0, 3))], [_boxes(0)], starts
        while len(rest) and not deadline.passed:
            f, n, top, begun = search(*data, rest, depth, *room, *work)
            found.append(room[0][:f].copy())
            roots.append(room[1][:f].copy())
            left.append(room[2][:n].copy())
            rest = np.concatenate([room[3][:top], rest[begun:]])
        estimates = np.concatenate(roots) * self.half + self.middle
        return np.concatenate(found), estimates, np.concatenate(left), rest


def _slopes(shape: tuple[int, ...]) -> Floats:
    """The derivatives at the centre of the unit box as sums (3, size) of Bernstein coefficients."""
    result = []
    for axis in range(3):
        parts = [middle_weights(n) for n in shape]
        n = shape[axis]
        # n - 1 times the mean of differences, each of which has one coefficient and takes off the one before
        steps = np.diff(middle_weights(n - 1), prepend=0.0, append=0.0) if n > 1 else np.zeros(1)
        parts[axis] = (1 - n) * steps
        result.append((parts[0][:, None, None] * parts[1][:, None] * parts[2]).ravel())
    return np.array(result)


def _boxes(count: int) -> Ints:
    return np.empty((count, 4), np.int64)
