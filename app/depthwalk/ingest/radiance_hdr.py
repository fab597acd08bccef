"""Read Radiance pictures (.hdr): three mantissas of 8 bits with a common exponent, flat or coded as runs.

Ward 1991, "Real Pixels", Graphics Gems II, describes the numbers; the file formats manual of Radiance describes the
header and the coding of scan lines. Exposure and colour correction in the header are ignored, as other programs do.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.image import check_sides
from depthwalk.ingest.rgbe_rows import CHANNELS, CODED, LONGEST_RUN, coded_rows, row_marker
from depthwalk.ingest.sources import read_bytes
from depthwalk.parallel import batches, thread_map

_MAGIC = (b"#?RADIANCE", b"#?RGBE")
_FORMAT = b"32-bit_rle_rgbe"
_MAX_HEADER = 1 << 16  # bytes
_EMPTY_LINE = re.compile(rb"\n\r?\n")  # some programs end lines as Windows does
_RESOLUTION = re.compile(rb"([-+])Y (\d{1,9}) ([-+])X (\d{1,9})")
_PIXEL_BYTES = 36  # per pixel while it is decoded: four bytes, three floats and as much again in between
_EXPONENT_OF_ONE = 128 + 8  # mantissas are whole numbers, so 256 stands for 1
_SCALES = np.ldexp(np.float32(1), np.arange(256) - _EXPONENT_OF_ONE).astype(np.float32)  # of mantissas, per exponent
_SCALES[0] = 0  # stands for black
_BAND_PIXELS = 1 << 16  # decoded at once: they stay in the cache of a core


def read_radiance(path: Path) -> NDArray[np.float32]:
    """Read a Radiance picture.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    numpy.ndarray
        (H, W, 3) float32, linear RGB, not negative; row 0 at the top.

    Raises
    ------
    InputError
        With the row where the file is damaged, or if it is too large or of an unsupported kind.
    """
    data = read_bytes(path)
    (height, width), is_upright, is_mirrored, start = _header(data, path)
    light = np.empty((height, width, 3), np.float32)
    rows = light if is_upright else light[::-1]
    rows = rows[:, ::-1] if is_mirrored else rows
    bands = batches(height, max(_BAND_PIXELS // width, 1))
    if (coded := coded_rows(data, start, height, width)) is not None:
        with thread_map() as parallel:
            list(parallel(lambda band: _decode(coded.decoded(band), rows[band]), bands))
        return light
    pixels = _read_rows(data, start, (height, width), path)
    for band in bands:
        _decode(pixels[band].transpose(0, 2, 1), rows[band])
    return light


def _decode(channels: NDArray[np.uint8], light: NDArray[np.float32]) -> None:
    """Compute the colours (H, W, 3) of rows from their mantissas and exponents (H, 4, W)."""
    scale = _SCALES[channels[:, 3]]
    for component in range(3):
        np.multiply(channels[:, component], scale, out=light[..., component])


def _header(data: bytes, path: Path) -> tuple[tuple[int, int], bool, bool, int]:
    """Return height and width, whether rows run downward, whether they run leftward, and where they begin."""
    if not data.startswith(_MAGIC):
        raise InputError(f"{path}: not a Radiance picture: it must begin with #?RADIANCE")
    end = _EMPTY_LINE.search(data, 0, _MAX_HEADER)
    if end is None:
        raise InputError(f"{path}: the header has no end within {_MAX_HEADER} bytes")
    formats = [line[7:].strip() for line in data[: end.start()].split(b"\n") if line.startswith(b"FORMAT=")]
    if any(found != _FORMAT for found in formats):
        raise InputError(f"{path}: pixels must be {_FORMAT.decode()}; XYZ colours are not supported")
    start = data.find(b"\n", end.end(), end.end() + 62) + 1
    found = _RESOLUTION.fullmatch(data[end.end() : max(start - 1, 0)].rstrip(b"\r"))
    if found is None:
        raise InputError(f"{path}: after the header must come the size, as in -Y 1024 +X 2048")
    height, width = int(found[2]), int(found[4])
    check_sides(path, width, height)
    runs = -(-width // LONGEST_RUN)
    if len(data) - start < height * (min(4 * width, 4 + 8 * runs) if width in CODED else 4 * width):
        raise InputError(f"{path}: ends before its {height} rows of {width} pixels do")
    check_memory(path, _PIXEL_BYTES * height * width, f"an image of {width} × {height} pixels")
    return (height, width), found[1] == b"-", found[3] == b"-", start


def _read_rows(data: bytes, place: int, size: tuple[int, int], path: Path) -> NDArray[np.uint8]:
    """Read rows one by one, coded or not, (H, W, 4). Raises InputError with the row where the file is damaged."""
    rows = np.empty((*size, CHANNELS), np.uint8)
    for number, row in enumerate(rows):
        try:
            place = _read_row(data, place, row)
        except ValueError as error:
            raise InputError(f"{path}: row {number} of {len(rows)}: {error}") from None
    return rows


def _read_row(data: bytes, place: int, row: NDArray[np.uint8]) -> int:
    """Decode the row at `place` into `row` (W, 4), and return the place after it; raise ValueError for damage."""
    width = len(row)
    if width in CODED and data[place : place + 4] == row_marker(width):
        place += 4
        for channel in range(CHANNELS):
            decoded, place = _read_runs(data, place, width)
            row[:, channel] = np.frombuffer(decoded, np.uint8)
        return place
    end = place + 4 * width
    if end > len(data):
        raise ValueError("the file ends within it")
    row[:] = np.frombuffer(data, np.uint8, 4 * width, place).reshape(-1, 4)
    if (row[:, :3] == 1).all(axis=1).any():  # the mantissas of a colour never are: the largest has its first bit set
        raise ValueError("runs are coded as before 1991, or the row is damaged; save the picture again")
    return end


def _read_runs(data: bytes, place: int, width: int) -> tuple[bytes, int]:
    """Decode one channel of a row: `width` bytes, and the place after them; raise ValueError where it is damaged."""
    pieces, missing, size = [], width, len(data)
    while missing > 0:
        if place + 1 >= size:
            raise ValueError("the file ends within it")
        count = data[place]
        if count > 128:
            count -= 128
            pieces.append(data[place + 1 : place + 2] * count)
            place += 2
        else:
            if count == 0 or place + 1 + count > size:
                raise ValueError("a run is empty" if count == 0 else "the file ends within it")
            pieces.append(data[place + 1 : place + 1 + count])
            place += 1 + count
        missing -= count
    if missing < 0:
        raise ValueError("a run is longer than the row")
    return b"".join(pieces), place
