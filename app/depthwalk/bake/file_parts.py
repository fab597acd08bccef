"""Convert a baked object to the parts of an OpenEXR file, laid out as `bake.file` describes, and back.

A part is a set of named channels, each an image (H, W). Depth images keep their shape; lists are folded into images.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.file_layout import (
    CHANNELS,
    COORDINATES,
    LISTS,
    MAPPED_NORMAL,
    TEXTURE,
    TEXTURE_CHANNELS,
    is_list,
    is_texture,
)
from depthwalk.bake.grid import grid_cells
from depthwalk.bake.header import Header
from depthwalk.bake.images import BakedObject, BoundaryStrip, DepthImage, Face
from depthwalk.colour import linear_from_srgb8, srgb8_from_linear

_LIST_WIDTH = 1024
Channels = dict[str, NDArray[Any]]


def object_parts(baked: BakedObject) -> dict[str, Channels]:
    """Return the parts of one object, by name."""
    contents = {image.name: _channels(image) for image in baked.images}
    for border in baked.boundary_strips:
        for kind, lists in _border_lists(border, _samples(baked.images, border.face)).items():
            contents[f"{kind}.{border.face.name.lower()}.{border.level}"] = lists
    if baked.texture is not None:
        linear = linear_from_srgb8(baked.texture[::-1]).astype(np.float16)  # converts back to the same 8 bits
        contents[TEXTURE] = dict(zip(TEXTURE_CHANNELS, np.ascontiguousarray(np.moveaxis(linear, -1, 0)), strict=True))
    return contents


def object_from(stored: dict[str, Channels], header: Header) -> BakedObject:
    """Build the object whose parts are `stored`; raises ValueError if they are inconsistent."""
    kinds = [name for name in stored if not is_list(name) and not is_texture(name)]
    images = [_image(name, stored[name], header.steps) for name in kinds]
    _check_cells(images)
    borders = [
        _border(name, stored, _samples(images, Face[name.split(".")[1].upper()]))
        for name in stored
        if name.startswith(LISTS[0])
    ]
    images.sort(key=lambda image: (image.face, image.layer))
    return BakedObject(
        cylinder=header.cylinder,
        images=tuple(images),
        boundary_strips=tuple(borders),
        shininess=header.shininess,
        steps=header.steps,
        key=header.key,
        position=header.position,
        rotation=header.rotation,
        texture=_texture(stored[TEXTURE]) if TEXTURE in stored else None,
        mesh_triangles=header.mesh_triangles,
        has_interior=header.has_interior,
        keeps_normals=header.keeps_normals,
        reflection=header.reflection,
        tells_roughness=header.tells_roughness,
    )


def _check_cells(images: list[DepthImage]) -> None:
    """Raise ValueError if a triangle has a corner on a layer that its face does not have."""
    for image in images:
        layers = sum(other.face is image.face for other in images)
        for codes in image.cells:
            for code in (codes & 127, codes >> 7 & 127):
                kept = code[code & 1 > 0]
                if np.maximum(kept >> 1 & 7, kept >> 4).max(initial=0) >= layers:
                    raise ValueError(f"part {image.name} has triangles on layers that its face does not have")


def _channels(image: DepthImage) -> Channels:
    planes = [*np.moveaxis(image.albedo.astype(np.float16), -1, 0), image.depth]
    planes += [*np.moveaxis(image.normal.astype(np.float16), -1, 0), image.owner.astype(np.uint32)]
    named = dict(zip(CHANNELS, planes, strict=True)) | _packed_cells(image)
    if image.coordinates is not None:
        u, v = np.moveaxis(image.coordinates.astype(np.uint32), -1, 0)
        named[COORDINATES] = u | v << 16
    if image.mapped_normal is not None:
        components = np.moveaxis(image.mapped_normal.astype(np.float16), -1, 0)
        named |= dict(zip(MAPPED_NORMAL, components, strict=True))
    return {name: np.ascontiguousarray(plane[::-1]) for name, plane in named.items()}


def _packed_cells(image: DepthImage) -> dict[str, NDArray[np.uint32]]:
    """Store cells at their lower left nodes: even levels in the low half of a channel, odd ones in the high half."""
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
    """Count the texels of the images of one face."""
    return sum(image.depth.size for image in images if image.face is face)


def _border_lists(border: BoundaryStrip, samples: int) -> dict[str, Channels]:
    """Return a boundary strip as two lists in the shape of images, vertices and triangles, as small numbers.

    Starts and first corners are stored as differences from the previous one; second and third corners are counted from
    the first corner, or from the first boundary vertex that starts at it.
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
    return {LISTS[0]: _folded(vertices), LISTS[1]: _folded(triangles)}


def _border(name: str, stored: dict[str, Channels], samples: int) -> BoundaryStrip:
    face, level = name.split(".")[1:]
    vertices, triangles = ({k: v.ravel() for k, v in stored[f"{kind}.{face}.{level}"].items()} for kind in LISTS)
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
    return BoundaryStrip(
        face=Face[face.upper()],
        level=int(level),
        start=start.astype(np.int32),
        offset=np.stack([vertices["du"][:count], vertices["dv"][:count]], -1),
        rise=vertices["rise"][:count],
        triangles=every.astype(np.int32),
    )


def _used(name: str, used: NDArray[np.uint32]) -> int:
    """Return how many entries a list has; raises ValueError if they are not at its beginning."""
    count = np.count_nonzero(used)
    if (used[:count] != 1).any():
        raise ValueError(f"part {name} marks its entries wrongly")
    return int(count)


def _folded(lists: Channels) -> Channels:
    """Fold lists (n,) to images of `_LIST_WIDTH` columns, integers as uint; `used` is 1 where a list has an entry."""
    lists = lists | {"used": np.ones(len(next(iter(lists.values()))), np.uint32)}
    rows = max(-(-len(lists["used"]) // _LIST_WIDTH), 1)  # an image without rows cannot be written
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
    normal = _vectors(plane, ("N.x", "N.y", "N.z"))
    mapped = _vectors(plane, MAPPED_NORMAL) if MAPPED_NORMAL[0] in plane else None
    albedo = np.stack([plane[k] for k in ("R", "G", "B", "specular")], -1).astype(np.float32)
    if not all(np.isfinite(values).all() for values in (normal, albedo, mapped) if values is not None):
        raise ValueError(f"part {name} holds normals or colours that are not numbers")
    return DepthImage(
        face=face,
        layer=int(layer),
        depth=depth,
        normal=normal,
        albedo=albedo,
        cells=_unpacked_cells(face, plane, steps),
        owner=np.ascontiguousarray(plane["owner"], np.uint8),
        coordinates=_coordinates(plane[COORDINATES]) if COORDINATES in plane else None,
        mapped_normal=mapped,
    )


def _vectors(plane: Channels, names: Iterable[str]) -> NDArray[np.float32]:
    """Return the vectors (H, W, 3) whose components are the channels `names`."""
    return np.stack([plane[name] for name in names], -1).astype(np.float32)


def _coordinates(packed: NDArray[np.uint32]) -> NDArray[np.uint16]:
    """Return `DepthImage.coordinates` from the pixels (H, W) of their channel."""
    return np.stack([packed & 0xFFFF, packed >> 16], -1).astype(np.uint16)


def _texture(channels: Channels) -> NDArray[np.uint8]:
    """Return `BakedObject.texture` from the channels of its part. Raises ValueError for values that are not colours."""
    linear = np.stack([channels[name][::-1] for name in TEXTURE_CHANNELS], -1)
    if not ((linear >= 0) & (linear <= 1)).all():
        raise ValueError("the texture holds values that are no colours")
    return srgb8_from_linear(linear)
