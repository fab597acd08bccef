"""Parse Wavefront OBJ text into arrays, with every defect located by its line.

NumPy does the parsing: lines are classified by their first bytes, and all numbers of a kind are parsed at once. Time
and memory grow linearly with the file, whatever it holds. It does not go through trimesh, which takes most of a second
to import, wraps indices out of range, counts relative indices from the end of the file, drops texture coordinates where
faces are written in different ways, and needs time quadratic in the number of `usemtl` lines.
"""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError

_NUMBER = rb"[-+.\deEnNaAiIfFtTyY]+"
_VERTEX = re.compile(rb"v %b %b %b(?: .*)?" % ((_NUMBER,) * 3))
_CORNER = re.compile(rb"-?\d+(?:/(?:-?\d+)?(?:/(?:-?\d+)?)?)?")
_KINDS = ((b"v", "vertex"), (b"vt", "texture coordinate"), (b"vn", "normal"))
_NEWLINE, _BLANK, _SLASH = b"\n /"
_FACE_BYTES = b"0123456789-/ "
_OTHER_SPACES = b"\t\x0b\x0c"

Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
Numbers = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ObjMesh:
    """Hold the polygons of an OBJ file, still with separate indices for vertices, texture coordinates and normals.

    Attributes
    ----------
    vertices
        (V, 3) float64 positions, in the frame and unit of the file.
    colours : (V, 3) float64 or None
        sRGB from 0 to 1, written after the coordinates; None unless every vertex has them.
    texture : (T, 2) float64 or None
        Texture coordinates u and v, in widths and heights of the image, v upward; None if the file has none.
    normals : (N, 3) float64 or None
        Directions in the frame of the file, of any length; None if the file has none.
    corners : (C, 3) int64
        Vertex, texture coordinate and normal of every polygon corner, counted from 1; 0 where absent.
    sizes : (P,) int64
        Corners of each polygon, at least 3; they follow one another in `corners`.
    group : (P,) int64
        Index into `material_names` of each polygon.
    material_names : tuple of str or None
        Names after `usemtl` in the order of their first polygon; None for polygons before the first `usemtl`.
    """

    vertices: Numbers
    colours: Numbers | None
    texture: Numbers | None
    normals: Numbers | None
    corners: Indices
    sizes: Indices
    group: Indices
    material_names: tuple[str | None, ...]

    @property
    def triangle_count(self) -> int:
        """Return how many triangles the polygons make."""
        return int((self.sizes - 2).sum())


def parse_obj(data: bytes, path: Path) -> ObjMesh:
    """Parse the text of an OBJ file, in UTF-8.

    Parameters
    ----------
    data
        The text, in UTF-8.
    path
        The file, for messages.

    Returns
    -------
    ObjMesh
        The polygons; none if the file has points alone.

    Raises
    ------
    InputError
        `path:line: defect` for damaged vertices and faces and for indices out of range; `path: no faces` for lines.
    """
    lines = _Lines(_tidy(data), path)
    columns = _numbers(lines, lines.of(b"v"), b"v")
    polygons = lines.of(b"f")
    if not polygons.any():
        if lines.of(b"l").any():
            raise InputError(f"{path}: no faces; lines alone are not drawn")
        return _points(columns, _numbers(lines, lines.of(b"vn"), b"vn"))
    sizes = lines.blanks[polygons]
    if sizes.min() < 3:
        raise lines.error(polygons, int(np.argmax(sizes < 3)), "a face needs at least three corners")
    corners = _absolute(lines, _corners(lines, polygons), sizes)
    group, names = _groups(lines, polygons)
    texture, normals = (_numbers(lines, lines.of(key), key) for key in (b"vt", b"vn"))
    return ObjMesh(
        vertices=columns[:, :3],
        colours=_colours(columns),
        texture=texture[:, :2] if texture.shape[1] >= 2 else None,
        normals=normals if normals.shape[1] == 3 else None,
        corners=corners,
        sizes=sizes,
        group=group,
        material_names=names,
    )


def _points(columns: Numbers, normals: Numbers) -> ObjMesh:
    """Return the vertices of a file without polygons, from the numbers (v, c) of its vertices.

    Its normals (n, 3) belong to them in the same order, if there are as many: no face tells.
    """
    return ObjMesh(
        vertices=columns[:, :3].reshape(-1, 3),
        colours=_colours(columns),
        texture=None,
        normals=normals if normals.shape == (len(columns), 3) else None,
        corners=np.zeros((0, 3), np.int64),
        sizes=np.zeros(0, np.int64),
        group=np.zeros(0, np.int64),
        material_names=(),
    )


def _colours(columns: Numbers) -> Numbers | None:
    """Return the colours (v, 3) among the numbers (v, c) of vertices; None if there are none."""
    return columns[:, 3:6] if columns.shape[1] >= 6 else None


class _Lines:
    """Hold the lines of a tidied text, classified by their first word.

    Attributes
    ----------
    starts, ends
        (n,) int64, the beginning of each line, and the position of its newline.
    blanks
        (n,) int64, the number of blanks in each line, which is one less than its words.
    """

    def __init__(self, text: bytes, path: Path) -> None:
        self.text = text + b"\n\n\n"  # so that three bytes can be read from the start of any line
        self.path = path
        self.bytes = np.frombuffer(self.text, np.uint8)
        self.ends = np.flatnonzero(self.bytes[: len(text) + 1] == _NEWLINE)
        self.starts = np.concatenate([[0], self.ends[:-1] + 1])
        self.blanks = np.add.reduceat(self.bytes[: len(text) + 1] == _BLANK, self.starts, dtype=np.int64)

    def of(self, key: bytes) -> Mask:
        """Return which lines have the first word `key` followed by a blank."""
        mask = self.bytes[self.starts] == key[0]
        at = np.flatnonzero(mask)
        # One byte at a time: a mismatch ends before the padding does.
        for offset, byte in enumerate(key[1:] + b" ", start=1):
            at = at[self.bytes[self.starts[at] + offset] == byte]
        mask[:] = False
        mask[at] = True
        return np.asarray(mask)

    def joined(self, mask: Mask, key: bytes) -> bytes:
        """Return the text after `key` on the lines of `mask`, joined by single blanks."""
        first, after = int(np.argmax(mask)), len(mask) - int(np.argmax(mask[::-1]))
        if mask[first:after].all():  # one block, as in most files
            text = self.text[self.starts[first] : self.ends[after - 1]]
        else:
            text = self.bytes[: self.ends[-1] + 1][np.repeat(mask, self.ends - self.starts + 1)].tobytes()[:-1]
        return text[len(key) + 1 :].replace(b"\n" + key + b" ", b" ")

    def line(self, index: "int | np.integer") -> bytes:
        """Return the text of a line."""
        return self.text[self.starts[index] : self.ends[index]]

    def error(self, mask: Mask, number: int, defect: str) -> InputError:
        """Return the error about line `number` of those in `mask`."""
        return InputError(f"{self.path}:{np.flatnonzero(mask)[number] + 1}: {defect}")


def _tidy(data: bytes) -> bytes:
    """Leave one blank between words, none at the ends of lines, and no comments or continued lines.

    Line numbers are preserved. Comments are removed first: a backslash at the end of one continues nothing.
    """
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:  # searching a single byte takes no time
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in data:
        data = re.sub(rb"(?:^|(?<=\s))#.*", b"", data, flags=re.MULTILINE)
    if b"\\" in data and b"\\\n" in data:
        data = re.sub(rb"^.*\\\n(?:.*\\\n)*.*", _joined, data, flags=re.MULTILINE)
    if any(space in data for space in _OTHER_SPACES):
        data = data.translate(bytes.maketrans(_OTHER_SPACES, b" " * len(_OTHER_SPACES)))
    if _has_idle_blanks(data):
        data = re.sub(rb" {2,}", b" ", data)
        data = data.replace(b"\n ", b"\n").replace(b" \n", b"\n").strip(b" ")
    return data


def _has_idle_blanks(data: bytes) -> bool:
    """Return whether any blank of a text is at the end of a line or next to another blank."""
    values = np.frombuffer(data, np.uint8)
    blank, newline = values == _BLANK, values == _NEWLINE
    space = blank | newline
    at_ends = data.startswith(b" ") or data.endswith(b" ")
    return at_ends or bool((space[1:] & blank[:-1]).any() or (newline[:-1] & blank[1:]).any())


def _joined(lines: re.Match[bytes]) -> bytes:
    """Join lines that end with a backslash, and append as many empty lines."""
    return lines[0].replace(b"\\\n", b" ") + b"\n" * lines[0].count(b"\\\n")


def _numbers(lines: _Lines, mask: Mask, key: bytes) -> Numbers:
    """Return the numbers of the lines of `mask`, as many columns as the shortest of them has; (0, 0) without lines."""
    if key == b"v":
        bare = (lines.bytes[lines.starts] == key[0]) & (lines.ends - lines.starts == 1)
        if (short := bare | (mask & (lines.blanks < 3))).any():
            raise _bad_vertex(lines, mask | short)
    if not mask.any():
        return np.zeros((0, 0))
    counts = lines.blanks[mask]
    values = _parsed(lines.joined(mask, key), np.float64)
    if values is None or len(values) != counts.sum():
        raise _bad_number(lines, mask, key)
    if (width := counts.min()) == counts.max():
        return np.asarray(values.reshape(-1, width))
    first = np.cumsum(counts) - counts
    return np.asarray(values[first[:, None] + np.arange(width)])


def _parsed(text: bytes, dtype: type[np.float64] | type[np.int64]) -> NDArray[Any] | None:
    """Return all numbers of a text; None if it holds anything else. Numbers may touch: the caller counts them."""
    with warnings.catch_warnings():
        # Only this message: the filter applies to all threads, and some are importing libraries.
        warnings.filterwarnings("error", message="string or file could not be read")
        try:
            return np.fromstring(text.decode("ascii"), dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            return None


def _bad_vertex(lines: _Lines, mask: Mask) -> InputError:
    at = (n for n, index in enumerate(np.flatnonzero(mask)) if not _VERTEX.fullmatch(lines.line(index)))
    return lines.error(mask, next(at), "a vertex needs three numbers")


def _bad_number(lines: _Lines, mask: Mask, key: bytes) -> InputError:
    """Return the error about the first line of `mask` with a word that is not a number."""
    if key == b"v" and not all(_VERTEX.fullmatch(lines.line(index)) for index in np.flatnonzero(mask)):
        return _bad_vertex(lines, mask)
    for number, index in enumerate(np.flatnonzero(mask)):
        for word in lines.line(index).split(b" ")[1:]:
            if not _is_number(word):
                shown = word[:40].decode(errors="replace")
                return lines.error(mask, number, f"cannot read the number {shown!r}")
    raise AssertionError("numbers that are wrong together and right one by one")


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word  # which only Python allows


def _corners(lines: _Lines, polygons: Mask) -> Indices:
    """Return vertex, texture coordinate and normal (C, 3) of all corners as written; 0 where absent."""
    joined = lines.joined(polygons, b"f")
    corners = None
    if not joined.translate(None, _FACE_BYTES):
        columns = _columns(joined)
        corners = _mixed_corners(joined) if columns is None else _uniform_corners(joined, columns)
    if corners is None:
        faces = [lines.line(index)[2:] for index in np.flatnonzero(polygons)]
        wrong = next((i for i, f in enumerate(faces) if not all(map(_CORNER.fullmatch, f.split(b" ")))), 0)
        shown = faces[wrong][:40].decode(errors="replace")
        raise lines.error(polygons, wrong, f"cannot read the face {shown!r}")
    return corners


def _columns(joined: bytes) -> list[int] | None:
    """Return which of vertex, texture coordinate and normal every corner names; None if corners differ."""
    if b"/" not in joined:
        return [0]
    text = np.frombuffer(joined + b" ", np.uint8)
    slash = text == _SLASH
    ends = np.flatnonzero(text == _BLANK)
    starts = np.concatenate([[0], ends[:-1] + 1])
    count = np.add.reduceat(slash, starts, dtype=np.int64)
    doubled = np.add.reduceat(slash[:-1] & slash[1:], starts, dtype=np.int64)
    if slash[starts].any() or slash[ends - 1].any() or (count != count[0]).any() or (doubled != doubled[0]).any():
        return None
    return {(1, 0): [0, 1], (2, 0): [0, 1, 2], (2, 1): [0, 2]}.get((int(count[0]), int(doubled[0])))


def _uniform_corners(joined: bytes, columns: list[int]) -> Indices | None:
    values = _parsed(joined.replace(b"//", b" ").replace(b"/", b" "), np.int64)
    count = joined.count(b" ") + 1
    if values is None or len(values) != count * len(columns):
        return None
    corners = np.zeros((count, 3), np.int64)
    corners[:, columns] = values.reshape(count, len(columns))
    return corners


def _mixed_corners(joined: bytes) -> Indices | None:
    words = joined.split(b" ")
    if not all(map(_CORNER.fullmatch, words)):
        return None
    padded = [[part or b"0" for part in (word + b"//").split(b"/")[:3]] for word in words]
    try:
        return np.array(padded).astype(np.int64)
    except (ValueError, OverflowError):
        return None


def _absolute(lines: _Lines, corners: Indices, sizes: Indices) -> Indices:
    """Return `corners` (C, 3) with relative indices resolved. Raises InputError for the first one out of range."""
    polygons = lines.of(b"f")
    polygon = np.repeat(np.arange(len(sizes)), sizes)
    result = corners.copy()
    for column, (key, name) in enumerate(_KINDS):
        written, declared = corners[:, column], lines.of(key)
        total = np.count_nonzero(declared)
        if (relative := written < 0).any():
            known = np.cumsum(declared)[polygons][polygon]  # number declared above the polygon
            result[:, column] = np.where(relative, written + known + 1, written)
        least = 1 if column == 0 else np.where(relative, 1, 0)
        wrong = (result[:, column] < least) | (result[:, column] > total)
        if wrong.any():
            at = int(np.argmax(wrong))
            raise lines.error(polygons, int(polygon[at]), f"face refers to {name} {written[at]} of {total}")
    return result


def _groups(lines: _Lines, polygons: Mask) -> tuple[Indices, tuple[str | None, ...]]:
    """Return the material of each polygon as a number, and the names by number in the order of their first polygon."""
    changes = lines.of(b"usemtl")
    if not changes.any():
        return np.zeros(np.count_nonzero(polygons), np.int64), (None,)
    written: list[str | None] = [None]
    written += [lines.line(index)[7:].decode("utf-8", "replace") for index in np.flatnonzero(changes)]
    numbers = {name: number for number, name in enumerate(dict.fromkeys(written))}
    used = np.array([numbers[name] for name in written])[np.cumsum(changes)[polygons]]
    distinct, first, group = np.unique(used, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    names = list(numbers)
    return rank[group], tuple(names[number] for number in distinct[order])
