"""Other libraries' answers where they are right, for those that are installed; scipy's are in the other files."""

from typing import Any

import numpy as np
import pytest

from parametric import BezierCurve, BSplineSurface, coons

RNG = np.random.default_rng(0)
U, V = RNG.random((2, 25))
NET = RNG.normal(size=(6, 5, 3))
KNOTS = ([0, 0, 0, 0, 0.3, 0.6, 1, 1, 1, 1], [0, 0, 0, 0.25, 0.5, 1, 1, 1])
WEIGHTS = RNG.random((6, 5)) + 0.5


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def boundary() -> list[BezierCurve]:
    c = RNG.normal(size=(2, 2, 3))
    ends = ((c[0, 0], c[1, 0]), (c[0, 1], c[1, 1]), (c[0, 0], c[0, 1]), (c[1, 0], c[1, 1]))
    return [BezierCurve([a, *RNG.normal(size=(2, 3)), b]) for a, b in ends]


def occ_bezier(curve: BezierCurve) -> Any:
    from OCP.collections import Array1_gp_Pnt
    from OCP.Geom import Geom_BezierCurve
    from OCP.gp import gp_Pnt

    points = Array1_gp_Pnt(1, len(curve.points))
    for k, p in enumerate(curve.points.tolist(), 1):
        points.SetValue(k, gp_Pnt(*p))
    return Geom_BezierCurve(points)


@pytest.mark.parametrize(("style", "blend"), [("GeomFill_StretchStyle", "linear"), ("GeomFill_CoonsStyle", "cubic")])
def test_coons_patches_of_opencascade(style, blend):
    """Its StretchStyle is the bilinear patch and its CoonsStyle the partially bicubic one."""
    pytest.importorskip("OCP", exc_type=ImportError)
    from OCP.GeomFill import GeomFill_BezierCurves, GeomFill_FillingStyle

    bottom, top, left, right = boundary()
    filled = GeomFill_BezierCurves(*map(occ_bezier, (bottom, right, top, left)), getattr(GeomFill_FillingStyle, style))
    surface = filled.Surface()
    theirs = [(p.X(), p.Y(), p.Z()) for p in (surface.Value(a, b) for a, b in zip(U.tolist(), V.tolist()))]
    near(theirs, coons(bottom, top, left, right, blend)(U, V), 1e-13)


def test_nurbs_of_geomdl():
    pytest.importorskip("geomdl")
    from geomdl import NURBS

    peer = NURBS.Surface(normalize_kv=False)
    peer.degree_u, peer.degree_v = 3, 2
    peer.set_ctrlpts(
        np.concatenate([NET * WEIGHTS[..., None], WEIGHTS[..., None]], axis=-1).reshape(-1, 4).tolist(), 6, 5
    )
    peer.knotvector_u, peer.knotvector_v = KNOTS
    surface = BSplineSurface(NET, (3, 2), KNOTS, WEIGHTS)
    near(peer.evaluate_list(np.stack([U, V], axis=-1).tolist()), surface(U, V))
    for a, b in zip(U[:5].tolist(), V[:5].tolist()):
        theirs = peer.derivatives(a, b, 1)
        near(theirs[1][0], surface.derivative(a, b, 1, 0), 1e-11)
        near(theirs[0][1], surface.derivative(a, b, 0, 1), 1e-11)


def test_rational_surface_of_splipy():
    pytest.importorskip("splipy", exc_type=ImportError)
    from splipy import BSplineBasis, Surface

    net = np.concatenate([NET * WEIGHTS[..., None], WEIGHTS[..., None]], axis=-1).transpose(1, 0, 2).reshape(-1, 4)
    peer = Surface(BSplineBasis(4, KNOTS[0]), BSplineBasis(3, KNOTS[1]), net, rational=True)
    near(peer(U, V, tensor=False), BSplineSurface(NET, (3, 2), KNOTS, WEIGHTS)(U, V))
