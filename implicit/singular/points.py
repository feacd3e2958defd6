"""Isolated singular points in a region: simple zeros of the gradient on the surface, and the boxes that stay open."""

from dataclasses import dataclass, field

import numpy as np
import sympy
from numpy.typing import NDArray

from implicit.singular.exact import recognise
from implicit.singular.form import Form
from implicit.singular.proof import CriticalPoint, Jet, is_zero, polish, value_at, zero_gap
from implicit.singular.region import WHOLE, Deadline, Region
from implicit.singular.symmetry import Symmetry, fundamental_cuts, orbits, symmetries

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]

_FRUITLESS = 3  # failures to find exact coordinates before all are taken to be of high degree
_MANY = 2000  # boxes: more are left only near curves
_DEPTHS = (27, 36, 45, 54, 63)  # levels of subdivision, three for each halving of all variables


@dataclass(frozen=True)
class Node:
    """A singular point where the Hessian is invertible; `exact` are its coordinates where they are of low degree."""

    point: CriticalPoint
    exact: Triple | None


@dataclass
class Sieve:
    """Decides whether f is zero at simple critical points."""

    jet: Jet
    gap: int | None = None
    fruitless: int = 0

    def singular(self, point: CriticalPoint) -> Node | None:
        """The point as a node, if f = 0 there; both answers are proved."""
        if not value_at(self.jet, point, 192).contains(0):
            return None
        if self.fruitless < _FRUITLESS:
            exact = recognise(self.jet, point)
            self.fruitless = 0 if exact else self.fruitless + 1
            if exact:
                return Node(point, exact.symbols)
        if self.gap is None:
            self.gap = zero_gap(self.jet.form)
        return Node(point, None) if is_zero(self.jet, point, self.gap) else None


@dataclass
class Search:
    """What a search has proved: these nodes, and no singular points elsewhere but in the boxes `left`."""

    region: Region
    nodes: list[Node] = field(default_factory=list)
    left: Ints = field(default_factory=lambda: np.zeros((0, 4), np.int64))
    group: list[Symmetry] = field(default_factory=list)

    def open_boxes(self) -> Floats:
        """The boxes (K, 2, 3) that are left and meet the box that was asked for, with their images."""
        corners = self.region.corners(self.left)
        boxes = np.unique(np.concatenate([g.move(corners) for g in self.group]), axis=0)
        asked = self.region.asked
        return boxes[np.all((boxes[:, 1] >= asked[0]) & (boxes[:, 0] <= asked[1]), axis=1)]


def search_nodes(form: Form, asked: Floats, deadline: Deadline) -> Search:
    """All nodes of an integral form in the box (2, 3), and the boxes where other singular points may be."""
    group = symmetries(form, asked)
    size = float((asked[1] - asked[0]).max())
    region = Region(form, asked, fundamental_cuts(group, size))
    result = Search(region, group=group)
    sieve, polished, left = Sieve(Jet(form)), [], WHOLE
    for depth in _DEPTHS:
        boxes, estimates, left, rest = region.search(left, depth, deadline)
        result.left = np.concatenate([result.left, rest])
        for box, estimate in zip(boxes, estimates, strict=True):
            point = None if deadline.passed else polish(sieve.jet, estimate, region.width(box))
            if point and region.holds(box, point.position):  # Newton's steps may lead to that of another box
                polished.append(point)
            else:
                result.left = np.concatenate([result.left, box[None]])
        if len(left) > _MANY:
            break
    result.left = np.concatenate([result.left, left])
    for orbit in orbits(polished, group):
        try:
            node = None if deadline.passed else sieve.singular(orbit[0][0])
        except ArithmeticError:  # more precision was needed than is spent on a point
            node, result.left = None, WHOLE
        if deadline.passed:
            result.left = WHOLE
            break
        if node:
            exact = node.exact
            result.nodes.extend(Node(p, exact and g.apply(exact)) for p, g in orbit)
    return result
