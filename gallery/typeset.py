"""Formulas as people write them, in HTML."""

import re
from html import escape

_TOKEN = re.compile(r"\s+|\d+\.?\d*|[A-Za-zα-ω]\w*|\*\*|.", re.DOTALL)
_WORDS = {"sin", "cos", "tan", "exp", "log", "abs", "min", "max"}
_LETTERS = {"pi": "π", "phi": "φ", "tau": "τ", "theta": "θ"}


def typeset(formula: str) -> str:
    """`formula` in HTML: letters slanted, powers raised, signs spaced.

    >>> typeset("x^2 - 2*x*y^10 = sqrt(5)")
    '<i>x</i><sup>2</sup> − 2<i>x</i><i>y</i><sup>10</sup> = √5'
    """
    tokens = [token for token in _TOKEN.findall(formula) if not token.isspace()]
    return _sequence(tokens)


def _sequence(tokens: list[str]) -> str:
    html, previous, index = "", "", 0
    while index < len(tokens):
        token = tokens[index]
        if token in ("^", "**"):
            end = _operand(tokens, index + 1)
            html += f"<sup>{_sequence(_unwrapped(tokens[index + 1 : end]))}</sup>"
        elif token == "sqrt":
            end = _operand(tokens, index + 1)
            inner = _unwrapped(tokens[index + 1 : end])
            html += "√" + (_sequence(inner) if len(inner) == 1 else f"({_sequence(inner)})")
        else:
            end = index + 1
            html += _token(token, previous)
        previous, index = tokens[end - 1], end
    return html


def _operand(tokens: list[str], start: int) -> int:
    """Where the operand that starts at `start` ends: a token with its sign, or a pair of brackets."""
    end = start + (tokens[start] in "+-")
    depth = 0
    while end < len(tokens):
        depth += (tokens[end] == "(") - (tokens[end] == ")")
        end += 1
        if depth == 0:
            break
    return end


def _unwrapped(tokens: list[str]) -> list[str]:
    """`tokens` without a pair of brackets round all of them."""
    return tokens[1:-1] if tokens and tokens[0] == "(" and tokens[-1] == ")" else tokens


def _token(token: str, previous: str) -> str:
    if token == "*":
        return ""
    if token in "+-":
        sign = "−" if token == "-" else "+"
        return sign if previous in ("", "(", "=", ",", "[") else f" {sign} "
    if token in ("=", "∈"):
        return f" {token} "
    if token == ",":
        return ", "
    if token in _WORDS:
        return f" {token}" if previous[-1:].isalnum() else token
    if token in _LETTERS or (token[0].isalpha() and token.isalnum()):
        return f"<i>{_LETTERS.get(token, escape(token))}</i>"
    return escape(token)
