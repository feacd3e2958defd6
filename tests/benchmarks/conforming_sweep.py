"""Conforming meshes of moved surfaces at several resolutions: right, refused, or wrong without a word.

Surfaces of degree 4 and less are moved ten times, the others turned three times, at three resolutions, all at default
settings. Moved means: turned, and shifted together with its bounds by a random offset of up to the size of the bounds
(a fraction with denominator 1000). Each time the lattice is shifted against both by a random part of a cell.
Refused means that something stands in `Mesh.unresolved`; a mesh can be right and refused.
"""

from collections import Counter
from collections.abc import Iterator
from unittest.mock import patch

import numpy as np

from implicit.polygonizers.conforming import grid
from tests.benchmarks.conforming import row
from tests.benchmarks.measure import markdown
from tests.singular_cases import CASES, case_of

_RESOLUTIONS = (24, 32, 40)
_VERDICTS = ("right", "right, refused", "wrong, refused", "WRONG")


def verdict(name: str, resolution: int, seed: int) -> str:
    """What became of one surface; seed 0 leaves it and the lattice where they are."""
    rng = np.random.default_rng([seed, resolution])
    shift = rng.random(3) if seed else grid._SHIFT
    offset = rng.integers(-1000, 1001, 3) / 1000 * case_of(name)[1].radius * (bool(seed) and _is_moved(name))
    with patch.object(grid, "_SHIFT", shift):
        found = row(name, resolution, seed, np.round(offset, 3))
    if found["unresolved"]:
        return "right, refused" if found["right"] else "wrong, refused"
    return "right" if found["right"] else "WRONG"


def _is_moved(name: str) -> bool:
    """Whether a case is shifted too, not only turned."""
    return (case_of(name)[0].degree or 0) <= 4


def runs(name: str) -> Iterator[tuple[int, int]]:
    """The resolutions and seeds at which a case is tried."""
    turns = 10 if _is_moved(name) else 3
    return ((resolution, seed) for resolution in _RESOLUTIONS for seed in range(turns + 1))


def table(names: tuple[str, ...] = tuple(CASES)) -> str:
    """A row of counts for each case, and their sums."""
    lines = []
    total = Counter[str]()
    for name in names:
        found = Counter(verdict(name, *run) for run in runs(name))
        total += found
        lines.append([name, case_of(name)[0].degree, *(found[v] for v in _VERDICTS)])
    lines.append(["all", "", *(total[v] for v in _VERDICTS)])
    return markdown(["case", "degree", *_VERDICTS], lines)
