"""The verb: what it refuses, what an empty surface gives, black boxes, progress, memory, interruption."""

import numpy as np
import pytest

from implicit import Ball, Box, Surface, polygonize
from implicit.domain import to_bounds
from implicit.polygonizers.lattice import Lattice
from implicit.polygonizers.samples import FieldSampler, choose_sampler
from implicit.work import Job, available_memory, check_memory

SPHERE = Surface("x^2 + y^2 + z^2 = 1")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"resolution": 0}, "resolution must be a positive whole number of cells, got 0"),
        ({"resolution": -3}, "got -3"),
        ({"resolution": 2.5}, "got 2.5"),
        ({"resolution": True}, "got True"),
        ({"method": "dancing"}, "method must be one of auto, marching, following, conforming, got 'dancing'"),
        ({"tolerance": 0.1}, "tolerance= .* is not there yet"),
        ({"certify": True}, "certify= .* is not there yet"),
        ({"workers": 0}, "workers must be a positive number of threads or -1 for all processors, got 0"),
        ({"workers": 1.5}, "got 1.5"),
    ],
)
def test_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        polygonize(SPHERE, 2, **arguments)


@pytest.mark.parametrize("bounds", [0, -1, np.inf])
def test_bounds_must_be_positive(bounds):
    with pytest.raises(ValueError, match="bounds as a number must be positive and finite"):
        polygonize(SPHERE, bounds)


def test_other_bounds_are_refused():
    with pytest.raises(TypeError, match="bounds must be a Box, a Ball or a number, got str"):
        polygonize(SPHERE, "here")


@pytest.mark.parametrize("bounds", [2, Ball(2), Box((5, 5, 5), (6, 6, 6))])
@pytest.mark.parametrize("formula", ["x^2 + y^2 + z^2 = -1", "exp(x) + 1", "-1 - x^2"])
def test_no_surface_gives_an_empty_mesh(formula, bounds):
    mesh = polygonize(Surface(formula), bounds, resolution=20)
    assert mesh.report().empty and mesh.faces.shape == (0, 3)
    assert "empty" in str(mesh.report())


def test_a_surface_larger_than_its_bounds_is_open():
    report = polygonize(SPHERE, 0.8, resolution=20).report()
    assert not report.closed and report.manifold and "boundary edges" in str(report)


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("1/x", r"no finite value at \(0, .*\): f = (inf|-inf|nan)"),
        ("log(x) + 1", r"no finite value at \(-?[\d.]+, .*\): f = (-inf|nan)"),
        ("sqrt(z) - 0.5", r"no finite value at \(.*, -[\d.]+\): f = nan"),
    ],
)
def test_values_that_are_not_finite_are_named(formula, message):
    with pytest.raises(ValueError, match=message):
        polygonize(Surface(formula), 1, resolution=14)


def count_calls(function):
    counted = {"points": 0}

    def wrapped(points):
        counted["points"] += len(points)
        return function(points)

    return wrapped, counted


def ball(points):
    return np.linalg.norm(points - (0.2, 0.1, -0.3), axis=1) - 0.3


def test_a_black_box_is_sampled_everywhere_unless_a_lipschitz_constant_is_given():
    everywhere, all_points = count_calls(ball)
    somewhere, few_points = count_calls(ball)
    full = polygonize(Surface.from_function(everywhere), 1, resolution=60)
    less = polygonize(Surface.from_function(somewhere, lipschitz=1.0), 1, resolution=60)
    assert all_points["points"] > 61**3 > few_points["points"]
    assert np.array_equal(full.vertices, less.vertices) and np.array_equal(full.faces, less.faces)
    assert full.report().euler == 2 and full.volume == pytest.approx(4 / 3 * np.pi * 0.3**3, rel=0.02)
    assert np.abs(ball(full.vertices)).max() < 1e-12


def test_the_same_mesh_from_a_formula_and_from_a_black_box():
    formula = Surface("(x^2 + y^2 + z^2 + 1 - 0.16)^2 = 4 (x^2 + y^2)")
    black = Surface.from_function(lambda p: formula.field.values(p), gradient=lambda p: formula.field.gradients(p)[1])
    one, other = (polygonize(surface, 1.61, resolution=31) for surface in (formula, black))
    assert np.array_equal(one.faces, other.faces)
    assert np.abs(one.vertices - other.vertices).max() < 1e-11


def test_the_search_for_bricks_goes_on_where_room_was_short():
    """The descent is interrupted several times here, and misses no brick with a change of sign, nor finds one twice."""
    surface = Surface("min(sin(9*x)*cos(9*y) + sin(9*y)*cos(9*z) + sin(9*z)*cos(9*x), x^2 + y^2 + z^2 - 0.9)")
    lattice = Lattice.over(to_bounds(1), 80)
    bricks = choose_sampler(surface, lattice).bricks
    samples = FieldSampler(surface.field, lattice, lattice.all_bricks())
    values = np.empty((len(samples.bricks), 512))
    samples.fill(0, len(values), values)
    crossed = samples.bricks[(values < 0).any(axis=1) & (values >= 0).any(axis=1)]
    first_room = 64 + 6 * lattice.bricks[0] ** 2
    assert len(bricks) > first_room
    found = {tuple(brick) for brick in bricks.tolist()}
    assert len(found) == len(bricks) and found >= {tuple(brick) for brick in crossed.tolist()}


def test_progress_rises_to_one():
    shares = []
    polygonize(SPHERE, 1.3, resolution=100, progress=shares.append)
    assert shares == sorted(shares) and shares[0] > 0 and shares[-1] == 1


@pytest.mark.parametrize("workers", [1, 3])
def test_interruption_stops_all_threads(workers):
    def interrupt(share):
        if share > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        polygonize(Surface("sin(9 x) + sin(9 y) + sin(9 z)"), 1, resolution=150, progress=interrupt, workers=workers)


def test_the_first_error_is_raised_and_the_others_stop():
    job = Job(100, workers=4)

    def work(number):
        if number == 3:
            raise ZeroDivisionError("three")
        for _ in range(10_000):
            job.advance(0)
        return number

    with pytest.raises(ZeroDivisionError, match="three"):
        job.map(work, range(10))


def test_memory_is_refused_with_the_numbers():
    if available_memory() is None:
        pytest.skip("this system does not say how much memory is free")
    check_memory(1000, "a small thing", "do nothing")
    with pytest.raises(MemoryError, match=r"a big thing needs about 1e\+06 TB, but only [\d.]+ .B .*; wait"):
        check_memory(1e18, "a big thing", "wait")


def test_a_mesh_that_cannot_fit_is_refused_before_it_is_begun():
    if available_memory() is None:
        pytest.skip("this system does not say how much memory is free")
    with pytest.raises(MemoryError, match="lower the resolution"):
        polygonize(Surface.from_function(ball), 1, resolution=20_000)
