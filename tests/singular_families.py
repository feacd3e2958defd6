"""Random members of families of singular surfaces whose topology theory knows."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial, prod
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from implicit import Ball, Surface, polygonize
from implicit.language.trees import x, y, z

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Member:
    """A surface, where to look, and what `tests.singular_cases.topology` should say of its mesh there."""

    surface: Surface
    bounds: Ball
    truth: dict[str, Any]


def _truth(
    euler: int, pieces: int, links: Sequence[tuple[int, int]], components: int = 1, sheets: int = 0
) -> dict[str, Any]:
    return {
        "euler": euler,
        "components": components,
        "pieces": pieces,
        "links": sorted(links),
        "sheets": {sheets} if sheets else set(),
        "crowded": 0,
    }


def _cone(circles: int) -> dict[str, Any]:
    """A cone over so many circles, or a solitary point."""
    return _truth(1 if circles else 0, circles, [(circles, 0)], components=min(circles, 1))


def _thousandths(values: Floats) -> Any:
    return np.vectorize(lambda v: sympy.Rational(round(1000 * float(v)), 1000))(values)


def _affine(expression: sympy.Expr, matrix: Floats, center: Floats) -> Surface:
    """The surface of the points p with f(matrix (p - center)) = 0; all is rounded to thousandths first."""
    a, c = sympy.Matrix(_thousandths(matrix)), sympy.Matrix(_thousandths(center))
    image = a * (sympy.Matrix([x, y, z]) - c)
    return Surface(sympy.expand(expression.subs(dict(zip((x, y, z), image, strict=True)), simultaneous=True)))


def _turn(rng: np.random.Generator) -> Floats:
    return np.asarray(np.linalg.qr(rng.normal(size=(3, 3)))[0])


def _stretched(rng: np.random.Generator, most: float) -> Floats:
    """A random matrix with singular values up to so much away from 1."""
    return np.asarray(_turn(rng) @ np.diag(rng.uniform(1 - most, 1 + most, 3)) @ _turn(rng))


def sign_regions(values: Floats, directions: Floats) -> int:
    """How many connected regions of one sign a function on the sphere has, from values at directions (n, 3)."""
    edges = ConvexHull(directions).simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    same = edges[(values[edges[:, 0]] < 0) == (values[edges[:, 1]] < 0)]
    return int(_parts(same, len(values)).max()) + 1


def _parts(edges: Ints, size: int) -> Ints:
    """Which component (n,) of a graph its nodes belong to."""
    graph = coo_array((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def directions(count: int = 20_000) -> Floats:
    """Directions (n, 3) spread evenly."""
    k = np.arange(count) + 0.5
    height, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    return np.column_stack([np.sqrt(1 - height**2) * np.cos(turn), np.sqrt(1 - height**2) * np.sin(turn), height])


def cone_over_a_curve(rng: np.random.Generator) -> Member | None:
    """The cone over a random plane curve of degree 2 to 4; None where samples disagree on the number of its ovals.

    The circles of the link cut the sphere into one region more than there are circles.
    """
    degree = int(rng.integers(2, 5))
    powers = [(i, j, degree - i - j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    shares = np.sqrt([factorial(degree) / prod(map(factorial, power)) for power in powers])
    weights = _thousandths(shares * rng.normal(size=len(powers)))
    surface = Surface(sum(w * x**i * y**j * z**k for w, (i, j, k) in zip(weights, powers, strict=True)))
    circles = {sign_regions(surface.field.values(ways), ways) - 1 for ways in (directions(9000), directions(20_000))}
    return Member(surface, Ball(1), _cone(circles.pop())) if len(circles) == 1 else None


def normal_form(kind: str, rng: np.random.Generator) -> Member:
    """A random affine image of a simple singularity: the cone over its link within every sphere round its point.

    A weighted homogeneous f is a multiple of its own derivative along E = W p. Its affine image is transversal to all
    spheres if p and the image of E enclose an acute angle everywhere, that is, if A^-1 W A is positive definite.
    """
    expression, weights, circles = NORMAL_FORMS[kind]
    while True:
        matrix, center = _stretched(rng, 0.3), rng.uniform(-0.5, 0.5, 3)
        field = np.linalg.inv(matrix) @ np.diag(weights) @ matrix
        if np.linalg.eigvalsh(field + field.T)[0] > 0.05:
            break
    center = np.round(center, 3)
    return Member(_affine(expression, matrix, center), Ball(1, center), _cone(circles))


def _normal_forms() -> dict[str, tuple[sympy.Expr, tuple[float, ...], int]]:
    """Expression, weights of x, y, z, and circles of the link for each kind.

    With g(x, y) + z^2 the circles are the sectors of the plane in which g < 0: half as many as half-branches of g = 0.
    """
    forms = {}
    for k in range(2, 7):
        weights = (1 / 2, 1 / 2, 1 / (k + 1))
        even = (k + 1) % 2 == 0
        forms[f"A{k}"] = x**2 + y**2 - z ** (k + 1), weights, 2 if even else 1
        forms[f"A{k} saddle"] = x**2 - y**2 + z ** (k + 1), weights, 2 if even else 1
        if even:
            forms[f"A{k} solitary"] = x**2 + y**2 + z ** (k + 1), weights, 0
    for k in range(4, 7):
        weights = ((k - 2) / (2 * k - 2), 1 / (k - 1), 1 / 2)
        forms[f"D{k}-"] = x**2 * y - y ** (k - 1) + z**2, weights, 3 if k % 2 == 0 else 2
        forms[f"D{k}+"] = x**2 * y + y ** (k - 1) - z**2, weights, 1 if k % 2 == 0 else 2
    forms["E6"] = x**3 + y**4 - z**2, (1 / 3, 1 / 4, 1 / 2), 1
    forms["E6 other"] = x**3 + y**4 + z**2, (1 / 3, 1 / 4, 1 / 2), 1
    forms["E7"] = x**3 + x * y**3 + z**2, (1 / 3, 2 / 9, 1 / 2), 2
    forms["E8"] = x**3 + y**5 + z**2, (1 / 3, 1 / 5, 1 / 2), 1
    return forms


NORMAL_FORMS = _normal_forms()


def between_roots(rng: np.random.Generator) -> Member | None:
    """A turned x y = g(z) with up to three roots of g, up to threefold; None where no ball up to 2 holds all of it.

    Where g is not 0 a level has two branches, at a root it has four half-axes, each of which joins a branch below and
    one above. At a simple root all four meet in a regular point. The squared distance from the center is critical on
    the surface at roots and where x = y, g' = -z or x = -y, g' = z.
    """
    count = int(rng.integers(1, 4))
    roots = np.cumsum(rng.integers(40, 71, count)) / 100
    roots = np.round(roots - roots.mean(), 2)
    powers, sign = rng.integers(1, 4, count).tolist(), int(rng.choice((-1, 1)))
    g = sign * np.poly1d(np.repeat(roots, powers), r=True)
    farthest = float(np.abs(roots).max())
    for way in (1, -1):
        levels = (g.deriv() + np.poly1d([way, 0])).r
        for level in levels[np.abs(levels.imag) < 1e-9].real:
            if way * g(level) > 0:
                farthest = max(farthest, float(np.sqrt(2 * abs(g(level)) + level**2)))
    if farthest > 1.7:
        return None
    factors = [(z - root) ** power for root, power in zip(_thousandths(roots), powers, strict=True)]
    links = [(2, 0) if power % 2 == 0 else (1, 0) for power in powers if power > 1]
    truth = _truth(2 - count, _strips(sign, powers), links)
    surface = _affine(x * y - sign * sympy.Mul(*factors), _turn(rng), np.zeros(3))
    return Member(surface, Ball(1.15 * farthest + 0.15), truth)


def _strips(sign: int, powers: list[int]) -> int:
    """The pieces of x y = g(z) cut at its singular points; the branches between roots are named by the sign of x."""
    joins = []
    signs = [sign * (-1) ** sum(powers[k:]) for k in range(len(powers) + 1)]
    for k, power in enumerate(powers):
        for half in (1, -1):
            joins.append(((k, half), (k + 1, half)))  # the half-axis of x
            joins.append(((k, half * signs[k]), (k + 1, half * signs[k + 1])))  # that of y
        if power == 1:
            joins.append(((k, 1), (k, -1)))
    nodes = [(k, half) for k in range(len(powers) + 1) for half in (1, -1)]
    return int(_parts(np.array([[nodes.index(a), nodes.index(b)] for a, b in joins]), len(nodes)).max()) + 1


def two_quadrics(rng: np.random.Generator) -> Member | None:
    """The union of two random quadrics that cross; None where smooth meshes of them disagree on what is to be seen."""
    signs, bounds = rng.choice((-1, 1), (2, 2)), Ball(1.3)
    pair = []
    for a, b in signs.tolist():
        form = x**2 + a * y**2 + b * z**2 - sympy.Rational(1, 2)
        pair.append(_affine(form, _stretched(rng, 0.3), rng.uniform(-0.3, 0.3, 3)))
    truths = [_union(pair, bounds, resolution) for resolution in (40, 60)]
    if truths[0] != truths[1] or truths[0] is None:
        return None
    return Member(Surface(pair[0].expression * pair[1].expression), bounds, truths[0])


def _union(pair: list[Surface], bounds: Ball, resolution: int) -> dict[str, Any] | None:
    """What the union of two smooth surfaces is like, from their own meshes: they cross where the other changes sign.

    Circles have Euler characteristic 0 and arcs 1, and every arc ends twice on the boundary.
    """
    meshes = [polygonize(surface, bounds, resolution=resolution, method="marching") for surface in pair]
    euler, pieces, labels = sum(mesh.euler for mesh in meshes), 0, []
    for mesh, other in zip(meshes, pair[::-1], strict=True):
        sides = np.sort(np.concatenate([mesh.faces[:, k] for k in ([0, 1], [1, 2], [2, 0])]), axis=1)
        edges, uses = np.unique(sides, axis=0, return_counts=True)
        inside = other.field.values(np.array(mesh.vertices)) < 0
        crossed = inside[edges[:, 0]] != inside[edges[:, 1]]
        pieces += _parts(edges[~crossed], len(inside)).max() + 1
        labels.append(_parts(edges, len(inside)))
        ends, cut = np.count_nonzero(crossed & (uses == 1)), edges[crossed]
    if not len(cut):
        return None
    first, second = meshes
    nearest = cKDTree(first.vertices).query(second.vertices[cut[:, 0]])[1]
    count = labels[0].max() + 1
    joined = np.column_stack([labels[0][nearest], count + labels[1][cut[:, 0]]])
    components = _parts(joined, count + labels[1].max() + 1).max() + 1
    return _truth(euler - ends // 2, int(pieces), [], components=int(components), sheets=4)


def four_nodes(rng: np.random.Generator) -> tuple[Surface, Ball]:
    """A cubic with nodes at the corners of a random tetrahedron: the sum of c / l over its planes l = 0, cleared."""
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / 2 + rng.uniform(-0.25, 0.25, (4, 3))
    planes = np.linalg.inv(np.column_stack([corners, np.ones(4)]))
    planes = [plane.dot((x, y, z, 1)) for plane in _thousandths(planes.T)]
    weights = _thousandths(rng.uniform(0.5, 1.5, 4) * rng.choice((-1, 1), 4))
    terms = [w * sympy.Mul(*(p for p in planes if p is not plane)) for w, plane in zip(weights, planes, strict=True)]
    return Surface(sympy.expand(sum(terms))), Ball(float(np.round(1.25 * np.linalg.norm(corners, axis=1).max(), 3)))


def euler_from_levels(surface: Surface, bounds: Ball, resolution: int) -> float | None:
    """(chi(f = e) + chi(f = -e)) / 2 once it stays for e, e / 2, e / 4 and on a finer lattice; None if it does not.

    With isolated singular points and a boundary that is met transversally this is the Euler characteristic of f = 0.
    """
    size = float(np.abs(surface.field.values(np.asarray(bounds.center) + bounds.radius * directions(500))).mean())
    found: list[float] = []
    for halvings in range(4, 12):
        found.append(_middle_euler(surface, bounds, resolution, size / 2**halvings))
        if found[-3:] == found[-1:] * 3:
            finer = _middle_euler(surface, bounds, resolution * 3 // 2, size / 2**halvings)
            return finer if finer == found[-1] else None
    return None


def _middle_euler(surface: Surface, bounds: Ball, resolution: int, e: float) -> float:
    levels = [Surface(surface.expression + sign * sympy.Float(e)) for sign in (1, -1)]
    return sum(polygonize(s, bounds, resolution=resolution, method="marching").euler for s in levels) / 2
