"""Read the buffers of glTF files, and determine how much these take to read, before any of it is decoded."""

from collections import Counter
from pathlib import Path
from typing import Any

from depthwalk.errors import InputError, quoted
from depthwalk.ingest.gltf import external_uris, mesh_size
from depthwalk.ingest.soup import check_mesh_memory
from depthwalk.ingest.sources import Sources, find
from depthwalk.limits import MAX_COPIED_TRIANGLES


def read_buffer(uri: str, path: Path, sources: Sources) -> bytes:
    """Return the contents of a file that holds a buffer of the glTF file `path`, beside which it is found by its URI.

    Raises InputError, `path: defect`, if it is missing.
    """
    if (file := find(uri, [path.parent], sources)) is None:
        raise InputError(f"{path}: buffer {quoted(uri)} is missing or outside the folder")
    return sources.read(file)


def buffer_bytes(header: dict[str, Any], path: Path, sources: Sources) -> int:
    """Return how many bytes the buffers of a glTF file have that are files of their own.

    Parameters
    ----------
    header
        The JSON header.
    path
        The glTF file, beside which its buffers lie.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    int
        The bytes of all these files together.

    Raises
    ------
    InputError
        `path: defect` for a buffer that is missing.
    """
    return sum(len(read_buffer(uri, path, sources)) for uri in external_uris(header, "buffers"))


def placed_size(header: dict[str, Any]) -> tuple[int, int]:
    """Return how many vertices and triangles a glTF file makes, counting meshes that nodes place more than once.

    Several nodes may show a mesh, and several primitives the same data; reading it makes a copy each time.

    Parameters
    ----------
    header
        The JSON header, as returned by `read_header` and checked by `check_header`.

    Returns
    -------
    tuple
        Upper bounds on the vertices and triangles of all nodes together.
    """
    shown = Counter(node["mesh"] for node in header.get("nodes", []) if "mesh" in node)
    vertices = triangles = 0
    for number, mesh in enumerate(header.get("meshes", [])):
        copies = max(shown[number], 1)  # trimesh also reads meshes that no node shows
        of_vertices, of_triangles = mesh_size(header, mesh)
        vertices += copies * of_vertices
        triangles += copies * of_triangles
    return vertices, triangles


def check_placed_size(header: dict[str, Any], length: int, path: Path) -> None:
    """Raise InputError if a glTF file makes many more triangles than it has data for, or too many for the memory.

    Parameters
    ----------
    header
        The JSON header, checked by `check_header`.
    length
        The bytes of the file with all of its buffers, decompressed.
    path
        The file, for messages.
    """
    vertices, triangles = placed_size(header)
    if triangles > (most := MAX_COPIED_TRIANGLES + length // 3):  # no triangle takes less than three bytes
        raise InputError(
            f"{path}: its nodes and primitives make {triangles} triangles of the same data, at most {most} are "
            "allowed; place copies by a scene file, as `depthwalk convert` makes one"
        )
    check_mesh_memory(vertices, triangles, path)
