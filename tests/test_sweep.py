"""Sweeps: the section is carried rigidly, closes on closed paths, is mitred at corners, and encloses what it should."""

from itertools import pairwise

import numpy as np
import pytest
import sympy

from parametric import FormulaCurve, circle, extrude, helix, line, polyline, sweep, t, transform_sweep
from parametric.analysis import area
from parametric.sweeps.caps import cap

UP = line((0, 0, 0), (0, 0, 1))
SQUARE = [(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)]
S = np.linspace(0, 1, 21)
ANGLES = 2 * np.pi * S
WAVE = FormulaCurve((t, t**3, 0), (-1, 1))
PATHS = {"wave": WAVE, "helix": helix(2, 3, 2), "line": line((0, 0, 0), (1, 2, 3))}


def near(found, expected, tolerance=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", PATHS)
def test_a_tube_keeps_its_radius(name):
    """splipy's sweep along an S-curve with an inflection has radii from .0417 to .0544 instead of .05."""
    path = PATHS[name]
    tube = sweep(circle(0.05), path)
    s = np.linspace(*path.domain, 40)
    offsets = tube.grid(ANGLES, s) - path(s)
    near(np.linalg.norm(offsets, axis=-1), 0.05)
    near(np.einsum("asc,sc->as", offsets, path.tangent(s)), 0)


@pytest.mark.parametrize("frame", ["minimal", "frenet", "fixed"])
def test_derivatives_are_limits(frame):
    tube = sweep(circle(0.3), helix(2, 3), frame=frame, twist=lambda s: s**2, scale=lambda s: 1 + s)
    rng = np.random.default_rng(0)
    a, b, h = 0.1 + 6 * rng.random(15), 0.1 + 6 * rng.random(15), 1e-5
    for i, j in ((1, 0), (0, 1), (1, 1), (0, 2)):
        step, lower = ((0, h), (i, j - 1)) if j else ((h, 0), (i - 1, j))
        limit = tube.derivative(a + step[0], b + step[1], *lower) - tube.derivative(a - step[0], b - step[1], *lower)
        near(tube.derivative(a, b, i, j), limit / (2 * h), 1e-6)


def test_a_counter_clockwise_section_has_its_normals_outside():
    tube = sweep(circle(0.3), helix(2, 3))
    s = np.linspace(0, 6, 7)
    outward = tube(1.0, s) - helix(2, 3)(s)
    near(tube.normal(1.0, s), outward / 0.3, 1e-9)


def test_sections_along_z_stay_where_they_are_drawn():
    prism = sweep(SQUARE, line((0, 0, 0), (0, 0, 5)))
    near(prism.grid(S, [0.0, 1.0])[:, 0, :2], polyline(SQUARE)(S)[:, :2])
    near(prism(S, 1.0)[:, 2], 5)


def test_a_straight_sweep_is_an_extrusion():
    near(sweep(SQUARE, line((0, 0, 0), (0, 0, 5))).grid(S, S), extrude(SQUARE, (0, 0, 5)).grid(S, S))


def test_twist_and_scale_are_reached_at_the_end():
    """A square swept along the x-axis and turned through 90 degrees, and a circle that shrinks to a cone's tip."""
    turned = sweep(SQUARE, line((0, 0, 0), (4, 0, 0)), twist=np.pi / 2)
    offsets = turned.grid(S, [0.0, 0.5, 1.0]) - [[0, 0, 0], [2, 0, 0], [4, 0, 0]]
    near(offsets[:, 2], np.cross([1, 0, 0], offsets[:, 0]))
    near(offsets[:, 1], (offsets[:, 0] + offsets[:, 2]) / np.sqrt(2))
    cone = sweep(circle(2), line((0, 0, 0), (0, 0, 4)), scale=0)
    near(np.linalg.norm(cone.grid(ANGLES, S)[..., :2], axis=-1), np.broadcast_to(2 * (1 - S), (21, 21)))
    assert area(cone) == pytest.approx(np.pi * 2 * np.hypot(2, 4), rel=1e-9)


def test_any_point_of_the_section_may_lie_on_the_path():
    path = helix(3, 1)
    s = np.linspace(*path.domain, 9)
    moved = sweep(SQUARE, path, anchor=(1, 1))
    near(moved(0.0, s), path(s))
    assert np.abs(sweep(SQUARE, path)(0.0, s) - path(s)).max() > 1


def test_start_turns_the_first_frame():
    tube = sweep([(1, 0), (0, 1)], line((0, 0, 0), (0, 0, 1)), start=(0, 2, 5))
    near(tube(0.0, 0.0), [0, 1, 0])


def test_closed_paths_close_smoothly():
    knot = FormulaCurve(
        (sympy.cos(t) * (2 + sympy.cos(3 * t) / 2), sympy.sin(t) * (2 + sympy.cos(3 * t) / 2), sympy.sin(3 * t) / 2),
        (0, 2 * np.pi),
    )
    tube = sweep(SQUARE, knot)
    for order in range(3):
        near(tube.derivative(S, 0.0, 0, order), tube.derivative(S, 2 * np.pi, 0, order), 1e-9)


def test_mitred_corners_keep_the_section():
    """CadQuery issue 39: the sweep grows thin at the corners of a polyline."""
    path = np.array([(0, 0, 0), (0, 0, 5), (5, 0, 5), (5, 4, 7)], dtype=float)
    tube = sweep(SQUARE, path)
    steps = np.diff(path, axis=0)
    for k, step in enumerate(steps):
        direction = step / np.linalg.norm(step)
        ends = tube.grid([0.0, 0.25, 0.5, 0.75], [k / 3, (k + 1) / 3])
        sides = ends[:, 1] - ends[:, 0]
        near(np.cross(sides, direction), 0)  # the edges run along the segment
        profile = ends[:, 0] - np.outer(ends[:, 0] @ direction, direction)
        lengths = np.linalg.norm(np.diff(profile, axis=0), axis=-1)
        near(lengths, 2)  # and its cross section is the square


def test_mitred_closed_polylines_close():
    tube = sweep(
        [(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1), (0.1, 0.1)],
        [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0), (0, 0, 0)],
    )
    near(tube(S, 0.0), tube(S, 1.0))


def test_a_fixed_frame_translates():
    path = [(0, 0, 0), (0, 0, 2), (1, 0, 4)]
    tube = sweep(SQUARE, path, frame="fixed")
    near(tube(S, 1.0) - tube(S, 0.0), np.broadcast_to([1, 0, 4], (21, 3)))


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (lambda: sweep(SQUARE, line((0, 0, 0), (0, 0, 3)), caps=True), 12),
        (lambda: sweep(circle(1), line((0, 0, 0), (0, 0, 3)), caps=True), 3 * np.pi),
        (lambda: sweep(circle(1), line((0, 0, 0), (0, 0, 3)), caps=True, scale=0), np.pi),
        (lambda: sweep(SQUARE, line((0, 0, 0), (3, 0, 0)), caps=True, twist=np.pi / 2), 12),
        (lambda: sweep(circle(0.25), helix(1, 2), caps=True), np.pi / 16 * helix(1, 2).length()),
        (lambda: sweep(SQUARE, [(0, 0, 0), (0, 0, 5), (5, 0, 5)], caps=True), 40),
    ],
)
def test_capped_sweeps_enclose_their_volume(solid, volume):
    """Volume by the divergence theorem: the integral of p . (p_u x p_v) / 3 over all faces."""
    shell = solid()
    assert shell.closed
    total = 0.0
    nodes, weights = np.polynomial.legendre.leggauss(24)
    for surface in shell.surfaces:
        rules = []
        for ends in surface.breaks:
            ends = np.unique(np.concatenate([np.linspace(a, b, 5) for a, b in pairwise(ends)]))
            half = np.diff(ends)[:, None] / 2
            rules.append((((ends[1:] + ends[:-1])[:, None] / 2 + half * nodes).ravel(), (half * weights).ravel()))
        (a, wa), (b, wb) = rules
        points, normals = surface.grid(a, b), surface.true_normal(a[:, None], b[None, :])
        total += wa @ np.einsum("abc,abc->ab", points, normals) @ wb / 3
    assert total == pytest.approx(volume, rel=1e-9)


def test_caps_lie_inside_star_shaped_sections_only():
    ell = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3), (0, 0)]
    assert area(cap(polyline(ell))) == pytest.approx(5, rel=1e-12)
    near(cap(polyline(ell), reverse=True).normal(0.3, 0.5), [0, 0, 1])
    near(cap(polyline(ell)).normal([0.3, 0.7], [0.0, 0.5]), [[0, 0, -1]] * 2)
    spiral = [(0, 0), (4, 0), (4, 4), (1, 4), (1, 2), (2, 2), (2, 3), (3, 3), (3, 1), (0, 1), (0, 0)]
    with pytest.raises(ValueError, match="only a section that one point inside sees as a whole can be capped"):
        cap(polyline(spiral))


def test_matrices_may_be_symbolic_or_scale_as_a_whole():
    s = sympy.Symbol("s")
    cos, sin = sympy.cos(s), sympy.sin(s)
    exact = transform_sweep(
        line((1, 0, 0), (2, 0, 0)), sympy.Matrix([[cos, sin, 0, 0], [-sin, cos, 0, 0], [0, 0, 1, 0], [0, 0, s, 1]])
    )
    numeric = transform_sweep(
        line((1, 0, 0), (2, 0, 0)),
        lambda x: [[np.cos(x), np.sin(x), 0, 0], [-np.sin(x), np.cos(x), 0, 0], [0, 0, 1, 0], [0, 0, x, 1]],
    )
    for order in ((0, 0), (1, 0), (0, 1), (1, 2)):
        near(exact.derivative(S, S, *order), numeric.derivative(S, S, *order), 1e-8)
    shrinking = transform_sweep(line((1, 0, 0), (2, 0, 0)), lambda x: np.diag([1, 1, 1, 1 + x]))
    near(shrinking(0.0, S)[:, 0], 1 / (1 + S))
    near(shrinking.derivative(0.0, S, 0, 1)[:, 0], -1 / (1 + S) ** 2, 1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: extrude(SQUARE, (0, 0, 0)), "vector of an extrusion must not be zero"),
        (lambda: sweep(SQUARE, circle(), frame="bishop"), "frame must be one of minimal, frenet, fixed, got 'bishop'"),
        (
            lambda: sweep(SQUARE, [(0, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0)]),
            r"path has the same point twice, numbers 1 and 2: \[1.0, 0.0, 0.0\]",
        ),
        (lambda: sweep(SQUARE, [(0, 0, 0), (1, 0, 0), (0, 0, 0), (0, 1, 0)]), "turns back on itself at vertex 1"),
        (lambda: sweep(SQUARE, [(0, 0, 0), (1, 0, 0), (1, 1, 0)], frame="frenet"), "a polyline has no Frenet frame"),
        (lambda: sweep(SQUARE, [(0, 0, 0), (1, 0, 0), (1, 1, 0)], frame="x"), "frame must be one of"),
        (lambda: sweep(SQUARE, polyline([(0, 0, 0), (0, 0, 1), (0, 1, 1)]).elevate()), "path has a corner at s = 0.5"),
        (lambda: sweep(SQUARE, circle(), caps=True), "a closed path has no ends to cap"),
        (lambda: sweep([(0, 0), (1, 0)], line((0, 0, 0), (0, 0, 1)), caps=True), "only a closed section can be capped"),
        (
            lambda: sweep(
                [(0, 0, 0), (1, 0, 0), (1, 1, 1), (0, 1, 0), (0, 0, 0)], line((0, 0, 0), (0, 0, 1)), caps=True
            ),
            "only a plane section can be capped, but this one leaves its plane by",
        ),
        (lambda: sweep(SQUARE, line((0, 0, 0), (0, 0, 1)), twist=np.inf), "twist must be finite"),
        (lambda: sweep(3, line((0, 0, 0), (0, 0, 1))), "section must be a curve, a callable or the vertices"),
        (lambda: transform_sweep(SQUARE, lambda s: np.eye(3)), r"finite matrices \(4, 4\)"),
        (lambda: transform_sweep(SQUARE, lambda s: np.ones((4, 4))), "last column of a sweep matrix must be 0 0 0 w"),
        (lambda: transform_sweep(SQUARE, sympy.eye(3)), r"a sweep needs a matrix \(4, 4\) in one symbol"),
        (lambda: sweep(SQUARE, line((0, 0, 0), (0, 0, 1)))(0.0, 1.5), r"parameter v must lie in \[0, 1\], got 1.5"),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()
