"""Decode the parts of glTF files that meshoptimizer has compressed, by its own code (`EXT_meshopt_compression`).

The extension compresses bufferViews, so everything that has numbers may be: vertices, indices, animations, instances.
How long they are is said beside them, and a byte stands for a known number at most, so that damaged data takes no more
than the file explains, and no process of its own is needed as it is for Draco.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from depthwalk.budget import check_memory
from depthwalk.errors import InputError
from depthwalk.ingest.gltf import MESHOPT, object_under, without_library
from depthwalk.ingest.gltf_accessors import Accessors, whole

# Most bytes, triangles and indices that a byte may stand for, by mode. Of a row of four bytes, vertex codec 1 needs two
# bits each for 256 rows (codec 0 for 16); index codecs need a byte each.
_MOST_BYTES, _CORNERS = 1024, {"TRIANGLES": 3, "INDICES": 1}

Header = dict[str, Any]


def decompress_views(header: Header, accessors: Accessors, path: Path) -> bool:
    """Replace compressed bufferViews by ordinary ones.

    Files that do not require the extension hold the same without compression; that is used.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`; changed in place.
    accessors
        Reads the file's buffers; holds the decoded data.
    path
        The file, for messages.

    Returns
    -------
    bool
        Whether there were any.

    Raises
    ------
    InputError
        `path: …` if the library is not installed or the machine has too little memory; `path: bufferViews[2]: …` for
        damaged data.
    ValueError, TypeError, LookupError
        For other damaged data.
    """
    found = [
        (number, terms)
        for number, view in enumerate(header.get("bufferViews", []))
        if (terms := _terms(view, header)) is not None
    ]
    if not found:
        return False
    if find_spec("meshopt") is None:
        raise without_library(path, "meshopt")
    length = sum(whole(terms["count"]) * whole(terms["byteStride"]) for _, terms in found)
    check_memory(path, 2 * length, f"meshopt data of {length} bytes")
    for number, terms in found:
        where, announced = f"{path}: bufferViews[{number}]", header["bufferViews"][number]["byteLength"]
        if announced != (length := terms["count"] * terms["byteStride"]):
            raise InputError(f"{where}: its meshopt data has {length} bytes instead of {announced}")
        accessors.replace_view(number, _decoded(terms, accessors, where))
    for buffer in header["buffers"]:
        if _is_hollow(buffer):
            accessors.replace_buffer(buffer, b"")  # nothing reads it any more, but trimesh asks for each
    return True


def _terms(view: Header, header: Header) -> Header | None:
    """Return how a bufferView is compressed; None if its data is there without compression."""
    extensions = object_under(view, "extensions")
    name = next((name for name in MESHOPT if name in extensions), None)
    if name is None or (
        name not in header.get("extensionsRequired", []) and not _is_hollow(header["buffers"][view["buffer"]])
    ):
        return None
    terms: Header = extensions[name]
    return terms


def _is_hollow(buffer: Header) -> bool:
    """Return whether a buffer only stands for what compressed views are decoded to."""
    marked = any(object_under(object_under(buffer, "extensions"), name).get("fallback") for name in MESHOPT)
    return marked and "uri" not in buffer


def _decoded(terms: Header, accessors: Accessors, where: str) -> bytes:
    """Return the contents of a view. Raises InputError, `where: …`, if its data is damaged."""
    import meshopt  # an extra, which few files need

    data, count, stride, mode = accessors.part(terms), terms["count"], terms["byteStride"], terms["mode"]
    least = count // _CORNERS[mode] if mode in _CORNERS else count * stride // _MOST_BYTES
    try:
        if len(data) < max(least, whole(terms["byteLength"])):
            raise ValueError("too short")
        decoded = meshopt.decode_gltf_buffer(data, count, stride, mode, terms.get("filter", "NONE"))
    except ValueError as error:
        raise InputError(f"{where}: its meshopt data is damaged ({error})") from None
    contents: bytes = decoded.tobytes()
    return contents
