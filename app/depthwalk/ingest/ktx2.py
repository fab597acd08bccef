"""Decode KTX 2 pictures, compressed by Basis Universal, in a process that may take only what their sizes explain.

The library that does it, of the extra `depthwalk[gltf]`, takes the sizes in damaged files for what they are: changed
files of 4 kB had it allocate 2 GB and work for 5 s. A process can be ended.
"""

import struct
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.ingest.ktx2_worker import SIZE
from depthwalk.ingest.watched_process import framed, messages_in, run_watched
from depthwalk.limits import MAX_TEXTURE_PIXELS, MAX_TEXTURE_SIDE

_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
_SIDES = struct.Struct("<20xII")  # the beginning of a file, up to its width and height
# What decoding may take; pictures of 2048 × 2048 pixels take 8 bytes and 4 ns for each.
_BYTES, _BYTES_PER_PIXEL = 256 << 20, 16
_SECONDS, _SECONDS_PER_PIXEL = 5.0, 1e-6
_WORKER = "depthwalk.ingest.ktx2_worker"


def is_available() -> bool:
    """Return whether the library that decodes is installed."""
    return find_spec("opengl_basisu") is not None


def decode(files: Sequence[bytes], path: Path) -> list[NDArray[np.uint8] | None]:
    """Decode pictures, in a process for all of them.

    Parameters
    ----------
    files
        The contents of KTX 2 files, or of anything else.
    path
        The file that holds or names them, for messages.

    Returns
    -------
    list
        For each its pixels (height, width, 4) uint8, as they are stored, row 0 at the top; None if it is damaged, of
        another kind or too large, or takes more memory or time than its size explains.

    Raises
    ------
    InputError
        `path: …` if the machine has too little memory.
    """
    sizes = [_size(data) for data in files]
    sound = [data for data, size in zip(files, sizes, strict=True) if size != (0, 0)]
    answers = messages_in(_answer(sound, sum(width * height for width, height in sizes), path))
    return [None if size == (0, 0) else _pixels(next(answers, memoryview(b"")), size) for size in sizes]


def _answer(files: Sequence[bytes], pixels: int, path: Path) -> bytes:
    """Return what the process writes of files of so many pixels in all, which may end anywhere."""
    most_bytes, most_seconds = _BYTES + _BYTES_PER_PIXEL * pixels, _SECONDS + _SECONDS_PER_PIXEL * pixels
    check_memory(path, most_bytes, f"KTX 2 pictures of {pixels} pixels")
    if not files:
        return b""
    return run_watched(_WORKER, framed(files), most_bytes=most_bytes, most_seconds=most_seconds).data


def _pixels(picture: memoryview, size: tuple[int, int]) -> NDArray[np.uint8] | None:
    """Return the pixels (height, width, 4) in what the process writes of a file; None if it is not of its size."""
    width, height = size
    if picture[: SIZE.size] != SIZE.pack(width, height) or len(picture) != SIZE.size + 4 * width * height:
        return None
    return np.frombuffer(picture[SIZE.size :], np.uint8).reshape(height, width, 4)


def _size(data: bytes) -> tuple[int, int]:
    """Return the width and height of a KTX 2 file, pixels; zeros for another file, or a size that is not allowed."""
    if not data.startswith(_MAGIC) or len(data) < _SIDES.size:
        return 0, 0
    width, height = _SIDES.unpack_from(data)
    is_allowed = 0 < min(width, height) <= max(width, height) <= MAX_TEXTURE_SIDE
    return (width, height) if is_allowed and width * height <= MAX_TEXTURE_PIXELS else (0, 0)
