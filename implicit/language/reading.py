"""What a user gives as formula or parameter, checked and brought into the symbols x, y, z."""

import difflib
import numbers
from collections.abc import Mapping
from functools import reduce
from itertools import chain

import numpy as np
import sympy

from implicit.algebra.expand import to_fraction
from implicit.language.trees import difference, postorder, substitute
from implicit.language.vocabulary import CONSTANTS, FUNCTIONS, VARIABLES

_KNOWN = (sympy.Add, sympy.Mul, sympy.Pow, *(kind for kind in FUNCTIONS.values() if isinstance(kind, type)))
_KINDS = (*_KNOWN, sympy.Number, sympy.NumberSymbol, sympy.Symbol, sympy.polys.rootoftools.ComplexRootOf)


def to_parameters(parameters: Mapping[str, object]) -> dict[str, sympy.Expr]:
    """Real numbers as exact sympy numbers."""
    for name in parameters:
        if name in VARIABLES or name in CONSTANTS or name in FUNCTIONS:
            raise ValueError(f"a parameter cannot be called {name}, the formula has its own {name}")
    return {name: _number(value, name) for name, value in parameters.items()}


def _number(value: object, name: str) -> sympy.Expr:
    if isinstance(value, sympy.Expr) and not value.free_symbols and value.is_real:
        return (
            value
            if value.is_Number is False or value.is_Rational
            else sympy.Rational(*to_fraction(value).as_integer_ratio())
        )
    if isinstance(value, numbers.Rational):
        return sympy.Rational(int(value.numerator), int(value.denominator))
    if isinstance(value, numbers.Real | np.floating) and np.isfinite(float(value)):
        return sympy.Rational(*to_fraction(float(value)).as_integer_ratio())
    raise ValueError(f"parameter {name} must be a finite real number, got {value!r}")


def to_expression(given: object, parameters: Mapping[str, sympy.Expr], *, needs_variables: bool = False) -> sympy.Expr:
    """A sympy expression or equation in the real symbols x, y, z, with values put in for the parameters."""
    if isinstance(given, sympy.Poly):
        given = given.as_expr()
    sides = given.args if isinstance(given, sympy.Equality) else (given,)
    if not all(isinstance(side, sympy.Expr) for side in sides):
        raise ValueError(f"a formula as text, a sympy expression or an Eq was wanted, got {given!r}")
    names = {**VARIABLES, **parameters}
    used, values = set(), {}
    for node in chain.from_iterable(map(postorder, sides)):
        if isinstance(node, sympy.Symbol):
            if node.name not in names:
                raise ValueError(_unknown(node.name, list(names)))
            used.add(node.name)
            values[node] = names[node.name]
        elif node.is_Float and node.is_finite:
            values[node] = sympy.Rational(*to_fraction(node).as_integer_ratio())
        elif not isinstance(node, _KINDS) or node in (sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
            raise ValueError(f"real numbers and functions with a rule were wanted, but {str(node)[:80]} occurs")
    unused = set(parameters) - used
    if unused:
        raise ValueError(f"the formula has no {', '.join(sorted(unused))}")
    if needs_variables and not used & set(VARIABLES):
        raise ValueError(f"a formula in x, y, z was wanted, but {str(given)[:80]} is a constant")
    return reduce(difference, (substitute(side, values) for side in sides))


def _unknown(name: str, known: list[str]) -> str:
    close = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.6)
    hint = f"did you mean {close[0]}?" if close else f"a value can be given as a parameter: {name}=1"
    return f"unknown name {name}; {hint}"
