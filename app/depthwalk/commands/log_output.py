"""Write the log of a command to stderr: plain lines, each warning once."""

import logging
import os
import sys
from contextlib import suppress
from pathlib import PurePath

from depthwalk.errors import printable
from depthwalk.files import finished_names

_log = logging.getLogger("depthwalk")


def from_here(line: str) -> str:
    """Return a message with the names of files, at its beginning and behind places, relative to the current folder.

    A scene's files are known by absolute names, which are longer than what the user typed and differ by machine. Files
    that are being written are named as they will be.
    """
    line = finished_names(line)
    with suppress(OSError):  # the current folder no longer exists
        here = os.path.join(os.getcwd(), "")
        return line.removeprefix(here).replace(f": {here}", ": ")
    return line


class _PlainFormatter(logging.Formatter):
    """Format records without characters from file names that could control a terminal, see `printable`."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the text of `record`."""
        if isinstance(record.args, tuple):
            escaped = (printable(arg) if isinstance(arg, str | PurePath) else arg for arg in record.args)
            record = logging.makeLogRecord(vars(record) | {"args": tuple(escaped)})
        return from_here(super().format(record))


class _OnceFilter(logging.Filter):
    """Let each warning pass once: a mesh's files are looked up when it is hashed and again when it is read.

    Attributes
    ----------
    seen
        The warnings so far.
    """

    def __init__(self) -> None:
        super().__init__()
        self.seen: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to print `record`."""
        message = record.getMessage()
        is_new = record.levelno != logging.WARNING or message not in self.seen
        self.seen.add(message)
        return is_new


def warned() -> set[str]:
    """Return the warnings on stderr so far: what is first noticed in the background may then end the command."""
    filters = [one for handler in _log.handlers for one in handler.filters]
    return set().union(*(one.seen for one in filters if isinstance(one, _OnceFilter)))


def configure_logging(verbose: bool, quiet: bool) -> None:
    """Write warnings to stderr from now on; with `verbose` everything else too, with `quiet` only errors."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_PlainFormatter("%(message)s"))
    handler.addFilter(_OnceFilter())
    _log.handlers = [handler]
    _log.propagate = False
    _log.setLevel(logging.DEBUG if verbose else logging.ERROR if quiet else logging.WARNING)
