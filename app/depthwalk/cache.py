"""Keep files that can be made again in the user's cache folder: found by key, checked when read, limited in size.

Baked models, cooked assets and simplified meshes are all kept by a `Cache`. A key is a hash of everything that the file
was made from, so that a file never becomes wrong; it only stops being asked for. A damaged file is no error: it is
named in a warning, removed and made again. Every kind of file carries checksums of its own: OpenEXR files of baked
models one over all pixels (`bake.file`), arrays the CRC-32 that a ZIP archive has of each member (`read_arrays`).
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

_DAMAGE = (InputError, ValueError, TypeError, LookupError, ArithmeticError)


def cache_folder() -> Path:
    """Return the folder, inside the user's cache folder, that holds all cached files; it need not exist."""
    return user_cache_path("depthwalk", appauthor=False) / "baked"


@dataclass(frozen=True, kw_only=True)
class Cache:
    """Find and keep files of one kind in the cache folder, one for each key.

    A key is a text of hex digits, a hash of everything that the file is made from.

    Attributes
    ----------
    suffix
        How the names of the files end, after the key.
    content
        What the files hold, in words for messages.
    """

    suffix: str
    content: str

    def file(self, key: str) -> Path:
        """Return the path at which the file of `key` is kept, whether or not it exists."""
        return cache_folder() / (key + self.suffix)

    def find(self, key: str, read: Callable[[Path], T]) -> T | None:
        """Read the file of a key, and count it as used now: `make_room` first removes what was not used for longest.

        Parameters
        ----------
        key
            The key under which `keep` stored the file.
        read
            Reads the file at the path that it is given.

        Returns
        -------
        T | None
            What `read` returns; None where there is no file, or it cannot be read or is damaged.
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
        with contextlib.suppress(OSError):  # removed meanwhile, or a cache that is read-only
            os.utime(path)  # its age is that of its last use
        return value

    def read(self, path: Path, read: Callable[[Path], T]) -> T:
        """Read one of the files.

        Parameters
        ----------
        path
            The file.
        read
            Reads the file at the path that it is given.

        Returns
        -------
        T
            What `read` returns.

        Raises
        ------
        OSError
            Where the file has vanished or cannot be read.
        DamagedFileError
            Where `read` raises InputError, ValueError, TypeError, LookupError or ArithmeticError. The file has then
            been named in a warning and removed.
        """
        path.open("rb").close()  # what cannot be opened is not damaged
        try:
            return read(path)
        except _DAMAGE as error:
            if not path.exists():  # removed by another process: readers may say so in their own way
                raise FileNotFoundError(f"{path}: no such file") from error
            reason = str(error).removeprefix(f"{path}: ").removeprefix(f"damaged {self.content}: ")
            log.warning("%s: damaged %s, to be made again (%s)", path, self.content, reason)
            with contextlib.suppress(OSError):  # whoever makes it again replaces it
                path.unlink(missing_ok=True)
            raise DamagedFileError(f"{path}: damaged: {reason}") from error

    def keep(self, key: str, write: Callable[[Path], object]) -> Path:
        """Write the file of a key, and remove the oldest files where the cache is full.

        Parameters
        ----------
        key
            The key under which `find` will find it.
        write
            Writes the file at the path that it is given, whole or not at all.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            Where the file cannot be written; and whatever else `write` raises.
        """
        path = self.file(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path)
        make_room(path)
        return path


@dataclass(frozen=True, kw_only=True)
class ArrayCache(Cache, Generic[T, Origin]):
    """Find and keep values of one kind, each derived from an origin such as a mesh, as `.npz` files.

    Attributes
    ----------
    arrays
        Returns the arrays of a value, by their names.
    parse
        Returns the value that such arrays hold, given its origin. Raises ValueError or KeyError where they hold none.
    compressed
        Whether the arrays are deflated.
    """

    arrays: Callable[[T], Arrays]
    parse: Callable[[Arrays, Origin], T]
    compressed: bool = False

    def find_value(self, origin: Origin, key: str) -> T | None:
        """Return the value of `key`, derived from `origin`; None where the cache holds none, or a damaged one."""
        return self.find(key, lambda path: self.parse(read_arrays(path), origin))

    def keep_value(self, value: T, key: str) -> Path:
        """Store a value under `key`, a hash of all that it depends on, and return its file.

        Raises OSError where it cannot be written.
        """
        return self.keep(key, lambda path: write_arrays(path, self.arrays(value), self.compressed))


class DamagedFileError(OSError):
    """Report that a cached file has changed since it was written, or holds what its reader cannot use."""


def forget(key: str) -> None:
    """Remove every cached file whose key is `key` or begins so, of whatever kind. Files that cannot be removed stay."""
    with contextlib.suppress(OSError):
        for path in cache_folder().iterdir():
            if path.name.startswith(key):
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)


def make_room(newest: Path | None = None) -> None:
    """Remove files until the cache is within `budget.cache_limit`.

    Leftovers of killed writers go first, then the files that were not used for longest.

    Parameters
    ----------
    newest
        The file just written, which stays however large it is; its folder is the cache. None: no file need stay.
    """
    folder = cache_folder() if newest is None else newest.parent
    remove_leftovers(folder)
    files: list[tuple[float, int, Path]] = []
    for path in folder.iterdir():  # files that are being written count, too
        with contextlib.suppress(OSError):  # another process may have removed it
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    excess = sum(size for _, size, _ in files) - cache_limit()
    for _, size, path in sorted(files):
        if excess <= 0:
            break
        if path != newest:
            with contextlib.suppress(OSError):  # it may be open, on systems where that forbids it
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
        When it was written or used last, seconds since 1970.
    """

    path: Path
    bytes: int
    used: float


def cached_files(suffix: str) -> list[CachedFile]:
    """Return the files in the cache folder whose names end in `suffix`, those that were not used for longest first.

    Files that are being written are not among them.
    """
    found: list[CachedFile] = []
    with contextlib.suppress(FileNotFoundError):
        for path in cache_folder().iterdir():
            if path.name.endswith(suffix) and not path.name.startswith("."):
                with contextlib.suppress(OSError):  # another process may have removed it
                    status = path.stat()
                    found.append(CachedFile(path=path, bytes=status.st_size, used=status.st_mtime))
    return sorted(found, key=lambda file: (file.used, file.path))


def write_arrays(path: Path, arrays: Mapping[str, Any], compressed: bool = False) -> None:
    """Write arrays to a `.npz` file, whole or not at all.

    Parameters
    ----------
    path
        The file to write or replace.
    arrays
        The arrays, of any shape and dtype, by the names under which `read_arrays` finds them.
    compressed
        Whether to deflate them, which takes longer and makes the file smaller.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        (np.savez_compressed if compressed else np.savez)(file, **arrays)


def read_arrays(
    path: Path, names: Iterable[str] | None = None, optional: Iterable[str] = ()
) -> dict[str, NDArray[Any]]:
    """Read arrays of a `.npz` file, each checked against its CRC-32 before it is parsed.

    `numpy.load` would not do: it parses bytes before they are checked, and checks members only if it reads all of them.

    Parameters
    ----------
    path
        The file.
    names
        Which arrays to read; None for all.
    optional
        Which arrays to read besides if the file has them.

    Returns
    -------
    dict
        The arrays by their names, with the shapes and dtypes that they were written with.

    Raises
    ------
    OSError
        Where the file cannot be read.
    ValueError
        Where it is damaged or lacks one of `names`.
    InputError
        Where the arrays take more memory than is allowed, see `check_memory`.
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
