"""Processor seconds, peak memory, and tables."""

import gc
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

_STATUS = Path("/proc/self/status")
_RESET = Path("/proc/self/clear_refs")


class Measured(NamedTuple):
    """A result, the median of the processor seconds, and the growth of memory at its peak in bytes (None: unknown)."""

    result: Any
    seconds: float
    memory: int | None


def measure(function: Callable[[], Any], repeat: int = 5) -> Measured:
    """Call `function` `repeat` times; processor seconds of this process, so that other load counts little."""
    gc.collect()
    before = _reset_peak()
    seconds, result = [], None
    for _ in range(repeat):
        result = None
        start = time.process_time()
        result = function()
        seconds.append(time.process_time() - start)
    return Measured(result, median(seconds), None if before is None else max(_status("VmHWM") - before, 0))


def _reset_peak() -> int | None:
    """Memory in use now, after the peak has been set back to it; None where the system cannot do this."""
    try:
        _RESET.write_text("5")
    except OSError:
        return None
    return _status("VmRSS")


def _status(key: str) -> int:
    line = next(line for line in _STATUS.read_text().splitlines() if line.startswith(key + ":"))
    return int(line.split()[1]) * 1024


def markdown(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
