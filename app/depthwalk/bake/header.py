"""Read the header of a baked file, and validate it before any pixel is decoded."""

import math
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk import limits
from depthwalk.bake.file_layout import (
    ATTRIBUTE,
    FORMAT_VERSION,
    GEOMETRY,
    HAS_INTERIOR,
    KEEPS_NORMALS,
    LEFT_OUT,
    LISTS,
    MAPPED_NORMAL,
    MAPPED_VERSION,
    MESH_TRIANGLES,
    PLACEMENT,
    REFLECTION,
    TELLS_ROUGHNESS,
    TEXTURED_VERSION,
    channel_names,
    channel_type,
    is_list,
    is_part,
    is_texture,
    split_name,
)
from depthwalk.bake.grid import MAX_STEPS
from depthwalk.bake.images import Cylinder, checked_reflection, checked_triangles
from depthwalk.budget import check_memory
from depthwalk.errors import InputError, missing_file
from depthwalk.ingest.mesh import Reflection

_MOST_DEFLATED = 1032  # largest compression ratio of deflate, which bounds the pixels that a file can hold


@dataclass(frozen=True, kw_only=True)
class Header:
    """Hold what every part of an OpenEXR file states about its object.

    Attributes
    ----------
    cylinder
        The volume that the object's images enclose, object frame, metres.
    position, rotation
        The cylinder's place in the asset's frame, metres and a unit quaternion (x, y, z, w).
    shininess
        Phong exponent; 0 for surfaces that are shown without light.
    steps
        Number of grids, of steps 1, 2, … 2^(steps − 1) texels.
    key
        Hex digest of what the object was made from.
    checksum
        CRC-32 in hex over all pixels of the file.
    left_out
        See `BakedModel`; None if the file does not say.
    mesh_triangles
        See `BakedObject`; None if the file does not say.
    has_interior, keeps_normals, reflection, tells_roughness
        See `BakedObject`.
    """

    cylinder: Cylinder
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    shininess: float
    steps: int
    key: str
    checksum: str
    left_out: float | None = None
    mesh_triangles: int | None = None
    has_interior: bool = False
    keeps_normals: bool = False
    reflection: Reflection | None = None
    tells_roughness: bool = False


def inspect_header(path: Path) -> tuple[dict[str, Any], tuple[Header, ...]]:
    """Read and check a file's header without decoding any pixel.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple
        The attributes of the first part by name, and for each object the header that all its parts agree on.

    Raises
    ------
    InputError
        If the file is missing, is not an OpenEXR file of depth images, has another version, is inconsistent or exceeds
        the limits.
    OSError, MemoryError
        If the machine lacks file handles or memory, or cannot read its disk; the file itself may be intact.
    """
    import OpenEXR

    if not path.is_file():
        raise missing_file(path)
    with complaints(path, "not an OpenEXR file"), OpenEXR.File(str(path), header_only=True) as file:
        parts = [dict(part.header) for part in file.parts]
    if not parts or ATTRIBUTE + "version" not in parts[0]:
        raise InputError(f"{path}: an OpenEXR file, but not one of baked depth images")
    version = parts[0][ATTRIBUTE + "version"]
    if type(version) is not int or version not in (FORMAT_VERSION, TEXTURED_VERSION, MAPPED_VERSION):
        raise InputError(f"{path}: baked by another version of depthwalk; bake it again")
    try:
        headers = _headers(parts)
        textured, mapped = _textured(part["name"] for part in parts), _mapped(parts)
        sizes = {}
        for part in parts:
            number, _ = split_name(part["name"])
            sizes[part["name"]] = _size(part, headers[number].steps, number in textured, number in mapped)
        if len(sizes) < len(parts):
            raise ValueError("two parts have the same name")
        for number in range(len(headers)):
            _check_names({rest: size for name, size in sizes.items() for n, rest in [split_name(name)] if n == number})
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: damaged depth images: {first_line(error)}") from error
    _check_sizes(path, sizes, headers, textured, mapped)
    return parts[0], headers


@contextmanager
def complaints(path: Path, defect: str) -> Iterator[None]:
    """Turn errors of the OpenEXR binding in the `with` block into an InputError, unless the machine is at fault.

    The binding raises the same RuntimeError for a damaged file and for one that cannot be opened. So this opens the
    file once more, which raises the operating system's own error.

    Parameters
    ----------
    path
        The file that the block reads.
    defect
        What is wrong with the file, for the message.

    Raises
    ------
    InputError
        If the file is damaged, or the user may not read it.
    OSError, MemoryError
        If the machine lacks file handles or memory, or cannot read its disk.
    """
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as error:  # the binding raises RuntimeError and ValueError for the same causes
        try:
            path.open("rb").close()
        except PermissionError as denied:
            raise InputError(f"{path}: cannot be read: {denied.strerror}") from error
        raise InputError(f"{path}: {defect}: {first_line(error)}") from error


def _headers(parts: list[dict[str, Any]]) -> tuple[Header, ...]:
    """Return the header of each object; raises ValueError if its parts differ or an object is missing."""
    found: dict[int, Header] = {}
    for part in parts:
        header = _parsed(part)
        if found.setdefault(split_name(part["name"])[0], header) != header:
            raise ValueError("the headers of its parts differ")
    if sorted(found) != list(range(len(found))) or len(found) > limits.MAX_DPCI_PARTS:
        raise ValueError("objects are missing or too many")
    if len({name.startswith("part") for name in (part["name"] for part in parts)}) > 1:
        raise ValueError("parts of one object and of several")
    if len({(header.key, header.checksum) for header in found.values()}) > 1:
        raise ValueError("the headers of its objects differ")
    return tuple(found[number] for number in range(len(found)))


def _parsed(part: dict[str, Any]) -> Header:
    """Return the header of one part; raises ValueError if something is missing or out of range."""
    numbers = (*GEOMETRY, *PLACEMENT, "shininess")
    missing = [name for name in (*numbers, "steps", "key", "checksum") if ATTRIBUTE + name not in part]
    if missing:
        raise ValueError(f"header lacks {', '.join(missing)}")
    values = {name.removeprefix(ATTRIBUTE): value for name, value in part.items() if name.startswith(ATTRIBUTE)}
    cylinder = Cylinder(**{name: values[name] for name in GEOMETRY})
    x, y, z, *rotation = (values[name] for name in PLACEMENT)
    steps, key, checksum = values["steps"], values["key"], values["checksum"]
    for name in numbers:
        if type(values[name]) is not float or not math.isfinite(values[name]):
            shown = repr(values[name]) if isinstance(values[name], int | float | str) else type(values[name]).__name__
            raise ValueError(f"{name} is {shown:.40}, not a finite number")
    if not (min(cylinder.radius, cylinder.half_width, cylinder.half_depth) > 0 and cylinder.top > cylinder.bottom):
        raise ValueError("its cylinder has no volume")
    if values["shininess"] < 0 or abs(math.hypot(*rotation) - 1) > 1e-3:
        raise ValueError("its shininess is negative or its rotation not a unit quaternion")
    if type(steps) is not int or not 1 <= steps <= MAX_STEPS:
        raise ValueError(f"steps is {steps!r:.40}, not a number from 1 to {MAX_STEPS}")
    if not isinstance(key, str) or not re.fullmatch(r"[0-9A-Za-z]{0,64}", key):  # it may become a file name
        raise ValueError("key is not text of at most 64 letters and digits")
    if not isinstance(checksum, str):
        raise ValueError("checksum is not text")
    left_out = values.get(LEFT_OUT)
    if left_out is not None and not (type(left_out) is float and 0 <= left_out <= 1):
        raise ValueError(f"{LEFT_OUT} is {left_out!r:.40}, not a number from 0 to 1")
    return Header(
        cylinder=cylinder,
        position=(x, y, z),
        rotation=tuple(rotation),
        shininess=values["shininess"],
        steps=steps,
        key=key,
        checksum=checksum,
        left_out=left_out,
        mesh_triangles=checked_triangles(values.get(MESH_TRIANGLES)),
        has_interior=values.get(HAS_INTERIOR) == 1,
        keeps_normals=values.get(KEEPS_NORMALS) == 1,
        reflection=checked_reflection(*(values.get(name) for name in REFLECTION)),
        tells_roughness=values.get(TELLS_ROUGHNESS) == 1,
    )


def _size(part: dict[str, Any], steps: int, textured: bool, mapped: bool) -> tuple[int, int]:
    """Return width and height of a part; raises ValueError unless its layout is the one that `write_baked` uses."""
    import OpenEXR

    name = part["name"]
    if not is_part(name, steps):
        raise ValueError(f"unknown part {name!r:.40}")
    channels = sorted((channel.name, channel.xSampling, channel.ySampling) for channel in part["channels"])
    if channels != sorted((channel, 1, 1) for channel in channel_names(name, steps, textured, mapped)):
        raise ValueError(f"part {name} has other channels than it should")
    (left, top), (right, bottom) = (map(int, corner) for corner in part["dataWindow"])
    layout = (part["type"], part["compression"], left, top)
    if layout != (OpenEXR.scanlineimage, OpenEXR.ZIP_COMPRESSION, 0, 0) or min(right, bottom) < 0:
        raise ValueError(f"part {name} is laid out otherwise than it should be")
    return right + 1, bottom + 1


def _check_names(sizes: dict[str, tuple[int, int]]) -> None:
    """Raise ValueError unless layers count from 0, images have one size and each face's lists come in pairs."""
    images = [name for name in sizes if not is_list(name) and not is_texture(name)]
    faces = [name.split(".")[0] for name in images]
    if not images or set(images) != {f"{face}.{layer}" for face in faces for layer in range(faces.count(face))}:
        raise ValueError("layers are missing")
    if len({sizes[name] for name in images}) > 1:
        raise ValueError("its images differ in size")
    borders, triangles = ({n.removeprefix(kind) for n in sizes if n.startswith(kind)} for kind in LISTS)
    if borders != triangles or not {name.split(".")[1] for name in borders} <= set(faces):
        raise ValueError("a boundary strip without its triangles or its face")


def _textured(names: Iterable[str]) -> frozenset[int]:
    """Return the numbers of the objects that have a texture, from the `names` of all parts."""
    return frozenset(split_name(name)[0] for name in names if is_texture(name))


def _mapped(parts: Iterable[dict[str, Any]]) -> frozenset[int]:
    """Return the numbers of the objects with an image that has normals turned by normal maps; then all must have."""
    return frozenset(
        split_name(part["name"])[0]
        for part in parts
        if any(channel.name == MAPPED_NORMAL[0] for channel in part["channels"])
    )


def _check_sizes(
    path: Path,
    sizes: dict[str, tuple[int, int]],
    headers: tuple[Header, ...],
    textured: frozenset[int],
    mapped: frozenset[int],
) -> None:
    """Raise InputError if decoding would take more memory than any valid file needs, or than this one can fill.

    With a limit on the side, `is_part` limits all images of an object together: its faces with eight layers each.
    """
    side = max(max(size) for name, size in sizes.items() if not is_list(name))
    if side > limits.MAX_DPCI_RESOLUTION:
        raise InputError(f"{path}: image of {side} texels; at most {limits.MAX_DPCI_RESOLUTION} are allowed")
    check_entries(path, sum(width * height for name, (width, height) in sizes.items() if is_list(name)))

    def channels(name: str) -> tuple[str, ...]:
        number, _ = split_name(name)
        return channel_names(name, headers[number].steps, number in textured, number in mapped)

    decoded = sum(
        width * height * sum(np.dtype(channel_type(channel)).itemsize for channel in channels(name))
        for name, (width, height) in sizes.items()
    )
    if decoded > _MOST_DEFLATED * path.stat().st_size:
        raise InputError(f"{path}: damaged depth images: too short for its {decoded} bytes of pixels")
    check_memory(path, 3 * decoded, "its depth images")  # as stored, as used, and one copy in between


def check_entries(path: Path, entries: int) -> None:
    """Check the size of all boundary strips together, before they are written or read.

    Parameters
    ----------
    path
        The file, for the message.
    entries
        Number of vertices and triangles of all boundary strips in the file, including the padding of their lists.

    Raises
    ------
    InputError
        If there are more entries than `MAX_BOUNDARY_STRIP_ENTRIES`.
    """
    if entries > limits.MAX_BOUNDARY_STRIP_ENTRIES:
        raise InputError(
            f"{path}: boundary strips of {entries} entries; at most {limits.MAX_BOUNDARY_STRIP_ENTRIES} are allowed: "
            "bake at a lower resolution or with fewer layers"
        )


def first_line(error: Exception) -> str:
    """Return the first line of the message of `error`, or the name of its type if it has none."""
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
