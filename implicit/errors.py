"""Errors that say what was wanted and what came. All are ValueErrors, but for things of a wrong kind: TypeErrors."""


class FormulaError(ValueError):
    """A text that is no formula; `position` is the index of the first character that cannot be read.

    The message shows the text, a caret under that character and, where one is likely, what was meant.
    """

    def __init__(self, problem: str, text: str, position: int, suggestion: str | None = None) -> None:
        self.problem = problem
        self.text = text
        self.position = position
        self.suggestion = suggestion
        hint = f"\n{suggestion}" if suggestion else ""
        super().__init__(f"{problem} (character {position + 1})\n  {text}\n  {' ' * position}^{hint}")


class NotPolynomialError(ValueError):
    """A question about polynomials, asked of a formula that is none."""


class SingularPointError(ValueError):
    """A normal or tangent plane was asked for where the gradient vanishes."""


class OpenSurfaceError(ValueError):
    """Inside and outside were asked of a surface with boundary edges."""


class SignAmbiguousError(ValueError):
    """The sign of f does not tell inside from outside, because f has a factor of even multiplicity."""


class UndecidedError(ValueError):
    """An exact answer was asked for and could not be proved; `indices` are the points without one."""

    def __init__(self, message: str, indices: object = None) -> None:
        self.indices = indices
        super().__init__(message)


class NotASurfaceError(ValueError):
    """A parametrization of rank below two: its image is a curve or a point."""


class TranscendentalError(ValueError):
    """Coordinates that satisfy no polynomial equation, such as u mixed with sin(u)."""


class TimeLimitError(ValueError, TimeoutError):
    """The time that was allowed is over, or cannot be enough."""


def wrong_kind(wanted: str, given: object) -> TypeError:
    """The error where `wanted` was wanted and something of another kind came; a text is probably meant as a formula."""
    hint = '; a formula becomes one by Surface("...")' if isinstance(given, str) and "Surface" in wanted else ""
    return TypeError(f"{wanted} was wanted, got {type(given).__name__}{hint}")
