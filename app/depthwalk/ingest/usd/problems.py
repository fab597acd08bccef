"""Define what the worker tells of a file that it cannot read, or reads in part."""

import re
from collections import Counter
from collections.abc import Iterable

_LOCATED = re.compile(r"^(?P<file>.*?):(?P<line>\d+):(?P<column>\d+): (?P<rest>.*)$", re.DOTALL)

_INTERNAL = re.compile(r"\bpxrInternal_\w+::(\w+::)*")


class UsdError(Exception):
    """Report a defect of a file: one line, which begins with the path of the prim if it is in one."""


class Unread:
    """Count what a file holds and its translation does not show."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str]] = Counter()

    def count(self, singular: str, plural: str = "", number: int = 1) -> None:
        """Count further things of a kind; the plural is made by "s" if it is not given."""
        self._counts[singular, plural or f"{singular}s"] += number

    def texts(self) -> list[str]:
        """Return a text for each kind, the number first, in the order in which they were met."""
        return [f"{count} {names[count > 1]}" for names, count in self._counts.items()]


def one_line(text: str) -> str:
    """Return a message of usd-core in one line, without names from its own source."""
    return " ".join(_INTERNAL.sub("", text).split())[:300]


def told(error: BaseException, path: str, root: str) -> str:
    """Return what an exception of usd-core says of a file, in one line.

    Parameters
    ----------
    error
        A `Tf.ErrorException`, whose arguments are errors with a `commentary`, or another exception.
    path
        The file that is read, which the message does not name.
    root
        Its folder, which is left out of the names of others.
    """
    texts: Iterable[str] = (getattr(each, "commentary", "") for each in error.args)
    text = next((text for text in texts if text), str(error))
    if (found := _LOCATED.match(text)) is not None:
        place = f"line {found['line']}" if found["file"] == path else f"{found['file']}:{found['line']}"
        text = f"{place}: {found['rest']}"
    return one_line(text.replace(root.rstrip("/") + "/", ""))
