"""Files that appear whole or not at all; pictures as PNG, JPEG, OpenEXR and MP4."""

import errno
import io
import logging
import os
import tempfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError

if TYPE_CHECKING:  # writing a file needs no GL, and most commands write no OpenEXR
    import OpenEXR

    from depthwalk.headless import LinearImage

log = logging.getLogger(__name__)

_QUALITY = 95  # of JPEG, in per cent
_CRF = 18  # x264's quality; visually lossless


def check_folder(path: Path) -> None:
    """Makes sure that `path` can be written, by a try: what a system forbids shows nowhere else. Raises InputError."""
    folder = path.parent
    try:
        if not folder.is_dir():
            raise InputError(f"{path}: the folder {str(folder)!r} does not exist")
        if path.is_dir():
            raise InputError(f"{path}: is a folder")
        with suppress(FileNotFoundError):
            os.lstat(_temporary(path))  # fails for names that no file can have
        tempfile.TemporaryFile(dir=folder).close()  # without a name: nothing stays where somebody interrupts
    except ValueError:  # a null character
        raise InputError(f"{path}: no file can have that name") from None
    except OSError as error:
        named = error.errno == errno.ENAMETOOLONG
        why = "the name is too long" if named else f"the folder {str(folder)!r} is not writable"
        raise InputError(f"{path}: {why}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to; it takes the place of `path` at the end, or vanishes where an error is raised.

    The name ends like `path`: writers choose the format by it.
    """
    temporary = _temporary(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):  # what went wrong is told already
            temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    return path.with_name(f".{os.getpid()}-{path.name}")


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The PNG file of an sRGB picture (H, W, 3) or (H, W, 4), row 0 at the top."""
    return _picture_bytes(pixels, "PNG", compress_level=4)


def jpeg_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The JPEG file of an sRGB picture (H, W, 3), row 0 at the top."""
    return _picture_bytes(pixels, "JPEG", quality=_QUALITY, subsampling="4:4:4")


def _picture_bytes(pixels: NDArray[np.uint8], form: str, **options: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, form, **options)
    return stream.getvalue()


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a whole file. Raises OSError."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_exr(path: Path, image: "LinearImage") -> None:
    """R, G, B (linear), A and Z (metres along the view axis, +inf where nothing is), all float. Raises OSError."""
    import OpenEXR

    channels = {name: np.ascontiguousarray(image.colour[..., c]) for c, name in enumerate("RGBA")}
    channels["Z"] = np.ascontiguousarray(image.distance)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    save_exr(path, OpenEXR.File(header, channels))


def save_exr(path: Path, file: "OpenEXR.File") -> None:
    """Writes a whole OpenEXR file. Raises OSError."""
    with replacing(path) as temporary:
        try:
            file.write(str(temporary))
        except RuntimeError as error:  # so the binding calls what the system refuses
            raise OSError(str(error)) from None


@contextmanager
def video(path: Path, size: tuple[int, int], fps: float) -> Iterator[Generator[None, NDArray[np.uint8], None]]:
    """An MP4 (H.264) file at `path`, which takes frames (H, W, 3) uint8, sRGB, through `send`.

    size: (width, height), pixels; an odd side is scaled to the next even one, as the format demands, with a warning.
    Raises OSError where the encoder fails.
    """
    import imageio_ffmpeg

    width, height = (side + side % 2 for side in size)
    if (width, height) != size:
        log.warning("%s: the sides of a video are even; scaled to %d,%d", path, width, height)
    filters = ["-vf", f"scale={width}:{height}", "-crf", str(_CRF)]
    with replacing(path) as temporary:
        writer = imageio_ffmpeg.write_frames(
            str(temporary), size, fps=fps, macro_block_size=1, quality=None, output_params=filters
        )
        writer.send(None)
        try:
            yield writer
        finally:
            writer.close()
        if not temporary.is_file() or not temporary.stat().st_size:
            raise OSError(f"{path}: the video encoder wrote nothing")
