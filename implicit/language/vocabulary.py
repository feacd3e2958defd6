"""The words and signs of formulas, and what a misspelt one may stand for."""

import difflib
import re
from collections.abc import Collection
from dataclasses import dataclass

import sympy

from implicit.errors import FormulaError
from implicit.language.trees import x, y, z

VARIABLES = {"x": x, "y": y, "z": z}
CONSTANTS = {"pi": sympy.pi, "e": sympy.E}
FUNCTIONS: dict[str, type] = {
    "sin": sympy.sin,
    "cos": sympy.cos,
    "tan": sympy.tan,
    "exp": sympy.exp,
    "log": sympy.log,
    "sqrt": sympy.sqrt,
    "abs": sympy.Abs,
    "min": sympy.Min,
    "max": sympy.Max,
    "sinh": sympy.sinh,
    "cosh": sympy.cosh,
    "tanh": sympy.tanh,
    "asin": sympy.asin,
    "acos": sympy.acos,
    "atan": sympy.atan,
}
_OTHER_NAMES = {
    "ln": "log",
    "arctan": "atan",
    "arcsin": "asin",
    "arccos": "acos",
    "Abs": "abs",
    "fabs": "abs",
    "tg": "tan",
}
_OTHER_SIGNS = {
    "–": "write the minus sign -",
    "√": "write sqrt(...)",
    "|": "write abs(...) for an absolute value",
    "[": "use round brackets ( )",
    "]": "use round brackets ( )",
    "{": "use round brackets ( )",
    "}": "use round brackets ( )",
    "<": "a surface is where both sides are equal: write =",
    ">": "a surface is where both sides are equal: write =",
    ";": "give one formula at a time",
    ".": "a number has one decimal point",
}
_SAME = {"**": "^", "·": "*", "⋅": "*", "×": "*", "÷": "/", "−": "-"}
RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(
    r"(?P<number>(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*|π)|(?P<raised>⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)"
    r"|(?P<sign>\*\*|[-−+*·⋅×/÷^(),=])",
    re.ASCII,
)


@dataclass(frozen=True)
class Token:
    """A piece of the text; `kind` is "number", "name", "raised" (a power as in x²), "end" or the sign itself."""

    kind: str
    text: str
    position: int


def tokens(text: str, words: Collection[str] = ()) -> list[Token]:
    """The text in pieces, closed by a token of kind "end"; xyz is read as x, y, z unless it is a word."""
    found, position = [], 0
    while position < len(text):
        if text[position].isspace():
            position += 1
            continue
        match = _TOKEN.match(text, position)
        if match is None:
            sign = text[position]
            raise FormulaError(f"unknown character {sign!r}", text, position, _OTHER_SIGNS.get(sign))
        piece = match.group()
        if match.lastgroup == "name" and piece not in words and set(piece) <= set(VARIABLES):
            piece = piece[0]
        kind = str(match.lastgroup) if match.lastgroup != "sign" else _SAME.get(piece, piece)
        found.append(Token(kind, "pi" if piece == "π" else piece, position))
        position += len(piece)
    found.append(Token("end", "", len(text.rstrip())))
    return found


def likely(text: str, names: Collection[str]) -> str:
    """What an unknown name may stand for."""
    known = [*names, *FUNCTIONS]
    if text in _OTHER_NAMES:
        return f"did you mean {_OTHER_NAMES[text]}?"
    for name in sorted(FUNCTIONS, key=len, reverse=True):
        if text.startswith(name) and (text[len(name) :] in known or text[len(name) :].isdigit()):
            return f"did you mean {name}({text[len(name) :]})?"
    if text.lower() in known:
        return f"did you mean {text.lower()}?"
    if re.fullmatch(r"[xyz]\d+", text):
        return f"did you mean {text[0]}^{text[1:]} or {text[1:]}*{text[0]}?"
    split = re.match("|".join(sorted(map(re.escape, names), key=len, reverse=True)), text)
    if split and text[split.end() :] in known:
        return f"did you mean {split.group()}*{text[split.end() :]}?"
    close = difflib.get_close_matches(text.lower(), known, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]}?"
    return f"known are {', '.join(names)}; a value for {text} can be given as a parameter: {text}=1"
