"""Write files that appear whole or not at all, and clean up after processes that were killed.

A file is written beside its final place, under a name that tells process and machine, flushed to the disk and renamed.
So no reader ever sees half a file, and what a killed process has left can be told from what is being written: the next
process that writes into the same folder removes it.
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

from depthwalk.errors import InputError

_STAGING = ".bake-"  # how names of staging folders begin, before the number of the process
_STALE = 86_400  # seconds after which leftovers may be removed of a process that cannot be asked for
_run = ""  # see `work_for`


def check_folder(path: Path) -> None:
    """Check that a file can be written, before work is put into its contents.

    The check writes a file without a name in its folder: only this shows missing permissions and read-only disks.

    Parameters
    ----------
    path
        The file, which may exist.

    Raises
    ------
    InputError
        Where the file cannot be written; the message names `path` and the reason.
    """
    folder = path.parent
    try:
        if not folder.is_dir():
            why = "is a file" if folder.exists() else "does not exist"
            raise InputError(f"{path}: the folder {str(folder)!r} {why}")
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
    """Provide a file name to write to; the new file takes the place of `path` when the `with` block ends.

    The name ends as `path` does, since writers choose the format by it. The contents are on the disk before they
    replace anything. Where the block raises, the new file is removed and `path` stays as it was.

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
        Where the file cannot be flushed or renamed; it names `path`.
    """
    _sweep(path.parent)
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
    """Return the name under which this process writes the file of `path`."""
    return path.with_name(f".{_writer()}-{path.name}")


def _writer() -> str:
    """Return what tells this process, and the run that it works for, from others, on other machines, too."""
    return f"{os.getpid()}-{_machine()}" + (f"-{_run}" if _run else "")


@functools.cache
def _machine() -> str:
    """Return six hex digits that tell where process numbers mean the same: one machine, and on it one container."""
    texts = [platform.node()]
    with suppress(OSError):  # Linux only
        texts.append(Path("/etc/machine-id").read_text(encoding="ascii", errors="replace"))
    with suppress(OSError):
        texts.append(str(os.stat("/proc/self/ns/pid").st_ino))
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:6]


@functools.lru_cache(maxsize=64)
def _sweep(folder: Path) -> None:
    """Remove what killed processes left in a folder, once for each process that writes there."""
    remove_leftovers(folder)


def work_for(run: str) -> None:
    """Have the names of unfinished files tell for which run they are written, so that `remove_unfinished` finds them.

    `run` is eight hex digits, or "" for none.
    """
    global _run
    _run = run


def remove_unfinished(folder: Path, run: str) -> None:
    """Remove what processes left unfinished in `folder` that worked for the run named `run`, which is over.

    Unlike `remove_leftovers` this waits for no day, and asks for no process: the run may have had other machines.
    """
    ours = re.compile(rf"\.(?:bake-)?\d{{1,9}}-[0-9a-f]{{6}}-{re.escape(run)}-.+")
    with suppress(OSError):
        for path in folder.iterdir():
            if ours.fullmatch(path.name):
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
    """Wait until a file is on the disk: some systems tell only then that it has no room. Raises OSError."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def staging_folder(folder: Path) -> "tempfile.TemporaryDirectory[str]":
    """Make a folder for unfinished files, on the same disk as their final place; see `remove_leftovers`.

    Parameters
    ----------
    folder
        The folder in which the new one is made.

    Returns
    -------
    tempfile.TemporaryDirectory
        Gives the path of the new folder to a `with` block, and removes the folder when the block ends.

    Raises
    ------
    OSError
        Where no folder can be made.
    """
    _sweep(folder)
    return tempfile.TemporaryDirectory(prefix=f"{_STAGING}{_writer()}-", dir=folder)


def temporary_folder() -> "tempfile.TemporaryDirectory[str]":
    """Make a folder for files that this process alone needs, among the temporary files of the system.

    It is as `staging_folder` makes it: where this process is killed, the next one removes it.
    """
    return staging_folder(Path(tempfile.gettempdir()))


# Before the machine was part of the name: such leftovers are removed once they are old.
_OURS = re.compile(rf"(?:\.|{re.escape(_STAGING)})(?P<process>\d{{1,9}})-(?:(?P<machine>[0-9a-f]{{6}})-)?.+")


def remove_leftovers(folder: Path) -> None:
    """Remove what killed processes left unfinished in a folder.

    Leftovers are files and folders that bear a name of this module's, for a process that does not run. Those of other
    machines, whose processes cannot be asked for, must also be a day old. What cannot be removed stays.

    Parameters
    ----------
    folder
        Where to look; its sub-folders are not searched.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name[:1] == "." and (ours := _OURS.fullmatch(entry.name)):
                with suppress(OSError):  # another process removes as well
                    if _is_left_over(entry, ours):
                        is_folder = entry.is_dir(follow_symlinks=False)
                        shutil.rmtree(entry.path) if is_folder else os.unlink(entry.path)


def _is_left_over(entry: "os.DirEntry[str]", ours: "re.Match[str]") -> bool:
    """Return whether nobody will finish a file or folder, whose name `ours` has matched. Raises OSError."""
    if _is_running(int(ours["process"])):
        return False
    is_here = ours["machine"] == _machine() and os.name != "nt"
    return is_here or time.time() - entry.stat(follow_symlinks=False).st_mtime > _STALE


def _is_running(process: int) -> bool:
    """Return whether a process runs on this machine; False where the system cannot be asked without ending it."""
    if os.name == "nt":  # there `os.kill` does kill
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True


def copy(source: Path, path: Path) -> None:
    """Copy the file `source` to the file `path`, whole or not at all. Raises OSError where that fails."""
    with replacing(path) as temporary, _about(path, temporary):
        shutil.copyfile(source, temporary)


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to the file `path`, whole or not at all. Raises OSError where that fails."""
    with replacing(path) as temporary, _about(path, temporary):
        temporary.write_bytes(data)
