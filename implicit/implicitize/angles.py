"""Sines, cosines and exponentials of parameters, and the rational functions that stand for them.

A parameter that occurs only in circular functions is w = k u for one unit k, and cos w = (1 - s^2)/(1 + s^2),
sin w = 2 s/(1 + s^2) with s = tan(w/2). One that occurs only in exponentials or hyperbolic functions is s = e^w.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import gcd, lcm
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.functions.elementary.hyperbolic import HyperbolicFunction
from sympy.functions.elementary.trigonometric import TrigonometricFunction

from implicit.errors import TranscendentalError

Floats: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Wave:
    """A function ("cos", "tanh", "exp", ...) of a sum of integer multiples of the units and a constant phase.

    `phase` is the cosine and the sine of that constant; exponentials have none.
    """

    function: str
    circular: bool
    multiples: tuple[tuple[sympy.Symbol, int], ...]
    phase: tuple[sympy.Expr, sympy.Expr]


@dataclass(frozen=True)
class Angles:
    """The unit k of every parameter that occurs in circular or exponential functions, and which of the two it is."""

    units: Mapping[sympy.Symbol, sympy.Expr]
    circular: Mapping[sympy.Symbol, bool]
    linear: Mapping[sympy.Expr, tuple[Mapping[sympy.Symbol, sympy.Expr], sympy.Expr]]

    def covers(self, e: sympy.Expr) -> bool:
        """Whether an expression is one of the functions that were found."""
        return e in self.linear

    def wave(self, e: sympy.Expr) -> Wave:
        """A function that was found, in multiples of the units."""
        slopes, constant = self.linear[e]
        multiples = tuple((name, int(slope / self.units[name])) for name, slope in slopes.items())
        return Wave(_name(e), _is_circular(e), multiples, (sympy.cos(constant), sympy.sin(constant)))

    @property
    def phases(self) -> list[sympy.Expr]:
        """The constants that phases bring in."""
        return [f(c) for e, (_, c) in self.linear.items() if _is_circular(e) and c != 0 for f in (sympy.cos, sympy.sin)]

    def substitution(self, name: sympy.Symbol) -> "Substitution":
        """What the rational variable of a parameter stands for."""
        if name not in self.units:
            return Substitution("plain", 1.0)
        return Substitution("circular" if self.circular[name] else "exponential", float(self.units[name]))


@dataclass(frozen=True)
class Substitution:
    """The rational variable s of a parameter u: s = u, s = tan(k u / 2) or s = e^(k u), with the unit k."""

    kind: Literal["plain", "circular", "exponential"]
    unit: float

    def forward(self, values: Floats) -> Floats:
        """From u to s."""
        if self.kind == "plain":
            return values
        return np.tan(self.unit * values / 2) if self.kind == "circular" else np.exp(self.unit * values)

    def back(self, values: Floats) -> Floats:
        """From s to u, the angle between -pi / k and pi / k; nan where an exponential would be negative."""
        if self.kind == "plain":
            return values
        if self.kind == "circular":
            return np.asarray(2 * np.arctan(values) / self.unit)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.log(values) / self.unit)


def read_angles(expressions: Sequence[sympy.Expr], names: Sequence[sympy.Symbol]) -> Angles:
    """All circular and exponential functions of the parameters; TranscendentalError where they cannot be rational."""
    linear = {}
    for e in _waves(expressions):
        linear[e] = _linear(e, names)
    units, circular = {}, {}
    for name in names:
        used = [(e, slopes[name]) for e, (slopes, _) in linear.items() if name in slopes]
        if not used:
            continue
        kinds = {_is_circular(e) for e, _ in used}
        if len(kinds) == 2:
            listed = " and ".join(sorted({str(e) for e, _ in used})[:2])
            raise TranscendentalError(f"{name} occurs in circular and in exponential functions: {listed}")
        _refuse_mixture(expressions, name, used[0][0])
        units[name], circular[name] = _unit(name, [slope for _, slope in used]), kinds.pop()
    return Angles(MappingProxyType(units), MappingProxyType(circular), MappingProxyType(linear))


def _waves(expressions: Iterable[sympy.Expr]) -> list[sympy.Expr]:
    """The outermost circular and exponential functions that contain a symbol, in a fixed order."""
    found: dict[sympy.Expr, None] = {}
    stack = list(expressions)
    while stack:
        e = stack.pop()
        if not e.free_symbols:
            continue
        if _is_wave(e):
            found[e] = None
        else:
            stack.extend(e.args)
    return list(found)


def _is_wave(e: sympy.Expr) -> bool:
    if isinstance(e, TrigonometricFunction | HyperbolicFunction | sympy.exp):
        return True
    return bool(e.is_Pow and not e.base.free_symbols and e.exp.free_symbols)


def _is_circular(e: sympy.Expr) -> bool:
    return isinstance(e, TrigonometricFunction)


def _name(e: sympy.Expr) -> str:
    return "exp" if e.is_Pow else str(e.func.__name__)


def _linear(e: sympy.Expr, names: Sequence[sympy.Symbol]) -> tuple[dict[sympy.Symbol, sympy.Expr], sympy.Expr]:
    """The argument as a sum of multiples of the parameters and a constant."""
    argument = e.exp * sympy.log(e.base) if e.is_Pow else e.args[0]
    rest = sympy.expand(argument)
    slopes = {}
    for name in names:
        slope = rest.coeff(name, 1)
        if slope != 0:
            slopes[name], rest = slope, sympy.expand(rest - slope * name)
    if rest.free_symbols or any(slope.free_symbols for slope in slopes.values()):
        raise TranscendentalError(f"{e} is transcendental: its argument is no sum of multiples of the parameters")
    if rest != 0 and not _is_circular(e):
        raise TranscendentalError(f"{e} contains the transcendental factor exp({rest})")
    return slopes, rest


def _refuse_mixture(expressions: Iterable[sympy.Expr], name: sympy.Symbol, wave: sympy.Expr) -> None:
    stack = list(expressions)
    while stack:
        e = stack.pop()
        if e == name:
            raise TranscendentalError(
                f"{name} occurs by itself and inside {wave}: such a surface satisfies no polynomial equation"
            )
        if not _is_wave(e):
            stack.extend(e.args)


def _unit(name: sympy.Symbol, slopes: list[sympy.Expr]) -> sympy.Expr:
    """The largest k of which all slopes are integer multiples."""
    ratios = [sympy.nsimplify(sympy.simplify(slope / slopes[0]), rational=True) for slope in slopes]
    if not all(r.is_Rational and sympy.simplify(r - s / slopes[0]) == 0 for r, s in zip(ratios, slopes, strict=True)):
        listed = ", ".join(map(str, slopes))
        raise TranscendentalError(f"the multiples {listed} of {name} have no common unit")
    denominator = lcm(*(int(r.q) for r in ratios))
    numerator = gcd(*(int(r.p) * (denominator // int(r.q)) for r in ratios))
    return slopes[0] * sympy.Rational(numerator, denominator)
