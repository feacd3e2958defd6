"""The command line: what it prints, what it writes, and what it says to bad input."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import sympy

from gallery.__main__ import main
from gallery.cards import make_surface
from gallery.catalog import catalog, find
from gallery.commands import with_parameters
from implicit import Surface


def run(*words: str) -> int:
    return main(list(words))


def test_list_names_every_surface(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(catalog())


def test_list_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("list", "--json") == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == list(catalog())
    assert {"title", "kind", "formula", "source", "facts"} <= rows[0].keys()


def test_mesh_of_a_formula(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "ball.stl"
    assert run("mesh", "x^2 + y^2 + z^2 = r^2", "-p", "r=3/2", "-o", str(path), "--resolution", "16") == 0
    assert "closed" in capsys.readouterr().out
    assert (path.stat().st_size - 84) % 50 == 0


@pytest.mark.parametrize(
    "formula", ["-x^2-y^2-z^2=-1", "-(x^2 + y^2 + z^2) = -1", "-2x^2 = 2y^2 + 2z^2 - 2", "-pi x^2 = pi(y^2 + z^2 - 1)"]
)
def test_a_formula_may_begin_with_a_minus(formula: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(tmp_path / "a.stl")
    rest = ("--resolution", "8", "-o", path)
    for words in ((formula, *rest), (*rest, "--separate", formula), (*rest, "--", formula)):
        assert run("mesh", *words) == 0
        assert "Euler characteristic 2" in capsys.readouterr().out
    assert run("mesh", "-x^2 + * y", "-o", path) == 2
    assert "\n  -x^2 + * y\n         ^" in capsys.readouterr().err


def test_what_begins_like_an_option_stays_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (("-px=2", "-o", "a.stl"), ("sphere", "-o", "-xyz.stl"), ("sphere", "--outxyz")):
        with pytest.raises(SystemExit) as stop:
            run("mesh", *words)
        assert stop.value.code == 2
    assert "usage" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_parameters_of_a_named_surface(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("-o", str(tmp_path / "a.stl"), "--resolution", "8")
    assert run("mesh", "cayley_cubic", "-p", "a=2", *words) == 2
    assert "cayley_cubic has no parameter a; it has none" in capsys.readouterr().err
    assert run("mesh", "teapot", "-p", "a=2", *words) == 2
    assert "teapot has no parameter a" in capsys.readouterr().err
    assert run("mesh", "barth_sextic", "-p", "a=2", *words) == 2
    assert "barth_sextic has no parameter a; its parameters are p" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_named_surface_takes_other_values_of_its_parameters() -> None:
    entry = find("barth_sextic")
    surface = make_surface(with_parameters(entry, ["p = sqrt(2)"]))
    assert surface == Surface(entry.formula, p=sympy.sqrt(2)) != make_surface(entry)


def test_mesh_of_a_parametric_surface_by_name(tmp_path: Path) -> None:
    assert run("mesh", "coons_patch", "-o", str(tmp_path / "a.obj")) == 0
    assert (tmp_path / "a.obj").read_text().count("\nf ") > 100


def test_a_surface_larger_than_its_bounds_is_said_to_be(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run("mesh", "x^2 + y^2 + z^2 = 9", "-o", str(tmp_path / "a.ply"), "--resolution", "16", "--bounds", "2.5") == 0
    )
    assert "has a rim there; --bounds R looks further" in capsys.readouterr().err


@pytest.mark.parametrize("bounds", ["ball:1.5", "box:-1.5,-1.5,-1.5,1.5,1.5,1.5", "1.5"])
def test_bounds_are_a_number_a_ball_or_a_box(bounds: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("mesh", "x^2 + y^2 + z^2 = 1", "-o", str(tmp_path / "a.ply"), "--resolution", "12", f"--bounds={bounds}")
    assert run(*words) == 0
    assert "closed, manifold" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("x^2 + * y = 1",), "x^2 + * y = 1\n        ^"),
        (("x^2 + sinn(y) = 1",), "sin"),
        (("spheer",), "did you mean sphere"),
        (("x^2 + y^2 + z^2 + 1 = 0",), "no surface found within"),
        (("x^2 + y^2 + z^2 = 1", "-p", "a"), "name=value"),
        (("x^2 + y^2 + z^2 = a",), "a"),
    ],
)
def test_bad_input_is_explained_without_a_traceback(
    words: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("mesh", *words, "-o", str(tmp_path / "a.stl"), "--resolution", "8") == 2
    error = capsys.readouterr().err
    assert error.startswith("gallery: ")
    assert message in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_sheets_are_separated_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("mesh", "x^2 + y^2 = z^2", "-o", str(tmp_path / "a.stl"), "--resolution", "12", "--bounds", "1")
    assert run(*words) == 0 and "not manifold" in capsys.readouterr().out
    assert run(*words, "--separate") == 0 and "not manifold" not in capsys.readouterr().out


def test_an_unknown_suffix_is_refused_before_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("mesh", "barth_sextic", "-o", str(tmp_path / "a.step")) == 2
    assert ".stl" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("render", "--size", "640"), "wanted a whole number"),
        (("render", "--size", "99999x10"), "at most 8000"),
        (("render", "--jobs", "0"), "wanted a whole number from 1"),
        (("mesh", "sphere", "-o", "a.stl", "--bounds", "cube:3"), "wanted R, ball:R or box"),
        (("mesh", "sphere", "-o", "a.stl", "--bounds", "-1"), "positive"),
        (("mesh", "sphere", "-o", "a.stl", "--bounds", "ball:x"), "could not convert"),
    ],
)
def test_options_out_of_range_are_refused(
    words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        run(*words)
    assert stop.value.code == 2
    assert message in capsys.readouterr().err


def test_an_unknown_name_to_render_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("render", "barth_sextik") == 2
    assert "did you mean barth_sextic" in capsys.readouterr().err


def test_show_draws_into_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.png"
    words = ("show", "x^2 + y^2 + z^2 = 1", "--out", str(path), "--size", "80x60", "--resolution", "12")
    assert run(*words) == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert run("show", "sphere", "--out", str(tmp_path / "a.gif")) == 2
    assert "saved as .png" in capsys.readouterr().err


def test_show_without_a_display_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if sys.platform != "linux":
        pytest.skip("other systems always have a display")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert run("show", "x^2 + y^2 + z^2 = 1", "--resolution", "8") == 4
    assert "needs a display" in capsys.readouterr().err


def test_doctor_finds_this_machine_well_or_says_why(capsys: pytest.CaptureFixture[str]) -> None:
    status = run("doctor")
    out = capsys.readouterr().out
    assert status == (4 if "! " in out else 0)
    assert all(word in out for word in ("python", "numba", "vtk", "processors", "implicit", "pictures"))


def test_doctor_notices_another_package_of_that_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import implicit
    from gallery.doctor import examine

    monkeypatch.setitem(vars(implicit), "__file__", str(tmp_path / "implicit" / "__init__.py"))
    advice = {finding.what: finding.advice for finding in examine()}
    assert "fresh environment" in advice["implicit"]
    assert not advice["parametric"]


def test_the_command_line_starts_quickly() -> None:
    """Help and list load neither sympy, numba nor VTK."""
    program = (
        "import sys; from gallery.__main__ import main; main(['list']); "
        "print(sorted({'sympy', 'numba', 'vtkmodules', 'pyvista', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True).stdout
    assert out.splitlines()[-1] == "[]"


def test_the_gallery_refuses_another_implicit(tmp_path: Path) -> None:
    """PyPI's `implicit` is a recommender library; taken for ours it must be named, not crash somewhere inside."""
    (tmp_path / "implicit.py").write_text("")
    root = Path(__file__).parents[1]
    program = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(root)!r}]; import gallery"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert "found another one at" in done.stderr.replace("\n", " ")
    assert "fresh environment" in done.stderr
