"""Long work: threads that stop together, progress, and memory asked for before it is needed."""

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event, Lock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Task = TypeVar("Task")
Result = TypeVar("Result")
Progress = Callable[[float], object]
"""Called with the share done, from 0 to 1."""


_SMALL = 2**26
"""Bytes that are not worth asking for."""


class Job:
    """A piece of work of known size, shared by threads: counts what is done and tells all of them to stop."""

    def __init__(self, total: int, progress: Progress | None = None, workers: int = 1) -> None:
        self.total = max(total, 1)
        self.workers = workers
        self._progress = progress
        self._done = 0
        self._stop = Event()
        self._lock = Lock()

    def advance(self, amount: int) -> None:
        """Report `amount` more as done; raises InterruptedError when the job has been stopped."""
        if self._stop.is_set():
            raise InterruptedError("stopped because another part of the work failed or was interrupted")
        if self._progress is not None:
            with self._lock:
                self._done += amount
                self._progress(min(self._done / self.total, 1.0))

    def map(self, function: Callable[[Task], Result], tasks: Sequence[Task]) -> list[Result]:
        """The results of all tasks in their order. The first error, or Ctrl-C, stops the others and is raised."""
        if self.workers == 1 or len(tasks) < 2:
            return [function(task) for task in tasks]
        with ThreadPoolExecutor(self.workers) as pool:
            futures = [pool.submit(function, task) for task in tasks]
            try:
                for future in futures:
                    if (error := future.exception()) and not isinstance(error, InterruptedError):
                        raise error
                return [future.result() for future in futures]
            except BaseException:
                self._stop.set()
                for future in futures:
                    future.cancel()
                raise


def check_workers(workers: int) -> int:
    """`workers` as a number of threads; -1 means one for each processor. Raises ValueError."""
    if isinstance(workers, bool) or not isinstance(workers, int) or (workers < 1 and workers != -1):
        raise ValueError(f"workers must be a positive number of threads or -1 for all processors, got {workers!r}")
    return (
        workers
        if workers > 0
        else len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1
    )


def available_memory() -> int | None:
    """Bytes that can be used now: the least of what the machine and the control group leave; None if unknown."""
    amounts = []
    for path, key in (("/proc/meminfo", "MemAvailable:"),):
        amounts += [int(line.split()[1]) * 1024 for line in _lines(path) if line.startswith(key)]
    limits, used = _lines("/sys/fs/cgroup/memory.max"), _lines("/sys/fs/cgroup/memory.current")
    if limits and used and limits[0].isdigit():
        amounts.append(int(limits[0]) - int(used[0]))
    return min(amounts, default=None)


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text().splitlines()
    except OSError:
        return []


def check_memory(needed: float, what: str, advice: str) -> None:
    """Raise MemoryError with the numbers when `needed` bytes are more than there are."""
    if needed < _SMALL:
        return
    free = available_memory()
    if free is not None and needed > free:
        raise MemoryError(f"{what} needs about {_size(needed)}, but only {_size(free)} of memory are free; {advice}")


def _size(amount: float) -> str:
    power = min(int(np.log10(max(amount, 1)) // 3), 4)
    return f"{amount / 1000**power:.3g} {('bytes', 'kB', 'MB', 'GB', 'TB')[power]}"


def batches(count: int, size: int) -> Iterable[tuple[int, int]]:
    """(first, last) of runs of at most `size`, together 0 to count."""
    return ((first, min(first + size, count)) for first in range(0, count, size))


def trimmed(array: NDArray[Any], rows: int) -> NDArray[Any]:
    """The first rows: in the same memory, or a copy where most of that would be kept for nothing.

    Never by `resize`: giving the rest back to the system costs more than writing the rows.
    """
    return array[:rows] if 2 * rows > len(array) else array[:rows].copy()
