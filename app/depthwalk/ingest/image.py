"""Picture files → arrays: textures, and the depth images of planar assets."""

import io
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.sources import read_bytes
from depthwalk.limits import MAX_TEXTURE_PIXELS, MAX_TEXTURE_SIDE

# Some of Pillow's other formats start programs (EPS) or reach for files of their own.
FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "TGA", "GIF", "PPM", "DDS")
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp", ".tga", ".gif", ".ppm", ".dds")

# Reading damaged files raises nearly anything; these are what Pillow itself documents and what its plugins let through.
_BROKEN = (OSError, ValueError, TypeError, SyntaxError, ArithmeticError, LookupError, EOFError, MemoryError)


@dataclass(frozen=True)
class PlanarImage:
    """A depth image over a rectangle: x right, y up, z toward the viewer, row 0 at the bottom (v upward).

    depth:  (H, W) float32, metres below the front plane z = 0 (positive is deeper); +inf where there is no surface.
    colour: (H, W, 3) uint8, sRGB.
    normal: (H, W, 3) float32, unit length, in the image's frame.
    size:   (width, height) of the rectangle in metres.
    """

    depth: NDArray[np.float32]
    colour: NDArray[np.uint8]
    normal: NDArray[np.float32]
    size: tuple[float, float]


def open_image(data: bytes, name: str) -> Image.Image:
    """The image with its header read and its size checked; no pixel is decoded yet.

    Raises InputError, `name: defect`, where it is unknown, damaged or too large.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's bomb warning: `check_size` is stricter
            image = Image.open(io.BytesIO(data), formats=FORMATS)
    except Image.DecompressionBombError:
        raise InputError(f"{name}: image has more pixels than can be used safely") from None
    except _BROKEN:
        raise InputError(f"{name}: cannot be read as an image") from None
    check_size(image, name)
    return image


def check_size(image: Image.Image, name: str) -> None:
    """Raise InputError where the image is larger than the limits allow."""
    width, height = image.size
    if max(width, height) > MAX_TEXTURE_SIDE or width * height > MAX_TEXTURE_PIXELS:
        raise InputError(f"{name}: image of {width} × {height} pixels is larger than {MAX_TEXTURE_SIDE} a side")


def rgba(image: Image.Image, name: str) -> NDArray[np.uint8]:
    """(H, W, 4) uint8, sRGB with alpha, row 0 at the top, from an image of any mode. Raises InputError."""
    check_size(image, name)
    if image.format is not None and image.format not in FORMATS:
        raise InputError(f"{name}: {image.format} images are not supported")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image.load()
            if image.mode.startswith("I") or image.mode == "F":  # Pillow would clip these at 255, not scale them
                image = Image.fromarray(_eight_bit(np.asarray(image)))
            return np.array(image.convert("RGBA"))
    except _BROKEN:
        raise InputError(f"{name}: image data is damaged or of an unsupported kind") from None


def load_texture(path: Path) -> NDArray[np.uint8]:
    """(H, W, 4) uint8, sRGB with alpha, row 0 at the top. Raises InputError."""
    return rgba(open_image(read_bytes(path), str(path)), str(path))


def _eight_bit(values: NDArray) -> NDArray[np.uint8]:
    """16-bit integers (Pillow widens them to 32) or floats 0–1 as 8 bits."""
    unit = np.nan_to_num(values) if values.dtype.kind == "f" else values / 65535.0
    return np.round(np.clip(unit, 0.0, 1.0) * 255.0).astype(np.uint8)


def load_depth_image(
    depth: Path,
    *,
    size: tuple[float, float],
    depth_range: float,
    colour: Path | None = None,
    normal: Path | None = None,
) -> PlanarImage:
    """A planar depth image from files whose row 0 is at the top, as everywhere on disk.

    depth:  grey image of 8 or 16 bits, white at the front plane, black `depth_range` metres below it, alpha 0 where
            there is no surface; or a float NPY of shape (H, W), metres below the plane, NaN or +inf where none is.
    size:   (width, height) in metres.
    colour: sRGB picture, light grey where None. normal: RGB normal map, x right, y up, z toward the viewer; where None
            the normals are central differences of the depth. Both are resampled to the depth's resolution.

    Raises InputError.
    """
    if not (np.isfinite([*size, depth_range]).all() and min(*size, depth_range) > 0):
        raise InputError(f"{depth}: size and range must be positive and finite")
    metres = _read_depth(depth, depth_range)[::-1].copy()
    shape = (metres.shape[1], metres.shape[0])
    if not np.isfinite(metres).any():
        raise InputError(f"{depth}: no pixel holds a depth")
    picture = np.full((*metres.shape, 3), 204, np.uint8) if colour is None else _resampled(colour, shape)
    if normal is None:
        directions = _normals_of(metres, (size[0] / shape[0], size[1] / shape[1]))
    else:
        directions = _decoded_normals(_resampled(normal, shape))
    return PlanarImage(metres, picture, directions, size)


def _read_depth(path: Path, depth_range: float) -> NDArray[np.float32]:
    metres = _read_npy(path) if path.suffix.lower() == ".npy" else _read_grey(path, depth_range)
    if min(metres.shape) < 2:
        raise InputError(f"{path}: a depth image needs at least 2 × 2 pixels")
    return metres


def _read_npy(path: Path) -> NDArray[np.float32]:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a lying header allocates nothing
    except _BROKEN:
        raise InputError(f"{path}: cannot be read as an NPY array") from None
    if values.ndim != 2 or values.dtype.kind != "f":
        raise InputError(f"{path}: depth must be floats of shape (H, W), not {values.dtype} of {values.shape}")
    if max(values.shape) > MAX_TEXTURE_SIDE:
        raise InputError(f"{path}: depth of {values.shape} is larger than {MAX_TEXTURE_SIDE} a side")
    metres = np.array(values, np.float32)
    if (metres < 0).any():
        raise InputError(f"{path}: {np.count_nonzero(metres < 0)} depths are negative (in front of the plane)")
    metres[np.isnan(metres)] = np.inf
    return metres


def _read_grey(path: Path, depth_range: float) -> NDArray[np.float32]:
    image = open_image(read_bytes(path), str(path))
    if image.mode not in ("1", "L", "LA", "I;16", "I;16B", "I;16L", "I"):
        raise InputError(f"{path}: a depth image must be grey, not {image.mode}")
    key = image.info.get("transparency")
    try:
        raw = np.asarray(image.convert("L") if image.mode == "1" else image)
    except _BROKEN:
        raise InputError(f"{path}: image data is damaged") from None
    grey = raw[..., 0] if raw.ndim == 3 else raw
    white = 255.0 if raw.dtype == np.uint8 else 65535.0
    metres = ((1.0 - grey / white) * depth_range).astype(np.float32)
    if raw.ndim == 3:
        metres[raw[..., 1] == 0] = np.inf
    elif isinstance(key, int):
        metres[grey == key] = np.inf
    return metres


def _resampled(path: Path, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 at `shape` = (W, H), row 0 at the bottom."""
    picture = Image.fromarray(np.ascontiguousarray(load_texture(path)[..., :3]))
    if picture.size != shape:
        picture = picture.resize(shape, Image.Resampling.BICUBIC)
    return np.array(picture)[::-1].copy()


def _decoded_normals(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    directions = picture.astype(np.float32) * np.float32(2 / 255) - 1
    directions[..., 2] = np.maximum(directions[..., 2], 1e-3)  # a depth image has no surface that faces away
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _normals_of(metres: NDArray[np.float32], cell: tuple[float, float]) -> NDArray[np.float32]:
    """Normals of the surface z = −depth: central differences, one-sided beside empty texels and at the border."""
    slopes = [_slope(metres.astype(np.float64), axis) / step for axis, step in ((1, cell[0]), (0, cell[1]))]
    directions = np.stack([*slopes, np.ones(metres.shape)], axis=-1)
    return (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).astype(np.float32)


def _slope(metres: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Depth per texel: the mean of the two one-sided differences that exist, 0 where none does."""
    finite = np.where(np.isfinite(metres), metres, np.nan)
    step = np.diff(finite, axis=axis)
    gap = np.full_like(np.take(step, [0], axis=axis), np.nan)
    sides = np.stack([np.concatenate([gap, step], axis=axis), np.concatenate([step, gap], axis=axis)])
    known = np.isfinite(sides)
    return np.where(known, sides, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
