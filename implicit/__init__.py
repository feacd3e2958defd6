"""Implicit surfaces f(x, y, z) = 0: exact answers, meshes and pictures.

f is negative inside, normals point along +grad f, and triangles run counter-clockwise seen from outside, so a
closed mesh has positive volume. Points are float64 arrays (..., 3), faces (F, 3), boxes (..., 2, 3).
"""

from typing import TYPE_CHECKING

from implicit.lazy import make_lazy

__version__ = "0.1.0"
__dist__ = "implicit-parametric"

if TYPE_CHECKING:
    from implicit.classify import certified_floor, classify, winding_number
    from implicit.domain import Ball, Box
    from implicit.errors import (
        FormulaError,
        NotASurfaceError,
        NotPolynomialError,
        OpenSurfaceError,
        SignAmbiguousError,
        SingularPointError,
        TimeLimitError,
        TranscendentalError,
        UndecidedError,
    )
    from implicit.implicitize import implicitize
    from implicit.implicitize.certificate import Certificate
    from implicit.implicitize.matrix import MatrixForm, matrix_form
    from implicit.mesh import Mesh
    from implicit.parametrize import parametrize
    from implicit.polygonize import polygonize, polygonize_from
    from implicit.rays import cast_rays
    from implicit.report import MeshReport
    from implicit.show import render, show
    from implicit.singular import SingularCurve, SingularLocus, SingularPoint, singularities
    from implicit.solids.combine import blend, offset
    from implicit.solids.shapes import box, capsule, cone, cylinder, plane, sphere, torus
    from implicit.surface import Curvature, Surface, x, y, z

_HOMES = {
    "certified_floor": "classify",
    "classify": "classify",
    "winding_number": "classify",
    "blend": "solids.combine",
    "offset": "solids.combine",
    "Ball": "domain",
    "Box": "domain",
    "FormulaError": "errors",
    "NotASurfaceError": "errors",
    "NotPolynomialError": "errors",
    "OpenSurfaceError": "errors",
    "SignAmbiguousError": "errors",
    "SingularPointError": "errors",
    "TimeLimitError": "errors",
    "TranscendentalError": "errors",
    "UndecidedError": "errors",
    "implicitize": "implicitize",
    "Certificate": "implicitize.certificate",
    "MatrixForm": "implicitize.matrix",
    "matrix_form": "implicitize.matrix",
    "Mesh": "mesh",
    "MeshReport": "report",
    "parametrize": "parametrize",
    "polygonize": "polygonize",
    "polygonize_from": "polygonize",
    "cast_rays": "rays",
    "box": "solids.shapes",
    "capsule": "solids.shapes",
    "cone": "solids.shapes",
    "cylinder": "solids.shapes",
    "plane": "solids.shapes",
    "sphere": "solids.shapes",
    "torus": "solids.shapes",
    "render": "show",
    "show": "show",
    "SingularCurve": "singular",
    "SingularLocus": "singular",
    "SingularPoint": "singular",
    "singularities": "singular",
    "Curvature": "surface",
    "Surface": "surface",
    "x": "surface",
    "y": "surface",
    "z": "surface",
}

make_lazy(__name__, _HOMES)
