"""Text to expression, with errors that point at the character.

    equation  = sum [ "=" sum ]                     left - right
    sum       = product { ("+" | "-") product }
    product   = signed { ("*" | "/") signed | power }    2x y is 2*x*y; 1/2x is (1/2)*x, read from the left
    signed    = ("+" | "-") signed | power
    power     = atom [ ("^" | "**") signed | raised ]    x^y^z is x^(y^z), -x^2 is -(x^2), x² is x^2
    atom      = number | name | function "(" sum { "," sum } ")" | "(" sum ")"

Numbers are exact: 0.1 is 1/10. Letters x, y, z written together are a product: xyz is x*y*z. `raised` means digits that
are raised, perhaps behind a raised minus, as in x¹² or x⁻¹; ·, ⋅ and × are *, ÷ is /, − is -, and π is pi. Nothing is
ever evaluated as Python.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NoReturn

import sympy

from implicit.errors import FormulaError
from implicit.language.trees import build, difference, is_branching
from implicit.language.vocabulary import CONSTANTS, FUNCTIONS, RAISED, VARIABLES, Token, likely, tokens

_DEEPEST = 120  # brackets within brackets
_LARGEST = 10_000  # digits of a number


def parse(text: str, parameters: Mapping[str, sympy.Expr] | None = None) -> sympy.Expr:
    """The expression left - right of a formula `left = right`, or of `left` alone.

    `parameters` are values for further names. Min, Max and Abs are built unevaluated.

    Raises
    ------
    FormulaError
        With the position of the first character that cannot be read and, where likely, what was meant.

    Examples
    --------
    >>> parse("x^2 + 0.1y = 2x y")
    x**2 - 2*x*y + y/10
    """
    clean = re.sub(r"\s", " ", text)
    reader = _Reader(clean, parameters or {})
    unused = set(parameters or {}) - {token.text for token in reader.tokens}
    result = reader.equation()
    if unused:
        raise ValueError(f"the formula has no {', '.join(sorted(unused))}")
    return result


class _Reader:
    """Recursive descent over the tokens of one formula."""

    def __init__(self, text: str, parameters: Mapping[str, sympy.Expr]) -> None:
        self.text = text
        self.names: dict[str, sympy.Expr] = {**CONSTANTS, **VARIABLES, **parameters}
        self.tokens = tokens(text, self.names)
        self.place = 0
        self.depth = 0

    @property
    def next(self) -> Token:
        return self.tokens[self.place]

    def take(self) -> Token:
        self.place += 1
        return self.tokens[self.place - 1]

    def fail(self, problem: str, token: Token, suggestion: str | None = None) -> NoReturn:
        raise FormulaError(problem, self.text, token.position, suggestion)

    def equation(self) -> sympy.Expr:
        if self.next.kind == "end":
            self.fail("the formula is empty", Token("end", "", 0), "for example: x^2 + y^2 + z^2 = 1")
        result = self.sum()
        if self.next.kind == "=":
            self.take()
            result = difference(result, self.sum())
        if self.next.kind != "end":
            self.fail_after(self.next)
        return result

    def fail_after(self, token: Token) -> NoReturn:
        if token.kind == "=":
            self.fail("a second =", token, "a formula has one equation: left = right")
        if token.kind == ")":
            self.fail("a closing bracket without an opening one", token)
        if token.kind == ",":
            self.fail("a comma outside a function", token, "a decimal point is written .")
        self.fail(f"cannot read {token.text!r} here", token)

    def sum(self) -> sympy.Expr:
        terms = [self.product()]
        while self.next.kind in ("+", "-"):
            sign = self.take().kind
            term = self.product()
            terms.append(term if sign == "+" else _negative(term))
        return _add(terms)

    def product(self) -> sympy.Expr:
        result = self.signed()
        while True:
            token = self.next
            if token.kind in ("*", "/"):
                self.take()
                factor = self.signed()
            elif token.kind in ("number", "name", "("):
                if token.kind == "number" and self.tokens[self.place - 1].kind in ("number", "name", "raised"):
                    self.fail_number_after(self.tokens[self.place - 1], token)
                factor = self.power()
            else:
                return result
            if token.kind == "/":
                if factor.is_zero:
                    self.fail("division by zero", token)
                factor = _power(factor, sympy.Integer(-1))
            result = _multiply(result, factor)

    def fail_number_after(self, before: Token, token: Token) -> NoReturn:
        if before.kind == "number":
            self.fail("two numbers side by side", token, f"write {before.text}*{token.text} for a product")
        if before.kind == "raised":
            self.fail("a number behind a power", token, "write * for a product")
        hint = f"write {before.text}^{token.text} for a power or {token.text}*{before.text} for a product"
        self.fail(f"a number behind {before.text}", token, hint)

    def signed(self) -> sympy.Expr:
        if self.next.kind in ("+", "-"):
            token = self.take()
            with_sign = self.nested(self.signed, token)
            return with_sign if token.kind == "+" else _negative(with_sign)
        return self.power()

    def nested(self, rule: Callable[[], sympy.Expr], token: Token) -> sympy.Expr:
        self.depth += 1
        if self.depth > _DEEPEST:
            self.fail(f"more than {_DEEPEST} levels of brackets, signs or powers", token)
        result = rule()
        self.depth -= 1
        return result

    def power(self) -> sympy.Expr:
        start = self.next
        base = self.atom()
        if self.next.kind not in ("^", "raised"):
            return base
        token = self.take()
        exponent = self.nested(self.signed, token) if token.kind == "^" else self.raised(token)
        if base.is_number and exponent.is_number:
            digits = abs(float(exponent)) * max(1.0, abs(float(sympy.log(sympy.Abs(base) + 2))))
            if digits > _LARGEST:
                self.fail("a number that is too large", token)
        return self.real(_power(base, exponent), start)

    def raised(self, token: Token) -> sympy.Expr:
        if self.next.kind in ("^", "raised"):
            self.fail("a power of a power", self.next, "use brackets, as in (x²)^3")
        text = token.text.translate(RAISED)
        digits = self.number(replace(token, text=text.lstrip("-")))
        return -digits if text.startswith("-") else digits

    def real(self, value: sympy.Expr, token: Token) -> sympy.Expr:
        if value.is_number and not value.is_real:
            self.fail("this is no real number", token)
        return value

    def atom(self) -> sympy.Expr:
        token = self.take()
        if token.kind == "number":
            return self.number(token)
        if token.kind == "name":
            return self.name(token)
        if token.kind == "(":
            result = self.nested(self.sum, token)
            self.close(token)
            return result
        self.place -= 1
        before = self.tokens[self.place - 1] if self.place else None
        if token.kind == "end":
            return self.fail(
                "the formula ends too early", token, f"something is missing after {before.text}" if before else None
            )
        if token.kind == "=":
            if before is not None and before.kind == "=":
                self.fail("a second =", token, "an equation is written with a single =")
            if before is None:
                self.fail("nothing on the left of =", token)
        if token.kind == ")" and before is not None and before.kind == "(":
            self.fail("nothing between the brackets", token)
        return self.fail(f"a number, a name or a bracket is missing before {token.text!r}", token)

    def close(self, opening: Token) -> None:
        if self.next.kind != ")":
            if self.next.kind == ",":
                self.fail_after(self.next)
            self.fail("a closing bracket is missing", self.next, f"for the bracket at character {opening.position + 1}")
        self.take()

    def number(self, token: Token) -> sympy.Expr:
        exponent = re.split("[eE]", token.text)[-1] if re.search("[eE]", token.text) else "0"
        if len(token.text) > _LARGEST or len(exponent) > 6 or abs(int(exponent)) > _LARGEST:
            self.fail("a number that is too large", token)
        return sympy.Rational(token.text)

    def name(self, token: Token) -> sympy.Expr:
        if token.text in self.names:
            return self.names[token.text]
        if token.text in FUNCTIONS:
            return self.call(token)
        return self.fail(f"unknown name {token.text!r}", token, likely(token.text, self.names))

    def call(self, token: Token) -> sympy.Expr:
        if self.next.kind in ("^", "raised"):
            self.fail(f"{token.text} needs its argument first", self.next, f"write {token.text}(...)^2")
        if self.next.kind != "(":
            behind = self.next.text or "..."
            self.fail(f"{token.text} needs brackets", self.next, f"did you mean {token.text}({behind})?")
        opening = self.take()
        arguments = [self.nested(self.sum, opening)]
        while self.next.kind == ",":
            comma = self.take()
            if token.text not in ("min", "max"):
                self.fail(f"{token.text} takes one argument", comma)
            arguments.append(self.nested(self.sum, opening))
        self.close(opening)
        kind = FUNCTIONS[token.text]
        branching = kind in (sympy.Min, sympy.Max, sympy.Abs)
        if all(argument.is_number for argument in arguments):
            return self.real(kind(*arguments), token)
        if branching or any(is_branching(argument) for argument in arguments):
            return build(kind, *arguments) if kind is not sympy.sqrt else build(sympy.Pow, arguments[0], sympy.S.Half)
        return kind(*arguments)


def _add(terms: list[sympy.Expr]) -> sympy.Expr:
    if len(terms) == 1:
        return terms[0]
    return build(sympy.Add, *terms) if any(map(is_branching, terms)) else sympy.Add(*terms)


def _negative(term: sympy.Expr) -> sympy.Expr:
    return build(sympy.Mul, sympy.S.NegativeOne, term) if is_branching(term) else -term


def _multiply(left: sympy.Expr, right: sympy.Expr) -> sympy.Expr:
    return build(sympy.Mul, left, right) if is_branching(left) or is_branching(right) else left * right


def _power(base: sympy.Expr, exponent: sympy.Expr) -> sympy.Expr:
    return build(sympy.Pow, base, exponent) if is_branching(base) or is_branching(exponent) else base**exponent
