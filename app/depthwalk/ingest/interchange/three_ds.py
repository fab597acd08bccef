"""Read 3D Studio files (.3ds): chunks of meshes and materials.

Vertices are taken as they are, in the frame of the scene; the keyframes that would move objects are not. Smoothing
groups are not read either: normals are made as for other meshes without any.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.errors import InputError
from depthwalk.ingest.interchange.model import Y_FROM_Z, Model, Placed, PlacingBudget, Polygons, unread_parts
from depthwalk.ingest.mtl import MtlMaterial

_MAIN, _EDITOR, _OBJECT, _MESH, _MATERIAL = 0x4D4D, 0x3D3D, 0x4000, 0x4100, 0xAFFF
_LAMP, _CAMERA = 0x4600, 0x4700
_VERTICES, _FACES, _GROUP, _COORDINATES, _MATRIX = 0x4110, 0x4120, 0x4130, 0x4140, 0x4160
_NAME, _DIFFUSE, _SPECULAR, _SHININESS, _STRENGTH, _CLEAR, _GLOW = (
    0xA000,
    0xA020,
    0xA030,
    0xA040,
    0xA041,
    0xA050,
    0xA084,
)
_PICTURES = {0xA200: "image", 0xA210: "mask", 0xA230: "bump", 0xA33D: "glow"}
_FILE, _SCALE_V, _SCALE_U, _OFFSET_U, _OFFSET_V = 0xA300, 0xA354, 0xA356, 0xA358, 0xA35A
_FLOATS, _BYTES, _LINEAR_BYTES, _LINEAR_FLOATS = 0x0010, 0x0011, 0x0012, 0x0013
_SHORT_PERCENT, _FLOAT_PERCENT = 0x0030, 0x0031
_HEAD = struct.Struct("<HI")

_Chunk = tuple[int, memoryview]


@dataclass
class _Material:
    """Hold a material, and how its picture is laid on: (scale u, scale v, offset u, offset v)."""

    entries: MtlMaterial = field(default_factory=MtlMaterial)
    name: str = ""
    laid: dict[int, float] = field(default_factory=dict)


def parse_three_ds(data: bytes, path: Path, geometry: bool) -> Model:
    """Parse a 3D Studio file, see `reader.parse`. Its z axis becomes y; the format has no unit."""
    if len(data) < _HEAD.size or _HEAD.unpack_from(data)[0] != _MAIN:
        raise InputError(f"{path}: not a 3D Studio file")
    if _HEAD.unpack_from(data)[1] > len(data):
        raise InputError(f"{path}: truncated: {len(data)} of {_HEAD.unpack_from(data)[1]} bytes")
    materials: dict[str, _Material] = {}
    meshes: list[memoryview] = []
    others = {_LAMP: 0, _CAMERA: 0}
    for kind, content in _chunks(memoryview(data)[_HEAD.size : _HEAD.unpack_from(data)[1]]):
        for inner, body in _chunks(content) if kind == _EDITOR else ():
            if inner == _MATERIAL:
                material = _material(body)
                materials[material.name] = material
            elif inner == _OBJECT:
                for part, mesh in _chunks(body[_text(body)[1] :]):
                    meshes += [mesh] if part == _MESH and geometry else []
                    if part in others:
                        others[part] += 1
    budget, placed = PlacingBudget(data, path), []
    for mesh in meshes:
        if (polygons := _polygons(mesh, materials, path)) is not None:
            budget.place(polygons)
            placed.append(Placed(polygons=polygons, matrix=Y_FROM_Z))
    return Model(
        placed=placed,
        materials={name: each.entries for name, each in materials.items()},
        unread=unread_parts(lamps=others[_LAMP], cameras=others[_CAMERA]),
    )


def _chunks(content: memoryview) -> Iterator[_Chunk]:
    """Yield the kind and the content of each chunk. Raises ValueError for one that does not fit."""
    at = 0
    while at + _HEAD.size <= len(content):
        kind, length = _HEAD.unpack_from(content, at)
        if length < _HEAD.size or at + length > len(content):
            raise ValueError(f"chunk {kind:#06x} of {length} bytes where {len(content) - at} are left")
        yield kind, content[at + _HEAD.size : at + length]
        at += length


def _text(content: memoryview) -> tuple[str, int]:
    """Return the text at the start of a chunk, and where what follows it begins."""
    end = bytes(content[:512]).find(b"\0")
    if end < 0:
        raise ValueError("a name that does not end")
    return bytes(content[:end]).decode("utf-8", "replace"), end + 1


def _material(content: memoryview) -> _Material:
    made = _Material()
    terms = made.entries.terms
    strength = 1.0
    for kind, body in _chunks(content):
        if kind == _NAME:
            made.name = _text(body)[0]
        elif kind == _DIFFUSE:
            terms["kd"] = _colour(body)
        elif kind == _SPECULAR:
            terms["ks"] = _colour(body)
        elif kind == _SHININESS:
            terms["ns"] = 2.0 ** (10 * _part(body))  # as 3ds Max's glossiness: 0 to 100 % is 1 to 1024
        elif kind == _STRENGTH:
            strength = _part(body)
        elif kind == _CLEAR:
            terms["tr"] = _part(body)
        elif kind == _GLOW:
            terms["ke"] = [_part(body)] * 3
        elif kind in _PICTURES:
            _picture(made, _PICTURES[kind], body)
    highlight, glow, colour = (terms.get(key) for key in ("ks", "ke", "kd"))
    if isinstance(highlight, list):
        terms["ks"] = [strength * each for each in highlight]
    if isinstance(glow, list) and isinstance(colour, list):
        terms["ke"] = [a * b for a, b in zip(glow, colour, strict=True)]
    if made.entries.image:
        terms.pop("kd", None)  # a picture replaces the colour
    if made.entries.mask:  # only the alpha of the picture of colours can cut out
        made.entries.mask = made.entries.image if made.entries.mask == made.entries.image else None
    return made


def _picture(made: _Material, use: str, content: memoryview) -> None:
    """Note the name of a picture; and how it is laid on, if it is that of the colours."""
    for kind, body in _chunks(content):
        if kind == _FILE:
            setattr(made.entries, use, _text(body)[0])
        elif use == "image" and kind in (_SCALE_U, _SCALE_V, _OFFSET_U, _OFFSET_V):
            made.laid[kind] = struct.unpack_from("<f", body)[0]


def _colour(content: memoryview) -> list[float]:
    """Return a colour, linear. Where it is stored both for a screen and linear, many programs write one for both."""
    found: list[float] | None = None
    for kind, body in _chunks(content):
        if kind in (_FLOATS, _LINEAR_FLOATS):
            values = np.frombuffer(body, "<f4", 3).astype(np.float64)
        elif kind in (_BYTES, _LINEAR_BYTES):
            values = np.frombuffer(body, np.uint8, 3) / 255.0
        else:
            continue
        if kind in (_FLOATS, _BYTES):
            return [float(each) for each in linear_from_srgb(np.clip(np.nan_to_num(values), 0, 1))]
        found = found or values.tolist()
    return found or [0.0, 0.0, 0.0]


def _part(content: memoryview) -> float:
    """Return a percentage as a part of 1."""
    for kind, body in _chunks(content):
        if kind == _SHORT_PERCENT:
            return float(np.clip(struct.unpack_from("<h", body)[0] / 100, 0, 1))
        if kind == _FLOAT_PERCENT:
            return float(np.clip(np.nan_to_num(struct.unpack_from("<f", body)[0]), 0, 1))
    return 0.0


def _polygons(content: memoryview, materials: dict[str, _Material], path: Path) -> Polygons | None:
    """Return the triangles of a mesh; None if it has none."""
    positions = np.zeros((0, 3))
    coordinates: NDArray[np.float64] | None = None
    faces, matrix, groups = np.zeros((0, 3), np.int64), np.eye(4), list[tuple[str, NDArray[np.int64]]]()
    for kind, body in _chunks(content):
        if kind == _VERTICES:
            positions = _array(body, "<f4", 3).astype(np.float64)
        elif kind == _COORDINATES:
            coordinates = _array(body, "<f4", 2).astype(np.float64)
        elif kind == _MATRIX:
            matrix[:3, :] = np.frombuffer(body, "<f4", 12).reshape(4, 3).T
        elif kind == _FACES:
            faces = _array(body, "<u2", 4)[:, :3].astype(np.int64)
            for part, group in _chunks(body[2 + 8 * len(faces) :]):
                if part == _GROUP:
                    name, start = _text(group)
                    groups.append((name, _array(group[start:], "<u2", 1)[:, 0].astype(np.int64)))
    if not len(faces):
        return None
    material, names = np.zeros(len(faces), np.int64), list[str | None]([None])
    for name, rows in groups:
        material[rows] = len(names)
        names.append(name)
    if len(positions) and int(faces.max()) >= len(positions):
        raise InputError(f"{path}: a face refers to vertex {faces.max()} of 0 to {len(positions) - 1}")
    vertex = faces.ravel()
    uv = None
    if coordinates is not None and len(coordinates) == len(positions):
        uv = _laid(coordinates[vertex], np.repeat(material, 3), names, materials)
    return Polygons(
        positions=_unmirrored(positions, matrix),
        vertex=vertex,
        sizes=np.full(len(faces), 3),
        uv=uv,
        material=material,
        names=tuple(names),
    )


def _array(content: memoryview, kind: str, width: int) -> NDArray[np.generic]:
    """Return the rows of an array, whose number stands before it."""
    (count,) = struct.unpack_from("<H", content)
    return np.frombuffer(content, kind, count * width, 2).reshape(count, width)


def _unmirrored(positions: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vertices (V, 3) in the scene's frame. 3D Studio stores meshes that are mirrored as if they were not."""
    with np.errstate(all="ignore"):
        turn = np.linalg.det(matrix[:3, :3])
        if not (np.isfinite(turn) and turn < 0):
            return positions
        mirror = matrix @ np.diag([-1.0, 1, 1, 1]) @ np.linalg.inv(matrix)
        return np.asarray(positions @ mirror[:3, :3].T + mirror[:3, 3])


def _laid(
    coordinates: NDArray[np.float64],
    material: NDArray[np.int64],
    names: list[str | None],
    materials: dict[str, _Material],
) -> NDArray[np.float64]:
    """Return texture coordinates (C, 2) as the material (C,) of each corner, by `names`, scales and shifts them."""
    scale, offset = np.ones((len(names), 2)), np.zeros((len(names), 2))
    for number, name in enumerate(names):
        if name in materials:
            laid = materials[name].laid
            scale[number] = laid.get(_SCALE_U, 1.0), laid.get(_SCALE_V, 1.0)
            offset[number] = laid.get(_OFFSET_U, 0.0), laid.get(_OFFSET_V, 0.0)
    with np.errstate(all="ignore"):
        return coordinates * scale[material] + offset[material]
