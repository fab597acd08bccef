"""Write files atomically, and clean up after processes that were killed.

A file is written beside its final path, under a name that identifies process and machine, flushed to the disk and
renamed. So no reader ever sees half a file, and leftovers of a killed process can be distinguished from files that are
being written: the next process that writes into the same folder removes them.
"""

import errno
import functools
import hashlib
import os
import platform
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from depthwalk.errors import InputError, as_given, foreign_name

_STAGING = ".bake-"  # prefix of staging folders' names, before the number of the process
_STALE = 86_400  # seconds after which leftovers are removed if their process cannot be checked
_run = ""  # see `work_for`


def check_folder(path: Path, *, may_be_folder: bool = False) -> None:
    """Check that a file can be written, before its contents are computed.

    The check writes an unnamed file in its folder: only this reveals missing permissions and read-only disks.

    Parameters
    ----------
    path
        The file, which may exist.
    may_be_folder
        Whether a folder is to be made at `path`, or filled that exists.

    Raises
    ------
    InputError
        If the file cannot be written; the message names `path` and the reason.
    OSError
        If the disk is full, which is no mistake of the user's.
    """
    folder = path.parent
    try:
        if not folder.is_dir():
            why = "is a file" if folder.exists() else "does not exist"
            raise InputError(f"{as_given(path)}: the folder {as_given(folder)!r} {why}{foreign_name(path)}")
        if not may_be_folder and path.is_dir():
            raise InputError(f"{path}: is a folder")
        with suppress(FileNotFoundError):
            os.lstat(_temporary(path))  # fails for names that no file can have
        tempfile.TemporaryFile(dir=folder).close()  # unnamed, so that an interrupt leaves nothing behind
    except ValueError:  # a null character
        raise InputError(f"{path}: no file can have that name") from None
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise OSError(error.errno, error.strerror, str(path)) from None
        named = error.errno == errno.ENAMETOOLONG
        why = "the name is too long" if named else f"the folder {str(folder)!r} is not writable"
        raise InputError(f"{path}: {why}") from None


def reason(error: OSError) -> str:
    """Return why the system refused something, and for which file, without the number of the error."""
    if error.strerror is None:
        return str(error)
    return error.strerror if error.filename is None else f"{error.filename}: {error.strerror}"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Provide a file name to write to; the new file replaces `path` when the `with` block ends.

    The name has the same ending as `path`, since writers choose the format by it. The contents are on the disk before
    they replace anything. If the block raises, the new file is removed and `path` stays unchanged.

    Parameters
    ----------
    path
        The file to write or replace.

    Yields
    ------
    Path
        The name to write to, beside `path`.

    Raises
    ------
    OSError
        If the file cannot be flushed or renamed; the error names `path`.
    """
    _sweep(path.parent)
    temporary = _temporary(path)
    try:
        yield temporary
        with _about(path, temporary):
            _flush(temporary)
            os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):  # the original error has been raised already
            temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    """Return the name under which this process writes the file of `path`."""
    return path.with_name(f".{_writer()}-{path.name}")


def _writer() -> str:
    """Return a text that identifies this process, and the run it works for, also among other machines."""
    return f"{os.getpid()}-{_machine()}" + (f"-{_run}" if _run else "")


@functools.cache
def _machine() -> str:
    """Return six hex digits that identify the scope of process numbers: one machine, and one container on it."""
    texts = [platform.node()]
    with suppress(OSError):  # Linux only
        texts.append(Path("/etc/machine-id").read_text(encoding="ascii", errors="replace"))
    with suppress(OSError):
        texts.append(str(os.stat("/proc/self/ns/pid").st_ino))
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:6]


@functools.lru_cache(maxsize=64)
def _sweep(folder: Path) -> None:
    """Remove leftovers of killed processes from a folder, once for each process that writes there."""
    remove_leftovers(folder)


def work_for(run: str) -> None:
    """Mark the names of unfinished files with the run that writes them, so that `remove_unfinished` finds them.

    `run` is eight hex digits, or "" for none.
    """
    global _run
    _run = run


def remove_unfinished(folder: Path, run: str) -> None:
    """Remove unfinished files in `folder` from processes of the run `run`, which is over.

    Unlike `remove_leftovers`, this does not wait for a day or check processes: the run may have used other machines.
    """
    pattern = re.compile(rf"\.(?:bake-)?\d{{1,9}}-[0-9a-f]{{6}}-{re.escape(run)}-.+")
    with suppress(OSError):
        for path in folder.iterdir():
            if pattern.fullmatch(path.name):
                with suppress(OSError):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


@contextmanager
def _about(path: Path, temporary: Path) -> Iterator[None]:
    """Name `path` in errors of the system, which name the temporary file or none."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from error


def _flush(path: Path) -> None:
    """Wait until a file is on the disk: some systems report only then that it is full. Raises OSError."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def staging_folder(folder: Path) -> "tempfile.TemporaryDirectory[str]":
    """Create a folder for unfinished files, on the same disk as their final path; see `remove_leftovers`.

    Parameters
    ----------
    folder
        The folder in which to create it.

    Returns
    -------
    tempfile.TemporaryDirectory
        Gives the path of the new folder to a `with` block, and removes the folder when the block ends.

    Raises
    ------
    OSError
        If no folder can be created.
    """
    _sweep(folder)
    return tempfile.TemporaryDirectory(prefix=f"{_STAGING}{_writer()}-", dir=folder)


def temporary_folder() -> "tempfile.TemporaryDirectory[str]":
    """Create a folder for this process's own files, among the temporary files of the system.

    Like a `staging_folder`, it is removed by the next process if this one is killed.
    """
    return staging_folder(Path(tempfile.gettempdir()))


# The machine is optional, since names did not contain it at first: such leftovers are removed once they are old.
_OURS = re.compile(rf"(?:\.|{re.escape(_STAGING)})(?P<process>\d{{1,9}})-(?:(?P<machine>[0-9a-f]{{6}})-)?.+")


_STAGED = re.compile(rf"{re.escape(_STAGING)}\d{{1,9}}-[0-9a-f]{{6}}-[^/\\]*[/\\]")


def finished_names(text: str) -> str:
    """Return a message without the names of staging folders, so that files are named as they will be."""
    return _STAGED.sub("", text)


def remove_leftovers(folder: Path) -> None:
    """Remove unfinished files of killed processes from a folder.

    Leftovers are files and folders with a name given by this module, for a process that does not run. Those of other
    machines, whose processes cannot be checked, must also be a day old. What cannot be removed stays.

    Parameters
    ----------
    folder
        The folder; its sub-folders are not searched.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name[:1] == "." and (match := _OURS.fullmatch(entry.name)):
                with suppress(OSError):  # another process removes as well
                    if _is_left_over(entry, match):
                        is_folder = entry.is_dir(follow_symlinks=False)
                        shutil.rmtree(entry.path) if is_folder else os.unlink(entry.path)


def _is_left_over(entry: "os.DirEntry[str]", match: "re.Match[str]") -> bool:
    """Return whether a file or folder, whose name gave `match`, will never be finished. Raises OSError."""
    if _is_running(int(match["process"])):
        return False
    is_here = match["machine"] == _machine() and os.name != "nt"
    return is_here or time.time() - entry.stat(follow_symlinks=False).st_mtime > _STALE


def _is_running(process: int) -> bool:
    """Return whether a process runs on this machine; False if the system cannot be asked without ending it."""
    if os.name == "nt":  # where `os.kill` really kills
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True


def copy(source: Path, path: Path) -> None:
    """Copy the file `source` to the file `path` atomically. Raises OSError if that fails."""
    with replacing(path) as temporary, _about(path, temporary):
        shutil.copyfile(source, temporary)


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to the file `path` atomically. Raises OSError if that fails."""
    with replacing(path) as temporary, _about(path, temporary):
        temporary.write_bytes(data)
