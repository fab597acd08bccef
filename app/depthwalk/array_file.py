"""Write arrays to `.npz` files, and read them back only if each is whole: CRC-32, shape, kind of numbers, memory."""

import errno
import math
import re
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.files import replacing

Arrays = dict[str, NDArray[Any]]
"""Arrays of any shape and dtype, by name."""

# Magic bytes, version, length and dictionary of the header of an array of numbers or texts, as NumPy writes it.
_HEADER = re.compile(
    rb"\x93NUMPY(?:\x01\x00..|\x02\x00....)"
    rb"\{'descr': '(?P<dtype>[<>|][biufU]\d{1,9})', 'fortran_order': (?P<fortran>True|False), "
    rb"'shape': \((?P<shape>|\d{1,18},|\d{1,18}(?:, \d{1,18})+)\), \} *\n",
    re.DOTALL,
)

# Levels at which zlib compresses. Files of the second are a hundredth smaller, and take twice the time to write.
USUAL, SMALLEST = 6, 9


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


def read_arrays(path: Path, names: Iterable[str] | None = None, optional: Iterable[str] = ()) -> Arrays:
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
    """Return the array that the bytes of a `.npy` file hold. Raises ValueError where they are no array or too few.

    NumPy parses headers as Python, which CPython 3.11 cannot always do in two threads at a time.
    """
    header = _HEADER.match(data)
    if header is None:
        raise ValueError("an array has no header")
    dtype = np.dtype(header["dtype"].decode())
    shape = tuple(int(length) for length in header["shape"].replace(b",", b" ").split())
    count, first = math.prod(shape), header.end()
    if len(data) != first + count * dtype.itemsize:
        raise ValueError(f"an array of shape {shape} in {len(data) - first} bytes")
    values = np.frombuffer(data, dtype, count, first)
    return values.reshape(shape, order="F" if header["fortran"] == b"True" else "C").copy(order="K")
