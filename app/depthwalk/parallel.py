"""Work in several threads: NumPy, SciPy and embreex let go of Python's lock while they compute."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol, TypeVar

_MAX_WORKERS = 4  # more threads would mostly wait for the lock, and each holds intermediate arrays of its own

S = TypeVar("S")
T = TypeVar("T")


class Map(Protocol):
    """Describe `map`, and functions like it that call from several threads at once and keep the order of results."""

    def __call__(self, function: Callable[[S], T], things: Iterable[S], /) -> Iterator[T]:
        """Yield `function` of each of `things`, in their order."""
        ...


@contextmanager
def thread_map(workers: int | None = None) -> Iterator[Map]:
    """Provide a `Map` over threads, which end with the `with` block.

    Functions that are called through the map must not use it in turn: they would wait for a thread that waits for them.

    Parameters
    ----------
    workers
        How many threads; None for `default_workers`. One is plain `map`, in the calling thread.

    Yields
    ------
    Map
        Calls a function for many things, in several threads.
    """
    workers = workers or default_workers()
    if workers == 1:
        yield map
        return
    with ThreadPoolExecutor(workers, "bake") as pool:
        yield pool.map


def default_workers(processes: int = 1) -> int:
    """Return how many threads each process should use where `processes` of them bake side by side.

    Together the processes use one thread per core, but each of them at least one and at most four.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(max(cores // processes, 1), _MAX_WORKERS)


def batches(count: int, size: int) -> list[slice]:
    """Divide a sequence of `count` things into slices of at most `size` things each, and return them in order.

    Where `count` is 0, the result is one empty slice.
    """
    return [slice(first, first + size) for first in range(0, max(count, 1), size)]
