"""Write files that are named by URLs: those of a shared file system, an object store, or whatever fsspec knows."""

import os
import re
import secrets
from contextlib import suppress
from typing import Any

from depthwalk.errors import InputError


def is_url(name: str) -> bool:
    """Return whether a name is a URL, `protocol://…`, rather than the name of a file on this machine."""
    return re.match(r"[A-Za-z][A-Za-z0-9+.:-]+://", name) is not None


def check_url(url: str) -> None:
    """Check that there is a driver for a URL, without a connection. Raises InputError where there is none."""
    _split(url)


def write_url(url: str, data: bytes) -> None:
    """Write a file that appears whole or not at all.

    It is written under a name of its own beside its place, and renamed: two workers that write the same file at a time
    do no harm, nor does one that is lost.

    Parameters
    ----------
    url
        The file to write or replace.
    data
        Its contents.

    Raises
    ------
    InputError
        Where there is no driver for the URL.
    OSError
        Where the file cannot be written.
    """
    files, path = _split(url)
    folder, _, name = path.rpartition("/")
    temporary = f"{folder}/.{os.getpid()}-{secrets.token_hex(6)}-{name}"
    try:
        files.pipe_file(temporary, data)
        files.mv(temporary, path)
    except BaseException:
        with suppress(Exception):  # what went wrong is told already
            files.rm_file(temporary)
        raise


def read_head(url: str, size: int) -> bytes:
    """Return the first `size` bytes of the file at `url`, fewer where it is shorter; none where it does not exist."""
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
        raise InputError(f"{url}: fsspec is not installed; pip install 'depthwalk[cluster]' brings it") from None
    try:
        files, path = url_to_fs(url)
    except (ValueError, ImportError) as error:
        raise InputError(f"{url}: {' '.join(str(error).split())[:200]}") from None
    return files, str(path)
