"""Read OFF files (Geomview's Object File Format) by writing them as OBJ, so that all checks of OBJ files hold.

Line by line, so that messages name the right ones.
"""

import re
from pathlib import Path

from depthwalk.errors import InputError, quoted

_KIND = re.compile(
    rb"(ST)?(C)?(N)?(4)?(n)?OFF(?![a-z])[ \t]*(BINARY)?|(?=\d)", re.IGNORECASE
)  # the word may be missing
_CHANNELS = 3  # of a colour, which may have an alpha, too
_BYTE = 255.0
_FEWEST = 3  # corners of a face


def obj_from_off(data: bytes, path: Path) -> bytes:
    """Return the text of an OBJ file with the vertices, their colours, and the faces of an OFF file.

    Normals, texture coordinates and colours of faces are left out.

    Parameters
    ----------
    data
        The contents of the file, UTF-8.
    path
        The file, for messages.

    Returns
    -------
    bytes
        As many lines as the file has, the same on each.

    Raises
    ------
    InputError
        `path: defect` or `path:line: defect`, for other kinds of files, and for missing vertices and faces.
    """
    lines = [line.partition(b"#")[0].strip() for line in data.splitlines()]
    filled = [number for number, line in enumerate(lines) if line]
    kind = _KIND.match(lines[filled[0]]) if filled else None
    if kind is None:
        raise InputError(f"{path}: not an OFF file")
    if any(kind.group(4, 5, 6)):
        raise InputError(f"{path}: only OFF files of text, with three coordinates, are read")
    first = filled[0]
    lines[first] = lines[first][kind.end() :].strip()  # the numbers may follow in the same line
    at = [first, *filled[1:]] if lines[first] else filled[1:]
    vertices, faces = _counts(lines[at[0]] if at else b"", path, at[0] if at else first)
    if len(at) < 1 + vertices + faces:
        raise InputError(f"{path}: truncated: {len(at) - 1} lines for {vertices} vertices and {faces} faces")
    written = [b""] * len(lines)
    colours = slice(6, 9) if kind.group(3) else slice(3, 6)  # after a normal
    for number in at[1 : 1 + vertices]:
        written[number] = _vertex(lines[number].split(), colours if kind.group(2) else None)
    for number in at[1 + vertices : 1 + vertices + faces]:
        written[number] = _face(lines[number].split(), path, number)
    return b"\n".join(written)


def _counts(line: bytes, path: Path, number: int) -> tuple[int, int]:
    """Return how many vertices and faces a line announces."""
    words = line.split()
    if len(words) < 2 or not all(word.isdigit() and len(word) < 12 for word in words[:2]):
        raise InputError(f"{path}:{number + 1}: not the numbers of vertices and faces: {quoted(_shown(line))}")
    return int(words[0]), int(words[1])


def _vertex(words: list[bytes], colours: slice | None) -> bytes:
    """Return a line of OBJ for a vertex; its colour, in 0 to 1 there, may be one of bytes here."""
    line = b"v " + b" ".join(words[:3])
    channels = words[colours] if colours else []
    if len(channels) < _CHANNELS:
        return line
    is_byte = not any(b"." in channel for channel in channels)
    return line + b" " + b" ".join(_unit(channel) if is_byte else channel for channel in channels)


def _unit(channel: bytes) -> bytes:
    """Return a whole number of 0 to 255 as one of 0 to 1; OBJ's reader tells of anything else."""
    return repr(int(channel) / _BYTE).encode() if channel.isdigit() and len(channel) < 4 else channel


def _face(words: list[bytes], path: Path, number: int) -> bytes:
    """Return a line of OBJ for a face, whose vertices are numbered from 1 there."""
    corners = words[1 : 1 + int(words[0])] if words[0].isdigit() and len(words[0]) < 6 else []
    if not corners or len(corners) != int(words[0]) or not all(each.isdigit() and len(each) < 12 for each in corners):
        raise InputError(f"{path}:{number + 1}: not a face: {quoted(_shown(b' '.join(words)))}")
    if len(corners) < _FEWEST:  # an edge or a point
        return b""
    return b"f " + b" ".join(str(int(each) + 1).encode() for each in corners)


def _shown(line: bytes) -> str:
    return line.decode("utf-8", "replace")
