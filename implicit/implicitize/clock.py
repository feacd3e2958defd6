"""How long a computation may still take."""

from dataclasses import dataclass, field
from time import monotonic

from implicit.errors import TimeLimitError


@dataclass(frozen=True)
class Clock:
    """A limit in seconds from its creation; None means none."""

    timeout: float | None = None
    start: float = field(default_factory=monotonic)

    def check(self, what: str) -> None:
        """Raise TimeLimitError once the time is over."""
        if self.timeout is not None and monotonic() - self.start > self.timeout:
            raise TimeLimitError(f"no answer within timeout={self.timeout:g} s: stopped during {what}")

    @property
    def left(self) -> float:
        """Seconds left."""
        return float("inf") if self.timeout is None else self.timeout - (monotonic() - self.start)
