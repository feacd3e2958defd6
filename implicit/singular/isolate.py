"""Boxes that may hold critical points of f on f = 0, by subdivision with errors bounded at every step.

A box is four integers: level, i, j, k. Axis a has been halved m = (level + 2 - a) // 3 times, and the box reaches
over [-1, 1] from -1 + 2 i / 2^m to -1 + 2 (i + 1) / 2^m:

    level 0: the whole   level 1: halves in x   level 2: quarters in x, y   level 3: octants ...
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from implicit.kernels.elementary import INNER, OPTIONS
from implicit.singular.restrict import restrict

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

UNIT = 2.0**-53


@njit(**INNER, inline="always")
def place(box: Ints, lower: Floats, width: Floats) -> None:
    """Lower corner and widths of a box, both exact."""
    for a in range(3):
        width[a] = 2.0 / 2.0 ** ((box[0] + 2 - a) // 3)
        lower[a] = -1.0 + width[a] * box[1 + a]


@njit(**INNER)
def spread(b: Floats, shape: Ints, first: int, second: int) -> tuple[float, float]:
    """Least and greatest difference of coefficients along the axes first and second (-1: none), times degrees.

    shape (6,): numbers of coefficients along the axes, then the steps between them.
    """
    factor, s, t = 1.0, 0, 0
    if first >= 0:
        factor *= shape[first] - 1
        s = shape[3 + first]
    if second >= 0:
        factor *= shape[second] - (2 if first == second else 1)
        t = shape[3 + second]
    if factor <= 0:
        return 0.0, 0.0
    least, greatest = np.inf, -np.inf
    for i in range(shape[0] - (first == 0) - (second == 0)):
        for j in range(shape[1] - (first == 1) - (second == 1)):
            o = i * shape[3] + j * shape[4]
            for k in range(o, o + shape[2] - (first == 2) - (second == 2)):
                v = b[k]
                if s:
                    v = b[k + s] - v
                if t:
                    v = (b[k + s + t] - b[k + t]) - v
                least = v if v < least else least
                greatest = v if v > greatest else greatest
    return factor * least, factor * greatest


@njit(**INNER)
def invert(m: Floats, out: Floats) -> bool:
    """The inverse of a 3x3 matrix by cofactors; False where it is singular to working precision."""
    for r in range(3):
        p, q = (r + 1) % 3, (r + 2) % 3
        for c in range(3):
            s, t = (c + 1) % 3, (c + 2) % 3
            out[c, r] = m[p, s] * m[q, t] - m[p, t] * m[q, s]
    d = m[0, 0] * out[0, 0] + m[0, 1] * out[1, 0] + m[0, 2] * out[2, 0]
    if abs(d) < 1e-280:
        return False
    for r in range(3):
        for c in range(3):
            out[r, c] /= d
    return True


@njit(**INNER, inline="always")
def contract(b: Floats, error: float, shape: Ints, centre: Floats, root: Floats, work: Floats) -> int:
    """Krawczyk's test of grad f on the unit box: 1 exactly one zero (near root), -1 none, 0 unknown.

    x -> x - Y grad f(x) maps the box into centre - Y g + (I - Y H) (box - centre), with H the range of the Hessian.
    To work in: work (4, 3, 3).
    """
    middle, radius, y, g, ge = work[0], work[1], work[2], work[3, 0], work[3, 1]
    largest = size_of(b)
    error = error + 4 * UNIT * largest
    for r in range(3):
        for c in range(r, 3):
            least, greatest = spread(b, shape, r, c)
            middle[r, c] = middle[c, r] = 0.5 * (least + greatest)
            pad = 4.0 * error * (shape[r] - 1) * (shape[c] - 1)
            radius[r, c] = radius[c, r] = (0.5 * (greatest - least) + pad) * (1 + 8 * UNIT)
    if not invert(middle, y):
        return 0
    for r in range(3):
        g[r] = 0.0
        for k in range(b.size):
            g[r] += centre[r, k] * b[k]
        ge[r] = 2.0 * (error + (b.size + 40) * UNIT * largest) * (shape[r] - 1)
    inside = True
    for r in range(3):
        reach, step, slack = 0.0, 0.0, 0.0
        for c in range(3):
            e, s = 0.0, 0.0
            for k in range(3):
                e += y[r, k] * middle[k, c]
                s += abs(y[r, k]) * (radius[k, c] + 8 * UNIT * abs(middle[k, c]))
            reach += abs((1.0 if r == c else 0.0) - e) + s
            step -= y[r, c] * g[c]
            slack += abs(y[r, c]) * (ge[c] + 8 * UNIT * abs(g[c]))
        reach = 0.5 * reach * (1 + 1e-12) + slack * (1 + 1e-12)
        root[r] = 0.5 + step
        if abs(step) - reach > 0.5:
            return -1
        if abs(step) + reach >= 0.5:
            inside = False
    return 1 if inside else 0


@njit(**INNER)
def halve(b: Floats, shape: Ints, axis: int, left: Floats, right: Floats) -> None:
    """De Casteljau at the middle along one axis: the Bernstein coefficients of both halves."""
    n = shape[axis] - 1
    stride = shape[3 + axis]
    block = stride * (n + 1)
    for k in range(b.size):
        right[k] = b[k]
    for start in range(0, b.size, block):
        for line in range(start, start + stride):
            left[line] = right[line]
            for k in range(1, n + 1):
                for o in range(line, line + (n - k + 1) * stride, stride):
                    right[o] = 0.5 * (right[o] + right[o + stride])
                left[line + k * stride] = right[line]
            # right now holds b0^n, b1^(n-1), ..., bn: the right half, in order
    return


@njit(**INNER, inline="always")
def cut_off(lower: Floats, width: Floats, cuts: Floats) -> bool:
    """Whether the box lies wholly where some cut a x + b y + c z + d is negative."""
    for c in range(len(cuts)):
        top = cuts[c, 3]
        for a in range(3):
            v, w = cuts[c, a] * lower[a], cuts[c, a] * (lower[a] + width[a])
            top += v if v > w else w
        if top < 0.0:
            return True
    return False


@njit(**INNER, inline="always")
def examine(
    b: Floats, error: float, shape: Ints, centre: Floats, precondition: bool, root: Floats, work: Floats
) -> int:
    """What a box with Bernstein coefficients b holds: -1 nothing, 1 exactly one critical point, 0 unknown."""
    none = np.int64(-1)  # a literal would compile `spread` again
    least, greatest = spread(b, shape, none, none)
    if least > error or greatest < -error:
        return -1
    largest = -least if -least > greatest else greatest
    for a in range(3):
        least, greatest = spread(b, shape, a, none)
        pad = (2 * error + 4 * UNIT * largest) * (shape[a] - 1)
        if least > pad or greatest < -pad:
            return -1
    return contract(b, error, shape, centre, root, work) if precondition else 0


@njit(**OPTIONS)
def search(
    high: Floats, low: Floats, shape: Ints, centre: Floats, cuts: Floats, starts: Ints, depth: int,
    found: Ints, roots: Floats, left: Ints, boxes: Ints, stack: Floats, errors: Floats, room: Floats, work: Floats,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Search the boxes `starts` down to level `depth`, visiting at most as many as there is room for.

    Writes boxes with exactly one critical point, estimates of these points (in [-1, 1]^3), boxes left at the last level
    or at the limit of precision, and boxes that are still open behind the last of `starts` that was begun. Returns how
    many there are of the first, the third and the fourth, and how many of `starts` were begun. The rest is empty.

    centre (3, size): the derivatives at the centre of the unit box as sums of coefficients. To work in: stack
    (depth + 2, size), errors (depth + 2,), room (2, >= size, >= 9), work (4, 3, 3).
    """
    parent, lower, width, root = room[0, : high.size], room[1, :3], room[1, 3:6], room[1, 6:9]
    n_found, n_left, visited, todo, top = 0, 0, 0, 0, 0
    while visited < len(left) and (top > 0 or todo < len(starts)):
        if top == 0:
            for a in range(4):
                boxes[0, a] = starts[todo, a]
            errors[0] = np.inf
            todo += 1
            top = 1
        top -= 1
        visited += 1
        b, box, error = stack[top], boxes[top], errors[top]
        place(box, lower, width)
        if cut_off(lower, width, cuts):
            continue
        largest = np.inf if error == np.inf else size_of(b)
        if error == np.inf or error > 1e-7 * largest:
            error = restrict(high, low, shape, lower, width, b, parent)
            largest = size_of(b)
        verdict = examine(b, error, shape, centre, box[0] >= 3, root, work)
        if verdict > 0:
            for a in range(4):
                found[n_found, a] = box[a]
            for a in range(3):
                roots[n_found, a] = lower[a] + width[a] * root[a]
            n_found += 1
        elif verdict == 0 and (box[0] >= depth or error > 1e-2 * largest):
            for a in range(4):
                left[n_left, a] = box[a]
            n_left += 1
        elif verdict == 0:
            # the upper half takes this place, the lower half the next
            axis = box[0] % 3
            errors[top] = errors[top + 1] = error + (shape[axis] + 1) * UNIT * largest
            for k in range(b.size):
                parent[k] = b[k]
            halve(parent, shape, axis, stack[top + 1], b)
            box[0] += 1
            box[1 + axis] *= 2
            for a in range(4):
                boxes[top + 1, a] = box[a]
            box[1 + axis] += 1
            top += 2
    return n_found, n_left, top, todo


@njit(**INNER)
def size_of(b: Floats) -> float:
    """The largest absolute coefficient."""
    largest = 0.0
    for k in range(b.size):
        largest = abs(b[k]) if abs(b[k]) > largest else largest
    return largest
