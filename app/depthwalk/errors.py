"""Define the one exception that means "the user's input is wrong", and help with misspelt words."""

import os
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from pathlib import Path

# Names of a folder that are compared with a misspelt one.
_MAX_NAMES = 10_000

# Characters of a name that a message quotes.
_MAX_QUOTED = 60


class InputError(Exception):
    """Report that what the user gave cannot be used; the message says where and why, in one line.

    The command line prints the message without a traceback and exits with code 2. Messages quote files and what is in
    them, so whatever a terminal would obey instead of show is escaped, see `printable`.

    Attributes
    ----------
    lines
        The message, a text for each mistake.
    """

    def __init__(self, *lines: str) -> None:
        """Make an error of one mistake or several, each told in one line."""
        self.lines = tuple(map(printable, lines))
        super().__init__(*self.lines)

    def __str__(self) -> str:
        """Return the message, a line for each mistake."""
        return "\n".join(self.lines)


def printable(text: object) -> str:
    r"""Return `text` with an escape, such as `\x1b`, in place of each character that is not printable.

    Names of files and texts in them may hold what moves a terminal's cursor, changes its colours or begins a line.
    """
    plain = str(text)
    if plain.isprintable():
        return plain
    return "".join(one if one.isprintable() else repr(one)[1:-1] for one in plain)


def quoted(name: str) -> str:
    """Return `name`, which stands in a file, in quotes, as messages show it: at most 60 characters of it."""
    return repr(name if len(name) <= _MAX_QUOTED else name[: _MAX_QUOTED - 3] + "...")


def suggest(word: str, choices: Iterable[str]) -> str:
    """Return the end of an error message, `; did you mean 'x'?`, that helps whoever misspelt a word.

    Parameters
    ----------
    word
        The word that was given.
    choices
        The words that would be right; the one spelt most like `word` is named.

    Returns
    -------
    str
        The end of the message; "" where no choice resembles the word.
    """
    close = get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""


def missing_file(path: Path) -> InputError:
    """Return the error that says why `path` names no file: it is a folder, something else, or not there.

    Where a file of the same folder and ending is spelt much like it, the message names that one.
    """
    if path.is_dir():
        return InputError(f"{path}: is a folder")
    if path.exists():
        return InputError(f"{path}: not a file")
    return InputError(f"{path}: no such file{suggest_file(path)}")


def suggest_file(path: Path) -> str:
    """Return `; did you mean 'x'?`, where x is the file of its folder spelt most like `path`; or "".

    The ending must be the same, or nearly so, as of `a.yml` and `a.yaml`. A name without ending also means the file of
    that name with one, scenes first.
    """
    try:
        with os.scandir(path.parent) as entries:
            names = [Path(entry.name) for entry in islice(entries, _MAX_NAMES)]
    except (OSError, ValueError):  # no such folder either, one that may not be read, or a null character
        return ""
    endings = {name.suffix.lower() for name in names}
    for ending in get_close_matches(path.suffix.lower(), endings, cutoff=0.6) if path.suffix else [""]:  # best first
        alike = {name.stem: name.name for name in names if name.suffix.lower() == ending}
        if close := get_close_matches(path.stem, alike, n=1, cutoff=0.6):
            return f"; did you mean {alike[close[0]]!r}?"
    whole = [name for name in names if name.stem == path.name and name.suffix]
    if whole:
        return f"; did you mean {min(whole, key=_scenes_first).name!r}?"
    return ""


def _scenes_first(name: Path) -> tuple[bool, str]:
    return name.suffix.lower() not in (".yaml", ".yml"), name.name
