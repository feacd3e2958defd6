"""Conforming meshes of turned surfaces at several resolutions: right, refused, or wrong without a word.

Surfaces of degree 4 and less are turned ten times, the others three times, at three resolutions, all at default
settings. Refused means that something stands in `Mesh.unresolved`; a mesh can be right and refused.
"""

from collections import Counter

from tests.benchmarks.conforming import row
from tests.benchmarks.measure import markdown
from tests.singular_cases import CASES, case_of

_RESOLUTIONS = (24, 32, 40)


def verdict(name: str, resolution: int, seed: int) -> str:
    """What became of one surface."""
    found = row(name, resolution, seed)
    if found["unresolved"]:
        return "right, refused" if found["right"] else "wrong, refused"
    return "right" if found["right"] else "WRONG"


def table(names: tuple[str, ...] = tuple(CASES)) -> str:
    """A row of counts for each case, and their sums."""
    verdicts = ("right", "right, refused", "wrong, refused", "WRONG")
    lines = []
    total = Counter[str]()
    for name in names:
        degree = case_of(name)[0].degree or 0
        turns = 10 if degree <= 4 else 3
        found = Counter(verdict(name, r, seed) for r in _RESOLUTIONS for seed in range(turns + 1))
        total += found
        lines.append([name, degree, *(found[v] for v in verdicts)])
    lines.append(["all", "", *(total[v] for v in verdicts)])
    return markdown(["case", "degree", *verdicts], lines)
