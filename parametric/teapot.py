"""The Utah teapot."""

from functools import cache
from importlib.resources import files

import numpy as np

from parametric.shell import Shell
from parametric.splines.tensor import BezierSurface


@cache
def teapot() -> Shell:
    """The Utah teapot: 32 bicubic Bezier patches, z up, standing on z = 0 (rim 0-3, body 4-11, handle 12-15,
    spout 16-19, lid 20-27, bottom 28-31).

    The lid and the bottom have a pole each. The edges of rim, lid, handle and spout that end in the air or inside the
    body are naked: 16 of them, so the teapot is no solid. Martin Newell, 1975; the bottom was added later.

    Examples
    --------
    >>> pot = teapot()
    >>> pot, len(pot.boundary)
    (Shell(32 surfaces, open), 16)
    """
    lines = files("parametric").joinpath("teapot.txt").read_text(encoding="ascii").splitlines()
    rows = [line.split() for line in lines if line and not line.startswith("#")]
    count = int(rows[0][1])
    nets = np.array(rows[1 : 1 + count], dtype=int)
    points = np.array(rows[2 + count :], dtype=float)
    # As published p_u x p_v points into the pot; v reversed, it points out.
    return Shell([BezierSurface(points[net].reshape(4, 4, 3)[:, ::-1]) for net in nets])
