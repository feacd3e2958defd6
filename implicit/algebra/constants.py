"""Real constants of a formula as proven enclosures."""

from collections.abc import Callable

import flint
import sympy

from implicit.algebra.expand import to_fraction
from implicit.language.trees import postorder

BITS = 256

_FUNCTIONS: dict[type, Callable[["flint.arb"], "flint.arb"]] = {
    sympy.sin: flint.arb.sin,
    sympy.cos: flint.arb.cos,
    sympy.tan: flint.arb.tan,
    sympy.exp: flint.arb.exp,
    sympy.log: flint.arb.log,
    sympy.sinh: flint.arb.sinh,
    sympy.cosh: flint.arb.cosh,
    sympy.tanh: flint.arb.tanh,
    sympy.asin: flint.arb.asin,
    sympy.acos: flint.arb.acos,
    sympy.atan: flint.arb.atan,
    sympy.Abs: abs,
}


def enclose(number: sympy.Expr) -> "flint.arb":
    """A ball of about 250 bits around a real number without symbols; not finite when it is no real number."""
    balls: dict[sympy.Basic, flint.arb] = {}
    with flint.ctx.workprec(BITS):
        for node in postorder(number):
            balls[node] = _ball(node, [balls[argument] for argument in node.args])
    return balls[number]


def _ball(node: sympy.Basic, parts: list["flint.arb"]) -> "flint.arb":
    if node.is_Float:
        node = sympy.Rational(*to_fraction(node).as_integer_ratio())
    if node.is_Rational:
        return flint.arb(flint.fmpq(int(node.p), int(node.q)))
    if node is sympy.pi:
        return flint.arb.pi()
    if node is sympy.E:
        return flint.arb.const_e()
    if isinstance(node, sympy.Add):
        return sum(parts[1:], start=parts[0])
    if isinstance(node, sympy.Mul):
        product = parts[0]
        for part in parts[1:]:
            product = product * part
        return product
    if isinstance(node, sympy.Pow):
        return parts[0] ** int(node.exp) if node.exp.is_Integer else parts[0] ** parts[1]
    if isinstance(node, sympy.Min | sympy.Max):
        best = parts[0]
        for part in parts[1:]:
            best = best.min(part) if isinstance(node, sympy.Min) else best.max(part)
        return best
    if type(node) in _FUNCTIONS:
        return _FUNCTIONS[type(node)](*parts)
    return _by_sympy(node)


def _by_sympy(node: sympy.Expr) -> "flint.arb":
    """Other numbers (roots of polynomials, the golden ratio) as sympy evaluates them, to 60 of its 80 digits."""
    value = node.evalf(80)
    if not value.is_Float:
        return flint.arb("nan")
    return flint.arb(str(value)) * (1 + flint.arb(0, 1e-60))
