"""Read binary STL and PLY files as the arrays of records that they are.

trimesh reads them, too, and any other PLY file. But importing it takes most of a second, longer than all else until the
first picture of a small model, and the soup of a large one takes twice the memory.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.materials import plain_material
from depthwalk.ingest.ply import INDICES, ORDERS, TYPES, with_usual_colours
from depthwalk.ingest.soup import (
    Soup,
    absent,
    check_geometry,
    check_mesh_memory,
    check_triangle_count,
    unit_normals,
    white,
)

_STL_HEADER = 84  # bytes: any 80, and the number of triangles
_STL_COLOUR = b"COLOR="  # in the header, followed by red, green, blue and alpha
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

_LONGEST_HEADER = 1 << 14  # bytes, of PLY files that are read here
_COUNT = re.compile(rb"[1-9]\d{0,9}")
_PLACE, _NORMAL, _COLOUR = (b"x", b"y", b"z"), (b"nx", b"ny", b"nz"), (b"red", b"green", b"blue")
_ELSEWHERE = {b"s", b"t", b"u", b"v", b"texture_u", b"texture_v"}  # texture coordinates, which divide vertices


class _PlyLayout(NamedTuple):
    """Where the numbers of a PLY file of triangles are: its header's length, and the records of its two elements."""

    start: int
    vertices: int
    vertex: np.dtype[Any]
    faces: int
    face: np.dtype[Any]


def read_binary_stl(data: bytes, path: Path) -> Soup | None:
    """Read the triangles of a binary STL file, each with three vertices of its own, and their colours.

    Their normals are left out.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages.

    Returns
    -------
    Soup or None
        The triangles, in the frame and unit of the file; None if its length is not that of a binary file.

    Raises
    ------
    InputError
        `path: defect`.
    """
    count = int.from_bytes(data[80:_STL_HEADER], "little")
    if len(data) != _STL_HEADER + _STL_TRIANGLE.itemsize * count:
        return None
    check_triangle_count(count, path)
    check_mesh_memory(3 * count, count, path)
    triangles = np.frombuffer(data, _STL_TRIANGLE, count, _STL_HEADER)
    colours = _stl_colours(data[: _STL_HEADER - 4], triangles["attribute"])
    return _soup(
        triangles["corners"].reshape(-1, 3),
        np.arange(3 * count).reshape(-1, 3),
        path,
        colours=None if colours is None else np.repeat(colours, 3, axis=0),
    )


def _stl_colours(header: bytes, attributes: NDArray[np.uint16]) -> NDArray[np.uint8] | None:
    """Return the colours (F, 3), sRGB, of the triangles of a binary STL file; None if it has none.

    The format has none, but programs write five bits for each channel into the `attributes` (F,). Magics gives the
    colour of the whole in the `header`; triangles without the highest bit have their own, red in the lowest bits.
    VisCAM and SolidView mark the triangles that have their own by the highest bit, and write blue in the lowest.
    """
    marked, start = attributes >> 15 == 1, header.find(_STL_COLOUR)
    whole = header[start + len(_STL_COLOUR) :][:3] if start >= 0 else b""
    is_magics = len(whole) == 3
    if not is_magics and not marked.any():
        return None
    own = ~marked if is_magics and attributes.any() else marked & (not is_magics)
    channels = np.stack([attributes >> shift & 31 for shift in ((0, 5, 10) if is_magics else (10, 5, 0))], axis=1)
    shades = np.round(channels * (255 / 31)).astype(np.uint8)
    return np.where(own[:, None], shades, np.frombuffer(whole, np.uint8) if is_magics else np.uint8(255))


def read_binary_ply(data: bytes, path: Path) -> Soup | None:
    """Read the triangles of a binary PLY file of the kind that most programs write.

    That is one of vertices with single numbers each, followed by faces of three vertices each and nothing else, without
    texture coordinates, and with colours, if any, of one byte a channel.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages.

    Returns
    -------
    Soup or None
        The triangles, in the frame and unit of the file; None for files of any other kind, and for damaged ones.

    Raises
    ------
    InputError
        `path: defect`.
    """
    layout = _ply_layout(data)
    if layout is None:
        return None
    middle = layout.start + layout.vertices * layout.vertex.itemsize
    if len(data) != middle + layout.faces * layout.face.itemsize:
        return None
    vertex = np.frombuffer(data, layout.vertex, layout.vertices, layout.start)
    face = np.frombuffer(data, layout.face, layout.faces, middle)
    if (face["corners"] != 3).any():
        return None
    check_triangle_count(layout.faces, path)
    check_mesh_memory(layout.vertices, layout.faces, path)
    positions, normals, colours = (_columns(vertex, names) for names in (_PLACE, _NORMAL, _COLOUR))
    assert positions is not None  # or there would be no layout
    return _soup(positions, face["indices"], path, normals=normals, colours=colours)


def _ply_layout(data: bytes) -> _PlyLayout | None:
    """Return the layout of a binary PLY file of triangles; None for anything else."""
    head = data[:_LONGEST_HEADER]
    end = head.find(b"\n", head.find(b"\nend_header") + 1)
    lines = [line.split() for line in with_usual_colours(head[:end]).splitlines()]
    if not lines or lines[-1] != [b"end_header"] or lines[0] != [b"ply"] or b"texturefile" in head[:end].lower():
        return None
    said = [words for words in lines[1:-1] if words[:1] not in ([], [b"comment"], [b"obj_info"])]
    order = ORDERS.get(said[0][1]) if said and len(said[0]) == 3 and said[0][0] == b"format" else None
    starts = [number for number, words in enumerate(said) if words[0] == b"element"]
    if order is None or len(starts) != 2 or starts[0] != 1:
        return None
    vertices, faces = said[1 : starts[1]], said[starts[1] :]
    counts = [int(words[2]) for words in (vertices[0], faces[0]) if len(words) == 3 and _COUNT.fullmatch(words[2])]
    vertex, face = _vertex_record(vertices[1:], order), _face_record(faces[1:], order)
    if vertex is None or face is None or [vertices[0][1:2], faces[0][1:2]] != [[b"vertex"], [b"face"]]:
        return None
    return _PlyLayout(end + 1, counts[0], vertex, counts[1], face) if len(counts) == 2 else None


def _vertex_record(properties: list[list[bytes]], order: str) -> np.dtype[Any] | None:
    """Return the record of a vertex; None if it has lists, unknown types, colours of other types or no place."""
    types = {words[2]: TYPES[words[1]] for words in properties if len(words) == 3 and words[1] in TYPES}
    colours = [types[name] for name in (*_COLOUR, b"alpha") if name in types]
    if len(types) != len(properties) or not set(_PLACE) <= types.keys() or types.keys() & _ELSEWHERE:
        return None
    if any(kind != "u1" for kind in colours) or not (b"alpha" not in types or set(_COLOUR) <= types.keys()):
        return None
    if any(words[0] != b"property" for words in properties):
        return None
    return np.dtype([(name.decode("latin-1"), order + kind) for name, kind in types.items()])


def _face_record(properties: list[list[bytes]], order: str) -> np.dtype[Any] | None:
    """Return the record of a face of three vertices; None if it has anything else."""
    if len(properties) != 1 or len(properties[0]) != 5 or properties[0][:2] != [b"property", b"list"]:
        return None
    _, _, length, kind, name = properties[0]
    types = TYPES.get(length, "f4"), TYPES.get(kind, "f4")
    if name not in INDICES or any(each[0] == "f" for each in types):
        return None
    return np.dtype([("corners", order + types[0]), ("indices", order + types[1], 3)])


def _columns(vertex: NDArray[np.void], names: tuple[bytes, ...]) -> NDArray[Any] | None:
    """Return the properties `names` of the records (V,), (V, k) of their common type; None if any is missing."""
    wanted = [name.decode() for name in names]
    if not set(wanted) <= set(vertex.dtype.names or ()):
        return None
    return np.column_stack([vertex[name] for name in wanted])


def _soup(
    positions: NDArray[Any],
    faces: NDArray[Any],
    path: Path,
    *,
    normals: NDArray[Any] | None = None,
    colours: NDArray[np.uint8] | None = None,
) -> Soup:
    """Return the soup of vertices (V, 3) and faces (F, 3) of any types, which are checked, without a material."""
    check_geometry(positions, faces, path)
    count = len(positions)
    if normals is not None:
        with np.errstate(invalid="ignore"):  # signalling NaN warn when they are converted
            normals = unit_normals(unit_normals(normals.astype(np.float64)) + 0.0)  # twice, as trimesh's are
    return Soup(
        positions=positions.astype(np.float64) + 0.0,
        normals=absent(count, 3) if normals is None else normals,
        colours=white(count) if colours is None else colours,
        uv=absent(count, 2),
        faces=faces.astype(np.int64),
        material=np.zeros(len(faces), np.int64),
        materials=(plain_material(colours is not None),),
    )
