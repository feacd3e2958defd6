"""Polynomials with factors that occur several times, meshed without multiplicities.

Across a factor of even multiplicity f does not change its sign, and no lattice sees it.
"""

from collections.abc import Callable
from functools import reduce
from operator import mul

import numpy as np
from numpy.typing import NDArray

from implicit.mesh import Mesh, assemble
from implicit.polygonizers.weld import fill_normals
from implicit.surface import Surface

_ON = 1e-6
"""Faces are part of a factor's surface if their corners are so near to it, as a share of their length."""
_SOMEWHERE = np.array([[0.3711, 0.2719, 0.4123]])


def has_multiple_factors(surface: Surface) -> bool:
    """Whether f is a polynomial that is divided by the square of another."""
    polynomial = surface.polynomial
    return polynomial is not None and polynomial.square_free.degree < polynomial.degree


def mesh_once(surface: Surface, mesh: Callable[[Surface], Mesh]) -> Mesh:
    """What `mesh` makes of the product of the distinct factors, with faces and normals turned to where f grows."""
    if surface.polynomial is None:
        raise TypeError("only polynomials have factors")
    factors = surface.polynomial.factors()
    single = Surface.from_polynomial(reduce(mul, (factor for factor, _ in factors)))
    even = [Surface.from_polynomial(factor) for factor, power in factors if power % 2 == 0]
    made = mesh(single)
    turned = _falls(surface, single, even, made)
    vertices, faces, normals = made.vertices.copy(), made.faces.copy(), made.normals.copy()
    faces[turned] = faces[turned][:, ::-1]
    normals[np.unique(faces[turned])] *= -1
    normals[np.intersect1d(faces[turned], faces[~turned])] = 0
    fill_normals(vertices, normals, faces)
    return assemble(vertices, faces, normals, made.curves, made.points, made.unresolved)


def _falls(surface: Surface, single: Surface, even: list[Surface], mesh: Mesh) -> NDArray[np.bool_]:
    """The faces (F,) across which f falls where the product of its distinct factors rises.

    f is that product times a constant and, but for squares, the even factors. On the surfaces of these f does neither.
    """
    corners = mesh.vertices[mesh.faces]
    lengths = np.ptp(corners, axis=1).max(axis=1, keepdims=True)
    signs = np.full(len(corners), np.sign(surface.field.values(_SOMEWHERE) * single.field.values(_SOMEWHERE))[0])
    on = np.zeros(len(corners), np.bool_)
    for factor in even:
        signs *= np.sign(factor.field.values(_SOMEWHERE)) * np.sign(factor.field.values(corners.mean(axis=1)))
        values, slopes = factor.field.gradients(corners.reshape(-1, 3))
        near = np.abs(values) <= _ON * np.repeat(lengths, 3) * np.linalg.norm(slopes, axis=1)
        on |= near.reshape(-1, 3).all(axis=1)
    return np.asarray((signs < 0) & ~on)
