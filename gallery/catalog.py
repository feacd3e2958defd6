"""The catalogue: surfaces with a name, a formula, a source, and facts that the tests check."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any, Literal

from implicit.domain import Bounds
from implicit.pictures.look import Look


@dataclass(frozen=True)
class Facts:
    """What is known of a surface from theory; None where nothing is claimed.

    All but the degree are meant within the entry's bounds. singular_points counts isolated real ones; `types` names
    them. volume is that of the closed solid. euler counts the triangles' complex, without solitary lines and points.
    """

    degree: int | None = None
    singular_points: int | None = None
    types: str = ""
    singular_curves: int | None = None
    closed: bool | None = None
    euler: int | None = None
    volume: float | None = None


@dataclass(frozen=True)
class Entry:
    """A surface of the catalogue: implicit with a formula and bounds, or parametric with a constructor.

    formula     text for `implicit.Surface`; for a parametric surface the text shown
    parameters  values of the other names in the formula, as formulas
    bounds      where an implicit surface is looked at
    build       makes a parametric surface or shell
    iso_lines   how many steps of u and of v are drawn as lines; 0 is none
    control_net whether the control points are drawn
    method      how `polygonize` is asked to make an implicit surface's mesh
    detail      how much finer than usual the mesh must be to show the surface well
    beside      whether the picture of a plain marching cubes stands beside ours
    """

    name: str
    title: str
    formula: str
    source: str
    facts: Facts
    bounds: Bounds | float | None = None
    parameters: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    build: Callable[[], Any] | None = None
    look: Look = Look()  # noqa: RUF009
    iso_lines: tuple[int, int] = (0, 0)
    control_net: bool = False
    method: str = "auto"
    detail: float = 1.0
    beside: bool = False

    @property
    def kind(self) -> Literal["implicit", "parametric"]:
        """Which of the two forms the entry has."""
        return "implicit" if self.build is None else "parametric"


def catalog() -> dict[str, Entry]:
    """All entries by name, in the order of the page."""
    from gallery.formulas import FORMULAS
    from gallery.patches import PATCHES

    return {entry.name: entry for entry in (*FORMULAS, *PATCHES)}


def find(name: str) -> Entry:
    """The entry called `name`. Raises ValueError with the nearest names."""
    entries = catalog()
    if name in entries:
        return entries[name]
    near = get_close_matches(name, entries, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else "`gallery list` names them all"
    raise ValueError(f"the gallery has no surface called {name!r}; {hint}")


def known(name: str) -> bool:
    """Whether the gallery has a surface called `name`."""
    return name in catalog()
