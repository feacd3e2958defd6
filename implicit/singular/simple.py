"""Simple zeros of the gradient near f = 0, by arrays of boxes: the search of `isolate` while it is short.

A surface whose only singular points are nodes is settled within a few levels of subdivision. Then the kernel of the
longer search is not needed, which a new user would wait for. Boxes and tests are those of `isolate`; tensors of
Bernstein coefficients have the boxes first.
"""

from functools import cache
from math import comb
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from implicit.bernstein import on_boxes, rounding, split

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]

UNIT = 2.0**-53
_LEVELS, _MOST, _LARGEST = 14, 400, 700
"""The search is short with so many levels, boxes in each, and coefficients."""
_SHARP = 1e-7
"""Errors above this share of the largest coefficient call for more precision."""


def simple_zeros(table: Floats, cuts: Floats) -> tuple[Ints, Floats] | None:
    """Boxes (k, 4) with exactly one zero of the gradient, and estimates of these (k, 3), where all others are ruled out
    to hold one on f = 0; None where that is not seen soon.

    table: coefficients of powers of variables over [-1, 1]; cuts as for `isolate.search`.
    """
    if table.size > _LARGEST:
        return None
    boxes, paths = np.zeros((1, 4), np.int64), np.zeros(1, np.int64)
    b = on_boxes(table, np.array([[[-1.0] * 3, [1.0] * 3]]))
    errors = np.array([rounding(np.argwhere(np.ones(table.shape))) * np.abs(table).sum()])
    found = [(boxes[:0], np.zeros((0, 3)), paths[:0])]
    for level in range(_LEVELS + 1):
        lower, width = place(boxes)
        some = ~_cut_off(lower, width, cuts)
        some[some] = _possible(b[some], errors[some])
        boxes, paths, b, errors = boxes[some], paths[some], b[some], errors[some]
        if level >= 3 and len(boxes):
            verdict, roots = _contract(b, errors)
            single, some = verdict > 0, verdict == 0
            lower, width = place(boxes[single])
            found.append((boxes[single], lower + width * roots[single], paths[single]))
            boxes, paths, b, errors = boxes[some], paths[some], b[some], errors[some]
        if not len(boxes):
            break
        largest = np.abs(b).max(axis=(1, 2, 3))
        if level == _LEVELS or len(boxes) > _MOST or (errors > _SHARP * largest).any():
            return None
        axis = level % 3
        errors = np.tile(errors + (b.shape[1 + axis] + 1) * UNIT * largest, 2)
        b = np.concatenate(split(b, 1 + axis))
        boxes, paths = _halves(boxes, axis), np.concatenate([2 * paths, 2 * paths + 1])
    all_boxes, all_roots, all_paths = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(all_paths << (_LEVELS - all_boxes[:, 0]))  # that of `isolate`: lower halves first
    return all_boxes[order], all_roots[order]


def place(boxes: Ints) -> tuple[Floats, Floats]:
    """Lower corners and widths (n, 3), both exact."""
    width = np.asarray(2.0 / 2.0 ** ((boxes[:, :1] + 2 - np.arange(3)) // 3), np.float64)
    return -1.0 + width * boxes[:, 1:], width


def _halves(boxes: Ints, axis: int) -> Ints:
    """The lower halves, then the upper ones."""
    lower = boxes.copy()
    lower[:, 0] += 1
    lower[:, 1 + axis] *= 2
    upper = lower.copy()
    upper[:, 1 + axis] += 1
    return np.concatenate([lower, upper])


def _cut_off(lower: Floats, width: Floats, cuts: Floats) -> Flags:
    """Which boxes lie wholly where some cut is negative."""
    ends = np.maximum(cuts[:, :3] * lower[:, None], cuts[:, :3] * (lower + width)[:, None])
    return np.asarray((ends.sum(axis=2) + cuts[:, 3] < 0.0).any(axis=1))


def _differences(b: Floats, axis: int) -> Floats:
    """Differences along an axis; a single zero where there is but one coefficient."""
    if b.shape[1 + axis] == 1:
        return np.zeros((len(b), 1, 1, 1))
    turned = b.swapaxes(0, 1 + axis)
    return (turned[1:] - turned[:-1]).swapaxes(0, 1 + axis)


def _extremes(b: Floats) -> tuple[Floats, Floats]:
    """The least and the greatest coefficients (n,)."""
    return b.min(axis=(1, 2, 3)), b.max(axis=(1, 2, 3))


def _possible(b: Floats, errors: Floats) -> Flags:
    """Which boxes may hold a zero of the gradient on f = 0: neither f nor a derivative has one sign."""
    least, greatest = _extremes(b)
    result: Flags = (least <= errors) & (greatest >= -errors)
    pad = 2 * errors + 4 * UNIT * np.maximum(-least, greatest)
    for axis in range(3):
        low, high = _extremes(_differences(b, axis))
        result &= (low <= pad) & (high >= -pad)
    return result


def _at_centre(b: Floats) -> Floats:
    """The values (n,) of Bernstein forms at the centres of their boxes."""
    for n in b.shape[:0:-1]:
        b = b @ middle_weights(n)
    return b


@cache
def middle_weights(n: int) -> Floats:
    """The values of n Bernstein polynomials at 1/2."""
    return np.array([comb(n - 1, k) * 0.5 ** (n - 1) for k in range(n)])


def _contract(b: Floats, errors: Floats) -> tuple[Ints, Floats]:
    """Krawczyk's test of grad f on unit boxes, as in `isolate.contract`: 1, -1 or 0 and where the zero is near."""
    n, degrees, largest = len(b), np.array(b.shape[1:]) - 1, np.abs(b).max(axis=(1, 2, 3))
    errors = errors + 4 * UNIT * largest
    middle, radius, g = np.empty((n, 3, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 1))
    for r in range(3):
        steps = _differences(b, r)
        g[:, r, 0] = degrees[r] * _at_centre(steps)
        for c in range(r, 3):
            factor = degrees[r] * (degrees[c] - (r == c))
            least, greatest = (factor * part for part in _extremes(_differences(steps, c)))
            middle[:, r, c] = middle[:, c, r] = 0.5 * (least + greatest)
            pad = 4.0 * errors * degrees[r] * degrees[c]
            radius[:, r, c] = radius[:, c, r] = (0.5 * (greatest - least) + pad) * (1 + 8 * UNIT)
    off = 2.0 * (errors + (b[0].size + 40) * UNIT * largest)[:, None, None] * degrees[:, None]
    regular: Flags = np.abs(np.linalg.det(middle)) > 1e-280
    y = np.zeros((n, 3, 3))
    y[regular] = np.linalg.inv(middle[regular])
    reach = (np.abs(np.eye(3) - y @ middle) + np.abs(y) @ (radius + 8 * UNIT * np.abs(middle))).sum(axis=2)
    step, slack = -(y @ g)[..., 0], (np.abs(y) @ (off + 8 * UNIT * np.abs(g)))[..., 0]
    reach = (0.5 * reach + slack) * (1 + 1e-12)
    outside, inside = (np.abs(step) - reach > 0.5).any(axis=1), (np.abs(step) + reach < 0.5).all(axis=1)
    return np.where(regular, inside.astype(np.int64) - outside, 0), 0.5 + step
