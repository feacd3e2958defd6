"""What this machine has, and what it lacks, for drawing and meshing."""

import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

PACKAGES = (
    "numpy",
    "scipy",
    "sympy",
    "python-flint",
    "numba",
    "scikit-image",
    "pyvista",
    "vtk",
    "matplotlib",
    "joblib",
)


@dataclass(frozen=True)
class Finding:
    """One line of the doctor's report; `advice` is empty where all is well."""

    what: str
    value: str
    advice: str = ""


def examine() -> Iterator[Finding]:
    """The findings, in the order they are made."""
    yield Finding("python", f"{platform.python_version()} on {platform.system()} {platform.machine()}")
    yield from _versions()
    yield _home("implicit")
    yield _home("parametric")
    yield Finding("processors", str(_processors()))
    yield _memory()
    yield _renderer()


def _versions() -> Iterator[Finding]:
    for name in PACKAGES:
        try:
            yield Finding(name, metadata.version(name))
        except metadata.PackageNotFoundError:
            yield Finding(name, "missing", f"install it: {Path(sys.executable).name} -m pip install {name}")


def _home(package: str) -> Finding:
    """Whether the import name leads to this distribution; other packages on PyPI bear it too."""
    import gallery

    module = __import__(package)
    here = Path(str(module.__file__)).resolve().parent
    ours = Path(str(gallery.__file__)).resolve().parents[1] / package
    advice = "" if here == ours else f"another package called {package} is in the way; use a fresh environment"
    return Finding(package, str(here), advice)


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _memory() -> Finding:
    if not hasattr(os, "sysconf") or "SC_PHYS_PAGES" not in os.sysconf_names:
        return Finding("memory", "unknown on this system")
    size = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    return Finding("memory", f"{size:.1f} GiB", "" if size >= 2 else "large meshes want 2 GiB or more")


def _renderer() -> Finding:
    from implicit.show import find_renderer

    if find_renderer() == "vtk":
        return Finding("pictures", "drawn by VTK")
    advice = "VTK finds no working OpenGL library; on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri"
    return Finding("pictures", "drawn by matplotlib", advice)
