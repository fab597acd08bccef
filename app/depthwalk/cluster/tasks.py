"""Do tasks on a cluster until each is done or has failed for good."""

import heapq
import logging
import random
import secrets
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field

from depthwalk.cluster.connection import Cluster, ClusterError
from depthwalk.errors import InputError

log = logging.getLogger(__name__)

MAX_ATTEMPTS = 4
FIRST_PAUSE = 1.0  # seconds before the second attempt; doubled for each later one
_POLL_SECONDS = 0.1


@dataclass(frozen=True, kw_only=True)
class Task:
    """Describe a task that may be done twice without harm: its files appear atomically, and are the same every time.

    Attributes
    ----------
    key
        A text that identifies the task by everything that its result depends on.
    function
        A function that workers can import.
    arguments
        Its arguments, which can be pickled.
    """

    key: str
    function: Callable[..., object]
    arguments: tuple[object, ...]


class TaskError(RuntimeError):
    """Report that a task failed in every attempt, although nothing is known to be wrong with its input."""


@dataclass
class Progress:
    """Count the states of tasks; `run_tasks` keeps it up to date.

    Attributes
    ----------
    workers
        Number of worker processes.
    running
        Number of tasks that the cluster has.
    again
        Failed attempts that were followed by another.
    lost
        Tasks that were submitted again because the scheduler was lost.
    """

    workers: int = 0
    running: int = 0
    again: int = 0
    lost: int = 0


@dataclass
class _Queue:
    """Tasks by number: those to submit now, and those to submit later."""

    waiting: deque[int]
    attempts: list[int]
    run: str
    later: list[tuple[float, int]] = field(default_factory=list)  # a heap of times and numbers
    running: "dict[Future[object], int]" = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.waiting or self.later or self.running)

    def retry_later(self, number: int) -> None:
        """Schedule another attempt after a pause, which differs between tasks lest they return all at once."""
        pause = FIRST_PAUSE * 2 ** (self.attempts[number] - 1) * random.uniform(0.75, 1.25)
        heapq.heappush(self.later, (time.monotonic() + pause, number))

    def enqueue_due(self) -> None:
        while self.later and self.later[0][0] <= time.monotonic():
            self.waiting.append(heapq.heappop(self.later)[1])


def run_tasks(
    cluster: Cluster, tasks: Sequence[Task], progress: Progress, check_interrupt: Callable[[], None]
) -> Generator[tuple[int, object], None, None]:
    """Do tasks on a cluster, and yield the outcome of each as it ends.

    If a worker is lost, Dask gives its task to another one. A task that raises is tried again, each time after a longer
    pause, unless it raises InputError, which every attempt would. If the scheduler is lost, its tasks are submitted
    again once it is back: those already done find their files, and end at once.

    Parameters
    ----------
    cluster
        The cluster.
    tasks
        The tasks.
    progress
        Counts the states of the tasks.
    check_interrupt
        Called ten times per second; it may raise to end everything.

    Yields
    ------
    tuple
        The number of a task, and its result; an InputError if the input is wrong, and a TaskError if all attempts
        failed.

    Raises
    ------
    ClusterError
        If the scheduler was lost for good.
    """
    queue = _Queue(deque(range(len(tasks))), [0] * len(tasks), secrets.token_hex(4))
    while queue:
        queue.enqueue_due()
        is_lost = not _submit_waiting(cluster, tasks, queue)
        ended = wait(queue.running, _POLL_SECONDS, FIRST_COMPLETED)[0] if queue.running else set()
        if not ended:
            is_lost |= bool(queue.running) and not cluster.is_connected()  # some futures are never notified
            time.sleep(0 if queue.running else _POLL_SECONDS)
        for future in ended:
            if future.cancelled():
                is_lost = True
                continue
            number = queue.running.pop(future)
            outcome = _outcome(future, queue.attempts[number] + 1)
            if isinstance(outcome, _Retry):
                queue.attempts[number] += 1
                progress.again += 1
                log.info("%s: %s; to be tried again", tasks[number].key, outcome.why)
                queue.retry_later(number)
            else:
                yield number, outcome
        if is_lost:
            progress.lost += len(queue.running)
            queue.waiting.extendleft(queue.running.values())
            queue.running.clear()
            cluster.reconnect(check_interrupt)
        progress.workers, progress.running = cluster.workers(), len(queue.running)
        check_interrupt()


@dataclass(frozen=True)
class _Retry:
    why: str


def _submit_waiting(cluster: Cluster, tasks: Sequence[Task], queue: _Queue) -> bool:
    """Submit tasks until the workers have enough; return whether there is a connection."""
    room = cluster.room()
    while queue.waiting and len(queue.running) < room:
        number = queue.waiting[0]
        task = tasks[number]
        try:
            # Dask keeps the result of a key as long as any future for it is held, so another attempt needs another key.
            # So does another run, before which the file may have been removed.
            key = f"{task.key}-{queue.run}-{queue.attempts[number]}"
            future = cluster.submit(key, task.function, *task.arguments)
        except ClusterError:
            return False
        queue.running[future] = queue.waiting.popleft()
    return True


def _outcome(future: "Future[object]", attempt: int) -> object:
    """Return what a task returned or why it failed; or that it should be tried again."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, InputError):
        return error
    why = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return _Retry(why) if attempt < MAX_ATTEMPTS else TaskError(f"failed {attempt} times, last: {why}")
