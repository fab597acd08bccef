"""Show the progress of a cluster's tasks: how many are done, how fast, and how long the rest will take."""

import logging
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from depthwalk.cluster.connection import Cluster
from depthwalk.cluster.tasks import Progress
from depthwalk.commands.progress import live_options, log, show_progress
from depthwalk.commands.signals import end_if_interrupted

if TYPE_CHECKING:
    from rich.table import Table

_PLAIN_SECONDS = 10.0  # between lines if stderr is not a terminal
_RATE_SECONDS = 60.0  # over which the rate is measured


class Rate:
    """Measure how many things per second have been done recently, and estimate how long the rest will take."""

    def __init__(self, now: float) -> None:
        """Begin measuring. now: seconds of a clock."""
        self._marks: deque[tuple[float, int]] = deque([(now, 0)])

    def mark(self, now: float, done: int) -> None:
        """Record that `done` things are done at time `now`; at most twice a second, so that few marks are kept."""
        if now - self._marks[-1][0] < 0.5 and len(self._marks) > 1:
            return
        self._marks.append((now, done))
        while now - self._marks[1][0] > _RATE_SECONDS:
            self._marks.popleft()

    @property
    def per_second(self) -> float:
        """Return the rate of the last minute, 1/s; 0 before anything is done."""
        (since, before), (now, done) = self._marks[0], self._marks[-1]
        return (done - before) / (now - since) if now > since else 0.0

    def seconds_left(self, left: int) -> float | None:
        """Return how long `left` things will take, seconds; None if it cannot be estimated."""
        return left / self.per_second if self.per_second else None


@dataclass
class Display:
    """Report on tasks while a cluster does them.

    Attributes
    ----------
    progress
        The counts of `run_tasks`.
    show
        To be called often: shows the progress, and ends an interrupted command.
    done
        To be called with the number of things made.
    """

    progress: Progress
    show: Callable[[], None]
    done: Callable[[int], None]


def duration(seconds: float | None) -> str:
    """Return seconds as hours, minutes and seconds, such as 1:02:03; "?" for None."""
    if seconds is None:
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"


@contextmanager
def cluster_progress(what: str, total: int, cluster: Cluster) -> Iterator[Display]:
    """Show a table on stderr, or else a line from time to time, during the `with` block.

    Parameters
    ----------
    what
        What the tasks make, such as "meshes".
    total
        How many are to be made.
    cluster
        The cluster that does them.

    Yields
    ------
    Display
        Counts the tasks and shows them.
    """
    progress, ended, rate = Progress(), 0, Rate(time.monotonic())

    def cells() -> dict[str, str]:
        """Return the columns by their headings."""
        return {
            what: f"{ended} of {total}",
            "per second": f"{rate.per_second:.1f}",
            "left": duration(rate.seconds_left(total - ended)),
            "workers": str(progress.workers),
            "retried": str(progress.again + progress.lost),
        }

    def done(count: int) -> None:
        nonlocal ended
        ended += count
        rate.mark(time.monotonic(), ended)

    if cluster.dashboard:
        log.info("%s: its dashboard is at %s", cluster.name, cluster.dashboard)
    if not show_progress():
        yield Display(progress, _Lines(cells), done)
        return
    from rich.live import Live

    with Live(get_renderable=lambda: _table(cells(), cluster), refresh_per_second=4, **live_options()):
        yield Display(progress, end_if_interrupted, done)


class _Lines:
    """Write a line about all tasks from time to time."""

    def __init__(self, cells: Callable[[], dict[str, str]]) -> None:
        self._cells, self._last = cells, time.monotonic()

    def __call__(self) -> None:
        end_if_interrupted()
        if time.monotonic() - self._last > _PLAIN_SECONDS and log.isEnabledFor(logging.WARNING):
            self._last = time.monotonic()
            print(", ".join(f"{name}: {value}" for name, value in self._cells().items()), file=sys.stderr, flush=True)


def _table(cells: dict[str, str], cluster: Cluster) -> "Table":
    from rich.table import Table

    table = Table(*cells, box=None, pad_edge=False, caption=cluster.dashboard or None, caption_justify="left")
    table.add_row(*cells.values())
    return table
