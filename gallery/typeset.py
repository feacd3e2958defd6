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
        end = index + 1
        if token in ("^", "**"):
            end = _operand(tokens, index + 1)
            html += f"<sup>{_sequence(_unwrapped(tokens[index + 1 : end]))}</sup>"
        elif token == "sqrt":
            end = _operand(tokens, index + 1)
            inner = _unwrapped(tokens[index + 1 : end])
            html += "√" + (_sequence(inner) if len(inner) == 1 else f"({_sequence(inner)})")
        elif _is_fraction(tokens[index : index + 3]) and previous != "/":
            end = index + 3
            html += f"<sup>{token}</sup>⁄<sub>{tokens[index + 2]}</sub>"
        else:
            html += _token(token, previous)
        previous, index = tokens[end - 1], end
    return html


def _is_fraction(tokens: list[str]) -> bool:
    """Whether three tokens are a number over a number."""
    return len(tokens) == 3 and tokens[1] == "/" and tokens[0].isdigit() and tokens[2].isdigit()


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
    space = "\u2009" if previous in _WORDS and token != "(" else ""
    if token in _WORDS:
        return f"\u2009{token}" if previous[-1:].isalnum() or previous == ")" else token
    name, _, index = _LETTERS.get(token, token).partition("_")
    if name.isalpha() and name != "Σ":
        letter = f"<i>{escape(name)}</i>" if len(name) == 1 else escape(name)
        return space + letter + (f"<sub>{escape(index)}</sub>" if index else "")
    return space + escape(token)
