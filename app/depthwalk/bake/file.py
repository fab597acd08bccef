"""`NAME.dpci.exr`: a baked object as one multi-part OpenEXR file that any EXR viewer opens.

One part per image (`side.0`, `top.1`, …) with channels R G B (half, linear), specular (half), Z (float, metres),
N.x N.y N.z (half), owner and cells.0 … cells.3 (uint; two grid levels each). Geometry and the source key stand in the
header of every part. The borders of each face and level are two more parts, lists folded to 1024 columns.
EXR counts rows from the top; ours count from the bottom, so rows are flipped here and nowhere else.
"""

import math
import os
import re
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from depthwalk import limits
from depthwalk.bake.images import MAX_STEPS, BakedObject, Border, Cylinder, DepthImage, Face, grid_cells
from depthwalk.errors import InputError

SUFFIX = ".dpci.exr"
FORMAT_VERSION = 6
_ATTRIBUTE = "depthwalk."
_GEOMETRY = ("radius", "bottom", "top", "half_width", "half_depth")
_PLACEMENT = ("x", "y", "z", "qx", "qy", "qz", "qw")
_LISTS = ("border", "triangles")  # names of the parts that hold a border: border.side.0, triangles.side.0
_LIST_WIDTH = 1024
_CHANNELS = ("R", "G", "B", "specular", "Z", "N.x", "N.y", "N.z", "owner")
_LIST_CHANNELS = {"border": ("start", "du", "dv", "rise", "used"), "triangles": ("a", "b", "c", "used")}
_PART = re.compile(r"(?:(border|triangles)\.)?(top|side|bottom)\.([0-7])", re.ASCII)
_MOST_DEFLATED = 1032  # times: deflate cannot make anything smaller, so a larger claim is a lie

Channels = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class _Header:
    """What every part of a file says about the object."""

    cylinder: Cylinder
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    shininess: float
    steps: int
    key: str
    checksum: str


def write_baked(path: Path, baked: BakedObject) -> None:
    """Writes `baked` to `path` in one step: a reader sees the old file or the whole new one.

    Raises OSError where the folder cannot be written, InputError where the borders are more than a file may hold.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.exr")
    try:
        names = [image.name for image in baked.images]
        channels = [_channels(image) for image in baked.images]
        for border in baked.borders:
            samples = _samples(baked.images, border.face)
            for kind, lists in _border_lists(border, samples).items():
                names.append(f"{kind}.{border.face.name.lower()}.{border.level}")
                channels.append(lists)
        _check_entries(path, sum(lists["used"].size for lists in channels if "used" in lists))
        header = _header(baked) | {_ATTRIBUTE + "checksum": _checksum(channels), "displayWindow": _window(channels[0])}
        parts = [
            OpenEXR.Part(header | {"dataWindow": _window(c)}, c, name) for c, name in zip(channels, names, strict=True)
        ]
        OpenEXR.File(parts).write(str(temporary))
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def read_baked(path: Path) -> BakedObject:
    """The object stored at `path`.

    Raises InputError where the file is missing, not an EXR, not ours, of another version, inconsistent or larger than
    the limits.
    """
    _, header = _inspected(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            stored = {part.name(): {k: channel.pixels for k, channel in part.channels.items()} for part in file.parts}
    except Exception as error:  # the binding raises bare RuntimeError and ValueError alike
        raise InputError(f"{path}: damaged depth images: {_first_line(error)}") from error
    try:
        _check_pixels(stored, header)
        images = [_image(name, channels, header.steps) for name, channels in stored.items() if not _is_list(name)]
        _check_cells(images)
        borders = [
            _border(name, stored, _samples(images, Face[name.split(".")[1].upper()]))
            for name in stored
            if name.startswith(_LISTS[0])
        ]
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: damaged depth images: {_first_line(error)}") from error
    images.sort(key=lambda image: (image.face, image.layer))
    return BakedObject(
        header.cylinder,
        tuple(images),
        tuple(borders),
        shininess=header.shininess,
        steps=header.steps,
        key=header.key,
        position=header.position,
        rotation=header.rotation,
    )


def read_header(path: Path) -> dict[str, Any]:
    """The checked header of a baked file, without its pixels. Raises InputError as `read_baked` does."""
    return _inspected(path)[0]


def _inspected(path: Path) -> tuple[dict[str, Any], _Header]:
    """The header of the first part as it stands there, and what all parts agree on. Raises InputError."""
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            parts = [dict(part.header) for part in file.parts]
    except Exception as error:  # the binding raises bare RuntimeError and ValueError alike
        raise InputError(f"{path}: not an OpenEXR file: {_first_line(error)}") from error
    if not parts or _ATTRIBUTE + "version" not in parts[0]:
        raise InputError(f"{path}: an OpenEXR file, but not one of baked depth images")
    if parts[0][_ATTRIBUTE + "version"] is not FORMAT_VERSION:
        raise InputError(f"{path}: baked by another version of depthwalk; bake it again")
    try:
        header = _parsed(parts[0])
        if any(_parsed(part) != header for part in parts[1:]):
            raise ValueError("the headers of its parts differ")
        sizes = {part["name"]: _size(part, header.steps) for part in parts}
        if len(sizes) < len(parts):
            raise ValueError("two parts have the same name")
        _check_names(sizes)
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: damaged depth images: {_first_line(error)}") from error
    _check_sizes(path, sizes, header.steps)
    return parts[0], header


def _parsed(part: dict[str, Any]) -> _Header:
    """The header of one part. Raises ValueError where something lacks or is out of its range."""
    numbers = (*_GEOMETRY, *_PLACEMENT, "shininess")
    missing = [name for name in (*numbers, "steps", "key", "checksum") if _ATTRIBUTE + name not in part]
    if missing:
        raise ValueError(f"header lacks {', '.join(missing)}")
    values = {name.removeprefix(_ATTRIBUTE): value for name, value in part.items() if name.startswith(_ATTRIBUTE)}
    cylinder = Cylinder(*(values[name] for name in _GEOMETRY))
    x, y, z, *rotation = (values[name] for name in _PLACEMENT)
    steps, key, checksum = values["steps"], values["key"], values["checksum"]
    for name in numbers:
        if type(values[name]) is not float or not math.isfinite(values[name]):
            raise ValueError(f"{name} is {values[name]!r:.40}, not a finite number")
    if not (min(cylinder.radius, cylinder.half_width, cylinder.half_depth) > 0 and cylinder.top > cylinder.bottom):
        raise ValueError("its cylinder has no volume")
    if values["shininess"] < 0 or abs(math.hypot(*rotation) - 1) > 1e-3:
        raise ValueError("its shininess is negative or its rotation not a unit quaternion")
    if type(steps) is not int or not 1 <= steps <= MAX_STEPS:
        raise ValueError(f"steps is {steps!r:.40}, not a number from 1 to {MAX_STEPS}")
    if not isinstance(key, str) or not re.fullmatch(r"\w{0,64}", key, re.ASCII):  # it may become a file's name
        raise ValueError("key is not of up to 64 letters and digits")
    if not isinstance(checksum, str):
        raise ValueError("checksum is not text")
    return _Header(cylinder, (x, y, z), tuple(rotation), values["shininess"], steps, key, checksum)


def _size(part: dict[str, Any], steps: int) -> tuple[int, int]:
    """Width and height of a part of the layout that `write_baked` gives it. Raises ValueError for any other."""
    name = part["name"]
    match = _PART.fullmatch(name)
    if match is None or (match[1] and int(match[3]) >= steps):
        raise ValueError(f"unknown part {name!r:.40}")
    channels = sorted((channel.name, channel.xSampling, channel.ySampling) for channel in part["channels"])
    if channels != sorted((channel, 1, 1) for channel in _channel_names(name, steps)):
        raise ValueError(f"part {name} has other channels than it should")
    (left, top), (right, bottom) = (map(int, corner) for corner in part["dataWindow"])
    layout = (part["type"], part["compression"], left, top)
    if layout != (OpenEXR.scanlineimage, OpenEXR.ZIP_COMPRESSION, 0, 0) or min(right, bottom) < 0:
        raise ValueError(f"part {name} is laid out otherwise than it should be")
    return right + 1, bottom + 1


def _check_names(sizes: dict[str, tuple[int, int]]) -> None:
    """Raises ValueError unless layers count from 0, images are of one size and lists come in pairs for a face."""
    images = [name for name in sizes if not _is_list(name)]
    faces = [name.split(".")[0] for name in images]
    if not images or set(images) != {f"{face}.{layer}" for face in faces for layer in range(faces.count(face))}:
        raise ValueError("layers are missing")
    if len({sizes[name] for name in images}) > 1:
        raise ValueError("its images differ in size")
    borders, triangles = ({n.removeprefix(kind) for n in sizes if n.startswith(kind)} for kind in _LISTS)
    if borders != triangles or not {name.split(".")[1] for name in borders} <= set(faces):
        raise ValueError("a border without its triangles or its face")


def _check_sizes(path: Path, sizes: dict[str, tuple[int, int]], steps: int) -> None:
    """Raises InputError where decoding would take more memory than any file of ours, or than this one can fill.

    With a limit on the side, `_PART` limits all images together: three faces, eight layers.
    """
    side = max(max(size) for name, size in sizes.items() if not _is_list(name))
    if side > limits.MAX_DPCI_RESOLUTION:
        raise InputError(f"{path}: image of {side} texels; at most {limits.MAX_DPCI_RESOLUTION} are allowed")
    _check_entries(path, sum(width * height for name, (width, height) in sizes.items() if _is_list(name)))
    decoded = sum(
        width * height * sum(np.dtype(_channel_type(channel)).itemsize for channel in _channel_names(name, steps))
        for name, (width, height) in sizes.items()
    )
    if decoded > _MOST_DEFLATED * path.stat().st_size:
        raise InputError(f"{path}: damaged depth images: too short for its {decoded} bytes of pixels")


def _check_entries(path: Path, entries: int) -> None:
    if entries > limits.MAX_BORDER_ENTRIES:
        raise InputError(
            f"{path}: borders of {entries} entries; at most {limits.MAX_BORDER_ENTRIES} are allowed: "
            "bake at a lower resolution or with fewer layers"
        )


def _check_pixels(stored: dict[str, Channels], header: _Header) -> None:
    """Raises ValueError where a channel is of the wrong type or anything differs from what was written."""
    for name, channels in stored.items():
        wrong = [channel for channel, pixels in channels.items() if pixels.dtype != _channel_type(channel)]
        if wrong:
            raise ValueError(f"part {name} has channels of another type: {', '.join(wrong)}")
    if _checksum(list(stored.values())) != header.checksum:
        raise ValueError("the pixels do not match their checksum")  # the library reads damaged ones without a word


def _check_cells(images: list[DepthImage]) -> None:
    """Raises ValueError where a triangle has a corner on a layer that its face does not have."""
    for image in images:
        layers = sum(other.face is image.face for other in images)
        for codes in image.cells:
            for code in (codes & 127, codes >> 7):
                kept = code[code & 1 > 0]
                if np.maximum(kept >> 1 & 7, kept >> 4).max(initial=0) >= layers:
                    raise ValueError(f"part {image.name} has triangles on layers that are not there")


def _is_list(name: str) -> bool:
    return name.startswith(_LISTS)


def _channel_names(name: str, steps: int) -> tuple[str, ...]:
    """The channels of the part `name` in a file of `steps` grids."""
    if _is_list(name):
        return _LIST_CHANNELS[name.split(".")[0]]
    return (*_CHANNELS, *(f"cells.{pair}" for pair in range((steps + 1) // 2)))


def _channel_type(channel: str) -> type[np.generic]:
    if channel.startswith("cells.") or channel in ("owner", "start", "used", "a", "b", "c"):
        return np.uint32
    return np.float32 if channel == "Z" else np.float16


def _header(baked: BakedObject) -> dict[str, Any]:
    values: dict[str, Any] = {name: np.float32(getattr(baked.cylinder, name)) for name in _GEOMETRY}
    values |= {name: np.float32(v) for name, v in zip(_PLACEMENT, (*baked.position, *baked.rotation), strict=True)}
    values |= {"version": FORMAT_VERSION, "steps": baked.steps, "key": baked.key}
    values["shininess"] = np.float32(baked.shininess)
    header = {_ATTRIBUTE + name: _attribute(value) for name, value in values.items()}
    return header | {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}


def _window(channels: Channels) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Corners of the pixels of a part. All parts of a file share the first one's as their display window."""
    height, width = next(iter(channels.values())).shape
    return np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)


def _attribute(value: Any) -> Any:
    return float(value) if isinstance(value, np.floating) else value


def _channels(image: DepthImage) -> Channels:
    planes = [*np.moveaxis(image.albedo.astype(np.float16), -1, 0), image.depth]
    planes += [*np.moveaxis(image.normal.astype(np.float16), -1, 0), image.owner.astype(np.uint32)]
    named = dict(zip(_CHANNELS, planes, strict=True)) | _packed_cells(image)
    return {name: np.ascontiguousarray(plane[::-1]) for name, plane in named.items()}


def _checksum(parts: list[Channels]) -> str:
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


def _samples(images: Iterable[DepthImage], face: Face) -> int:
    """How many texels the images of one face have."""
    return sum(image.depth.size for image in images if image.face is face)


def _border_lists(border: Border, samples: int) -> dict[str, Channels]:
    """A border as two lists in the shape of images: its vertices and its triangles, as small numbers that compress.

    Starts and first corners are differences to the one before; second and third corners are counted from the first
    corner, or from the first border vertex that starts there.
    """
    if not len(border.triangles):
        return {}
    du, dv = border.offset.T
    vertices = {"start": np.diff(border.start, prepend=0), "du": du, "dv": dv, "rise": border.rise}
    first, *others = border.triangles.T
    triangles = {"a": np.diff(first, prepend=0)}
    for name, corner in zip("bc", others, strict=True):
        is_end = corner >= samples
        relative = np.where(is_end, corner - samples - np.searchsorted(border.start, first), corner - first)
        triangles[name] = (relative << 1 ^ relative >> 31) << 1 | is_end  # zigzag: small magnitudes, small codes
    return {_LISTS[0]: _folded(vertices), _LISTS[1]: _folded(triangles)}


def _border(name: str, stored: dict[str, Channels], samples: int) -> Border:
    face, level = name.split(".")[1:]
    vertices, triangles = ({k: v.ravel() for k, v in stored[f"{kind}.{face}.{level}"].items()} for kind in _LISTS)
    count, faces = _used(name, vertices["used"]), _used(name, triangles["used"])
    start = np.cumsum(vertices["start"][:count].astype(np.int64))
    first = np.cumsum(triangles["a"][:faces].astype(np.int64))
    corners = [first]
    for channel in "bc":
        code = triangles[channel][:faces].astype(np.int64)
        relative = (code >> 2) ^ -(code >> 1 & 1)
        corners.append(np.where(code & 1, samples + np.searchsorted(start, first) + relative, first + relative))
    every = np.stack(corners, -1)
    most = max(start.max(initial=0), first.max(initial=0))  # both are samples
    if not (most < samples and every.min(initial=0) >= 0 and every.max(initial=0) < samples + count):
        raise ValueError(f"part {name} points outside its face")
    if not all(np.isfinite(vertices[channel]).all() for channel in ("du", "dv", "rise")):
        raise ValueError(f"part {name} holds places that are not numbers")
    return Border(
        Face[face.upper()],
        int(level),
        start.astype(np.int32),
        np.stack([vertices["du"][:count], vertices["dv"][:count]], -1),
        vertices["rise"][:count],
        every.astype(np.int32),
    )


def _used(name: str, used: NDArray[np.uint32]) -> int:
    """How many entries a list has. Raises ValueError unless they are its first."""
    count = np.count_nonzero(used)
    if (used[:count] != 1).any():
        raise ValueError(f"part {name} marks its entries wrongly")
    return int(count)


def _folded(lists: Channels) -> Channels:
    """Lists (n,) as images of `_LIST_WIDTH` columns, integers as uint; channel `used` is 1 where there is an entry."""
    lists = lists | {"used": np.ones(len(next(iter(lists.values()))), np.uint32)}
    rows = -(-len(lists["used"]) // _LIST_WIDTH)
    padding = rows * _LIST_WIDTH - len(lists["used"])
    folded = {name: np.pad(values, (0, padding)).reshape(rows, _LIST_WIDTH) for name, values in lists.items()}
    return {k: v if v.dtype == np.float16 else v.astype(np.uint32) for k, v in folded.items()}


def _image(name: str, channels: dict[str, Any], steps: int) -> DepthImage:
    face_name, layer = name.split(".")
    face = Face[face_name.upper()]
    plane = {key: pixels[::-1] for key, pixels in channels.items()}
    depth = np.ascontiguousarray(plane["Z"], np.float32)
    if np.isnan(depth).any() or (depth < 0).any():
        raise ValueError(f"part {name} holds depths that are negative or not numbers")
    if (plane["owner"] >= len(Face)).any():
        raise ValueError(f"part {name} has texels that belong to no face")
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
