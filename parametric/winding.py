"""Inside, on or outside of closed shells."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.classify import classify, winding_number
from implicit.errors import OpenSurfaceError
from implicit.mesh import Mesh
from parametric.parameters import Array

if TYPE_CHECKING:
    from parametric.shell import Shell

_CHORD = 1e-3


class Solid:
    """Answers for a shell by the winding number of its tessellation.

    The mesh keeps within a thousandth of the size of the shell, and answers closer to the surface than that are those
    of the mesh.
    """

    def __init__(self, shell: Shell) -> None:
        self.shell = shell

    @cached_property
    def mesh(self) -> Mesh:
        """The tessellation that answers."""
        from parametric.tessellate import tessellate

        size = float(np.ptp(self.shell.corners, axis=0).max()) or 1.0
        return tessellate(self.shell, tolerance=_CHORD * size)

    def classify(self, points: ArrayLike, tolerance: float | None, rule: str) -> NDArray[np.int8]:
        """-1 inside, 0 on, 1 outside."""
        if not self.shell.closed:
            edges = self.shell.boundary
            raise OpenSurfaceError(f"inside needs a closed shell, got one with {len(edges)} naked edges: {edges}")
        return classify(self.mesh, points, tolerance=tolerance, rule=rule)  # type: ignore[arg-type]

    def winding_numbers(self, points: ArrayLike) -> Array:
        """Winding numbers of the mesh."""
        return winding_number(self.mesh, points)
