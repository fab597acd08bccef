"""New files of the walk: pictures and camera paths, beside what is there."""

from collections.abc import Callable, Sequence
from datetime import datetime
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory


def save_new(suffix: str, write: Callable[[Path], object], folders: Sequence[Path]) -> Path:
    """A new file, named by the time, in the first of `folders` that takes it; returns its path.

    write: writes a file; what it raises but for OSError is let through. Raises OSError when no folder takes it.
    """
    failure = OSError("no folder to write to")
    for folder in folders:
        try:
            return _write_new(folder, suffix, write)
        except OSError as error:
            failure = error
    raise failure


def _write_new(folder: Path, suffix: str, write: Callable[[Path], object]) -> Path:
    """The whole file under a name that was free. A name is taken by an empty file, for a moment only: where there are
    no hard links, no move of a file refuses to overwrite."""
    stem = f"depthwalk-{datetime.now():%Y%m%d-%H%M%S}"
    with TemporaryDirectory(prefix=".depthwalk-", dir=folder) as temporary:
        whole = Path(temporary) / f"whole{suffix}"
        write(whole)
        for number in count(1):
            path = folder / (f"{stem}{suffix}" if number == 1 else f"{stem}-{number}{suffix}")
            try:
                path.open("xb").close()
            except FileExistsError:
                continue
            try:
                return whole.replace(path)
            except BaseException:
                path.unlink()
                raise
    raise AssertionError("numbers do not end")
