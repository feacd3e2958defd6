"""Parametric curves and surfaces: Bezier, B-spline, Coons, swept, revolved; shells of many patches.

A parametric surface is a map from a rectangle of (u, v) to space. Points are float64 arrays (..., 3), degrees are
degrees and never orders, angles are in radians. The normal is p_u x p_v, and points out of a closed shell.
"""

from typing import TYPE_CHECKING

import implicit
from implicit.lazy import make_lazy

if getattr(implicit, "__dist__", None) != "implicit-parametric":
    raise ImportError(
        f"`parametric` needs the package `implicit` of the distribution implicit-parametric, but Python found "
        f"another one at {implicit.__file__}. Install implicit-parametric in a fresh environment."
    )

if TYPE_CHECKING:
    from parametric.conic import circle, ellipse, hyperbola, parabola
    from parametric.continuity import ContinuityReport, continuity
    from parametric.coons import coons, gordon, ruled
    from parametric.curve import BezierCurve, BSplineCurve, FormulaCurve, HermiteCurve, ParabolicBlend, helix, line
    from parametric.fit import graph, interpolate
    from parametric.revolve import revolve
    from parametric.shell import Shell
    from parametric.surface import FormulaSurface, t, u, v
    from parametric.sweep import extrude, sweep, transform_sweep
    from parametric.teapot import teapot
    from parametric.tensor import BezierSurface, BSplineSurface, HermitePatch
    from parametric.tessellate import tessellate

_HOMES: dict[str, str] = {}

make_lazy(__name__, _HOMES)
