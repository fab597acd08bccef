"""Show on stderr what a command is waiting for: the asset being loaded, the frames done so far.

Live displays appear only on a terminal. Elsewhere a line every few seconds says what takes long, and with --verbose
every step has its own line.
"""

import itertools
import logging
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from depthwalk.commands.failures import tell
from depthwalk.commands.signals import end_if_interrupted
from depthwalk.errors import printable

log = logging.getLogger("depthwalk")

PLAIN_SECONDS = 3.0  # between progress lines if stderr is not a terminal

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


@contextmanager
def plain_lines() -> Iterator[Callable[[str], None]]:
    """Print what is being waited for, every few seconds during the `with` block, if stderr is not a terminal.

    So users of a pipe learn it, even while a single step takes long. Nothing is printed twice, nor with --quiet.

    Yields
    ------
    Callable[[str], None]
        A function to call with the line that describes the present step.
    """
    told = current = ""
    ended = threading.Event()

    def print_now_and_then() -> None:
        nonlocal told
        while not ended.wait(min(PLAIN_SECONDS, threading.TIMEOUT_MAX)):
            if current != told:
                told = current
                tell(printable(told))

    def begin(line: str) -> None:
        nonlocal current
        end_if_interrupted()
        current = line

    if not log.isEnabledFor(logging.WARNING):
        yield begin
        return
    printer = threading.Thread(target=print_now_and_then, daemon=True)
    printer.start()
    try:
        yield begin
    finally:
        ended.set()
        printer.join()


@contextmanager
def plain_steps() -> Iterator[Report]:
    """Report steps where stderr is not a terminal: what takes long by `plain_lines`, with --verbose every step.

    Yields
    ------
    Report
        A function to call with a name and the step that begins.
    """
    if not log.isEnabledFor(logging.INFO):
        with plain_lines() as begin:
            yield lambda name, step: begin(f"{name}: {step}")
        return

    def log_step(name: str, step: str) -> None:
        end_if_interrupted()
        log.info("%s: %s", name, step)

    yield log_step


@contextmanager
def asset_progress() -> Iterator[Report]:
    """Show which asset is being read or baked during the `with` block.

    Yields
    ------
    Report
        A function to call with an asset's name and the stage of loading that begins.
    """
    if not show_progress():
        with plain_steps() as report:
            yield report
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
        done = itertools.count(1)
        with plain_lines() as begin:
            yield lambda: begin(f"{label}: {next(done)} of {total} frames")
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, **live_options()) as progress:
        task = progress.add_task(label, total=total)

        def advance() -> None:
            progress.advance(task)
            end_if_interrupted()

        yield advance
