"""`import implicit` is quick: heavy libraries come with the first use of a name."""

import subprocess
import sys

import pytest

HEAVY = ("sympy", "numba", "scipy", "vtkmodules", "pyvista", "skimage", "matplotlib", "joblib", "flint", "dask")


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("package", ["implicit", "parametric"])
def test_importing_loads_nothing_heavy(package):
    loaded = run(f"import sys, {package}; print([m for m in {HEAVY!r} if m in sys.modules])")
    assert loaded.strip() == "[]"


def test_a_formula_and_its_values_load_no_pictures():
    code = "import sys; from implicit import Surface; Surface('x^2 + y^2 = max(z, 1)')((1, 2, 3))\n"
    loaded = run(
        code + "print([m for m in ('vtkmodules', 'pyvista', 'skimage', 'matplotlib', 'joblib') if m in sys.modules])"
    )
    assert loaded.strip() == "[]"


def test_a_polynomial_compiles_no_tapes():
    code = (
        "import sys; from implicit import Surface; s = Surface('x^2 + y^2 = z'); s((1, 2, 3)); s.gradient((1, 2, 3))\n"
    )
    code += "from implicit.kernels import values; print(values.evaluate.signatures)"
    assert run(code).strip() == "[]"


def test_public_names_stay_the_verbs():
    code = (
        "import implicit, implicit.polygonize, implicit.classify, implicit.surface\n"
        "print(callable(implicit.polygonize), callable(implicit.classify), implicit.Surface.__name__)\n"
        "from implicit import polygonize, x; import implicit.polygonize; print(callable(implicit.polygonize), x)"
    )
    assert run(code).split() == ["True", "True", "Surface", "True", "x"]


@pytest.mark.parametrize("package", ["implicit", "parametric"])
def test_a_star_imports_every_public_name(package):
    code = f"from {package} import *; import {package}; names = {package}.__all__\n"
    code += f"print(len(names) > 20, all(globals()[name] is getattr({package}, name) for name in names))"
    assert run(code).split() == ["True", "True"]


def test_unknown_names_are_refused():
    import implicit

    with pytest.raises(AttributeError, match="no public name 'polygonise'"):
        implicit.polygonise  # noqa: B018
