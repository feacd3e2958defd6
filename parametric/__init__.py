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
    from parametric.analysis import area, curve_on, fundamental_forms, is_singular
    from parametric.conic import Conic, circle, ellipse, helix, hyperbola, parabola
    from parametric.continuity import ContinuityReport, continuity, make_c0, make_c1, make_g1
    from parametric.curve import FunctionCurve, ParametricCurve
    from parametric.edges import Edge
    from parametric.fit import approximate, fit_scattered, interpolate, interpolate_curve
    from parametric.formula import FormulaCurve, FormulaSurface, t, u, v
    from parametric.function import FunctionSurface
    from parametric.graph import graph, polynomial_coefficients
    from parametric.grids import grid_mesh, iso_curves
    from parametric.place import rotation, scaling, translation
    from parametric.shell import EdgeReport, Shell
    from parametric.splines.bspline import BezierCurve, BSplineCurve, line, polyline
    from parametric.splines.cubic import HermiteCurve, ParabolicBlend
    from parametric.splines.hermite import HermitePatch
    from parametric.splines.knots import KnotVector
    from parametric.splines.tensor import BezierSurface, BSplineSurface
    from parametric.surface import ParametricSurface
    from parametric.sweeps.caps import cap
    from parametric.sweeps.frames import minimal_frames
    from parametric.sweeps.revolve import revolve
    from parametric.sweeps.sweep import extrude, sweep, transform_sweep
    from parametric.teapot import teapot
    from parametric.tessellate import SurfaceMesh, tessellate
    from parametric.textbook.algorithms import basis_function, bernstein, de_boor, de_casteljau
    from parametric.transfinite.coons import coons, coons_triangle, gordon, loft, plane, ruled

_HOMES = {
    "basis_function": "textbook.algorithms",
    "bernstein": "textbook.algorithms",
    "de_boor": "textbook.algorithms",
    "de_casteljau": "textbook.algorithms",
    "area": "analysis",
    "curve_on": "analysis",
    "fundamental_forms": "analysis",
    "is_singular": "analysis",
    "BezierCurve": "splines.bspline",
    "BSplineCurve": "splines.bspline",
    "line": "splines.bspline",
    "polyline": "splines.bspline",
    "cap": "sweeps.caps",
    "circle": "conic",
    "Conic": "conic",
    "ellipse": "conic",
    "helix": "conic",
    "hyperbola": "conic",
    "parabola": "conic",
    "continuity": "continuity",
    "ContinuityReport": "continuity",
    "make_c0": "continuity",
    "make_c1": "continuity",
    "make_g1": "continuity",
    "coons": "transfinite.coons",
    "coons_triangle": "transfinite.coons",
    "gordon": "transfinite.coons",
    "loft": "transfinite.coons",
    "plane": "transfinite.coons",
    "ruled": "transfinite.coons",
    "HermiteCurve": "splines.cubic",
    "ParabolicBlend": "splines.cubic",
    "FunctionCurve": "curve",
    "ParametricCurve": "curve",
    "Edge": "edges",
    "approximate": "fit",
    "fit_scattered": "fit",
    "interpolate": "fit",
    "interpolate_curve": "fit",
    "FormulaCurve": "formula",
    "FormulaSurface": "formula",
    "t": "formula",
    "u": "formula",
    "v": "formula",
    "minimal_frames": "sweeps.frames",
    "FunctionSurface": "function",
    "graph": "graph",
    "polynomial_coefficients": "graph",
    "grid_mesh": "grids",
    "iso_curves": "grids",
    "HermitePatch": "splines.hermite",
    "KnotVector": "splines.knots",
    "rotation": "place",
    "scaling": "place",
    "translation": "place",
    "revolve": "sweeps.revolve",
    "EdgeReport": "shell",
    "Shell": "shell",
    "ParametricSurface": "surface",
    "extrude": "sweeps.sweep",
    "sweep": "sweeps.sweep",
    "transform_sweep": "sweeps.sweep",
    "teapot": "teapot",
    "BezierSurface": "splines.tensor",
    "BSplineSurface": "splines.tensor",
    "SurfaceMesh": "tessellate",
    "tessellate": "tessellate",
}

make_lazy(__name__, _HOMES)
