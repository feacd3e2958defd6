"""Expressions as text that `formula` reads again."""

import sympy
from sympy.printing.str import StrPrinter

from implicit.language.trees import postorder

_LONGEST = 400  # operations


class _Printer(StrPrinter):
    """sympy's text with this package's names."""

    def _print_Exp1(self, expr: sympy.Expr) -> str:
        return "e"

    def _print_Abs(self, expr: sympy.Abs) -> str:
        return f"abs({self._print(expr.args[0])})"

    def _print_Max(self, expr: sympy.Expr) -> str:
        return f"{type(expr).__name__.lower()}({', '.join(self._print(part) for part in expr.args)})"

    _print_Min = _print_Max


def write(expression: sympy.Expr) -> str:
    """The expression in the grammar of `formula`, or the number of its operations when that is long.

    Examples
    --------
    >>> from implicit.formula import parse
    >>> write(parse("max(abs(x), e^y) = 2x y^2"))
    '-2*x*y^2 + max(abs(x), exp(y))'
    """
    size = len(postorder(expression))
    if size > _LONGEST:
        return f"<{size} operations>"
    return str(_Printer({"order": None}).doprint(expression)).replace("**", "^")
