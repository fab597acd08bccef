"""Pictures as files: PNG, JPEG and OpenEXR."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.files import replacing

if TYPE_CHECKING:
    import OpenEXR


@dataclass(frozen=True)
class LinearImage:
    """A picture before its encoding for the screen, row 0 at the top.

    colour: (H, W, 4) float32, linear RGB, premultiplied, and alpha.
    distance: (H, W) float32, metres along the view axis, of the nearest in each pixel, +inf where nothing is.
    """

    colour: NDArray[np.float32]
    distance: NDArray[np.float32]


def save_exr(path: Path, file: "OpenEXR.File") -> None:
    """Writes a whole OpenEXR file. Raises OSError."""
    with replacing(path) as temporary:
        try:
            file.write(str(temporary))
        except RuntimeError as error:  # so the binding calls what the system refuses
            raise OSError(str(error).replace(str(temporary), str(path))) from None


def write_exr(path: Path, image: "LinearImage") -> None:
    """R, G, B (linear), A and Z (metres along the view axis, +inf where nothing is), all float. Raises OSError."""
    import OpenEXR

    channels = {name: np.ascontiguousarray(image.colour[..., c]) for c, name in enumerate("RGBA")}
    channels["Z"] = np.ascontiguousarray(image.distance)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    save_exr(path, OpenEXR.File(header, channels))


def _picture_bytes(pixels: NDArray[np.uint8], form: str, **options: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, form, **options)
    return stream.getvalue()


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The PNG file of an sRGB picture (H, W, 3) or (H, W, 4), row 0 at the top."""
    return _picture_bytes(pixels, "PNG", compress_level=4)


_QUALITY = 95  # of JPEG, in per cent


def jpeg_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The JPEG file of an sRGB picture (H, W, 3), row 0 at the top."""
    return _picture_bytes(pixels, "JPEG", quality=_QUALITY, subsampling="4:4:4")
