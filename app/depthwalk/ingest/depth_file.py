"""Read files with a depth per pixel and convert the depths to metres: grey pictures, TIFF, OpenEXR, NPY."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.exr import read_channels
from depthwalk.ingest.image import BROKEN, open_image
from depthwalk.ingest.npy import map_npy
from depthwalk.ingest.sources import read_bytes
from depthwalk.limits import MAX_COORDINATE, MAX_DEPTH_PIXELS, MAX_TEXTURE_SIDE

_GREY_MODES = ("1", "L", "LA", "I;16", "I;16B", "I;16L", "I", "F")
_PIXEL_BYTES = 120  # per pixel, measured; the same again per pixel in a block of rows at which normals are fitted
_BLOCK_ROWS = 256
_GREY_ALPHA_16 = b"\x10\x04"  # bits per channel and colour type in the header of a PNG

Raw = tuple[NDArray[Any], NDArray[np.bool_]]  # values (H, W) as stored, and which of them are valid


def read_depth(path: Path, *, depth_range: float | None, unit: float | None, camera: bool) -> NDArray[np.float32]:
    """Read the depths of an image, in metres.

    A pixel has no depth if its value is NaN or beyond 1000 km, or if it is transparent (PNG) or its alpha is 0 (PNG,
    EXR). If `unit` is given or `camera` is set, 0 also means no depth: depth cameras write it for "unknown".

    Parameters
    ----------
    path
        The file: NPY, OpenEXR, PNG or TIFF.
    depth_range
        Metres between white (depth 0) and black, for integers if `unit` is None; None if it is unknown.
    unit
        Metres per unit of the file; None: floats are metres.
    camera
        Whether depth is a distance from a camera, rather than below a plane.

    Returns
    -------
    numpy.ndarray
        (H, W) float32, metres, row 0 at the top; +inf where a pixel has no depth.

    Raises
    ------
    InputError
        If the file cannot be read, its numbers cannot be converted to metres, or no pixel has a depth.
    """
    values, valid = _read_raw(path)
    if min(values.shape) < 2:
        raise InputError(f"{path}: a depth image needs at least 2 × 2 pixels")
    if values.dtype.kind == "f":
        with np.errstate(over="ignore", invalid="ignore"):  # values beyond float32 are not depths either
            metres = values.astype(np.float32) * np.float32(unit or 1)
    elif unit is not None:
        metres = values * np.float32(unit)
    elif depth_range is not None and values.dtype.kind == "u":
        metres = (1 - values / np.iinfo(values.dtype).max) * depth_range
    else:
        needed = "'unit'" if camera else "'unit' or 'range'"
        raise InputError(f"{path}: whole numbers need {needed} to become metres")
    valid = valid & np.isfinite(metres) & (metres <= MAX_COORDINATE)  # Blender writes 1e10 for empty pixels
    if unit is not None or camera:
        valid &= metres != 0  # nor values that float32 rounds to it
    if negative := np.count_nonzero(metres[valid] < 0):
        raise InputError(f"{path}: {negative} depths are negative (in front of the {'camera' if camera else 'plane'})")
    if not valid.any():
        raise InputError(f"{path}: no pixel holds a depth")
    return np.where(valid, metres, np.inf).astype(np.float32)


def _read_raw(path: Path) -> Raw:
    match path.suffix.lower():
        case ".npy":
            return _read_npy(path)
        case ".exr":
            return _read_exr(path)
    return _read_picture(path)


def _read_npy(path: Path) -> Raw:
    values = map_npy(path)
    if values.ndim != 2 or values.dtype.kind not in "fu":
        raise InputError(
            f"{path}: depth must be floats or unsigned integers of shape (H, W), not {values.dtype} of {values.shape}"
        )
    _check_size(path, (values.shape[0], values.shape[1]))
    return np.array(values), np.ones(values.shape, bool)


def _read_exr(path: Path) -> Raw:
    """Return channel Z of the first part, or its only channel, and where its channel A, if any, is not 0."""
    channels = read_channels(path, lambda width, height, planes: _check_size(path, (height, width), planes))
    alpha = channels.pop("A", None)
    values = channels.get("Z", next(iter(channels.values())) if len(channels) == 1 else None)
    if values is None or values.ndim != 2:
        raise InputError(f"{path}: no channel Z; it has {', '.join(sorted(channels)) or 'none'}")
    return values, np.ones(values.shape, bool) if alpha is None else alpha > 0


def _read_picture(path: Path) -> Raw:
    data = read_bytes(path)
    image = open_image(data, str(path))
    if image.format == "PNG" and data[24:26] == _GREY_ALPHA_16:  # Pillow keeps 8 bits of it
        raise InputError(f"{path}: 16-bit grey with alpha is not supported; mark empty pixels otherwise")
    if image.mode not in _GREY_MODES:
        raise InputError(f"{path}: a depth image must be grey, not {image.mode}")
    _check_size(path, (image.height, image.width))
    key = image.info.get("transparency")
    try:
        raw = np.asarray(image.convert("L") if image.mode == "1" else image)
    except BROKEN:
        raise InputError(f"{path}: image data is damaged") from None
    if raw.ndim == 3:
        return raw[..., 0], raw[..., 1] > 0
    if raw.dtype.kind == "i":  # 16 bits, widened by Pillow
        raw = raw.clip(0, 65535).astype(np.uint16)
    return raw, raw != key if isinstance(key, int) else np.ones(raw.shape, bool)


def _check_size(path: Path, shape: tuple[int, int], planes: int = 1) -> None:
    """Raise InputError if an image of `shape` (H, W) takes too much time or memory. planes: channels in the file."""
    height, width = shape
    if max(shape) > MAX_TEXTURE_SIDE or width * height > MAX_DEPTH_PIXELS:
        most = f"{MAX_TEXTURE_SIDE} a side and {MAX_DEPTH_PIXELS} pixels are allowed"
        raise InputError(f"{path}: depth image of {width} × {height} pixels; at most {most}")
    check_memory(path, depth_bytes(height, width, planes), f"a depth image of {width} × {height} pixels")


def depth_bytes(height: int, width: int, planes: int) -> int:
    """Return how many bytes a depth image takes until its normals are fitted. planes: channels in the file."""
    return width * ((height + _BLOCK_ROWS) * _PIXEL_BYTES + 4 * height * planes)
