"""`NAME.dpci.exr`: a baked object as one multi-part OpenEXR file that any EXR viewer opens.

One part per image (`side.0`, `top.1`, …) with channels R G B (half, linear), specular (half), Z (float, metres),
N.x N.y N.z (half), owner and cells.0 … cells.3 (uint; two grid levels each). Geometry and the source key stand in the
header of every part.
EXR counts rows from the top; ours count from the bottom, so rows are flipped here and nowhere else.
"""

import os
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from depthwalk import limits
from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face, grid_cells
from depthwalk.errors import InputError

SUFFIX = ".dpci.exr"
FORMAT_VERSION = 2
_ATTRIBUTE = "depthwalk."
_GEOMETRY = ("radius", "bottom", "top", "half_width", "half_depth")
_PLACEMENT = ("x", "y", "z", "qx", "qy", "qz", "qw")
_CHANNELS = ("R", "G", "B", "specular", "Z", "N.x", "N.y", "N.z", "owner")


def write_baked(path: Path, baked: BakedObject) -> None:
    """Writes `baked` to `path` in one step: a reader sees the old file or the whole new one.

    Raises OSError where the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(suffix=".exr", prefix=".bake-", dir=path.parent)
    os.close(handle)
    try:
        channels = [_channels(image) for image in baked.images]
        header = _header(baked) | {_ATTRIBUTE + "checksum": _checksum(channels)}
        parts = [OpenEXR.Part(dict(header), c, image.name) for c, image in zip(channels, baked.images, strict=True)]
        OpenEXR.File(parts).write(temporary)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def read_baked(path: Path) -> BakedObject:
    """The object stored at `path`.

    Raises InputError where the file is missing, not an EXR, not ours, of another version or inconsistent.
    """
    header = read_header(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            stored = [(part.name(), {k: channel.pixels for k, channel in part.channels.items()}) for part in file.parts]
        if _checksum([channels for _, channels in stored]) != header[_ATTRIBUTE + "checksum"]:
            raise ValueError("the pixels do not match their checksum")  # the library reads damaged ones without a word
        images = [_image(name, channels, int(header[_ATTRIBUTE + "steps"])) for name, channels in stored]
    except (RuntimeError, KeyError, ValueError) as error:
        raise InputError(f"{path}: damaged depth images: {_first_line(error)}") from error
    images.sort(key=lambda image: (image.face, image.layer))
    cylinder = Cylinder(*(float(header[_ATTRIBUTE + name]) for name in _GEOMETRY))
    placement: Any = tuple(float(header[_ATTRIBUTE + name]) for name in _PLACEMENT)
    return BakedObject(
        cylinder,
        tuple(images),
        shininess=float(header[_ATTRIBUTE + "shininess"]),
        steps=int(header[_ATTRIBUTE + "steps"]),
        key=str(header[_ATTRIBUTE + "key"]),
        position=placement[:3],
        rotation=placement[3:],
    )


def read_header(path: Path) -> dict[str, Any]:
    """The checked header of a baked file, without its pixels. Raises InputError as `read_baked` does."""
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            headers = [dict(part.header) for part in file.parts]
    except Exception as error:  # the binding raises bare RuntimeError and ValueError alike
        raise InputError(f"{path}: not an OpenEXR file: {_first_line(error)}") from error
    header = headers[0]
    if header.get(_ATTRIBUTE + "version") is None:
        raise InputError(f"{path}: an OpenEXR file, but not one of baked depth images")
    if int(header[_ATTRIBUTE + "version"]) != FORMAT_VERSION:
        raise InputError(f"{path}: baked by another version of depthwalk; bake it again")
    for part in headers:
        low, high = part["dataWindow"]
        side = int(max(high[0] - low[0], high[1] - low[1])) + 1
        if side > limits.MAX_DPCI_RESOLUTION:
            raise InputError(f"{path}: image of {side} texels; at most {limits.MAX_DPCI_RESOLUTION} are allowed")
    missing = [
        n for n in (*_GEOMETRY, *_PLACEMENT, "shininess", "steps", "key", "checksum") if _ATTRIBUTE + n not in header
    ]
    if missing:
        raise InputError(f"{path}: damaged depth images: header lacks {', '.join(missing)}")
    return header


def _header(baked: BakedObject) -> dict[str, Any]:
    values: dict[str, Any] = {name: np.float32(getattr(baked.cylinder, name)) for name in _GEOMETRY}
    values |= {name: np.float32(v) for name, v in zip(_PLACEMENT, (*baked.position, *baked.rotation), strict=True)}
    values |= {"version": FORMAT_VERSION, "steps": baked.steps, "key": baked.key}
    values["shininess"] = np.float32(baked.shininess)
    header = {_ATTRIBUTE + name: _attribute(value) for name, value in values.items()}
    return header | {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}


def _attribute(value: Any) -> Any:
    return float(value) if isinstance(value, np.floating) else value


def _channels(image: DepthImage) -> dict[str, NDArray[Any]]:
    planes = [*np.moveaxis(image.albedo.astype(np.float16), -1, 0), image.depth]
    planes += [*np.moveaxis(image.normal.astype(np.float16), -1, 0), image.owner.astype(np.uint32)]
    named = dict(zip(_CHANNELS, planes, strict=True)) | _packed_cells(image)
    return {name: np.ascontiguousarray(plane[::-1]) for name, plane in named.items()}


def _checksum(parts: list[dict[str, NDArray[Any]]]) -> str:
    """CRC-32 in hex over all pixels, part by part, channels by name."""
    checksum = 0
    for channels in parts:
        for name in sorted(channels):
            checksum = zlib.crc32(np.ascontiguousarray(channels[name]).data, checksum)
    return f"{checksum:08x}"


def _packed_cells(image: DepthImage) -> dict[str, NDArray[np.uint32]]:
    """The cells at their lower left nodes: even levels in the low half of a channel, odd ones in the high half."""
    shape = (image.depth.shape[0], image.depth.shape[1])
    channels: dict[str, NDArray[np.uint32]] = {}
    for level, cells in enumerate(image.cells):
        channel = channels.setdefault(f"cells.{level // 2}", np.zeros(shape, np.uint32))
        i, j, _, _ = grid_cells(shape, image.face, 1 << level)
        channel[j, i] |= cells.astype(np.uint32) << 16 * (level % 2)
    return channels


def _unpacked_cells(face: Face, channels: dict[str, NDArray[np.uint32]], steps: int) -> tuple[NDArray[np.uint16], ...]:
    cells = []
    for level in range(steps):
        channel = channels[f"cells.{level // 2}"]
        i, j, _, _ = grid_cells((channel.shape[0], channel.shape[1]), face, 1 << level)
        cells.append((channel[j, i] >> 16 * (level % 2)).astype(np.uint16))
    return tuple(cells)


def _image(name: str, channels: dict[str, Any], steps: int) -> DepthImage:
    face_name, layer = name.split(".")
    face = Face[face_name.upper()]
    plane = {key: pixels[::-1] for key, pixels in channels.items()}
    depth = np.ascontiguousarray(plane["Z"], np.float32)
    if np.isnan(depth).any() or (depth < 0).any():
        raise ValueError(f"part {name} holds depths that are negative or not numbers")
    return DepthImage(
        face,
        int(layer),
        depth,
        normal=np.stack([plane[k] for k in ("N.x", "N.y", "N.z")], -1).astype(np.float32),
        albedo=np.stack([plane[k] for k in ("R", "G", "B", "specular")], -1).astype(np.float32),
        cells=_unpacked_cells(face, plane, steps),
        owner=np.ascontiguousarray(plane["owner"], np.uint8),
    )


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
