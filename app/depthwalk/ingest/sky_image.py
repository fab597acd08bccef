"""Read equirectangular pictures of all directions, which light a scene: Radiance, OpenEXR, and those of 8 bits."""

import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.colour import linear_from_srgb8
from depthwalk.errors import InputError
from depthwalk.ingest.exr import read_channels
from depthwalk.ingest.formats import check_sky_suffix
from depthwalk.ingest.image import check_sides, check_size, open_image, rgba
from depthwalk.ingest.radiance_hdr import read_radiance
from depthwalk.ingest.sources import read_bytes
from depthwalk.limits import MAX_SKY_WIDTH

log = logging.getLogger(__name__)

_MOST_LIGHT = 1e10  # of a pixel: some files hold cd/m², of which the sun has 2 · 10⁹; sums stay far below float32's end
# What infinity stands for: light beyond the end of half floats, as of the sun in many files. A pixel of `_MOST_LIGHT`
# would outshine all others.
_OVERFLOWN = 65504.0
_ROUNDING = 2  # pixels by which the width may miss twice the height, in pictures that were scaled
_PIXEL_BYTES = 32  # per pixel and while it is decoded, besides the channels of an OpenEXR file


def load_sky_image(path: Path) -> NDArray[np.float32]:
    """Read a picture of all directions as light.

    Parameters
    ----------
    path
        The file: .hdr, .exr with the channels R, G, B or Y, or a picture of 8 bits, which is decoded from sRGB.

    Returns
    -------
    numpy.ndarray
        (H, W, 3) float32, linear RGB, finite and not negative; row 0 is at the zenith, and W is twice H but for
        rounding. W is at most MAX_SKY_WIDTH: larger pictures are reduced, with a note in the log.

    Raises
    ------
    InputError
        If the file cannot be read, or is not twice as wide as high.
    """
    check_sky_suffix(path)
    match path.suffix.lower():
        case ".hdr":
            texels = read_radiance(path)
        case ".exr":
            texels = _read_exr(path)
        case _:
            image = open_image(read_bytes(path), str(path))
            check_size(image, str(path))
            _check_shape(path, image.width, image.height)
            _check_memory(path, image.width, image.height)
            texels = linear_from_srgb8(rgba(image, str(path))[..., :3])
    height, width = texels.shape[:2]
    _check_shape(path, width, height)
    np.nan_to_num(texels, copy=False, nan=0.0, posinf=_OVERFLOWN, neginf=0.0)  # in place: two copies would be 24 bytes
    np.clip(texels, 0, _MOST_LIGHT, out=texels)
    if width <= MAX_SKY_WIDTH:
        return texels
    log.warning("%s: reduced from %s to %s pixels across, the most that are drawn", path, width, MAX_SKY_WIDTH)
    return shrunk(texels, MAX_SKY_WIDTH, MAX_SKY_WIDTH // 2)


def shrunk(texels: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Reduce a picture (H, W, 3) to (`height`, `width`, 3), each texel the mean of those whose centres it covers."""
    from PIL import Image

    channels = [
        np.asarray(Image.fromarray(np.ascontiguousarray(texels[..., c])).resize((width, height), Image.Resampling.BOX))
        for c in range(3)
    ]
    return np.asarray(np.maximum(np.stack(channels, -1), 0))


def _check_shape(path: Path, width: int, height: int) -> None:
    if abs(width - 2 * height) > min(_ROUNDING, height - 1):
        raise InputError(
            f"{path}: a sky must be an equirectangular picture of all directions, twice as wide as high; "
            f"this one has {width} × {height} pixels"
        )


def _check_memory(path: Path, width: int, height: int, planes: int = 0) -> None:
    """Raise InputError where too little memory is left for a picture; planes: channels of floats besides."""
    needed = (_PIXEL_BYTES + 4 * planes) * width * height
    check_memory(path, needed, f"an image of {width} × {height} pixels")


def _read_exr(path: Path) -> NDArray[np.float32]:
    """Return the channels R, G and B, or Y, of the first part of an OpenEXR file, (H, W, 3)."""

    def check(width: int, height: int, planes: int) -> None:
        check_sides(path, width, height)
        _check_shape(path, width, height)
        _check_memory(path, width, height, planes)

    channels = read_channels(path, check)
    names = ("R", "G", "B") if channels.keys() >= set("RGB") else ("Y", "Y", "Y")
    if not all(name in channels and channels[name].ndim == 2 and channels[name].dtype.kind == "f" for name in names):
        raise InputError(f"{path}: no channels R, G, B of floats; it has {', '.join(sorted(channels)) or 'none'}")
    return np.stack([np.asarray(channels[name], np.float32) for name in names], -1)
