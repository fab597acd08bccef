"""Work in several threads: NumPy, SciPy and embreex release Python's lock while they compute."""

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Protocol, TypeVar

_MAX_WORKERS = 4  # more threads would mostly wait for the lock, and each needs its own intermediate arrays

_NAME = "depthwalk-map"  # with which the names of the threads begin

S = TypeVar("S")
T = TypeVar("T")


class Map(Protocol):
    """Describe `map`, and similar functions that call from several threads at once and keep the order of results."""

    def __call__(self, function: Callable[[S], T], items: Iterable[S], /) -> Iterator[T]:
        """Yield `function` of each of `items`, in their order."""
        ...


@contextmanager
def thread_map(workers: int | None = None) -> Iterator[Map]:
    """Provide a `Map` over threads, which end with the `with` block.

    Functions called through the map must not use it themselves: they would deadlock, waiting for a thread that waits.
    If the block is interrupted, by Ctrl-C or a request to end, it does not wait for threads that are still at work, see
    `is_at_work`.

    Parameters
    ----------
    workers
        Number of threads; None for `default_workers`. One means plain `map`, in the calling thread.

    Yields
    ------
    Map
        Calls a function for many items, in several threads.
    """
    workers = workers or default_workers()
    if workers == 1:
        yield map
        return
    pool, is_interrupted = ThreadPoolExecutor(workers, _NAME), False
    try:
        yield pool.map
    except (KeyboardInterrupt, SystemExit):
        is_interrupted = True
        raise
    finally:
        pool.shutdown(wait=not is_interrupted, cancel_futures=is_interrupted)


def is_at_work() -> bool:
    """Return whether threads of a `thread_map` are still at work, which Python waits for before it ends."""
    return any(thread.name.startswith(f"{_NAME}_") for thread in threading.enumerate())


def begin(function: Callable[[], T], parallel_map: Map) -> Callable[[], T]:
    """Begin a piece of work in a separate thread if work is done in several; return a function that waits for it.

    Unlike functions that are called through a map, this one may use the map.

    Parameters
    ----------
    function
        The work.
    parallel_map
        What `thread_map` yields; or `map`, with which the work is done when its result is first requested.

    Returns
    -------
    Callable
        Returns the result of `function`, or raises its exception.
    """
    if parallel_map is map:
        return cache(function)
    with_result: Future[T] = Future()

    def work() -> None:
        try:
            with_result.set_result(function())
        except BaseException as error:
            with_result.set_exception(error)

    threading.Thread(target=work, name="bake beside", daemon=True).start()
    return with_result.result


def default_workers(processes: int = 1) -> int:
    """Return how many threads each process should use if `processes` of them bake side by side.

    Together the processes use one thread per core, but each of them at least one and at most four.
    """
    return min(max(usable_cores() // processes, 1), _MAX_WORKERS)


def usable_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def batches(count: int, size: int) -> list[slice]:
    """Divide a sequence of `count` items into consecutive slices of at most `size` items each.

    If `count` is 0, the result is one empty slice.
    """
    return [slice(first, first + size) for first in range(0, max(count, 1), size)]
