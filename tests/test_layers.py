"""The house stands one way up: `implicit` is the base, `parametric` builds on it, `gallery` uses both."""

import ast
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("implicit", "parametric", "gallery")
FILES = sorted(file for package in PACKAGES for file in (ROOT / package).rglob("*.py"))


def imports(file: Path) -> Iterator[str]:
    """Every module that `file` imports, at the top or inside a function, typing-only imports included."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file.name} imports relatively"
            yield node.module or ""


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_imports_go_one_way(file: Path) -> None:
    package = file.relative_to(ROOT).parts[0]
    above = PACKAGES[PACKAGES.index(package) + 1 :]
    assert not [name for name in imports(file) if name.split(".")[0] in above]


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_only_show_draws(file: Path) -> None:
    if file != ROOT / "implicit" / "show.py":
        assert not [name for name in imports(file) if name.split(".")[0] in {"pyvista", "vtk", "vtkmodules"}]


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_text_is_never_executed(file: Path) -> None:
    calls = [node.func for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]
    names = {call.id for call in calls if isinstance(call, ast.Name)}
    assert not names & {"eval", "exec", "sympify", "parse_expr"}


def test_top_level_is_as_asked() -> None:
    asked = {"pyproject.toml", "README.md", "implicit", "parametric", "tests", "gallery"}
    small = {"Makefile", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "constraints.txt", "docs", ".ci", ".gitignore"}
    if not (ROOT / ".git").exists():
        pytest.skip("the files of the project are known in a git checkout only")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found = {name.split("/")[0] for name in listed.splitlines()}
    assert asked <= found <= asked | small
