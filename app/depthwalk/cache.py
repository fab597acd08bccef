"""Store files that can be recreated in the user's cache folder: found by key, checked when read, limited in size.

Baked models, cooked assets and simplified meshes are all stored by a `Cache`. A key is a hash of everything that the
file was made from, so a file never becomes wrong; it only stops being used. A damaged file is not an error: it is named
in a warning, removed and recreated. Every kind of file carries its own checksums: OpenEXR files of baked models one
over all pixels (`bake.file`), arrays the CRC-32 of each member of the ZIP archive (`read_arrays`).
"""

import contextlib
import errno
import io
import logging
import math
import os
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from depthwalk.budget import cache_limit, check_memory
from depthwalk.errors import InputError
from depthwalk.files import remove_leftovers, replacing

log = logging.getLogger(__name__)

T = TypeVar("T")
Origin = TypeVar("Origin")
Arrays = dict[str, NDArray[Any]]

SMALLEST = 9  # of the levels at which zlib compresses: files a hundredth smaller than at `_USUAL`, in twice the time
_USUAL = 6
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
        return self.keep(key, lambda path: write_arrays(path, self.arrays(value), _USUAL if self.compressed else 0))


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
    with contextlib.suppress(FileNotFoundError):
        for path in cache_folder().iterdir():
            if path.name.endswith(suffix) and not path.name.startswith("."):
                with contextlib.suppress(OSError):  # another process may have removed it
                    status = path.stat()
                    found.append(CachedFile(path=path, bytes=status.st_size, used=status.st_mtime))
    return sorted(found, key=lambda file: (file.used, file.path))


def write_arrays(path: Path, arrays: Mapping[str, Any], compression: int = 0) -> None:
    """Write arrays to a `.npz` file atomically.

    Parameters
    ----------
    path
        The file to write or replace.
    arrays
        The arrays, of any shape and dtype, by the names under which `read_arrays` finds them.
    compression
        The level at which zlib deflates them, 1 to `SMALLEST`; 0 stores them as they are, which is quickest.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    method = zipfile.ZIP_DEFLATED if compression else zipfile.ZIP_STORED
    level = compression or None
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w", method, compresslevel=level) as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)


def read_arrays(
    path: Path, names: Iterable[str] | None = None, optional: Iterable[str] = ()
) -> dict[str, NDArray[Any]]:
    """Read arrays of a `.npz` file, each checked against its CRC-32 before it is parsed.

    `numpy.load` is unsuitable: it parses bytes before they are checked, and checks members only if it reads all of
    them.

    Parameters
    ----------
    path
        The file.
    names
        The arrays to read; None for all.
    optional
        Further arrays to read if the file has them.

    Returns
    -------
    dict
        The arrays by their names, with the shapes and dtypes that they were written with.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is damaged or lacks one of `names`.
    InputError
        If the arrays take more memory than is allowed, see `check_memory`.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):  # a named pipe would be waited for
        raise OSError(errno.ENXIO, "not a file", str(path))
    with path.open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                stored = [name.removesuffix(".npy") for name in archive.namelist()]
                wanted = stored if names is None else [*names, *(name for name in optional if name in stored)]
                sizes = [archive.getinfo(f"{name}.npy").file_size for name in wanted]
                # An array is there twice while it is parsed.
                check_memory(path, sum(sizes) + max(sizes, default=0), "its arrays")
                return {name: _parsed(archive.read(f"{name}.npy")) for name in wanted}
        except OSError as error:
            if error.errno != errno.EINVAL:  # which a damaged archive causes by places outside the file
                raise
            raise ValueError("it points outside of itself") from error
        except (MemoryError, InputError):
            raise
        except Exception as error:  # damaged archives and headers raise nearly anything, bare Exception included
            raise ValueError(" ".join(str(error).split())[:100] or type(error).__name__) from error


def check_array(name: str, values: NDArray[Any], shape: tuple[int, ...], kind: str | np.dtype[Any]) -> None:
    """Raise ValueError unless an array that was read has a shape, a kind of numbers, and finite ones.

    Parameters
    ----------
    name
        What the message calls it.
    values
        The array.
    shape
        The shape that it must have.
    kind
        The kind that its dtype must have, as NumPy names it, "f", "i" or "u"; or the dtype that it must be.
    """
    found = values.dtype.kind if isinstance(kind, str) else values.dtype
    if values.shape != shape or found != kind:
        raise ValueError(f"{name} are {values.dtype} of {values.shape}")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise ValueError(f"{name} hold what is no finite number")


def _parsed(data: bytes) -> NDArray[Any]:
    """Return the array that the bytes of a `.npy` file hold. Raises ValueError where they are no array or too few."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read_header(stream)
    if math.prod(shape) * dtype.itemsize > len(data):  # NumPy allocates before it looks
        raise ValueError(f"an array of shape {shape} in {len(data)} bytes")
    return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
