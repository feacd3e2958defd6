"""An expression as a program of registers: data, not code, so that nothing is compiled per formula.

Row q of `code` computes register q: operation, operands a and b, and the mask of the variables that it depends on
(4 for x, 2 for y, 1 for z). Equal subexpressions share a register. Sums and products are grouped by dependence, so that
in a brick of samples parts in one or two variables are computed once per line or plane. The last row is the result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isfinite

import numpy as np
import sympy
from numpy.typing import NDArray

from implicit.algebra.constants import enclose
from implicit.language.trees import postorder, x, y, z

X, Y, Z, CONST, ADD, SUB, MUL, DIV, NEG, ABS, SQR, SQRT, EXP, LOG, SIN, COS, ATAN, POW, MIN, MAX = range(20)

_UNARY = {sympy.exp: EXP, sympy.log: LOG, sympy.sin: SIN, sympy.cos: COS, sympy.atan: ATAN, sympy.Abs: ABS}
_LARGEST_POWER = 1024


@dataclass(frozen=True, eq=False)
class Tape:
    """`code` int32 (n, 4) rows (operation, a, b, mask); `arguments` int32, the operands of MIN and MAX, where a is
    the first place and b the number; `constants` float64 (c, 3) rows (value, lower, upper): CONST and POW refer here.
    """

    code: NDArray[np.int32]
    arguments: NDArray[np.int32]
    constants: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.code)


def make_tape(expression: sympy.Expr) -> Tape:
    """The program of an expression in x, y, z.

    Raises ValueError where a part has no rule, or is no real number.

    Examples
    --------
    >>> len(make_tape((x**2 + y**2 - 1) ** 2 + (x**2 + y**2 - 1)))
    9
    """
    writer = _Writer()
    registers: dict[sympy.Basic, int] = {}
    numeric: set[sympy.Basic] = set()
    for node in postorder(expression):
        if node.is_Number or isinstance(node, sympy.NumberSymbol) or (node.args and numeric.issuperset(node.args)):
            numeric.add(node)
            continue
        arguments = [writer.number(a) if a in numeric else registers[a] for a in _operands(node)]
        registers[node] = writer.node(node, arguments)
    root = writer.number(expression) if expression in numeric else registers[expression]
    return writer.finish(root)


def _operands(node: sympy.Basic) -> Sequence[sympy.Expr]:
    """The arguments that become registers: exponents that are numbers do not."""
    return node.args[:1] if isinstance(node, sympy.Pow) and not node.exp.free_symbols else node.args


class _Writer:
    """Rows under construction; equal rows are written once."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, int, int, int]] = []
        self.arguments: list[int] = []
        self.constants: list[tuple[float, float, float]] = []
        self.known: dict[tuple[int, ...], int] = {}
        self.known_constants: dict[tuple[float, float, float], int] = {}

    def mask(self, *registers: int) -> int:
        result = 0
        for register in registers:
            result |= self.rows[register][3]
        return result

    def row(self, operation: int, a: int = 0, b: int = 0, mask: int = 0) -> int:
        key = (operation, a, b)
        if key not in self.known:
            self.known[key] = len(self.rows)
            self.rows.append((operation, a, b, mask))
        return self.known[key]

    def unary(self, operation: int, a: int) -> int:
        return self.row(operation, a, 0, self.mask(a))

    def binary(self, operation: int, a: int, b: int) -> int:
        return self.row(operation, a, b, self.mask(a, b))

    def constant(self, number: sympy.Expr) -> int:
        """The place of a number in the table of constants."""
        ball = enclose(number)
        if not ball.is_finite():
            raise ValueError(f"real numbers were wanted, but {number} occurs")
        value = float(ball.mid())
        if not isfinite(value):
            raise ValueError(f"numbers within the range of floats were wanted, but {str(number)[:20]}... occurs")
        exact = bool(ball == value)
        low, high = float(ball.lower()), float(ball.upper())
        entry = (
            value,
            value if exact else min(value, np.nextafter(low, -np.inf)),
            value if exact else max(value, np.nextafter(high, np.inf)),
        )
        entry = (float(entry[0]), float(entry[1]), float(entry[2]))
        if entry not in self.known_constants:
            self.known_constants[entry] = len(self.constants)
            self.constants.append(entry)
        return self.known_constants[entry]

    def number(self, number: sympy.Expr) -> int:
        return self.row(CONST, self.constant(number))

    def chain(self, operation: int, registers: Sequence[int]) -> int:
        """A sum or product: first within each set of variables, then from few variables to many."""

        def spread(register: int) -> tuple[int, int]:
            mask = self.rows[register][3]
            return mask.bit_count(), mask

        parts = []
        for _, group in groupby(sorted(registers, key=spread), key=spread):
            first, *others = group
            for other in others:
                first = self.binary(operation, first, other)
            parts.append(first)
        result = parts[0]
        for part in parts[1:]:
            result = self.binary(operation, result, part)
        return result

    def branches(self, operation: int, registers: Sequence[int]) -> int:
        distinct = tuple(dict.fromkeys(registers))
        if len(distinct) == 1:
            return distinct[0]
        key = (operation, *distinct)
        if key not in self.known:
            start = len(self.arguments)
            self.arguments.extend(distinct)
            self.known[key] = len(self.rows)
            self.rows.append((operation, start, len(distinct), self.mask(*distinct)))
        return self.known[key]

    def node(self, node: sympy.Basic, arguments: list[int]) -> int:
        if node in (x, y, z):
            axis = (x, y, z).index(node)
            return self.row(axis, mask=4 >> axis)
        if isinstance(node, sympy.Add):
            return self.sum(node, arguments)
        if isinstance(node, sympy.Mul):
            return self.product(node, arguments)
        if isinstance(node, sympy.Pow):
            return self.power(node, arguments)
        if isinstance(node, sympy.Min | sympy.Max):
            return self.branches(MIN if isinstance(node, sympy.Min) else MAX, arguments)
        if type(node) in _UNARY:
            return self.unary(_UNARY[type(node)], arguments[0])
        return self.composed(node, arguments)

    def sum(self, node: sympy.Add, arguments: list[int]) -> int:
        plus = [a for a in arguments if self.rows[a][0] != NEG]
        minus = [self.rows[a][1] for a in arguments if self.rows[a][0] == NEG]
        if not plus:
            return self.unary(NEG, self.chain(ADD, minus))
        result = self.chain(ADD, plus)
        return self.binary(SUB, result, self.chain(ADD, minus)) if minus else result

    def product(self, node: sympy.Mul, arguments: list[int]) -> int:
        above, below = list[int](), list[int]()
        scale = sympy.Mul(*(factor for factor in node.args if not factor.free_symbols))
        negative = bool(scale.is_negative)
        scale = -scale if negative else scale
        if scale != 1:
            above.append(self.number(scale))
        for factor, register in zip(node.args, arguments, strict=True):
            operation, a, b, _ = self.rows[register]
            if not factor.free_symbols:
                continue
            if operation == DIV and self.rows[a][0] == CONST and self.constants[self.rows[a][1]] == (1.0, 1.0, 1.0):
                below.append(b)
            else:
                above.append(register)
        result = self.chain(MUL, above) if above else self.number(sympy.Integer(1))
        if below:
            result = self.binary(DIV, result, self.chain(MUL, below))
        return self.unary(NEG, result) if negative else result

    def power(self, node: sympy.Pow, arguments: list[int]) -> int:
        base, exponent = arguments[0], node.exp
        if exponent.free_symbols:
            if node.base is sympy.E:
                return self.unary(EXP, arguments[1])
            return self.unary(EXP, self.binary(MUL, arguments[1], self.unary(LOG, base)))
        if exponent.is_Rational and (2 * exponent).is_Integer and abs(exponent) <= _LARGEST_POWER:
            if exponent.q == 2:
                base = self.unary(SQRT, base)
            result = self.whole_power(base, abs(int(exponent.p)))
            return result if exponent > 0 else self.binary(DIV, self.number(sympy.Integer(1)), result)
        return self.row(POW, base, self.constant(exponent), self.mask(base))

    def whole_power(self, base: int, n: int) -> int:
        if n == 0:
            return self.number(sympy.Integer(1))
        if n == 1:
            return base
        half = self.unary(SQR, self.whole_power(base, n // 2))
        return half if n % 2 == 0 else self.binary(MUL, half, base)

    def composed(self, node: sympy.Basic, arguments: list[int]) -> int:
        """Functions written with the operations above."""
        one, two = self.number(sympy.Integer(1)), self.number(sympy.Integer(2))
        if isinstance(node, sympy.tan):
            return self.binary(DIV, self.unary(SIN, arguments[0]), self.unary(COS, arguments[0]))
        if isinstance(node, sympy.tanh):  # 1 - 2 / (exp(2 a) + 1)
            grown = self.binary(ADD, self.unary(EXP, self.binary(MUL, two, arguments[0])), one)
            return self.binary(SUB, one, self.binary(DIV, two, grown))
        if isinstance(node, sympy.sinh | sympy.cosh):
            grown = self.unary(EXP, arguments[0])
            shrunk = self.binary(DIV, one, grown)
            return self.binary(DIV, self.binary(ADD if isinstance(node, sympy.cosh) else SUB, grown, shrunk), two)
        if isinstance(node, sympy.asin | sympy.acos):  # atan(a / sqrt(1 - a^2))
            root = self.unary(SQRT, self.binary(SUB, one, self.unary(SQR, arguments[0])))
            angle = self.unary(ATAN, self.binary(DIV, arguments[0], root))
            return angle if isinstance(node, sympy.asin) else self.binary(SUB, self.number(sympy.pi / 2), angle)
        raise ValueError(f"no rule for {type(node).__name__} in {str(node)[:80]}")

    def finish(self, root: int) -> Tape:
        """The rows that the result needs, the result last."""
        needed = {root}
        for q in range(root, -1, -1):
            if q in needed:
                needed.update(self.sources(q))
        place = {old: new for new, old in enumerate(sorted(needed))}
        rows, arguments = [], list[int]()
        for q in sorted(needed):
            operation, a, b, mask = self.rows[q]
            if operation in (MIN, MAX):
                start = len(arguments)
                arguments.extend(place[r] for r in self.arguments[a : a + b])
                rows.append((operation, start, b, mask))
            elif operation <= CONST:
                rows.append((operation, a, b, mask))
            else:
                rows.append((operation, place[a], place[b] if ADD <= operation <= DIV else b, mask))
        constants = np.array(self.constants or [(0.0, 0.0, 0.0)])
        tape = Tape(np.array(rows, dtype=np.int32), np.array(arguments or [0], dtype=np.int32), constants)
        for array in (tape.code, tape.arguments, tape.constants):
            array.flags.writeable = False
        return tape

    def sources(self, q: int) -> Sequence[int]:
        operation, a, b, _ = self.rows[q]
        if operation <= CONST:
            return ()
        if operation in (MIN, MAX):
            return self.arguments[a : a + b]
        return (a, b) if operation <= DIV else (a,)
