"""Write files named by URLs: on a shared file system, in an object store, or wherever fsspec has a driver."""

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from depthwalk.errors import InputError
from depthwalk.extras import install_command


def is_url(name: str) -> bool:
    """Return whether a name is a URL, `protocol://…`, rather than the name of a file on this machine."""
    return re.match(r"[A-Za-z][A-Za-z0-9+.:-]+://", name) is not None


def check_url(url: str) -> None:
    """Check that there is a driver for a URL, without connecting. Raises InputError if there is none."""
    _split(url)


def write_url(url: str, data: bytes) -> None:
    """Write a file atomically.

    It is written under a unique name in the same folder, and renamed: two workers that write the same file at the same
    time do no harm, nor does one that is lost.

    Parameters
    ----------
    url
        The file to write or replace.
    data
        Its contents.

    Raises
    ------
    InputError
        If there is no driver for the URL, its folder does not exist, or writing there is not permitted.
    OSError
        If the file cannot be written for another reason.
    """
    with _replacing(url) as (files, temporary):
        files.pipe_file(temporary, data)


def send_file(file: Path, url: str) -> None:
    """Copy the file `file` of this machine to `url` atomically; see `write_url`."""
    with _replacing(url) as (files, temporary):
        files.put_file(str(file), temporary)


@contextmanager
def _replacing(url: str) -> Iterator[tuple[Any, str]]:
    """Provide a file system and a name in it to write to; the new file replaces `url` at the end."""
    files, path = _split(url)
    folder, _, name = path.rpartition("/")
    temporary = f"{folder}/.{os.getpid()}-{secrets.token_hex(6)}-{name}"
    try:
        yield files, temporary
        files.mv(temporary, path)
    except BaseException as error:
        with suppress(Exception):  # the original error has been raised already
            files.rm_file(temporary)
        if not isinstance(error, Exception):
            raise
        reason = f"{url}: cannot be written: {_reason(error)}"
        # Errors that no later attempt can overcome must be resolved by the user.
        kind = InputError if isinstance(error, FileNotFoundError | NotADirectoryError | PermissionError) else OSError
        raise kind(reason) from error


def _reason(error: Exception) -> str:
    text = (error.strerror if isinstance(error, OSError) else "") or str(error) or type(error).__name__
    return " ".join(text.split())[:200]


def fetch_file(url: str, file: Path) -> bool:
    """Copy the file at `url` to the file `file` of this machine.

    Parameters
    ----------
    url
        The file to copy.
    file
        The destination; an existing file is replaced.

    Returns
    -------
    bool
        Whether there is a file at `url`.

    Raises
    ------
    InputError
        If there is no driver for the URL, or reading there is not permitted.
    OSError
        If the file cannot be copied for another reason.
    """
    files, path = _split(url)
    try:
        if not files.isfile(path):
            return False
        files.get_file(path, str(file))
    except FileNotFoundError:  # removed meanwhile
        return False
    except Exception as error:
        kind = InputError if isinstance(error, PermissionError) else OSError
        raise kind(f"{url}: cannot be read: {_reason(error)}") from error
    return True


def read_head(url: str, size: int) -> bytes:
    """Return the first `size` bytes of the file at `url`, fewer if it is shorter; none if it does not exist."""
    files, path = _split(url)
    try:
        data: bytes = files.cat_file(path, start=0, end=size)
    except FileNotFoundError:
        return b""
    return data


def _split(url: str) -> tuple[Any, str]:
    """Return fsspec's file system of a URL, and the path in it."""
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise InputError(f"{url}: fsspec is not installed; `{install_command('cluster')}` brings it") from None
    try:
        files, path = url_to_fs(url)
    except (ValueError, ImportError) as error:
        raise InputError(f"{url}: {' '.join(str(error).split())[:200]}") from None
    return files, str(path)
