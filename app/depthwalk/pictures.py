"""Write pictures to files: PNG, JPEG and WebP for screens, OpenEXR for linear light and depth.

OpenEXR and Pillow are imported when a picture is written, since most commands write none and should start fast.
"""

import errno
import io
import os
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.files import replacing
from depthwalk.types import Picture

if TYPE_CHECKING:
    import OpenEXR

_JPEG_QUALITY = 95  # per cent
_WEBP_QUALITY = 95  # per cent
_PNG_EFFORT = 4  # zlib's level, 0 to 9
_KEY = "depthwalk.key"  # the name of a picture's key: of a PNG text, an EXR attribute, and in a JPEG comment
_STORED_KEY = re.compile(rb"depthwalk\.key\0(?:string\0@\0\0\0)?([0-9a-f]{64})")

KEY_BYTES = 4096
"""Bytes at the beginning of a picture's file that contain its key, which PNG, JPEG and EXR store in their headers."""


@dataclass(frozen=True)
class LinearImage:
    """Hold a picture before its encoding for the screen, row 0 at the top.

    Attributes
    ----------
    colour
        (H, W, 4) float32: linear RGB, premultiplied, and alpha.
    distance
        (H, W) float32: metres along the view axis of the nearest surface in each pixel, +inf where there is none.
    """

    colour: NDArray[np.float32]
    distance: NDArray[np.float32]


def save_exr(path: Path, file: "OpenEXR.File") -> None:
    """Write `file`, an OpenEXR file in memory, to `path` atomically. Raises OSError if that fails."""
    with replacing(path) as temporary:
        try:
            file.write(str(temporary))
        except RuntimeError as error:  # raised by the binding for errors of the operating system
            raise _system_error(str(error).replace(str(temporary), str(path)), path) from None
        if not _is_whole(temporary.read_bytes()):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def _system_error(message: str, path: Path) -> OSError:
    """Return the error of the operating system that the `message` of OpenEXR about the file `path` quotes."""
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG):
        if os.strerror(number) in message:
            return OSError(number, os.strerror(number), str(path))
    return OSError(message)


_MULTI_PART = 0x1000  # in the second word of a file


def _is_whole(data: bytes) -> bool:
    """Return whether a just written OpenEXR file of scan lines ends where its last chunk does.

    The library writes the last kilobytes and the table of chunks when it closes the file, and ignores errors of the
    system then: on a full disk they are missing. See *OpenEXR File Layout*: header, table of offsets, chunks.
    """
    try:
        (version,) = struct.unpack_from("<I", data, 4)
        place, is_multi = 8, bool(version & _MULTI_PART)
        while data[place]:  # a header; in files of several parts another follows, the last one empty
            while data[place]:
                value = data.index(0, data.index(0, place) + 1) + 5  # behind name, type and size
                place = value + struct.unpack_from("<I", data, value - 4)[0]
            place += 1
            if not is_multi:
                break
        place += is_multi
        (first,) = struct.unpack_from("<Q", data, place)  # the first chunk follows the table
        offsets = np.frombuffer(data, "<u8", (first - place) // 8, place)
        size = int(offsets.max()) + (8 if is_multi else 4)  # after the numbers of part and line
        return bool(offsets.min() > 0) and size + 4 + struct.unpack_from("<I", data, size)[0] == len(data)
    except (IndexError, ValueError, struct.error):
        return False


def write_exr(path: Path, image: LinearImage, key: str = "") -> None:
    """Write a picture as OpenEXR with float32 channels R, G, B (linear), A and Z (metres, +inf for none).

    Parameters
    ----------
    path
        The file to write or replace.
    image
        The picture.
    key
        Key of the picture, for `stored_key`: 64 hex digits; "" for none.

    Raises
    ------
    OSError
        If that fails; `path` is then unchanged.
    """
    import OpenEXR

    channels = {name: np.ascontiguousarray(image.colour[..., c]) for c, name in enumerate("RGBA")}
    channels["Z"] = np.ascontiguousarray(image.distance)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | ({_KEY: key} if key else {})
    save_exr(path, OpenEXR.File(header, channels))


def png_bytes(pixels: Picture, key: str = "") -> bytes:
    """Return the bytes of a PNG file of `pixels`, (H, W, 3) or (H, W, 4) uint8 sRGB, row 0 at the top.

    `key`, 64 hex digits, names the picture for `stored_key`; "" stores none.
    """
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    if key:
        info.add_text(_KEY, key)
    return _encoded(pixels, "PNG", compress_level=_PNG_EFFORT, pnginfo=info)


def jpeg_bytes(pixels: Picture, key: str = "") -> bytes:
    """Return the bytes of a JPEG file of `pixels`, (H, W, 3) uint8 sRGB, row 0 at the top; `key` as in `png_bytes`."""
    comment = {"comment": f"{_KEY}\0{key}".encode()} if key else {}
    return _encoded(pixels, "JPEG", quality=_JPEG_QUALITY, subsampling="4:4:4", **comment)


def webp_bytes(pixels: Picture) -> bytes:
    """Return the bytes of a WebP file of `pixels`, (H, W, 3) or (H, W, 4) uint8 sRGB, row 0 at the top."""
    return _encoded(pixels, "WEBP", quality=_WEBP_QUALITY)


def stored_key(head: bytes) -> str:
    """Return the key in the first `KEY_BYTES` bytes of a picture's file, PNG, JPEG or EXR; "" if it has none."""
    found = _STORED_KEY.search(head)
    return found[1].decode() if found else ""


def _encoded(pixels: Picture, format_: str, **options: Any) -> bytes:
    """Return a picture as a file encoded by Pillow."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, format_, **options)
    return stream.getvalue()
