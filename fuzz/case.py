"""Define what is fuzzed: a reader, the files that it begins with, and the ways in which these are changed."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

Files = dict[str, bytes]
"""What a reader is given, as contents by name: the first file is the one that is read, the others lie beside it."""

Change = Callable[[bytes, random.Random], bytes]
"""Changes the contents of a file at random; raises anything where the file is not of the kind that it knows."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A reader to be fuzzed.

    Attributes
    ----------
    name
        What the command line calls it.
    seeds
        Returns the files to begin with; each is read without an error, or is a hostile file.
    read
        Reads the file at a path, and raises AssertionError where what it returns is out of bounds.
    modules
        The modules whose lines are counted, by their names.
    words
        What is inserted into files: key words of the format.
    changes
        By the end of a file's name, what knows its structure.
    megabytes
        Memory that reading any file may take, besides what grows with the file.
    slowness
        About how many times as long as that of other targets reading a file takes. `--inputs` asks for as many fewer.
    """

    name: str
    seeds: Callable[[], list[Files]]
    read: Callable[[Path], object]
    modules: tuple[str, ...]
    words: tuple[bytes, ...] = ()
    changes: dict[str, tuple[Change, ...]] = field(default_factory=dict)
    megabytes: int = 256
    slowness: int = 1


def write_files(folder: Path, files: Files) -> Path:
    """Write `files` to an empty `folder`; returns the path of the first."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder / next(iter(files))
