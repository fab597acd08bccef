"""Pictures to files: PNG, OpenEXR and MP4. A file appears whole or not at all."""

import io
import os
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError

if TYPE_CHECKING:  # writing a file needs no GL
    from depthwalk.headless import LinearImage

_CRF = 18  # x264's quality; visually lossless


def check_folder(path: Path) -> None:
    """Makes sure that `path` can be written. Raises InputError."""
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {str(folder)!r} does not exist")
    if path.is_dir():
        raise InputError(f"{path}: is a folder")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: the folder {str(folder)!r} is not writable")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to; it takes the place of `path` at the end, or vanishes where an error is raised.

    The name ends like `path`: writers choose the format by it.
    """
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The PNG file of an sRGB picture (H, W, 3) or (H, W, 4), row 0 at the top."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, "PNG", compress_level=4)
    return stream.getvalue()


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a whole file. Raises OSError."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_exr(path: Path, image: "LinearImage") -> None:
    """R, G, B (linear), A and Z (metres along the view axis, +inf where nothing is), all float."""
    import OpenEXR

    channels = {name: np.ascontiguousarray(image.colour[..., c]) for c, name in enumerate("RGBA")}
    channels["Z"] = np.ascontiguousarray(image.distance)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with replacing(path) as temporary, OpenEXR.File(header, channels) as file:
        file.write(str(temporary))


@contextmanager
def video(path: Path, size: tuple[int, int], fps: float) -> Iterator[Generator[None, NDArray[np.uint8], None]]:
    """An MP4 (H.264) file at `path`, which takes frames (H, W, 3) uint8, sRGB, through `send`.

    size: (width, height), pixels; an odd side is scaled to the next even one, as the format demands.
    Raises OSError where the encoder fails.
    """
    import imageio_ffmpeg

    with replacing(path) as temporary:
        writer = imageio_ffmpeg.write_frames(
            str(temporary), size, fps=fps, macro_block_size=2, quality=None, output_params=["-crf", str(_CRF)]
        )
        writer.send(None)
        try:
            yield writer
        finally:
            writer.close()
        if not temporary.is_file() or not temporary.stat().st_size:
            raise OSError(f"{path}: the video encoder wrote nothing")
