"""Store files that can be recreated in the user's cache folder: found by key, checked when read, limited in size.

Baked models, cooked assets and simplified meshes are all stored by a `Cache`. A key is a hash of everything that the
file was made from, so a file never becomes wrong; it only stops being used. A damaged file is not an error: it is named
in a warning, removed and recreated. Every kind of file carries its own checksums: OpenEXR files of baked models one
over all pixels (`bake.file`), arrays the CRC-32 of each member of the ZIP archive (`array_file`).
"""

import contextlib
import logging
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from platformdirs import user_cache_path

from depthwalk.array_file import USUAL, Arrays, read_arrays, write_arrays
from depthwalk.budget import cache_limit
from depthwalk.errors import InputError
from depthwalk.files import remove_leftovers

log = logging.getLogger(__name__)

T = TypeVar("T")
Origin = TypeVar("Origin")

_DAMAGE = (InputError, ValueError, TypeError, LookupError, ArithmeticError)


def cache_folder() -> Path:
    """Return the folder, inside the user's cache folder, that holds all cached files; it need not exist."""
    return user_cache_path("depthwalk", appauthor=False) / "baked"


@dataclass(frozen=True, kw_only=True)
class Cache:
    """Find and store files of one kind in the cache folder, one for each key.

    A key is a string of hex digits, a hash of everything that the file is made from.

    Attributes
    ----------
    suffix
        Ending of the files' names, after the key.
    content
        What the files hold, for messages.
    """

    suffix: str
    content: str

    def file(self, key: str) -> Path:
        """Return the path of the file of `key`, whether or not it exists."""
        return cache_folder() / (key + self.suffix)

    def find(self, key: str, read: Callable[[Path], T]) -> T | None:
        """Read the file of a key, and mark it as just used: `make_room` removes the least recently used files first.

        Parameters
        ----------
        key
            The key under which `keep` stored the file.
        read
            Reads the file at the given path.

        Returns
        -------
        T | None
            The result of `read`; None if there is no file, or it cannot be read or is damaged.
        """
        path = self.file(key)
        if not path.is_file():
            return None
        try:
            value = self.read(path, read)
        except OSError as error:
            if not isinstance(error, DamagedFileError):
                log.warning("%s: cannot be read: %s", path, error.strerror or error)
            return None
        with contextlib.suppress(OSError):  # the file may have been removed, or the cache may be read-only
            os.utime(path)  # its age is the time since its last use
        return value

    def read(self, path: Path, read: Callable[[Path], T]) -> T:
        """Read one of the files.

        Parameters
        ----------
        path
            The file.
        read
            Reads the file at the given path.

        Returns
        -------
        T
            The result of `read`.

        Raises
        ------
        OSError
            If the file has vanished or cannot be read.
        DamagedFileError
            If `read` raises InputError, ValueError, TypeError, LookupError or ArithmeticError. The file has then been
            named in a warning and removed.
        """
        path.open("rb").close()  # a file that cannot be opened is not damaged
        try:
            return read(path)
        except _DAMAGE as error:
            if not path.exists():  # removed by another process, which readers may report in their own way
                raise FileNotFoundError(f"{path}: no such file") from error
            reason = str(error).removeprefix(f"{path}: ").removeprefix(f"damaged {self.content}: ")
            log.warning("%s: damaged %s, to be made again (%s)", path, self.content, reason)
            with contextlib.suppress(OSError):  # it is replaced when it is made again
                path.unlink(missing_ok=True)
            raise DamagedFileError(f"{path}: damaged: {reason}") from error

    def keep(self, key: str, write: Callable[[Path], object]) -> Path:
        """Write the file of a key, and remove the oldest files if the cache is full.

        Parameters
        ----------
        key
            The key under which `find` will find it.
        write
            Writes the file at the given path atomically.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            If the file cannot be written; and whatever else `write` raises.
        """
        path = self.file(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path)
        make_room(path)
        return path


@dataclass(frozen=True, kw_only=True)
class ArrayCache(Cache, Generic[T, Origin]):
    """Find and store values of one kind, each derived from an origin such as a mesh, as `.npz` files.

    Attributes
    ----------
    arrays
        Returns the arrays of a value, by their names.
    parse
        Returns the value in such arrays, given its origin. Raises ValueError or KeyError if they hold none.
    compressed
        Whether the arrays are deflated.
    """

    arrays: Callable[[T], Arrays]
    parse: Callable[[Arrays, Origin], T]
    compressed: bool = False

    def find_value(self, origin: Origin, key: str) -> T | None:
        """Return the value of `key`, derived from `origin`; None if the cache holds none, or a damaged one."""
        return self.find(key, lambda path: self.parse(read_arrays(path), origin))

    def keep_value(self, value: T, key: str) -> Path:
        """Store a value under `key`, a hash of everything that it depends on, and return its file.

        Raises OSError if it cannot be written.
        """
        return self.keep(key, lambda path: write_arrays(path, self.arrays(value), USUAL if self.compressed else 0))


class DamagedFileError(OSError):
    """Report that a cached file has changed since it was written, or holds data that its reader cannot use."""


def forget(key: str) -> None:
    """Remove every cached file whose key is or begins with `key`, of any kind. Files that cannot be removed stay."""
    with contextlib.suppress(OSError):
        for path in cache_folder().iterdir():
            if path.name.startswith(key):
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)


def make_room(newest: Path | None = None) -> None:
    """Remove files until the cache is within `budget.cache_limit`.

    Leftovers of killed writers are removed first, then the least recently used files.

    Parameters
    ----------
    newest
        The file just written, which is kept however large it is; its folder is the cache. None: no file must be kept.
    """
    folder = cache_folder() if newest is None else newest.parent
    remove_leftovers(folder)
    files: list[tuple[float, int, Path]] = []
    for path in folder.iterdir():  # files being written count, too
        with contextlib.suppress(OSError):  # another process may have removed it
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    excess = sum(size for _, size, _ in files) - cache_limit()
    for _, size, path in sorted(files):
        if excess <= 0:
            break
        if path != newest:
            with contextlib.suppress(OSError):  # some systems do not remove open files
                path.unlink(missing_ok=True)
                excess -= size


@dataclass(frozen=True, kw_only=True)
class CachedFile:
    """Describe a file of the cache.

    Attributes
    ----------
    path
        The file.
    bytes
        Its size.
    used
        When it was last written or used, seconds since 1970.
    """

    path: Path
    bytes: int
    used: float


def cached_files(suffix: str) -> list[CachedFile]:
    """Return the files in the cache folder whose names end in `suffix`, the least recently used first.

    Files that are being written are not included.
    """
    found: list[CachedFile] = []
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        for path in cache_folder().iterdir():
            if path.name.endswith(suffix) and not path.name.startswith("."):
                with contextlib.suppress(OSError):  # another process may have removed it
                    status = path.stat()
                    found.append(CachedFile(path=path, bytes=status.st_size, used=status.st_mtime))
    return sorted(found, key=lambda file: (file.used, file.path))
