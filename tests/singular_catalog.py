"""The catalogue of surfaces with known singularities: what is true of each, and how it is built."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import sympy

from implicit import Box, Surface
from implicit.algebra.numberfield import NumberField
from implicit.algebra.polynomial import Polynomial
from implicit.language.trees import x, y, z

ENTRIES: list[dict[str, Any]] = json.loads((Path(__file__).parent / "cases" / "singular_catalog.json").read_text())
NAMES = [entry["name"] for entry in ENTRIES]
w = sympy.Symbol("w")


def entry_of(name: str) -> dict[str, Any]:
    """What the catalogue says of a surface."""
    return ENTRIES[NAMES.index(name)]


def surface_of(name: str) -> Surface:
    """The surface, with exact coefficients."""
    entry = entry_of(name)
    expression = sympy.sympify(entry["equation"], locals={"x": x, "y": y, "z": z, "w": w})
    if "field" not in entry:
        return Surface(expression)
    minimal, near = entry["field"]["minimal"], Fraction(entry["field"]["near"])
    root = sympy.CRootOf(sympy.Poly(minimal[::-1], w), 0)
    field = NumberField(tuple(minimal), (near - Fraction(1, 10**9), near + Fraction(1, 10**9)), root)
    powers = sympy.Poly(expression, w, x, y, z)
    terms: dict[tuple[int, int, int], list[Fraction]] = {}
    for (n, i, j, k), c in powers.terms():
        terms.setdefault((i, j, k), [Fraction(0)] * (powers.degree(w) + 1))[n] = Fraction(int(c.p), int(c.q))
    return Surface.from_polynomial(Polynomial.from_terms(terms, field))


def box_of(name: str) -> Box:
    """Where its singularities are."""
    return Box(*entry_of(name)["box"])
