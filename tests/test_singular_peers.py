"""Other programs find the same points: sympy, and Singular where it is installed."""

import shutil
import subprocess

import numpy as np
import pytest
import sympy

from implicit import Surface, singularities
from implicit.language.trees import x, y, z
from implicit.singular.form import Form
from implicit.singular.projection import project
from implicit.singular.proof import integral
from implicit.singular.region import Deadline
from tests.singular_catalog import box_of, entry_of, surface_of


@pytest.mark.parametrize("name", ["source_cubic_node", "source_cubic_A5", "cayley_cubic", "cone", "kummer"])
def test_sympy_solves_for_the_same_points(name: str) -> None:
    f = surface_of(name).expression
    basis = sympy.groebner([f, *(f.diff(v) for v in (x, y, z))], x, y, z, order="grevlex")
    assert basis.is_zero_dimensional
    locus = singularities(surface_of(name), box_of(name))
    for point in locus.points:
        assert point.exact is not None
        at = dict(zip((x, y, z), point.exact, strict=True))
        assert all(sympy.simplify(g.as_expr().subs(at)) == 0 for g in basis.polys)
    if name != "kummer":  # a square root in a square root: minutes
        solved = sympy.solve([f, *(f.diff(v) for v in (x, y, z))], [x, y, z], dict=True)
        real = {tuple(s[v] for v in (x, y, z)) for s in solved if all(s[v].is_real for v in (x, y, z))}
        assert real == {p.exact for p in locus.points}


def _singular(f: sympy.Expr, commands: str) -> list[int]:
    """The whole numbers that Singular prints."""
    formula = str(sympy.Poly(f, x, y, z).clear_denoms()[1].as_expr()).replace("**", "^")
    script = f'LIB "primdec.lib"; ring r = 0,(x,y,z),dp; poly f = {formula}; ideal j = f, jacob(f); {commands} quit;'
    ran = subprocess.run(["Singular", "-q"], input=script, capture_output=True, text=True, timeout=120, check=True)
    return [int(word) for word in ran.stdout.split() if word.lstrip("-").isdigit()]


needs_singular = pytest.mark.skipif(shutil.which("Singular") is None, reason="the program Singular is not installed")


@needs_singular
@pytest.mark.parametrize("name", ["chmutov_cheb4", "chmutov_cheb6", "cayley_cubic", "cushion"])
def test_singular_counts_the_same_complex_points(name: str) -> None:
    """Here all complex singular points are real, and the numbers of Tjurina add up to the length of the ideal."""
    f = surface_of(name).expression
    count, length = _singular(f, "vdim(std(radical(j))); vdim(std(j));")
    locus = singularities(surface_of(name), box_of(name))
    assert count == len(locus.points)
    assert length == sum(p.milnor or 0 for p in locus.points)  # simple singularities: tau = mu


@needs_singular
@pytest.mark.parametrize("name", ["source_cubic_A5", "e6_surface", "sofa_e8", "a3_surface", "piriform"])
def test_singular_has_the_same_milnor_numbers(name: str) -> None:
    f = surface_of(name).expression
    script = "ring s = 0,(x,y,z),ds; poly f = imap(r, f); vdim(std(jacob(f)));"
    (point,) = singularities(surface_of(name), box_of(name)).points
    assert np.array_equal(point.position, [0, 0, 0])
    assert _singular(f, script) == [point.milnor]


@needs_singular
@pytest.mark.parametrize("name", ["steiner_roman", "klein_bottle", "hunt", "crixxi", "enneper", "taubin_heart"])
def test_singular_finds_curves_of_the_same_degree(name: str) -> None:
    polynomial = Surface(surface_of(name).expression).polynomial
    assert polynomial is not None
    projection = project(integral(Form.of(polynomial)), Deadline(None))
    assert projection is not None and entry_of(name)["curves"]
    dimension, degree = _singular(surface_of(name).expression, "ideal g = std(radical(j)); dim(g); mult(g);")
    assert (dimension, degree) == (1, projection.plane.total_degree())
