"""Define the exception that reports wrong input from the user, and suggest corrections for misspelt words."""

import os
import re
from collections.abc import Iterable
from contextlib import suppress
from difflib import get_close_matches
from itertools import islice
from pathlib import Path

# Most names in a folder that are compared with a misspelt one.
_MAX_NAMES = 10_000

# Most characters of a name that a message quotes.
_MAX_QUOTED = 60

# An address, such as https://example.org/a.glb, once `Path` has made one slash of two. Drives have one letter.
_ADDRESS = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):/+")


class InputError(Exception):
    """Report that the user's input cannot be used; the message says where and why, in one line.

    The command line prints the message without a traceback and exits with code 2. Messages quote file names and file
    contents, so characters that would control a terminal are escaped, see `printable`.

    Attributes
    ----------
    lines
        The message, one text per mistake.
    """

    def __init__(self, *lines: str) -> None:
        """Make an error from one or more mistakes, each described in one line."""
        self.lines = tuple(map(printable, lines))
        super().__init__(*self.lines)

    def __str__(self) -> str:
        """Return the message, one line per mistake."""
        return "\n".join(self.lines)

    def at(self, place: str) -> "InputError":
        """Return this error with the `place` that led to it, in another file, before each line that lacks it.

        The place "" changes nothing.
        """
        return InputError(*(_after(place, line) for line in self.lines)) if place else self


class UnbakableError(InputError):
    """Report that a mesh cannot have depth images, though it can be drawn as polygons.

    Attributes
    ----------
    reason
        Why, with the name of the file, without what the user may do about it.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        """Make an error from the `reason`, and what the user may do: `remedy`."""
        super().__init__(f"{reason}; {remedy}")
        self.reason = printable(reason)
        self.args = (reason, remedy)  # with which it is made again in another process

    def at(self, place: str) -> "UnbakableError":
        """Return this error after a `place`, as `InputError.at` does."""
        reason, remedy = self.args
        return UnbakableError(_after(place, reason), remedy) if place else self


def _after(place: str, line: str) -> str:
    return line if line.startswith(place) else f"{place}: {line}"


def printable(text: object) -> str:
    r"""Return `text` with every unprintable character replaced by an escape such as `\x1b`.

    File names and the text in files may hold characters that move a terminal's cursor, change its colours or start a
    new line.
    """
    plain = str(text)
    if plain.isprintable():
        return plain
    return "".join(one if one.isprintable() else repr(one)[1:-1] for one in plain)


def quoted(name: str) -> str:
    """Return a name from a file in quotes, as messages show it, shortened to at most 60 characters."""
    return repr(name if len(name) <= _MAX_QUOTED else name[: _MAX_QUOTED - 3] + "...")


def suggest(word: str, choices: Iterable[str]) -> str:
    """Return the end of an error message, `; did you mean 'x'?`, for a misspelt word.

    Parameters
    ----------
    word
        The word that was given.
    choices
        The valid words; the message names the one spelt most like `word`.

    Returns
    -------
    str
        The end of the message; "" if no choice resembles the word.
    """
    close = get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""


def reason(error: Exception) -> str:
    """Return what an `error` says that is not written for users, with its kind, on one line of at most 100 letters."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:100]


def counted(number: int, noun: str) -> str:
    """Return a number with a noun that takes an s for any but one: `1 model`, `12,000 triangles`."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def missing_file(path: Path) -> InputError:
    """Return the error that says why `path` is not a file: it is a folder, something else, or does not exist.

    If a file with the same ending in the same folder is spelt much like it, the message suggests that file.
    """
    if str(path) == "-":
        return InputError("-: standard input is not read; name a file")
    if path.is_dir():
        return InputError(f"{path}: is a folder")
    if path.exists():
        return InputError(f"{path}: not a file")
    with suppress(OSError, ValueError):  # it is no link, or no file can have that name
        return InputError(f"{path}: a link to {os.readlink(path)!r}, which does not exist")
    return InputError(f"{as_given(path)}: no such file{suggest_file(path)}")


def as_given(path: Path) -> str:
    """Return a name as the user wrote it, with the slashes after `https:` or `file:` of which `Path` leaves one."""
    return _ADDRESS.sub(
        lambda found: f"{found[1]}:///" if found[1].lower() == "file" else f"{found[1]}://", str(path), 1
    )


def foreign_name(path: Path) -> str:
    """Return the end of a message about a name that no file has, but that other programs would understand.

    These are addresses, the home folder as a shell writes it, and Windows' separators where folders have others. None
    of them is expanded: a shell does so before the program sees the name, except in quotes and in `--option=~/name`,
    and a scene file shall mean the same for every user.

    Parameters
    ----------
    path
        The name as it was given, relative or absolute.

    Returns
    -------
    str
        Such as `; write 'models/a.ply'`, and why; "" for all other names.
    """
    name = str(path)
    if address := _ADDRESS.match(name):
        remedy = "leave out 'file://'" if address[1].lower() == "file" else "name a file on this machine"
        return f"; addresses are not opened: {remedy}"
    if name[:1] == "~" and len(path.parts) > 1:
        return "; '~' means the home folder only to a shell: write the folder's name"
    if "\\" in path.name and os.sep == "/":
        slashed = name.replace("\\", "/")
        return f"; write {slashed!r}: folders are separated by '/'"
    return ""


def suggest_file(path: Path) -> str:
    """Return `; did you mean 'x'?`, where x is the file in the same folder spelt most like `path`; or "".

    The ending must be the same, or nearly so, as with `a.yml` and `a.yaml`. A name without an ending also matches files
    of that name with one, scenes first. Folders are never meant, nor what has the very name: it may be there, and be
    something else. Names of other programs come before all that, see `foreign_name`.
    """
    if foreign := foreign_name(path):
        return foreign
    try:
        with os.scandir(path.parent) as entries:
            some = islice(entries, _MAX_NAMES)
            names = [Path(entry.name) for entry in some if entry.name != path.name and not entry.is_dir()]
    except (OSError, ValueError):  # the folder does not exist or may not be read, or there is a null character
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
