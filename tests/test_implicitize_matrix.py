"""The matrix of moving planes as an implicit form, and approximate implicitization."""

import numpy as np
import pytest
import sympy
from sympy import cos, sin

from implicit import NotASurfaceError, implicitize, matrix_form
from tests.rational import OTHERS, bezier, random_net, u, v


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 3), (3, 1), (2, 2), (3, 3)])
def test_matrix_form_inverts_contains_and_evaluates(m, n):
    coordinates = bezier(random_net(m, n, 4))
    form = matrix_form(coordinates, (u, v))
    parameters = np.random.default_rng(m).random((200, 2))
    points = np.stack(sympy.lambdify((u, v), coordinates)(*parameters.T), axis=1)
    assert form.degree == 2 * m * n
    assert form.planes.shape[1] == form.planes.shape[2] == 2 * m * n
    assert np.abs(form.invert(points) - parameters).max() < 1e-10
    assert form.contains(points, 1e-9).all()
    normals = np.random.default_rng(0).standard_normal(points.shape)
    assert not form.contains(points + 0.5 * normals, 1e-9).any()
    elsewhere = np.random.default_rng(1).uniform(-5, 5, (40, 3))
    matrices = np.einsum("nk,kij->nij", np.column_stack([elsewhere, np.ones(40)]), form.planes)
    assert np.allclose(form(elsewhere), np.linalg.det(matrices), rtol=1e-6)


def test_determinant_of_the_matrix_form_is_a_multiple_of_the_polynomial():
    coordinates = bezier(random_net(2, 2, 5))
    form, surface = matrix_form(coordinates, (u, v)), implicitize(coordinates, (u, v))
    points = np.random.default_rng(1).uniform(-9, 9, (50, 3))
    ratio = form(points) / surface(points)
    assert np.ptp(ratio) < 1e-9 * abs(ratio).max()


def test_matrix_form_with_base_points_and_angles():
    form = matrix_form(OTHERS["torus"][0], (u, v), ((-3, 3), (-3, 3)))
    assert form.invert((3, 0, 0)) == pytest.approx((0, 0), abs=1e-9)
    assert form.invert((0, 2, 1)) == pytest.approx((np.pi / 2, np.pi / 2), abs=1e-9)
    assert list(form.contains([(3, 0, 0), (2, 0, 0), (0, 0, 0)])) == [True, False, False]
    with pytest.raises(ValueError, match="8 x 12"):
        form((0, 0, 0))
    with pytest.raises(ValueError, match="shape"):
        form.contains((0, 0))


def test_matrix_form_separates_crossing_sheets():
    whitney = matrix_form((u * v, u, v**2), (u, v), ((-2, 2), (-2, 2)))
    both = [tuple(np.round(whitney.invert((0, 0, 1)), 6)), tuple(np.round(whitney.invert((0, 0, 2.25)), 6))]
    assert [(a, abs(b)) for a, b in both] == [(0, 1), (0, 1.5)]


def test_approximation_reports_its_distance():
    net = [[(i, j, ((i * j) % 3) / 4) for j in range(4)] for i in range(4)]
    coordinates = bezier(net)
    errors = []
    for degree in (2, 4, 6):
        surface = implicitize(coordinates, (u, v), method="approximate", degree=degree)
        assert (surface.certificate.proof, surface.degree) == ("approximate", degree)
        errors.append(surface.certificate.residual)
    assert errors[0] > 10 * errors[1] > 100 * errors[2] > 0
    a, b = np.random.default_rng(3).random((2, 500))
    points = np.stack(sympy.lambdify((u, v), coordinates)(a, b), axis=1)
    slope = np.linalg.norm(surface.gradient(points), axis=1)
    assert (abs(surface(points)) / slope).max() < 3 * errors[2]


def test_approximation_takes_transcendental_coordinates():
    spiral = (u * cos(u), u * sin(u), v)
    assert implicitize(spiral, (u, v), method="approximate", degree=6).certificate.residual < 1e-6


def test_approximation_refuses_what_is_no_surface():
    with pytest.raises(NotASurfaceError, match="line"):
        implicitize((u, 2 * u, 3 * u), (u, v), method="approximate")
    with pytest.raises(ValueError, match="degree must be"):
        implicitize((u, v, u * v), (u, v), method="approximate", degree=0)
    with pytest.raises(ValueError, match="method must be"):
        implicitize((u, v, u * v), (u, v), method="guess")
    with pytest.raises(ValueError, match="not finite"):
        implicitize((sympy.log(u - 1), v, u * v), (u, v), method="approximate")
