"""Store the finished parts of a report, so that the same command can continue an interrupted run."""

import contextlib
import hashlib
import time
from collections.abc import Iterable
from pathlib import Path

import depthwalk
from depthwalk.cache import Cache
from depthwalk.commands.progress import log
from depthwalk.provenance import commit

MEASURED = Cache(suffix=".measured", content="unfinished reports")
_KEEP_SECONDS = 7 * 86_400  # after its last entry; a later run is meant to measure again


class Journal:
    """Append results to a file in the cache folder as they are found; the file is removed when all are there.

    An entry is a line: the SHA-256 of the rest, the key of the result, and its JSON. A line half written by a killed
    process does not match its checksum, and is skipped. If a journal cannot be written, a warning is logged and
    measuring continues.

    Attributes
    ----------
    path
        The file, which need not exist.
    """

    def __init__(self, *run: object) -> None:
        """Name a journal by the program's version and by `run`, whose `repr` identifies what is measured, and how."""
        self.path: Path = MEASURED.file(digest(depthwalk.__version__, commit(), *run))
        self._is_writable = True

    def read(self) -> dict[str, bytes]:
        """Return the results as JSON by their keys; none if the journal is old."""
        found: dict[str, bytes] = {}
        try:
            if time.time() - self.path.stat().st_mtime > _KEEP_SECONDS:
                self.remove()
                return {}
            with self.path.open("rb") as file:
                for line in file:
                    checksum, _, entry = line.rstrip(b"\n").partition(b" ")
                    if hashlib.sha256(entry).hexdigest().encode() == checksum:
                        key, _, result = entry.partition(b" ")
                        found[key.decode()] = result
        except FileNotFoundError:
            pass
        except OSError as error:
            log.warning("%s: cannot be read: %s", self.path, error.strerror or error)
        return found

    def add(self, key: str, result: bytes) -> None:
        """Append a result. key: a text without blanks; result: its JSON, in one line."""
        if not self._is_writable:
            return
        entry = key.encode() + b" " + result
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab") as file:  # the line before may be half written
                file.write(b"\n" + hashlib.sha256(entry).hexdigest().encode() + b" " + entry)
        except OSError as error:
            self._is_writable = False
            log.warning(
                "%s: cannot be written: %s; if this run is interrupted, it cannot be continued",
                self.path,
                error.strerror or error,
            )

    def remove(self) -> None:
        """Remove the journal, if possible."""
        with contextlib.suppress(OSError):
            self.path.unlink(missing_ok=True)


def digest(*values: object) -> str:
    """Return a hash of values whose `repr` is complete, 64 hex digits."""
    return hashlib.sha256(repr(values).encode()).hexdigest()


def file_states(files: Iterable[Path]) -> list[tuple[str, int, int]]:
    """Return values that change with files: the name of each, its size, bytes, and its time, nanoseconds."""
    states = []
    for file in files:
        try:
            status = file.stat()
        except OSError:  # reported when the file is read
            continue
        states.append((str(file.absolute()), status.st_size, status.st_mtime_ns))
    return sorted(states)
