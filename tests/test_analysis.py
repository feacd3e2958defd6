"""Normals and their limits, fundamental forms, curvatures, lengths, angles and areas."""

from math import pi, sqrt

import numpy as np
import pytest
import sympy

from implicit import SingularPointError, Surface
from parametric import (
    BezierCurve,
    BezierSurface,
    FormulaCurve,
    FormulaSurface,
    FunctionCurve,
    FunctionSurface,
    ParametricCurve,
    ParametricSurface,
    Shell,
    area,
    circle,
    fundamental_forms,
    iso_curves,
    line,
    parabola,
    revolve,
    rotation,
    ruled,
    sweep,
    t,
    teapot,
    tessellate,
    transform_sweep,
    u,
    v,
)
from parametric.analysis import angle, arc_length, curve_on, is_singular
from tests.solids import box_patches

SPHERE = FormulaSurface(
    (2 * sympy.sin(u) * sympy.cos(v), 2 * sympy.sin(u) * sympy.sin(v), 2 * sympy.cos(u)), ((0, pi), (0, 2 * pi))
)
SADDLE = FormulaSurface((u, v, u * v), ((-1, 1), (-1, 1)))
CATENOID = FormulaSurface((sympy.cosh(u) * sympy.cos(v), sympy.cosh(u) * sympy.sin(v), u), ((-1, 1), (0, 2 * pi)))


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_sphere_curvature():
    a, b = np.linspace(0.2, 2.8, 9), np.linspace(0, 6, 9)
    found = SPHERE.curvature(a, b)
    near(found.gaussian, 0.25)
    near(found.mean, 0.5)  # the normal points outside, the surface bends away from it
    near(found.principal, 0.5)


def test_torus_curvature():
    torus = revolve(circle(1, (0, 3)))
    a, b = np.random.default_rng(0).random((2, 20)) * 2 * pi
    found = torus.curvature(a, b)
    inward = -1.0 if torus.normal(pi / 2, 0.0)[1] < 0 else 1.0
    expected = inward * np.stack([np.ones(20), np.sin(a) / (3 + np.sin(a))], axis=-1)
    near(found.principal, -np.sort(-expected, axis=-1))
    near(found.gaussian, expected.prod(axis=-1))
    circles = torus.derivative(a, b, 1, 0)
    across = np.abs(np.einsum("nc,nc->n", found.directions[:, 0 if inward > 0 else 1], circles))
    near(across, 1)


def test_minimal_surface_has_no_mean_curvature():
    a, b = np.linspace(-1, 1, 9), np.linspace(0, 6, 9)
    near(CATENOID.curvature(a, b).mean, 0)
    near(CATENOID.curvature(a, b).gaussian, -1 / np.cosh(a) ** 4)


def test_curvature_agrees_with_the_implicit_surface():
    parametric, implicit = SADDLE, Surface("z - x y")
    a, b = np.random.default_rng(0).uniform(-0.9, 0.9, (2, 15))
    one, other = parametric.curvature(a, b), implicit.curvature(parametric(a, b))
    near(implicit.normal(parametric(a, b)), parametric.normal(a, b))
    near(one.principal, other.principal, 1e-11)
    near(one.gaussian, other.gaussian, 1e-11)
    near(one.mean, other.mean, 1e-11)
    near(np.abs(np.einsum("npc,npc->np", one.directions, other.directions)), 1, 1e-9)


def test_curvature_does_not_depend_on_the_parametrization():
    skew = FormulaSurface((u + v**3 / 3, u - 2 * v, (u + v**3 / 3) * (u - 2 * v)), ((-0.3, 0.3), (-0.3, 0.3)))
    a, b = np.random.default_rng(0).uniform(-0.3, 0.3, (2, 15))
    x, y, _ = skew(a, b).T
    one, other = skew.curvature(a, b), SADDLE.curvature(x, y)
    near(one.gaussian, other.gaussian)
    near(np.abs(one.mean), np.abs(other.mean))


def test_fundamental_forms_give_the_gaussian_curvature():
    a, b = np.random.default_rng(0).uniform(-1, 1, (2, 15))
    f = fundamental_forms(SADDLE, a, b)
    near((f.L * f.N - f.M**2) / (f.E * f.G - f.F**2), SADDLE.curvature(a, b).gaussian)
    near(f.E, 1 + b**2)
    near(f.F, a * b)
    near(np.sqrt(f.E * f.G - f.F**2), np.linalg.norm(SADDLE.true_normal(a, b), axis=-1))


def test_areas():
    assert area(SPHERE) == pytest.approx(16 * pi, rel=1e-10)
    assert area(revolve(circle(1, (0, 3)))) == pytest.approx(12 * pi**2, rel=1e-10)
    assert area(CATENOID) == pytest.approx(pi * (2 + np.sinh(2)), rel=1e-10)


def test_the_area_of_a_shell_is_that_of_its_surfaces():
    assert area(Shell(box_patches((1, 2, 3)))) == pytest.approx(2 * (2 + 3 + 6), rel=1e-12)
    mesh = tessellate(teapot(), tolerance=1e-3)
    corners = mesh.vertices[mesh.faces]
    facets = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area(teapot(), tolerance=1e-4) == pytest.approx(facets, rel=1e-2)


@pytest.mark.parametrize(
    "ask",
    [
        lambda thing: fundamental_forms(thing, 0, 0),
        lambda thing: is_singular(thing, 0, 0),
        lambda thing: curve_on(thing, line((0, 0), (1, 1))),
        lambda thing: iso_curves(thing, u=[0.5], tolerance=0.1),
    ],
)
def test_only_parametric_surfaces_are_measured(ask):
    for thing in (Surface("x"), teapot(), 3):
        with pytest.raises(TypeError, match=f"a parametric surface was wanted, got {type(thing).__name__}"):
            ask(thing)


def test_a_curve_on_a_surface_has_a_path():
    with pytest.raises(TypeError, match=r"a curve \(u, v\) in the domain was wanted, got tuple"):
        curve_on(SADDLE, (0, 0))


def test_the_area_of_something_else_is_an_error():
    with pytest.raises(TypeError, match="a parametric surface or Shell was wanted, got Surface"):
        area(Surface("x"))


def test_lengths_and_angles_on_the_surface():
    quarter = curve_on(SPHERE, line((pi / 2, 0), (pi / 2, pi)))
    assert quarter.length() == pytest.approx(2 * pi, rel=1e-12)
    loxodrome = curve_on(SPHERE, line((pi / 4, 0), (pi / 2, 1)))
    a, h = np.linspace(0.1, 0.9, 5), 1e-6
    near(loxodrome.derivative(a), (loxodrome(a + h) - loxodrome(a - h)) / (2 * h), 1e-8)
    near(loxodrome.derivative(a, 2), (loxodrome.derivative(a + h) - loxodrome.derivative(a - h)) / (2 * h), 1e-7)
    near(angle(SPHERE, [0.5, 1.0], [1.0, 2.0]), pi / 2)
    skew = BezierSurface([[(0, 0, 0), (1, 1, 0)], [(1, 0, 0), (2, 1, 0)]])
    near(angle(skew, 0.3, 0.7), pi / 4)
    with pytest.raises(ValueError, match="derivatives up to the second here, not the 3th"):
        loxodrome.derivative(0.5, 3)


def test_the_length_of_a_curve_without_length_is_an_error():
    wild = FunctionCurve(lambda s: (s, s * np.sin(1 / s) if s else 0.0, 0))
    with pytest.raises(ValueError, match="does not settle"):
        arc_length(wild)


def test_teapot_poles():
    """geomdl and splipy give a horizontal normal at the apex of the lid, gmsh zero, OpenCASCADE an exception."""
    poles = []
    for patch in teapot().surfaces:
        for row, value in ((0, 0.0), (-1, 1.0)):
            for axis, name in ((0, "u"), (1, "v")):
                if np.ptp(np.take(patch.points, row, axis=axis), axis=0).max() == 0:
                    where = np.linspace(0, 1, 7)
                    at = (value, where) if name == "u" else (where, value)
                    poles.append(patch.normal(*at))
    assert len(poles) == 8  # four patches at the lid's apex, four at the middle of the bottom
    for normals in poles:
        near(np.abs(normals @ [0, 0, 1]), 1)
        near(normals, np.broadcast_to(normals[0], normals.shape))


def test_limits_of_normals():
    near(SPHERE.normal([0.0, pi], 1.0), [[0, 0, 1], [0, 0, -1]])
    near(revolve(parabola(1)).normal(0.0, 0.5), [1, 0, 0])
    flat = BezierSurface([[(0, 0, 0)] * 3, [(1, 0, 0), (1, 1, 0), (0, 1, 0)]])
    near(flat.normal([0.0, 0.5], [0.3, 0.3]), [[0, 0, 1]] * 2)
    cubic = FormulaSurface((u**3, v, u**3 * v), ((0, 1), (0, 1)))  # p_u vanishes along an edge, to second order
    near(cubic.normal(0.0, 0.5), np.array([-0.5, 0, 1]) / sqrt(1.25))


def test_no_limit_no_normal():
    cone = FormulaSurface((u * sympy.cos(v), u * sympy.sin(v), u), ((0, 1), (0, 2 * pi)))
    with pytest.raises(SingularPointError, match=r"no normal at \(u, v\) = \(0, 2\)"):
        cone.normal([0.5, 0.0], 2.0)
    assert np.isnan(cone.normal([0.5, 0.0], 2.0, undefined="nan")).any(axis=-1).tolist() == [False, True]
    needle = FormulaSurface((u, 0 * v, 0 * v), ((0, 1), (0, 1)))
    with pytest.raises(SingularPointError):
        needle.normal(0.5, 0.5)
    whitney = FormulaSurface((u, u * v, v**2), ((-1, 1), (-1, 1)))
    with pytest.raises(SingularPointError):
        whitney.normal(0.0, 0.0)
    with pytest.raises(SingularPointError, match="curvature was asked for where p_u x p_v vanishes"):
        cone.curvature(0.0, 0.0)


def test_singular_parametrization_is_found():
    assert is_singular(SPHERE, [0.0, 1.0, pi], 1.0).tolist() == [True, False, True]


def test_one_method_makes_a_surface():
    """Everything follows from `domain` and `derivative`."""

    class Saddle(ParametricSurface):
        domain = ((-1.0, 1.0), (-1.0, 1.0))

        def derivative(self, u, v, i, j):
            a, b = np.broadcast_arrays(*self.parameters(u, v))
            x, y = (a, 1.0, 0.0)[min(i, 2)], (b, 1.0, 0.0)[min(j, 2)]
            parts = (x * (j == 0), y * (i == 0), x * y)
            return np.stack(np.broadcast_arrays(*parts, a)[:3], axis=-1)

    mine, a, b = Saddle(), np.linspace(-1, 1, 7), np.linspace(-1, 1, 5)
    near(mine.grid(a, b), SADDLE.grid(a, b))
    near(mine.normal(a[:, None], b), SADDLE.normal(a[:, None], b))
    near(mine.curvature(a[:5], b).principal, SADDLE.curvature(a[:5], b).principal)
    near(mine.iso_u(0.5).derivative(b), SADDLE.iso_u(0.5).derivative(b))
    assert mine.iso_v(0.5).length() == pytest.approx(np.sqrt(5), rel=1e-12)
    assert area(mine) == pytest.approx(area(SADDLE), rel=1e-9)
    assert repr(mine) == "<Saddle on [-1, 1] x [-1, 1]>"


def test_frame_gives_all_at_once():
    frame = SPHERE.frame(1.0, [0.0, 1.0])
    near(frame.point, SPHERE(1.0, [0.0, 1.0]))
    near(frame.normal, SPHERE.normal(1.0, [0.0, 1.0]))
    near(frame.along_u, SPHERE.derivative(1.0, [0.0, 1.0], 1, 0))
    near(frame.along_v, SPHERE.derivative(1.0, [0.0, 1.0], 0, 1))


ARC, SEGMENT = circle(1, (0, 2)), line((0, 0, 0), (1, 0, 0))
NET = np.stack(np.meshgrid([0.0, 1], [0.0, 1], [0.0], indexing="ij"), axis=-1)[:, :, 0]
SURFACES = [
    BezierSurface(NET),
    BezierSurface(NET, [[1, 2], [1, 1]]),
    SADDLE,
    SADDLE.transform(np.eye(4)),
    FunctionSurface(lambda u, v: (u, v, u * v)),
    revolve(line((1, 0, 0), (2, 0, 1))),
    sweep(circle(0.1), ARC),
    transform_sweep(SEGMENT, lambda s: rotation((0, 0, 1), s).T),
    ruled(SEGMENT, ARC),
]
CURVES = [
    SEGMENT,
    BezierCurve([(0, 0), (1, 1)], [1, 2]),
    ARC,
    FormulaCurve((t, t**2, 0), (0, 1)),
    FormulaCurve((t, t**2, 0), (0, 1)).reversed(),
    FormulaCurve((t, t**2, 0), (0, 1)).transform(np.eye(4)),
    FunctionCurve(lambda s: (s, s**2, 0)),
    SADDLE.iso_u(0.5),
    SADDLE.iso_v(0.5),
    curve_on(SADDLE, line((0, 0), (1, 1))),
]


def definers(base, method):
    """The classes of `parametric` that give `method` themselves."""
    found = {base} if base.__module__.startswith("parametric.") and method in base.__dict__ else set()
    return found.union(*(definers(kind, method) for kind in base.__subclasses__()))


@pytest.mark.parametrize("order", [-1, -2, 0.5, 1.0, "1", None])
def test_orders_of_derivatives_are_whole_numbers_from_zero(order):
    for base, things in ((ParametricSurface, SURFACES), (ParametricCurve, CURVES)):
        tried = {kind for thing in things for kind in type(thing).__mro__}
        assert definers(base, "derivative") | definers(base, "jet") <= tried
    for surface in SURFACES:
        (u0, _), (v0, _) = surface.domain
        for ask in (
            lambda s=surface, a=u0, b=v0: s.derivative(a, b, order, 0),
            lambda s=surface, a=u0, b=v0: s.derivative(a, b, 1, order),
            lambda s=surface, a=u0, b=v0: s.jet(a, b, order),
        ):
            with pytest.raises(ValueError, match=f"order of a derivative must be a whole number from 0, got {order!r}"):
                ask()
    for curve in CURVES:
        with pytest.raises(ValueError, match=f"order of a derivative must be a whole number from 0, got {order!r}"):
            curve.derivative(curve.domain[0], order)


def test_orders_of_numpy_are_whole_numbers_too():
    assert np.array_equal(SADDLE.derivative(0.5, 0.5, np.int64(1), 0), SADDLE.derivative(0.5, 0.5, 1, 0))


def test_formulas_are_checked():
    for coordinates, message in (
        ((u, v), "coordinates must be three formulas"),
        ((u, v, sympy.Symbol("w")), "z may only depend on u, v, but contains w"),
        (("u", v, u), "x must be a sympy expression in u, v, got the text 'u'"),
    ):
        with pytest.raises(ValueError, match=message):
            FormulaSurface(coordinates, ((0, 1), (0, 1)))
    with pytest.raises(ValueError, match=r"domain must be \(\(u0, u1\), \(v0, v1\)\)"):
        FormulaSurface((u, v, u), (0, 1))
    with pytest.raises(ValueError, match=r"formula has no finite value at \(0, 0.5\)"):
        FormulaSurface((1 / u, v, u), ((0, 1), (0, 1)))(0.0, 0.5)


def test_symbols_of_the_same_name_are_taken():
    a, b = sympy.symbols("u v")
    near(FormulaSurface((a, b, a * b), ((0, 1), (0, 1)))(0.5, 0.5), [0.5, 0.5, 0.25])
