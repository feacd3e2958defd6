"""Frames along paths."""

import numpy as np
import pytest
import sympy

from implicit import SingularPointError
from parametric import FormulaCurve, circle, helix, line, minimal_frames, t
from parametric.sweeps.frames import FixedFrame, FrenetFrame, MinimalFrame, first_normal, to_frame

TWISTED = FormulaCurve((t, t**2, t**3 - t), (-1, 1))
KNOT = FormulaCurve(
    (sympy.cos(t) * (2 + sympy.cos(3 * t) / 2), sympy.sin(t) * (2 + sympy.cos(3 * t) / 2), sympy.sin(3 * t) / 2),
    (0, 2 * sympy.pi.evalf()),
)


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("kind", [MinimalFrame, FrenetFrame, FixedFrame])
def test_frames_are_orthonormal_and_right_handed(kind):
    s = np.linspace(-0.9, 0.9, 31)
    e1, e2, tangent = kind(TWISTED).derivatives(s, 0)[0]
    frame = np.stack(np.broadcast_arrays(e1, e2, tangent), axis=-2)
    near(frame @ frame.swapaxes(-1, -2), np.broadcast_to(np.eye(3), frame.shape))
    near(np.linalg.det(frame), 1)


@pytest.mark.parametrize("kind", [MinimalFrame, FrenetFrame])
def test_derivatives_are_limits(kind):
    s, h = np.linspace(-0.9, 0.9, 13), 1e-5
    field = kind(TWISTED)
    exact = field.derivatives(s, 3)
    for order in (1, 2, 3):
        for k in range(3):
            above, below = (field.derivatives(s + d, order - 1)[order - 1][k] for d in (h, -h))
            limit = (above - below) / (2 * h)
            near(exact[order][k], limit, 1e-6 * max(1, np.abs(limit).max()))


def test_minimal_frames_do_not_turn_about_the_tangent():
    frames = MinimalFrame(TWISTED).derivatives(np.linspace(-1, 1, 31), 1)
    near(np.einsum("nc,nc->n", frames[1][0], frames[0][1]), 0)


def test_double_reflection_is_of_fourth_order():
    """The exact frame of a helix turns against the Frenet frame by its torsion."""
    radius, rise = 1.0, 0.5
    path = helix(radius, 2 * np.pi * rise, 2)
    angle = -rise / (radius**2 + rise**2) * 4 * np.pi * np.sqrt(radius**2 + rise**2)
    normal, binormal, _ = FrenetFrame(path).derivatives(np.array([0.0, 4 * np.pi]), 0)[0]
    exact = np.cos(angle) * normal[1] + np.sin(angle) * binormal[1]
    errors = []
    for count in (50, 100, 200, 400):
        s = np.linspace(0, 4 * np.pi, count + 1)
        carried = minimal_frames(path(s), path.tangent(s), normal[0])
        errors.append(np.linalg.norm(carried[-1] - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 4) < 0.2).all()
    s = np.array([4 * np.pi])
    near(MinimalFrame(path, normal[0]).derivatives(s, 0)[0][0], exact[None], 1e-11)


def test_holonomy_of_plane_and_space_curves():
    assert abs(MinimalFrame(circle(2)).holonomy) < 1e-12
    assert abs(MinimalFrame(KNOT).holonomy) > 0.1


def test_a_path_along_z_keeps_the_axes():
    near(first_normal(np.array([0.0, 0, 1]), None), [1, 0, 0])
    near(first_normal(np.array([0.0, 0, -1]), None), [1, 0, 0])
    for tangent in np.random.default_rng(0).normal(size=(10, 3)):
        tangent /= np.linalg.norm(tangent)
        normal = first_normal(tangent, None)
        near([normal @ tangent, normal @ normal], [0, 1])


def test_frenet_frames_need_curvature():
    with pytest.raises(SingularPointError, match='no curvature: use frame="minimal"'):
        FrenetFrame(FormulaCurve((t, t**3, 0), (-1, 1))).derivatives(np.array([0.0]), 0)
    with pytest.raises(SingularPointError, match="Frenet frame is not defined at s = 0"):
        FrenetFrame(line((0, 0), (1, 1))).derivatives(np.array([0.0]), 0)


def test_wrong_arguments():
    with pytest.raises(ValueError, match="frame must be one of minimal, frenet, fixed, got 'bishop'"):
        to_frame("bishop", circle())
    with pytest.raises(ValueError, match="start must not lie along the path's tangent"):
        MinimalFrame(line((0, 0, 0), (0, 0, 1)), (0, 0, 2))
    with pytest.raises(ValueError, match="the path stands still at s = 0: it has no tangent there"):
        MinimalFrame(FormulaCurve((t**2, t**3, 0), (-1, 1)))
