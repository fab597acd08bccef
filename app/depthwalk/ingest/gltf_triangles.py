"""Read the triangles of glTF files as nearly all programs write them.

trimesh reads them, too, and all others: strips, specular-glossiness materials, and whatever is malformed, of which it
then tells. But importing it takes most of a second, longer than all else until the first picture of a small model.
"""

import io
import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf import TRIANGLES, is_unlit
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_expressed import expressed
from depthwalk.ingest.gltf_textures import KTX, picture_number
from depthwalk.ingest.image import TextureDecoder, check_picture
from depthwalk.ingest.materials import phong_from_pbr, plain_material, without_light
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.soup import (
    Soup,
    check_geometry,
    check_triangle_count,
    joined_soups,
    placed_soup,
    srgb8_from_file,
    unit_normals,
)
from depthwalk.ingest.sources import Sources, read_named

Header = dict[str, Any]
_Matrix = NDArray[np.float64]  # (4, 4)

_ELSEWHERE = "KHR_materials_pbrSpecularGlossiness"
_COLOURS = "baseColorFactor", "emissiveFactor"
_NUMBERS = "roughnessFactor", "metallicFactor", "alphaCutoff"
_TEXTURES = "baseColorTexture", "emissiveTexture", "normalTexture", "metallicRoughnessTexture"
_ALMOST_RIGID = 1e-13, 1e-5  # deviations of a matrix from a rotation that rounding may have caused
_NO_TURN = np.finfo(np.float64).eps * 4.0  # squared length of a quaternion


class _Shape(NamedTuple):
    """The vertices and faces of a primitive, in its own frame, and its material, by its number in the file or None."""

    positions: NDArray[np.float64]
    normals: NDArray[np.float64] | None
    uv: NDArray[np.float64] | None
    colours: NDArray[np.uint8] | None
    faces: NDArray[np.int64]
    material: int | None


def read_gltf_triangles(header: Header, data: bytes, path: Path, sources: Sources) -> Soup | None:
    """Read the triangles that the scene of a glTF file shows, placed by its nodes.

    Parameters
    ----------
    header
        The JSON header, which is changed in place.
    data
        The contents of the file.
    path
        The file, for messages, and to find other files beside it.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    Soup or None
        The triangles, in the frame of the scene, metres; None for files that only trimesh reads, and for damaged ones.

    Raises
    ------
    InputError
        `path: defect`.
    """
    try:
        if not _is_usual(header):
            return None
        unlit = is_unlit(header)
        accessors = Accessors(header, data, partial(_read_beside, path=path, sources=sources))
        expressed(header, accessors, len(data), path, sources)
        soup = _soup(header, accessors, path)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None
    if soup is not None and unlit:
        soup = replace(soup, materials=tuple(map(without_light, soup.materials)))
    return soup


def _is_usual(header: Header) -> bool:
    """Return whether a file holds only separate triangles, and materials of metal and roughness."""
    primitives = [primitive for mesh in header.get("meshes", []) for primitive in mesh["primitives"]]
    return all(primitive.get("mode", TRIANGLES) == TRIANGLES for primitive in primitives) and not any(
        _ELSEWHERE in material.get("extensions", {}) for material in header.get("materials", [])
    )


def _soup(header: Header, accessors: Accessors, path: Path) -> Soup | None:
    """Return the triangles of a file that is expressed in plain terms; None if it shows none."""
    pictures = _pictures(header, accessors)
    terms = [_pbr_terms(material, header, pictures) for material in header.get("materials", [])]
    placed = list(_placed(header))
    if not placed:
        return None
    shapes: dict[tuple[int, int], _Shape] = {}
    for key, _ in placed:
        if key not in shapes:
            with np.errstate(invalid="ignore"):  # signalling NaN warn when they are converted
                shapes[key] = _shape(header["meshes"][key[0]]["primitives"][key[1]], accessors)
    for shape in shapes.values():
        check_geometry(shape.positions, shape.faces, path)
    check_triangle_count(sum(len(shapes[key].faces) for key, _ in placed), path)
    textures, numbers, materials = TextureDecoder(), dict[object, int](), list[Material]()
    pieces = []
    for key, matrix in placed:
        shape = shapes[key]
        found: object = (shape.material,) if shape.material is not None else shape.colours is not None
        if found not in numbers:
            numbers[found] = len(materials)
            materials.append(
                plain_material(shape.colours is not None)
                if shape.material is None
                else phong_from_pbr(terms[shape.material], str(path), textures, shape.uv)
            )
        pieces.append(
            placed_soup(
                shape.positions,
                shape.faces,
                normals=shape.normals,
                uv=shape.uv,
                colours=shape.colours,
                material=numbers[found],
                matrix=matrix,
            )
        )
    return joined_soups(pieces, materials)


def _placed(header: Header) -> Iterator[tuple[tuple[int, int], _Matrix]]:
    """Yield the mesh and primitive of every use, by number, and its scene_from_mesh matrix, the last nodes first."""
    nodes = header["nodes"]
    ends = [(root, np.eye(4)) for root in header["scenes"][header.get("scene", 0)].get("nodes", [])]
    seen: set[int] = set()
    while ends:
        number, above = ends.pop()
        if number in seen or number < 0:
            raise ValueError("a node has several parents")
        seen.add(number)
        node = nodes[number]
        matrix = above @ _local_matrix(node)
        if not np.isfinite(matrix).all():
            raise ValueError("a matrix is not finite")
        ends += [(child, matrix) for child in node.get("children", [])]
        if "mesh" in node:
            count = len(header["meshes"][node["mesh"]]["primitives"])
            if not count:
                raise ValueError("a mesh is empty")
            rigid = _nearest_rigid(matrix)
            yield from (((node["mesh"], each), rigid) for each in range(count))


def _local_matrix(node: Header) -> _Matrix:
    """Return the matrix of a node relative to its parent, to the last bit that of trimesh."""
    if "matrix" in node:
        if not node.keys().isdisjoint(("translation", "rotation", "scale")):
            raise ValueError("a node is placed twice")
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        x, y, z, w = node["rotation"]
        turn = np.array([w, x, y, z], np.float64)
        if (length := float(np.dot(turn * turn, np.ones(4)))) >= _NO_TURN:
            turn *= np.sqrt(2.0 / length)
            (_, wx, wy, wz), (_, xx, xy, xz), (_, _, yy, yz), (_, _, _, zz) = turn[:, None] * turn
            matrix[0, :3] = 1.0 - yy - zz, xy - wz, xz + wy
            matrix[1, :3] = xy + wz, 1.0 - xx - zz, yz - wx
            matrix[2, :3] = xz - wy, yz + wx, 1.0 - xx - yy
    if "scale" in node:
        x, y, z = node["scale"]
        matrix[:3, :3] *= np.array([x, y, z], np.float64)
    if "translation" in node:
        x, y, z = node["translation"]
        matrix[:3, 3] = x, y, z
    return matrix


def _nearest_rigid(matrix: _Matrix) -> _Matrix:
    """Return a matrix that is a rotation but for rounding as one, any other as it is: as trimesh's `fix_rigid` does."""
    linear = matrix[:3, :3]
    off = float(np.abs(np.dot(linear, linear.T) - np.eye(3)).max())
    if not _ALMOST_RIGID[0] < off < _ALMOST_RIGID[1]:
        return matrix
    left, _, right = np.linalg.svd(linear)
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = np.dot(left, right), matrix[:3, 3]
    return rigid


def _shape(primitive: Header, accessors: Accessors) -> _Shape:
    """Return the vertices and faces of a primitive of separate triangles."""
    attributes, material = primitive["attributes"], primitive.get("material")
    positions = accessors.stored(attributes["POSITION"]).astype(np.float64)
    count = len(positions)
    normals = uv = None
    if "NORMAL" in attributes:
        normals = unit_normals(accessors.stored(attributes["NORMAL"], count).astype(np.float64))
    if material is not None and "TEXCOORD_0" in attributes:
        found = accessors.stored(attributes["TEXCOORD_0"], count).copy()
        found[:, 1] = 1.0 - found[:, 1]  # v upward
        uv = found.astype(np.float64)
    colours = None
    if "COLOR_0" in attributes:
        colours = _srgb(accessors.stored(attributes["COLOR_0"], count), rounded=material is None)
    corners = accessors.stored(primitive["indices"]) if "indices" in primitive else np.arange(count)[:, None]
    if corners.dtype.kind == "f":
        raise ValueError("indices that are not whole numbers")
    for values, width in ((positions, 3), (normals, 3), (uv, 2), (corners, 1)):
        if values is not None and values.shape[1] != width:
            raise ValueError("an accessor has another width")
    return _Shape(positions, normals, uv, colours, corners.reshape(-1, 3).astype(np.int64), material)


def _srgb(linear: NDArray[Any], *, rounded: bool) -> NDArray[np.uint8]:
    """Return the sRGB colours of the `linear` ones (V, 3 or 4), which trimesh has `rounded` to bytes or not."""
    if linear.shape[1] not in (3, 4) or linear.dtype not in (np.uint8, np.float32):
        raise ValueError("colours of another kind")
    values = linear[:, :3]
    if rounded and values.dtype != np.uint8:
        values = _bytes(values)
    return srgb8_from_file(values / 255.0 if values.dtype == np.uint8 else values)


def _bytes(unit: NDArray[Any]) -> NDArray[np.uint8]:
    """Return numbers from 0 to 1 as bytes; those that are not finite become 0."""
    values = np.where(np.isfinite(unit), unit, 0.0) * unit.dtype.type(255)
    return np.asarray(np.clip(values, 0.0, 255.0).round().astype(np.uint8))


def _pictures(header: Header, accessors: Accessors) -> list[Any] | None:
    """Return the pictures of a file, opened, None for those that cannot be; None for a file without a list of them."""
    if "images" not in header:
        return None
    from PIL import Image

    opened: list[Any] = []
    for image in header["images"]:
        opened.append(None)
        if image.get("mimeType", "") == KTX or image.keys().isdisjoint(("bufferView", "uri")):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about pictures of many pixels, whose size is checked later
            try:
                content = accessors.picture(image)
            except FileNotFoundError:
                continue
            try:
                opened[-1] = Image.open(io.BytesIO(content))
            except Exception:  # Pillow's plugins raise nearly anything; told by `warn_of_missing_textures`
                continue
    return opened


def _read_beside(name: str, *, path: Path, sources: Sources) -> bytes:
    """Return the contents of a buffer or a picture in another file.

    Raises FileNotFoundError if it is missing, which is logged, and InputError for a damaged picture.
    """
    file, content = read_named(name, path, sources)
    check_picture(file, content)
    return content


def _pbr_terms(material: Header, header: Header, pictures: list[Any] | None) -> SimpleNamespace:
    """Return the terms of a material by their names in the file; None for those that it lacks."""
    said = {**material, **material.get("pbrMetallicRoughness", {})}
    terms: dict[str, Any] = dict.fromkeys(("name", "alphaMode", *_COLOURS, *_NUMBERS, *_TEXTURES))
    if not isinstance(said.get("name", ""), str) or said.get("alphaMode", "OPAQUE") not in ("OPAQUE", "MASK", "BLEND"):
        raise ValueError("a material has another kind of name or mode")
    terms |= {key: said[key] for key in ("name", "alphaMode") if key in said}
    terms |= {key: float(_number(said[key])) for key in _NUMBERS if key in said}
    if "baseColorFactor" in said:
        red, green, blue, alpha = map(_number, said["baseColorFactor"])
        terms["baseColorFactor"] = _bytes(np.array([red, green, blue, alpha], np.float64))
    if "emissiveFactor" in said:
        red, green, blue = map(_number, said["emissiveFactor"])
        if min(red, green, blue) < 0:
            raise ValueError("a material emits less than nothing")
        terms["emissiveFactor"] = np.array([red, green, blue], np.float64)
    for key in _TEXTURES:
        if pictures is not None and "index" in said.get(key, {}):
            terms[key] = _picture(said[key]["index"], header, pictures)
    return SimpleNamespace(**terms)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("not a number")
    return value


def _picture(texture: int, header: Header, pictures: list[Any]) -> Any:
    """Return the picture of a texture, by its number; None if it has none."""
    try:
        number = picture_number(header["textures"][texture])
        return None if number is None else pictures[number]
    except (LookupError, TypeError):
        return None
