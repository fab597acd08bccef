"""Measure the iterations of the frame loop, and decide when one may be skipped.

It may be skipped if the window already shows everything.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from depthwalk.walk.window import wait_for_event

_ROUNDS = 3  # iterations in which widgets are drawn after an event: imgui responds to events one iteration later


class WalkClock:
    """Measure the iterations of the frame loop, without the time spent on loading and on waiting for the user.

    Attributes
    ----------
    now
        When the present iteration began, on the clock of `time.perf_counter`.
    left_out
        How long the clock has been stopped since then, seconds.
    """

    def __init__(self) -> None:
        self.now = time.perf_counter()
        self.left_out = 0.0

    def tick(self) -> float:
        """Begin an iteration, and return how long the last one took, seconds."""
        before, self.now = self.now, time.perf_counter()
        stopped, self.left_out = self.left_out, 0.0
        return self.now - before - stopped

    @contextmanager
    def stopped(self) -> Iterator[None]:
        """Stop the clock during the `with` block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.left_out += time.perf_counter() - start

    def wait(self, seconds: float) -> None:
        """Wait for the user for at most `seconds` with the clock stopped: no frame took that long."""
        with self.stopped():
            wait_for_event(seconds)


class WidgetRounds:
    """Count the iterations of the frame loop in which widgets must still be drawn after their content has changed."""

    def __init__(self) -> None:
        self._content: tuple[Any, ...] = ()
        self._left = 0

    def are_over(self, content: tuple[Any, ...], has_news: bool) -> bool:
        """Return whether the widgets already show their content; call this once per iteration.

        Parameters
        ----------
        content
            Everything that they show, of comparable types.
        has_news
            Whether there was an event to which they may respond.
        """
        changed, self._content = has_news or content != self._content, content
        self._left = _ROUNDS if changed else max(self._left - 1, 0)
        return not self._left

    def begin(self) -> None:
        """Have the widgets drawn in a window that shows nothing yet."""
        self._content = ()
