"""Show on stderr what a command is waiting for: the asset being loaded, the frames done so far.

Live displays appear only on a terminal; elsewhere --verbose logs the same stages as lines.
"""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

log = logging.getLogger("depthwalk")

Report = Callable[[str, str], None]  # called with the name of an asset and the stage of its loading


def show_progress() -> bool:
    """Return whether to show live progress: stderr is a terminal and --quiet was not given."""
    return sys.stderr.isatty() and log.getEffectiveLevel() < logging.ERROR


def live_options() -> dict[str, Any]:
    """Return the options of every live display of rich: it is on stderr, and removed when done."""
    from rich.console import Console

    # Results on stdout are printed above the display only where both are on one terminal.
    return {"console": Console(stderr=True), "transient": True, "redirect_stdout": sys.stdout.isatty()}


@contextmanager
def asset_progress() -> Iterator[Report]:
    """Show which asset is being read or baked.

    The `with` block gets a function to call with an asset's name and the stage that begins.
    """
    if not show_progress():
        yield lambda name, stage: log.info("%s: %s", name, stage)
        return
    from rich.console import Console
    from rich.markup import escape

    with Console(stderr=True).status("") as status:
        yield lambda name, stage: status.update(f"{escape(name)}: {stage}")


@contextmanager
def frame_progress(label: str, total: int) -> Iterator[Callable[[], None]]:
    """Show a progress bar called `label` over `total` frames.

    The `with` block gets a function to call after each frame.
    """
    if total < 2 or not show_progress():
        yield lambda: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, **live_options()) as progress:
        task = progress.add_task(label, total=total)
        yield lambda: progress.advance(task)
