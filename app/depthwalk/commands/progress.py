"""Show on stderr what a command is waiting for: the asset being loaded, the frames done so far.

Live displays appear only on a terminal. Elsewhere long stages are reported in a line from time to time, and with
--verbose every stage in its own line.
"""

import itertools
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from depthwalk.commands.signals import end_if_interrupted

log = logging.getLogger("depthwalk")

PLAIN_SECONDS = 5.0  # between progress lines if stderr is not a terminal

Report = Callable[[str, str], None]  # called with the name of an asset and the stage of its loading


@contextmanager
def quiet() -> Iterator[None]:
    """Log only errors during the `with` block: in a worker process, whose output is not read."""
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


def show_progress() -> bool:
    """Return whether to show live progress: stderr is a terminal that can move its cursor, and --quiet is not given."""
    can_move = sys.stderr.isatty() and os.environ.get("TERM", "") not in ("dumb", "unknown")  # as `rich` sees it
    return can_move and log.getEffectiveLevel() < logging.ERROR


def live_options() -> dict[str, Any]:
    """Return the keyword arguments of every live display of `rich`: it is on stderr, and vanishes when it ends."""
    from rich.console import Console

    # Results on stdout are printed above the display only if both are on one terminal.
    return {"console": Console(stderr=True), "transient": True, "redirect_stdout": sys.stdout.isatty()}


class _PlainReport:
    """Report stages as lines if stderr is not a terminal: all with --verbose, otherwise one from time to time.

    So users of a pipe learn what they are waiting for. With --quiet nothing is printed.
    """

    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, name: str, stage: str) -> None:
        end_if_interrupted()
        if log.isEnabledFor(logging.INFO):
            log.info("%s: %s", name, stage)
        else:
            self.now_and_then(f"waiting for {name}: {stage}")

    def now_and_then(self, line: str) -> None:
        """Print a line, unless the last one was printed a moment ago."""
        if log.isEnabledFor(logging.WARNING) and time.monotonic() - self._last > PLAIN_SECONDS:
            self._last = time.monotonic()
            print(line, file=sys.stderr, flush=True)


@contextmanager
def asset_progress() -> Iterator[Report]:
    """Show which asset is being read or baked during the `with` block.

    Yields
    ------
    Report
        A function to call with an asset's name and the stage of loading that begins.
    """
    if not show_progress():
        yield _PlainReport()
        return
    from rich.console import Console
    from rich.markup import escape

    with Console(stderr=True).status("") as status:
        yield lambda name, stage: status.update(f"{escape(name)}: {stage}")


@contextmanager
def frame_progress(label: str, total: int) -> Iterator[Callable[[], None]]:
    """Show a progress bar during the `with` block; without a terminal, a line from time to time.

    Parameters
    ----------
    label
        The text before the bar.
    total
        Number of frames; nothing is shown for a single one.

    Yields
    ------
    Callable[[], None]
        A function to call after each frame. It also ends an interrupted command, see `end_if_interrupted`.
    """
    if total < 2:
        yield end_if_interrupted
        return
    if not show_progress():
        plain, done = _PlainReport(), itertools.count(1)

        def count() -> None:
            plain.now_and_then(f"{label}: {next(done)} of {total} frames")
            end_if_interrupted()

        yield count
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, **live_options()) as progress:
        task = progress.add_task(label, total=total)

        def advance() -> None:
            progress.advance(task)
            end_if_interrupted()

        yield advance
