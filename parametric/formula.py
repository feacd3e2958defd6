"""Curves and surfaces given by formulas in t, or in u and v."""

from collections.abc import Sequence
from math import comb
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike

from parametric.curve import ParametricCurve
from parametric.parameters import Array, Interval, check_orders, to_interval
from parametric.surface import ParametricSurface

u, v, t = sympy.symbols("u v t", real=True)


class FormulaCurve(ParametricCurve):
    """The curve of three formulas in the symbol t; immutable.

    Parameters
    ----------
    coordinates : three sympy expressions in `parametric.t`, or numbers
    domain : (t0, t1)

    Examples
    --------
    >>> curve = FormulaCurve((sympy.cos(t), sympy.sin(t), t), (0, 1))
    >>> curve.derivative(0.0).tolist() == [0, 1, 1]
    True
    """

    def __init__(self, coordinates: Sequence[Any], domain: ArrayLike) -> None:
        self._coordinates = to_coordinates(coordinates, (t,))
        self._domain = to_interval(domain)
        self._functions: dict[int, Any] = {}

    @property
    def domain(self) -> Interval:
        """The interval (t0, t1)."""
        return self._domain

    def derivative(self, t: ArrayLike, order: int = 1) -> Array:
        """The derivative of that order, (..., 3), differentiated exactly."""
        check_orders(order)
        if order not in self._functions:
            self._functions[order] = compile_(_differentiate(self._coordinates, ((_T, order),)), (_T,))
        return evaluate(self._functions[order], (self.parameters(t),))

    def expressions(self) -> tuple[Any, Any, Any]:
        """The three formulas."""
        return self._coordinates


class FormulaSurface(ParametricSurface):
    """The surface of three formulas in the symbols u and v; immutable.

    Parameters
    ----------
    coordinates : three sympy expressions in `parametric.u` and `parametric.v`, or numbers
    domain : ((u0, u1), (v0, v1))

    Examples
    --------
    >>> saddle = FormulaSurface((u, v, u * v), ((-1, 1), (-1, 1)))
    >>> saddle(0.5, 0.5), saddle.twist(0.0, 0.0)
    (array([0.5 , 0.5 , 0.25]), array([0., 0., 1.]))
    """

    def __init__(self, coordinates: Sequence[Any], domain: ArrayLike) -> None:
        self._coordinates = to_coordinates(coordinates, (u, v))
        intervals = np.asarray(domain, dtype=float)
        if intervals.shape != (2, 2):
            raise ValueError(f"domain must be ((u0, u1), (v0, v1)), got {domain!r}")
        self._domain = to_interval(intervals[0], "the domain of u"), to_interval(intervals[1], "the domain of v")
        self._functions: dict[tuple[int, int], Any] = {}

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The rectangle ((u0, u1), (v0, v1))."""
        return self._domain

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by v: (..., 3), differentiated exactly."""
        check_orders(i, j)
        if (i, j) not in self._functions:
            self._functions[i, j] = compile_(_differentiate(self._coordinates, ((_U, i), (_V, j))), (_U, _V))
        return evaluate(self._functions[i, j], self.parameters(u, v))

    def expressions(self) -> tuple[Any, Any, Any]:
        """The three formulas."""
        return self._coordinates


_U, _V, _T = u, v, t


def exact(number: float) -> Any:
    """The rational number that the float is."""
    return sympy.Rational(float(number)) if not float(number).is_integer() else sympy.Integer(int(number))


def to_coordinates(coordinates: Sequence[Any], symbols: tuple[Any, ...]) -> tuple[Any, Any, Any]:
    """Three sympy expressions in the symbols and nothing else; symbols of the same name are taken for them."""
    if isinstance(coordinates, str) or len(coordinates) != 3:
        raise ValueError(f"coordinates must be three formulas, got {coordinates!r}")
    names = {symbol.name: symbol for symbol in symbols}
    result = []
    for name, coordinate in zip("xyz", coordinates):
        if isinstance(coordinate, str):
            raise ValueError(f"{name} must be a sympy expression in {', '.join(names)}, got the text {coordinate!r}")
        expression = sympy.sympify(coordinate)
        expression = expression.xreplace({s: names[s.name] for s in expression.free_symbols if s.name in names})
        foreign = expression.free_symbols - set(symbols)
        if foreign:
            found = ", ".join(sorted(map(str, foreign)))
            raise ValueError(f"{name} may only depend on {', '.join(names)}, but contains {found}")
        result.append(expression)
    return result[0], result[1], result[2]


def _differentiate(coordinates: Sequence[Any], by: Sequence[tuple[Any, int]]) -> list[Any]:
    return [e.diff(*((s, k) for s, k in by if k)) if any(k for _, k in by) else e for e in coordinates]


def compile_(coordinates: Sequence[Any], symbols: Sequence[Any]) -> Any:
    """A numpy function for the three expressions."""
    return sympy.lambdify(list(symbols), list(coordinates), modules="numpy", cse=True)


def evaluate(function: Any, parameters: Sequence[Array]) -> Array:
    """Values (..., 3) of a compiled triple."""
    shape = np.broadcast_shapes(*(p.shape for p in parameters))
    out = np.empty((*shape, 3))
    with np.errstate(all="ignore"):
        for k, values in enumerate(function(*parameters)):
            out[..., k] = values
    if not np.isfinite(out).all():
        bad = tuple(np.argwhere(~np.isfinite(out).all(axis=-1))[0])
        at = ", ".join(f"{np.broadcast_to(p, shape)[bad]:g}" for p in parameters)
        raise ValueError(f"the formula has no finite value at ({at})")
    return out


def bezier_expressions(net: Array, symbols: Sequence[Any], domains: Sequence[Interval]) -> tuple[Any, ...]:
    """Coordinates of a Bezier curve or surface of homogeneous or plain points, as exact expressions."""
    factors = [sympy.Integer(1)]
    for symbol, size, (low, high) in zip(symbols, net.shape, domains):
        s, n = (symbol - exact(low)) / (exact(high) - exact(low)), size - 1
        factors = [f * comb(n, k) * s**k * (1 - s) ** (n - k) for f in factors for k in range(size)]
    rows = net.reshape(len(factors), -1)
    sums = [sympy.expand(sum(exact(c) * f for c, f in zip(column, factors) if c)) for column in rows.T.tolist()]
    return tuple(sympy.cancel(s / sums[3]) for s in sums[:3]) if len(sums) == 4 else tuple(sums)
