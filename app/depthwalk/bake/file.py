"""Read and write `NAME.dpci.exr`: a baked model as one multi-part OpenEXR file that any EXR viewer opens.

Each object has one part per image (`side.0`, `top.1`, …) with channels R G B (half, linear), specular (half), Z (float,
metres), N.x N.y N.z (half), owner and cells.0 … cells.3 (uint; two grid levels each). Geometry and the source key
are in the header of every part. In a model that keeps its texture, images have a channel uv (uint; u in the low half,
v in the high half, see `DepthImage.coordinates`), and a part `texture` has channels R G B (half, linear). In one with
normal maps, images have channels M.x M.y M.z (half): the normals to light by, while N are those of the mesh. The
boundary strips of each face and level are two more parts, lists folded to 1024 columns. In a model of several objects,
a prefix names the object of a part: `part1.side.0`, `part2.side.0`.
EXR counts rows from the top and we count from the bottom; rows are flipped in `file_parts` and nowhere else.
"""

import contextlib
import io
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.file_layout import (
    ATTRIBUTE,
    FORMAT_VERSION,
    GEOMETRY,
    HAS_INTERIOR,
    KEEPS_NORMALS,
    LEFT_OUT,
    MAPPED_VERSION,
    MESH_TRIANGLES,
    PLACEMENT,
    REFLECTION,
    TELLS_ROUGHNESS,
    TEXTURED_VERSION,
    channel_type,
    split_name,
)
from depthwalk.bake.file_parts import Channels, object_from, object_parts
from depthwalk.bake.header import check_entries, complaints, first_line, inspect_header
from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.errors import InputError
from depthwalk.ingest.formats import BAKED_SUFFIX
from depthwalk.pictures import save_exr

SUFFIX = BAKED_SUFFIX
_CAPTURING = threading.Lock()  # if two threads redirected standard output at once, it would not be restored


def write_baked(path: Path, model: BakedModel) -> None:
    """Write a model to a file atomically: a reader sees the old file or the whole new one.

    Parameters
    ----------
    path
        The file; its folder is created if needed.
    model
        The model.

    Raises
    ------
    OSError
        If it cannot be written.
    InputError
        If there are more boundary strips than a file may hold.
    """
    import OpenEXR

    path.parent.mkdir(parents=True, exist_ok=True)
    contents = [object_parts(baked) for baked in model.parts]
    channels = [lists for named in contents for lists in named.values()]
    check_entries(path, sum(lists["used"].size for lists in channels if "used" in lists))
    version = TEXTURED_VERSION if any(baked.texture is not None for baked in model.parts) else FORMAT_VERSION
    if any(image.mapped_normal is not None for baked in model.parts for image in baked.images):
        version = MAPPED_VERSION
    common = {
        ATTRIBUTE + "version": version,
        ATTRIBUTE + "checksum": channel_checksum(channels),
        "displayWindow": _window(channels[0]),
    }
    if model.left_out is not None:
        common[ATTRIBUTE + LEFT_OUT] = float(np.float32(model.left_out))  # rounded as files store it
    parts = []
    for number, (baked, named) in enumerate(zip(model.parts, contents, strict=True), 1):
        prefix = f"part{number}." if len(contents) > 1 else ""
        header = _header(baked) | common
        parts += [OpenEXR.Part(header | {"dataWindow": _window(c)}, c, prefix + name) for name, c in named.items()]
    save_exr(path, OpenEXR.File(parts))


def read_baked(path: Path) -> BakedModel:
    """Read a model from a baked file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    BakedModel
        The model, with each of its arrays checked.

    Raises
    ------
    InputError
        If the file is missing, is not an OpenEXR file of depth images, has another version, is inconsistent or exceeds
        the limits.
    OSError, MemoryError
        If the machine lacks file handles or memory, or cannot read its disk; the file itself may be intact.
    """
    import OpenEXR

    headers = inspect_header(path)[1]
    damage = complaints(path, "damaged depth images")
    with damage, _captured_output(), OpenEXR.File(str(path), separate_channels=True) as file:
        stored = {part.name(): {k: channel.pixels for k, channel in part.channels.items()} for part in file.parts}
    try:
        _check_pixels(stored, headers[0].checksum)
        contents: list[dict[str, Channels]] = [{} for _ in headers]
        for full, channels in stored.items():
            number, name = split_name(full)
            contents[number][name] = channels
        return BakedModel(parts=tuple(map(object_from, contents, headers)), left_out=headers[0].left_out)
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: damaged depth images: {first_line(error)}") from error


@contextlib.contextmanager
def _captured_output() -> Iterator[None]:
    """Redirect OpenEXR's messages about undecodable pixels to standard error: standard output may be a picture.

    Raises MemoryError if there was such a message, since OpenEXR raises nothing and leaves the channels out.
    """
    printed = io.StringIO()
    try:
        with _CAPTURING, contextlib.redirect_stdout(printed):
            yield
    finally:
        if "MemoryError" in printed.getvalue() or "bad_alloc" in printed.getvalue():
            raise MemoryError("no memory for the pixels of depth images")
        print(printed.getvalue(), end="", file=sys.stderr)


def read_header(path: Path) -> dict[str, Any]:
    """Read and check the header of the baked file `path`, without its pixels; raises what `read_baked` raises.

    Returns the attributes of the file's first part, by name.
    """
    return inspect_header(path)[0]


def _check_pixels(stored: dict[str, Channels], checksum: str) -> None:
    """Raise ValueError if a channel has the wrong type or anything differs from what was written."""
    for name, channels in stored.items():
        wrong = [channel for channel, pixels in channels.items() if pixels.dtype != channel_type(channel)]
        if wrong:
            raise ValueError(f"part {name} has channels of another type: {', '.join(wrong)}")
    if channel_checksum(list(stored.values())) != checksum:
        raise ValueError("the pixels do not match their checksum")  # the library reads damaged ones silently


def _header(baked: BakedObject) -> dict[str, Any]:
    import OpenEXR

    values: dict[str, Any] = {name: np.float32(getattr(baked.cylinder, name)) for name in GEOMETRY}
    values |= {name: np.float32(v) for name, v in zip(PLACEMENT, (*baked.position, *baked.rotation), strict=True)}
    values |= {"steps": baked.steps, "key": baked.key}
    values["shininess"] = np.float32(baked.shininess)
    if baked.mesh_triangles is not None:
        values[MESH_TRIANGLES] = baked.mesh_triangles
    if baked.has_interior:
        values[HAS_INTERIOR] = 1
    if baked.keeps_normals:
        values[KEEPS_NORMALS] = 1
    if baked.reflection is not None:
        values |= {name: np.float32(value) for name, value in zip(REFLECTION, baked.reflection, strict=True)}
    if baked.tells_roughness:
        values[TELLS_ROUGHNESS] = 1
    header = {ATTRIBUTE + name: _attribute(value) for name, value in values.items()}
    return header | {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}


def _window(channels: Channels) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the corners of the pixels of a part. All parts of a file use those of the first as display window."""
    height, width = next(iter(channels.values())).shape
    return np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)


def _attribute(value: Any) -> Any:
    return float(value) if isinstance(value, np.floating) else value


def channel_checksum(parts: list[Channels]) -> str:
    """Return the CRC-32 in hex over all pixels, part by part, with channels sorted by name."""
    checksum = 0
    for channels in parts:
        for name in sorted(channels):
            checksum = zlib.crc32(np.ascontiguousarray(channels[name]).data, checksum)
    return f"{checksum:08x}"
