"""A sympy expression multiplied out: exact rational coefficients, irrational constants as further variables."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import comb, prod

import flint
import sympy

from implicit.errors import NotPolynomialError
from implicit.language.trees import postorder, x, y, z

MOST_TERMS = 200_000


@dataclass(frozen=True)
class Expansion:
    """A polynomial `flint` in x, y, z, c0, c1, ... where the c are the irrational numbers `constants`."""

    flint: "flint.fmpq_mpoly"
    constants: tuple[sympy.Expr, ...]


def ring(extra: int = 0) -> "flint.fmpq_mpoly_ctx":
    """The ring Q[x, y, z] with further variables c0, c1, ... or, when there is just one, w."""
    names = ("w",) if extra == 1 else tuple(f"c{index}" for index in range(extra))
    return flint.fmpq_mpoly_ctx.get(("x", "y", "z", *names), "lex")


def to_fraction(number: sympy.Number | float) -> Fraction:
    """An exact value; floats stand for the shortest decimal that reads the same, so that 0.1 is 1/10."""
    if isinstance(number, sympy.Float):
        return Fraction(repr(float(number))) if number._prec <= 53 else Fraction(str(number))
    if isinstance(number, sympy.Rational):
        return Fraction(int(number.p), int(number.q))
    return Fraction(repr(float(number)))


def expand(expression: sympy.Expr) -> Expansion:
    """The expression multiplied out.

    Raises
    ------
    NotPolynomialError
        Naming the part that is no polynomial in x, y, z, or when there are more than MOST_TERMS terms.
    """
    order = postorder(expression)
    numeric: set[sympy.Basic] = set()
    for node in order:
        if node.is_Number or isinstance(node, sympy.NumberSymbol) or (node.args and numeric.issuperset(node.args)):
            numeric.add(node)
    wanted, constants = _wanted(order, numeric)
    context = ring(len(constants))
    generators = context.gens()
    done: dict[sympy.Basic, flint.fmpq_mpoly] = dict(zip((x, y, z), generators, strict=False))
    done.update(zip(constants, generators[3:], strict=True))
    for node in order:
        if node in wanted and node not in done:
            done[node] = _node(node, done, context)
    return Expansion(done[expression], tuple(constants))


def _root_of(node: sympy.Basic) -> tuple[sympy.Expr, int, sympy.Rational] | None:
    """A rational power r^(p/q) as (r^(1/q), p mod q, r^(p div q)); None for anything else."""
    if isinstance(node, sympy.Pow) and node.base.is_Rational and node.exp.is_Rational and node.exp.q > 1:
        whole, part = divmod(int(node.exp.p), int(node.exp.q))
        return sympy.Pow(node.base, sympy.Rational(1, node.exp.q)), part, node.base**whole
    return None


def _wanted(order: Sequence[sympy.Basic], numeric: set[sympy.Basic]) -> tuple[set[sympy.Basic], list[sympy.Expr]]:
    """The nodes to multiply out, and the irrational numbers that they are written with; not the parts of those."""
    wanted, constants = {order[-1]}, dict[sympy.Expr, None]()
    for node in reversed(order):
        if node not in wanted or node.is_Number:
            continue
        root = _root_of(node)
        if root is not None or (node in numeric and not _is_rational_step(node)):
            constants[root[0] if root else node] = None
        elif isinstance(node, sympy.Pow):
            wanted.add(node.base)
        else:
            wanted.update(node.args)
    return wanted, list(constants)


def _is_rational_step(node: sympy.Basic) -> bool:
    if isinstance(node, sympy.Add | sympy.Mul):
        return True
    return isinstance(node, sympy.Pow) and node.exp.is_Integer and (node.exp >= 0 or node.base.is_Rational is True)


def _node(
    node: sympy.Basic, done: dict[sympy.Basic, "flint.fmpq_mpoly"], context: "flint.fmpq_mpoly_ctx"
) -> "flint.fmpq_mpoly":
    """One node multiplied out."""
    if node.is_Number:
        if not node.is_finite:
            raise NotPolynomialError(f"a polynomial has finite coefficients, this one has {node}")
        return context.constant(_flint(to_fraction(node)))
    root = _root_of(node)
    if root is not None:
        return done[root[0]] ** root[1] * _flint(to_fraction(root[2]))
    if isinstance(node, sympy.Add):
        return sum((done[argument] for argument in node.args[1:]), start=done[node.args[0]])
    if isinstance(node, sympy.Mul):
        product = done[node.args[0]]
        for argument in node.args[1:]:
            _check_size(len(product) * len(done[argument]), [product, done[argument]], node)
            product = product * done[argument]
        return product
    if isinstance(node, sympy.Pow) and node.exp.is_Integer and node.exp >= 0:
        base, n = done[node.base], int(node.exp)
        _check_size(comb(len(base) + n - 1, n), [base] * min(n, 1000), node)
        return base**n
    if isinstance(node, sympy.Pow) and node.exp.is_Integer and node.base.is_Rational and node.base != 0:
        return done[node.base] ** 0 * _flint(to_fraction(node.base) ** int(node.exp))
    raise NotPolynomialError(_reason(node))


def _flint(number: Fraction) -> "flint.fmpq":
    return flint.fmpq(number.numerator, number.denominator)


def _check_size(terms: int, factors: Sequence["flint.fmpq_mpoly"], node: sympy.Expr) -> None:
    if terms > MOST_TERMS and prod(sum(d) + 1 for d in zip(*(f.degrees() for f in factors), strict=True)) > MOST_TERMS:
        raise NotPolynomialError(f"more than {MOST_TERMS} terms when {str(node)[:60]} is multiplied out")


def _reason(node: sympy.Expr) -> str:
    if isinstance(node, sympy.Symbol):
        return f"a polynomial in x, y, z was wanted, but {node} occurs"
    text = str(node)
    return f"a polynomial in x, y, z was wanted, but {text if len(text) < 80 else type(node).__name__ + '(...)'} occurs"
