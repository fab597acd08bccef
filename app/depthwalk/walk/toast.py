"""Show one short message at a time to the user, for as long as it takes to read."""

import time

_SHORTEST = 4.0  # seconds
_READING = 15.0  # characters per second


class Toast:
    """Hold the message that the window shows now, until its time is over or another replaces it.

    Attributes
    ----------
    message
        The last message, also after its time.
    """

    def __init__(self) -> None:
        self.message, self._end = "", 0.0

    def show(self, message: str) -> None:
        """Show `message` for a few seconds, or longer if it takes longer to read; "" ends the last one."""
        self.message, self._end = message, time.monotonic() + max(_SHORTEST, len(message) / _READING)

    @property
    def text(self) -> str:
        """Return the message to show now, or an empty string if there is none or its time is over."""
        return self.message if time.monotonic() < self._end else ""
