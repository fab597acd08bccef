"""Save a walk's screenshots and recorded camera paths under new names, without overwriting anything."""

from collections.abc import Callable, Sequence
from datetime import datetime
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory


def save_new(suffix: str, write: Callable[[Path], object], folders: Sequence[Path]) -> Path:
    """Save a new file, named by the time, in the first folder that can be written to.

    Parameters
    ----------
    suffix
        The suffix of the file's name, such as ".png".
    write
        Called with the path of a temporary file, which it must write. Exceptions other than OSError pass through.
    folders
        The folders to try, in this order.

    Returns
    -------
    Path
        The new file.

    Raises
    ------
    OSError
        Where none of the folders can be written to.
    """
    failure = OSError("no folder to write to")
    for folder in folders:
        try:
            return _write_new(folder, suffix, write)
        except OSError as error:
            failure = error
    raise failure


def _write_new(folder: Path, suffix: str, write: Callable[[Path], object]) -> Path:
    """Write a whole file under a free name of `folder` and return its path.

    An empty file reserves the name for a moment: without hard links, no system call moves a file and refuses to
    overwrite another.
    """
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
