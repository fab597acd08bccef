"""Files that appear whole or not at all; pictures as PNG, JPEG, OpenEXR and MP4."""

import errno
import logging
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from depthwalk.errors import InputError

if TYPE_CHECKING:  # writing a file needs no GL, and most commands write no OpenEXR
    pass

log = logging.getLogger(__name__)

_STAGING = ".bake-"  # before the number of the process that makes the folder
_STALE = 86_400  # seconds, after which what a process that is gone has left may be removed


def check_folder(path: Path) -> None:
    """Makes sure that `path` can be written, by a try: what a system forbids shows nowhere else. Raises InputError."""
    folder = path.parent
    try:
        if not folder.is_dir():
            raise InputError(f"{path}: the folder {str(folder)!r} does not exist")
        if path.is_dir():
            raise InputError(f"{path}: is a folder")
        with suppress(FileNotFoundError):
            os.lstat(_temporary(path))  # fails for names that no file can have
        tempfile.TemporaryFile(dir=folder).close()  # without a name: nothing stays where somebody interrupts
    except ValueError:  # a null character
        raise InputError(f"{path}: no file can have that name") from None
    except OSError as error:
        named = error.errno == errno.ENAMETOOLONG
        why = "the name is too long" if named else f"the folder {str(folder)!r} is not writable"
        raise InputError(f"{path}: {why}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to; it takes the place of `path` at the end, or vanishes where an error is raised.

    The name ends like `path`: writers choose the format by it. What was written is on the disk before it takes the
    place of anything. Raises OSError where that fails.
    """
    temporary = _temporary(path)
    try:
        yield temporary
        with _about(path, temporary):
            _flush(temporary)
            os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):  # what went wrong is told already
            temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    return path.with_name(f".{os.getpid()}-{path.name}")


@contextmanager
def _about(path: Path, temporary: Path) -> Iterator[None]:
    """Names `path` in errors of the system, which name the temporary file or none."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from error


def _flush(path: Path) -> None:
    """Wait until a file is on the disk: some systems tell only then that it has no room. Raises OSError."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def staging_folder(folder: Path) -> "tempfile.TemporaryDirectory[str]":
    """Make a folder in `folder`, on the same disk, for files not finished yet; leaving it as a context removes it.

    First removes those that killed processes left there, see `remove_leftovers`. Raises OSError.
    """
    remove_leftovers(folder, (_STAGING,))
    return tempfile.TemporaryDirectory(prefix=f"{_STAGING}{os.getpid()}-", dir=folder)


def remove_leftovers(folder: Path, prefixes: tuple[str, ...] = (".", _STAGING)) -> None:
    """Remove what killed processes left unfinished in `folder`: files and folders named by us for a process that is
    gone, and a day old, since a disk may be shared with other machines. What cannot be removed stays.

    prefixes: what stands before the number of the process in their names.
    """
    ours = re.compile(rf"(?:{'|'.join(map(re.escape, prefixes))})(\d{{1,9}})-.+")
    with suppress(OSError):
        for path in folder.iterdir():
            if (match := ours.fullmatch(path.name)) and not _is_running(int(match[1])):
                with suppress(OSError):  # another process removes as well
                    if time.time() - path.lstat().st_mtime > _STALE:
                        shutil.rmtree(path) if path.is_dir() else path.unlink()


def _is_running(process: int) -> bool:
    """Whether there is such a process on this machine; False where that cannot be asked without ending it."""
    if os.name == "nt":  # there `os.kill` does kill
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's
        return True
    return True


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a whole file. Raises OSError."""
    with replacing(path) as temporary, _about(path, temporary):
        temporary.write_bytes(data)
