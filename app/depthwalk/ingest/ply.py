"""Read headers of PLY files, and rewrite them so that the reader finds colours under other names than the usual ones.

The names of properties in a PLY file are a convention (Turk 1994, "The PLY Polygon File Format"): colours are `red`,
`green` and `blue` today. MeshLab and older scanners wrote `diffuse_red`, `diffuse_green` and `diffuse_blue`.
"""

import re
from itertools import pairwise
from pathlib import Path

from depthwalk.errors import InputError

ORDERS = {b"binary_little_endian": "<", b"binary_big_endian": ">"}
TYPES = {
    b"char": "i1",
    b"uchar": "u1",
    b"short": "i2",
    b"ushort": "u2",
    b"int": "i4",
    b"uint": "u4",
    b"float": "f4",
    b"double": "f8",
    b"int8": "i1",
    b"uint8": "u1",
    b"int16": "i2",
    b"uint16": "u2",
    b"int32": "i4",
    b"uint32": "u4",
    b"float32": "f4",
    b"float64": "f8",
}
INDICES = b"vertex_index", b"vertex_indices"  # the lists of a face's corners

_FACES = re.compile(rb"^element[ \t]+(?:face|tristrips)[ \t]+0*[1-9]", re.MULTILINE)
_ELEMENT = re.compile(rb"^element[ \t]", re.MULTILINE)
_USUAL = re.compile(rb"^property[ \t]+\w+[ \t]+(?:red|green|blue)[ \t\r]*$", re.MULTILINE)
_SPLATS = re.compile(rb"^property[ \t]+\w+[ \t]+f_dc_2[ \t\r]*$", re.MULTILINE)
_PACKED_SPLATS = re.compile(rb"^property[ \t]+uint(?:32)?[ \t]+packed_position[ \t\r]*$", re.MULTILINE)
_DIFFUSE = re.compile(rb"^(property[ \t]+\w+[ \t]+)diffuse_(red|green|blue)(?=[ \t\r]*$)", re.MULTILINE)


def has_faces(header: bytes) -> bool:
    """Return whether the `header` of a PLY file, up to `end_header`, announces faces, or else only points."""
    return _FACES.search(header) is not None


def holds_splats(header: bytes) -> bool:
    """Return whether the `header` of a PLY file, up to `end_header`, announces plain Gaussian splats."""
    return not has_faces(header) and _SPLATS.search(header) is not None


def check_packing(header: bytes, path: Path) -> None:
    """Raise InputError if the `header` of the PLY file `path` announces splats as SuperSplat compresses them."""
    if _PACKED_SPLATS.search(header):
        raise InputError(f"{path}: Gaussian splats that are compressed; save them as an uncompressed PLY file")


def with_usual_colours(header: bytes) -> bytes:
    """Return the header of a PLY file with `red` in place of `diffuse_red`, and so on.

    Elements that have a colour by a usual name keep all of their names.

    Parameters
    ----------
    header
        The file up to `end_header`, lines that end with line feeds, or carriage returns and line feeds.

    Returns
    -------
    bytes
        The header; `header` itself if there is nothing to rename.
    """
    if not _DIFFUSE.search(header):
        return header
    starts = [0, *(element.start() for element in _ELEMENT.finditer(header)), len(header)]
    elements = [header[start:end] for start, end in pairwise(starts)]
    renamed = b"".join(element if _USUAL.search(element) else _DIFFUSE.sub(rb"\1\2", element) for element in elements)
    return header if renamed == header else renamed
