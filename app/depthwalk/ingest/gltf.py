"""Read the JSON header of glTF files, and reject what trimesh would silently misread.

The header lists the other files that belong to the mesh, so they are found without decoding any geometry.
"""

import json
import struct
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.extras import install_command
from depthwalk.ingest.formats import USD_SUFFIXES
from depthwalk.ingest.mesh import OPAQUE
from depthwalk.limits import MAX_MESH_TRIANGLES

DRACO = "KHR_draco_mesh_compression"
MESHOPT = "EXT_meshopt_compression", "KHR_meshopt_compression"  # with the same contents
BASISU = "KHR_texture_basisu"
_KNOWN = (
    "KHR_materials_", "KHR_lights_punctual", "KHR_mesh_quantization", "KHR_texture_transform", "EXT_texture_webp",
    BASISU, DRACO, *MESHOPT,
)  # fmt: skip
_TEXTURES = ("KHR_texture_", "EXT_texture_", "MSFT_texture_")
INSTANCING = "EXT_mesh_gpu_instancing"
_UNLIT = "KHR_materials_unlit"
_SPECULAR_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
_STRENGTH, _TRANSMISSION = "KHR_materials_emissive_strength", "KHR_materials_transmission"
_MIRRORED = 0.08  # part of the light that a pane of glass with refractive index 1.5 reflects: 4 % on either face
POINTS = 0  # mode of primitives of separate points; lines, loops and strips of lines are 1 to 3
TRIANGLES = 4  # mode of primitives of separate triangles; strips and fans make one triangle per further corner
_CONVERT = "; `depthwalk convert` makes a scene of the file"
_FIRST = " but 1.0; gltf-pipeline, for example, converts it"


def read_header(data: bytes, path: Path) -> dict[str, Any]:
    """Return the JSON header of the glTF or GLB file `path`, whose contents are `data`.

    Raises InputError if the header is damaged.
    """
    if not data:
        raise InputError(f"{path}: empty file")
    if is_binary(path):
        if len(data) < 20 or data[:4] != b"glTF":
            raise InputError(f"{path}: not a GLB file")
        version, total, length, kind = struct.unpack_from("<II I4s", data, 4)
        if version != 2 or kind != b"JSON":
            raise InputError(f"{path}: not a GLB file of version 2{_FIRST if version == 1 else ''}")
        if total > len(data):
            raise InputError(f"{path}: truncated: {len(data)} of {total} bytes")
        data = data[20 : 20 + length]
    try:
        header = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: its glTF header is not JSON: {error}") from None
    if not isinstance(header, dict):
        raise InputError(f"{path}: its glTF header is not an object")
    if isinstance(header.get("accessors"), dict):  # since version 2, a list
        raise InputError(f"{path}: not a glTF file of version 2{_FIRST}")
    return header


def is_binary(path: Path) -> bool:
    """Return whether the file `path` is a GLB file, or one that `Sources.read` translates to one."""
    return path.suffix.lower() in (".glb", *USD_SUFFIXES)


def remedy() -> str:
    """Return the part of a message about what is compressed that tells how to install the libraries for it."""
    return f"`{install_command('gltf')}` installs what reads it"


def without_library(path: Path, codec: str) -> InputError:
    """Return the error for a file that is compressed by a codec whose library is not installed."""
    return InputError(
        f"{path}: is compressed by {codec}; {remedy()}, and `gltf-transform copy` makes a file without compression"
    )


def external_uris(header: dict[str, Any], key: str) -> list[str]:
    """Return the names of the files that hold the buffers or the images of a glTF file.

    Parameters
    ----------
    header
        The JSON header, as returned by `read_header`.
    key
        The list in the header to look at, "buffers" or "images".

    Returns
    -------
    list
        The URIs as written, except those that contain the data themselves (data URIs).
    """
    uris = (item.get("uri", "data:") for item in header.get(key, []))
    return [uri for uri in uris if not uri.startswith("data:")]


def has_cut_outs(header: dict[str, Any]) -> bool:
    """Return whether any material in the JSON header of a glTF file uses alpha."""
    return any(material.get("alphaMode", "OPAQUE") != "OPAQUE" for material in objects_under(header, "materials"))


def has_translucency(header: dict[str, Any]) -> bool:
    """Return whether any material in the JSON header of a glTF file may be translucent."""
    return any(
        material.get("alphaMode") == "BLEND" or _TRANSMISSION in object_under(material, "extensions")
        for material in objects_under(header, "materials")
    )


def is_all_translucent(header: dict[str, Any]) -> bool:
    """Return whether a glTF file shows nothing opaque, as far as its JSON header tells.

    Many programs write `BLEND` for all materials, so that alone says nothing; nor does a texture, which may cut out.
    """
    return _all_used(header, _is_wholly_translucent)


def is_unlit(header: dict[str, Any]) -> bool:
    """Return whether all that a glTF file shows is to be shown without light, as far as its JSON header tells.

    Depth images mix the materials of a model, so one that only some of its materials say counts for nothing.
    """
    return _all_used(header, lambda material: _UNLIT in object_under(material, "extensions"))


def _all_used(header: dict[str, Any], holds: Callable[[dict[str, Any]], bool]) -> bool:
    """Return whether there are triangles in a glTF file, all with a material of which something holds."""
    try:
        primitives = [primitive for mesh in header.get("meshes", []) for primitive in mesh["primitives"]]
        used = {primitive.get("material") for primitive in primitives if primitive.get("mode", TRIANGLES) >= TRIANGLES}
        return bool(used) and all(number is not None and holds(header["materials"][number]) for number in used)
    except (AttributeError, TypeError, LookupError):  # reported when the mesh is read
        return False


def _is_wholly_translucent(material: dict[str, Any]) -> bool:
    """Return whether the numbers of a material make all of it translucent."""
    mode = material.get("alphaMode", "OPAQUE")
    if mode == "MASK":
        return False
    passing = object_under(material, "extensions").get(_TRANSMISSION, {}).get("transmissionFactor", 0.0)
    alpha = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1.0,) * 4)[3] if mode == "BLEND" else 1.0
    return bool((1 - passing) * alpha < OPAQUE)


def has_glow(header: dict[str, Any]) -> bool:
    """Return whether any material in the JSON header of a glTF file may emit light."""
    return any("emissiveFactor" in material for material in objects_under(header, "materials"))


def roughness_map_count(header: dict[str, Any]) -> int:
    """Count the materials in the JSON header of a glTF file that have a map of roughness and metalness."""
    materials = objects_under(header, "materials")
    return sum("metallicRoughnessTexture" in object_under(each, "pbrMetallicRoughness") for each in materials)


def has_reflections(header: dict[str, Any]) -> bool:
    """Return whether any material in the JSON header of a glTF file may be glossy or metallic, as most are.

    Without numbers a material is metal, and maps may reduce roughness.
    """
    terms = [object_under(material, "pbrMetallicRoughness") for material in objects_under(header, "materials")]
    return any(
        "metallicRoughnessTexture" in each
        or _SPECULAR_GLOSSINESS in object_under(material, "extensions")
        or each.get("metallicFactor", 1) != 0
        or each.get("roughnessFactor", 1) != 1
        for each, material in zip(terms, objects_under(header, "materials"), strict=True)
    )


def object_under(parent: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the object under a key of `parent`; an empty one if that is something else.

    What is malformed is reported on reading the mesh, if it matters there.
    """
    found = parent.get(key)
    return found if isinstance(found, dict) else {}


def objects_under(parent: Any, key: str) -> list[dict[str, Any]]:
    """Return the objects in the list under a key of the object `parent`; none if either is something else."""
    listed = parent.get(key) if isinstance(parent, dict) else None
    return [item for item in listed if isinstance(item, dict)] if isinstance(listed, list) else []


def fold_extensions(header: dict[str, Any], path: Path) -> bool:
    """Express material extensions in terms of core glTF, since trimesh ignores them.

    KHR_materials_emissive_strength multiplies `emissiveFactor`. KHR_materials_transmission reduces alpha, and makes an
    opaque material a blended one; what two faces of glass reflect remains.

    Parameters
    ----------
    header
        The JSON header; its materials are changed in place.
    path
        The file, for messages.

    Returns
    -------
    bool
        Whether anything was changed.

    Raises
    ------
    InputError
        `path: materials[k]: defect` for values out of range.
    """
    changed = False
    for number, material in enumerate(header.get("materials", [])):
        extensions, where = material.get("extensions", {}), f"{path}: materials[{number}]"
        strength = _value(extensions.get(_STRENGTH, {}), "emissiveStrength", 1.0, np.inf, where)
        if strength != 1 and "emissiveFactor" in material:
            material["emissiveFactor"] = [strength * term for term in material["emissiveFactor"]]
            changed = True
        passing = _value(extensions.get(_TRANSMISSION, {}), "transmissionFactor", 0.0, 1.0, where)
        if passing > 0 and material.get("alphaMode", "OPAQUE") != "MASK":
            metallic_roughness = material.setdefault("pbrMetallicRoughness", {})
            red, green, blue, alpha = metallic_roughness.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
            if material.get("alphaMode", "OPAQUE") == "OPAQUE":
                alpha = 1.0
            left = max(1.0 - passing, _MIRRORED)
            metallic_roughness["baseColorFactor"] = [red, green, blue, left * alpha]
            material["alphaMode"] = "BLEND"
            changed = True
    return changed


def _value(terms: dict[str, Any], name: str, default: float, most: float, where: str) -> float:
    """Return a number of an extension, from 0 to `most`. Raises InputError for anything else."""
    value = terms.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most or value == np.inf:
        wanted = "a number from 0 to 1" if most == 1 else "a number, 0 or more"
        raise InputError(f"{where}: {name} must be {wanted}, not {str(value)[:40]}")
    return float(value)


def with_header(data: bytes, header: dict[str, Any], path: Path) -> bytes:
    """Return the contents `data` of the glTF or GLB file `path` with another JSON header."""
    if not is_binary(path):
        return json.dumps(header).encode()
    rest = data[20 + struct.unpack_from("<I", data, 12)[0] :]
    return _glb_head(header, len(rest)) + rest


def glb_parts(header: dict[str, Any], chunks: Iterable[bytes], length: int) -> Iterator[bytes]:
    """Yield the bytes of a GLB file, piece by piece.

    Parameters
    ----------
    header
        The JSON header.
    chunks
        The data of its only buffer, one after the other.
    length
        Bytes of all chunks, a multiple of 4.

    Raises
    ------
    struct.error
        If the file would be longer than 4 GiB, before anything is yielded.
    """
    yield _glb_head(header, 8 + length)
    yield struct.pack("<I4s", length, b"BIN\0")
    yield from chunks


def _glb_head(header: dict[str, Any], rest: int) -> bytes:
    """Return the beginning of a GLB file, of which `rest` bytes follow the JSON header."""
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sII I4s", b"glTF", 2, 20 + len(text) + rest, len(text), b"JSON") + text


def placed_node(node: dict[str, Any], matrix: NDArray[np.float64]) -> dict[str, Any]:
    """Return the entry of a node of a header with its matrix (4, 4), for column vectors, unless it is the identity."""
    return node if np.array_equal(matrix, np.eye(4)) else node | {"matrix": matrix.T.ravel().tolist()}


def surfaces(mesh: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the primitives of a mesh that are triangles, not points or lines."""
    return [primitive for primitive in mesh["primitives"] if primitive.get("mode", TRIANGLES) >= TRIANGLES]


def compressed_primitives(header: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each primitive that Draco has compressed, with its place in the header, `meshes[0].primitives[1]`.

    What is malformed counts as none.
    """
    for number, mesh in enumerate(header.get("meshes", [])):
        for place, primitive in enumerate(mesh["primitives"]):
            if DRACO in object_under(primitive, "extensions"):
                yield f"meshes[{number}].primitives[{place}]", primitive


def accessor_numbers(primitive: dict[str, Any]) -> list[int]:
    """Return the numbers of the accessors of a primitive's vertices and corners."""
    return [*primitive["attributes"].values(), *([primitive["indices"]] if "indices" in primitive else [])]


def mesh_size(header: dict[str, Any], mesh: dict[str, Any]) -> tuple[int, int]:
    """Return how many vertices and triangles, at most, a mesh of a checked glTF file takes to read."""
    vertices = triangles = 0
    for primitive in mesh["primitives"]:
        points = header["accessors"][primitive["attributes"]["POSITION"]]["count"]
        corners = header["accessors"][primitive["indices"]]["count"] if "indices" in primitive else points
        vertices += points
        triangles += corners // 3 if primitive.get("mode", TRIANGLES) == TRIANGLES else corners
    return vertices, triangles


def check_header(header: dict[str, Any], path: Path, *, known: str | None = None) -> None:
    """Check a glTF header for anything that trimesh skips, misreads or allocates without checking its size.

    Parameters
    ----------
    header
        The JSON header.
    path
        The file, for messages.
    known
        A further extension that the caller reads itself.

    Raises
    ------
    InputError
        `path: defect`, for the first defect.
    """
    for name in header.get("extensionsRequired", []):
        if name == INSTANCING != known and path.suffix.lower() in USD_SUFFIXES:
            raise InputError(f"{path}: its copies are too many for one mesh{_CONVERT}")
        if not name.startswith(_KNOWN) and name != known:
            raise InputError(f"{path}: the required glTF extension {name} is not supported{_remedy(name)}")
    decoded = {number for _, primitive in compressed_primitives(header) for number in accessor_numbers(primitive)}
    for index, accessor in enumerate(header.get("accessors", [])):
        if index not in decoded and "sparse" not in accessor and "bufferView" not in accessor:
            raise InputError(f"{path}: accessors[{index}]: compressed or empty data is not supported")
        if not 0 < accessor["count"] <= 3 * MAX_MESH_TRIANGLES:
            raise InputError(f"{path}: accessors[{index}]: count {accessor['count']} is out of range")


def _remedy(extension: str) -> str:
    """Return how to do without an extension that is not supported, as the end of a message; "" if nothing is known."""
    if extension == INSTANCING:
        return _CONVERT
    return "; export its textures as PNG, JPEG or WebP" if extension.startswith(_TEXTURES) else ""
