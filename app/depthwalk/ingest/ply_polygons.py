"""Rewrite PLY files of polygons as files of triangles, which the other readers read.

Blender and other modellers write faces of any number of corners. trimesh reads binary files only if all faces have
equally many, and cuts concave ones so that triangles leave them. Of text, triangles are rewritten, too: importing
trimesh takes longer than that.
"""

import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.triangulation import triangulated
from depthwalk.ingest.ply import INDICES, ORDERS, TYPES
from depthwalk.ingest.soup import check_mesh_memory, check_triangle_count
from depthwalk.types import Ints

_END = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)
_NAMES = {kind: name for name, kind in reversed(TYPES.items())}  # the shorter name of each type
_TEXTURE_COORDINATES = b"texcoord"
_AT_ONCE, _LINES_AT_ONCE = 1 << 20, 1 << 16  # numbers and lines that are read at once, which bounds the memory
_LONGEST_WORD = 400  # characters of a number in text; all words read at once take as much memory as the longest


class _Property(NamedTuple):
    """A number, or a list of numbers, of each record: its name and types, `length` that of the lists' lengths."""

    name: bytes
    kind: str
    length: str | None


@dataclass(frozen=True, kw_only=True)
class _Element:
    """Describe the records of a kind: vertices, faces or others."""

    name: bytes
    count: int
    properties: tuple[_Property, ...]

    @property
    def has_lists(self) -> bool:
        """Return whether records may differ in length."""
        return any(part.length for part in self.properties)


@dataclass(frozen=True, kw_only=True)
class _Columns:
    """Hold the values of all records of an element, by the names of their properties.

    Attributes
    ----------
    numbers
        (n,) of the property's type.
    lists
        (n,) the length of each list, and the values of all lists, one after the other.
    """

    numbers: dict[bytes, NDArray[Any]]
    lists: dict[bytes, tuple[Ints, NDArray[Any]]]


def with_triangles(data: bytes, path: Path) -> bytes | None:
    """Return a PLY file of polygons as one of triangles.

    Texture coordinates and colours of faces are kept; lists of vertices and other elements are left out.

    Parameters
    ----------
    data
        The contents of the file, binary or text.
    path
        The file, for messages.

    Returns
    -------
    bytes or None
        A binary file; None for binary files that have only triangles and no lists of vertices, and for files that have
        no faces or are damaged.

    Raises
    ------
    InputError
        If it has more triangles than are allowed, or they would take more memory than is allowed.
    """
    try:
        with np.errstate(invalid="ignore", over="ignore"):  # of text, infinity and NaN are cast to whole numbers
            return _with_triangles(data, path)
    # Damaged, or of no kind that is known: the other readers tell.
    except (ValueError, LookupError, OverflowError, StopIteration):
        return None


def _with_triangles(data: bytes, path: Path) -> bytes | None:
    """Do as `with_triangles`; raise ValueError, LookupError, OverflowError or StopIteration for damaged files."""
    order, elements, comments, start = _header(data)
    names = [element.name for element in elements]
    vertex, face = elements[names.index(b"vertex")], elements[names.index(b"face")]
    if not face.count:
        return None
    indices = next(part.name for part in face.properties if part.length and part.name in INDICES)
    last = max(map(names.index, (b"vertex", b"face")))
    columns = dict(zip(names[: last + 1], _read(order, elements[: last + 1], data, start), strict=True))
    sizes, corners = columns[b"face"].lists[indices]
    if order and (sizes == 3).all() and not vertex.has_lists:
        return None
    return _rewritten(columns[b"vertex"], columns[b"face"], (sizes, corners.astype(np.int64)), comments, path)


def _header(data: bytes) -> tuple[str, list[_Element], list[bytes], int]:
    """Return the byte order ("" for text), the elements, the comments, and where the header ends.

    Raises ValueError or LookupError for headers that cannot be read.
    """
    end = _END.search(data, 0, 1 << 16)
    if end is None:
        raise ValueError("no end of the header")
    lines = data[: end.start()].splitlines()
    comments = [line for line in lines if line.startswith((b"comment", b"obj_info"))]
    said = [words for words in map(bytes.split, lines[1:]) if words and words[0] not in (b"comment", b"obj_info")]
    if said[0][0] != b"format":
        raise ValueError("no format")
    found: list[tuple[bytes, int, list[_Property]]] = []
    for words in said[1:]:
        if words[0] == b"element":
            if not words[2].isdigit() or int(words[2]) > len(data):  # each record takes a byte at least
                raise ValueError("a number of records is none, or too large for the file")
            found.append((words[1], int(words[2]), []))
        elif words[0] != b"property":
            raise ValueError("neither an element nor a property")
        elif words[1] == b"list":
            found[-1][2].append(_Property(words[4], TYPES[words[3]], TYPES[words[2]]))
        else:
            found[-1][2].append(_Property(words[2], TYPES[words[1]], None))
    elements = [_Element(name=name, count=count, properties=tuple(parts)) for name, count, parts in found]
    for names in [name for name, _, _ in found], *([part.name for part in parts] for _, _, parts in found):
        if len(set(names)) < len(names):
            raise ValueError("two have one name")
    return "" if said[0][1] == b"ascii" else ORDERS[said[0][1]], elements, comments, end.end()


def _read(order: str, elements: Sequence[_Element], data: bytes, start: int) -> Iterator[_Columns]:
    """Yield the values of each element. Raises ValueError if the data end early, or are no numbers."""
    if order:
        for element in elements:
            columns, start = _binary(element, data, start, order)
            yield columns
        return
    lines = data[start:].splitlines()
    at = 0
    for element in elements:
        yield _text(element, lines[at : at + element.count])
        at += element.count


def _binary(element: _Element, data: bytes, start: int, order: str) -> tuple[_Columns, int]:
    """Return the values of an element whose records begin at `start`, and where they end."""
    octets = np.frombuffer(data, np.uint8)
    if not element.has_lists:
        record = np.dtype([(part.name.decode("latin-1"), order + part.kind) for part in element.properties])
        values = np.frombuffer(data, record, element.count, start)  # raises ValueError past the end
        numbers = {part.name: values[part.name.decode("latin-1")] for part in element.properties}
        return _Columns(numbers=numbers, lists={}), start + element.count * record.itemsize
    places, lengths, end = _walked(element, data, start, order)
    numbers, lists = {}, {}
    for part, place in zip(element.properties, places, strict=True):
        kind = np.dtype(order + part.kind)
        if part.length is None:
            numbers[part.name] = _gathered(octets, place, kind)
        else:
            count = lengths[part.name]
            step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            lists[part.name] = count, _gathered(octets, np.repeat(place, count) + step * kind.itemsize, kind)
    return _Columns(numbers=numbers, lists=lists), end


def _walked(element: _Element, data: bytes, start: int, order: str) -> tuple[list[Ints], dict[bytes, Ints], int]:
    """Find where the values of each record are, one record after the other.

    Returns the places (n,) of each property in `data`, of the first value of a list; the lengths (n,) of each list;
    and where the records end.
    """
    byte_order: Literal["little", "big"] = "little" if order == "<" else "big"
    steps, before, lists = [], 0, [part for part in element.properties if part.length]
    for part in element.properties:
        width = np.dtype(part.kind).itemsize
        if part.length is None:
            before += width
        else:
            steps.append((before, np.dtype(part.length).itemsize, width, array("q"), array("q")))
            before = 0
    at, begins = start, array("q")
    for _ in range(element.count):
        begins.append(at)
        for skipped, wide, width, firsts, lengths in steps:
            at += skipped + wide
            length = int.from_bytes(data[at - wide : at], byte_order)
            firsts.append(at)
            lengths.append(length)
            at += length * width
        at += before
        if at > len(data):
            raise ValueError("the file ends early")
    places: list[Ints] = []
    place, number = np.array(begins, np.int64), 0
    for part in element.properties:
        width = np.dtype(part.kind).itemsize
        if part.length is None:
            places.append(place)
            place = place + width
        else:
            places.append(np.array(steps[number][3], np.int64))
            place = places[-1] + np.array(steps[number][4], np.int64) * width
            number += 1
    return places, {part.name: np.array(step[4], np.int64) for part, step in zip(lists, steps, strict=True)}, at


def _gathered(octets: NDArray[np.uint8], places: Ints, kind: np.dtype[Any]) -> NDArray[Any]:
    """Return the numbers (n,) of type `kind` that begin at `places` (n,)."""
    parts = [
        octets[places[at : at + _AT_ONCE, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
        for at in range(0, len(places), _AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.zeros(0, kind)


def _text(element: _Element, lines: Sequence[bytes]) -> _Columns:
    """Return the values of an element, a line for each record."""
    if len(lines) < element.count:
        raise ValueError("the file ends early")
    parts = [lines[at : at + _LINES_AT_ONCE] for at in range(0, len(lines), _LINES_AT_ONCE)]
    rows = _equal_rows(element, np.concatenate([_numbers(part) for part in parts] or [np.zeros(0)]))
    return _by_line(element, lines) if rows is None else rows


def _numbers(lines: Sequence[bytes]) -> NDArray[np.float64]:
    """Return the numbers in lines of text. Raises ValueError for what is none."""
    words = b" ".join(lines).split()
    if max(map(len, words), default=0) > _LONGEST_WORD:
        raise ValueError("a number is too long")
    return np.array(words).astype(np.float64)


def _equal_rows(element: _Element, values: NDArray[np.float64]) -> _Columns | None:
    """Return the values of an element whose records are as long as the first one; None if they are not."""
    at, starts = 0, []  # of each property in the first record, and the number of its values
    for part in element.properties:
        length = 1 if part.length is None else int(values[at])
        starts.append((at + (part.length is not None), length))
        at = sum(starts[-1])
    if len(values) != at * element.count:
        return None
    table = values.reshape(element.count, at)
    numbers, lists = {}, {}
    for part, (start, length) in zip(element.properties, starts, strict=True):
        found = table[:, start : start + length].ravel().astype(part.kind)
        if part.length is None:
            numbers[part.name] = found
        elif (table[:, start - 1] != length).any():
            return None
        else:
            lists[part.name] = np.full(element.count, length), found
    return _Columns(numbers=numbers, lists=lists)


def _by_line(element: _Element, lines: Sequence[bytes]) -> _Columns:
    """Return the values of an element with lists of any length. Raises ValueError or LookupError for short lines."""
    numbers: dict[bytes, list[float]] = {part.name: [] for part in element.properties if part.length is None}
    lengths: dict[bytes, list[int]] = {part.name: [] for part in element.properties if part.length}
    items: dict[bytes, list[float]] = {name: [] for name in lengths}
    for line in lines:
        values = [float(word) for word in line.split()]
        at = 0
        for part in element.properties:
            if part.length is None:
                numbers[part.name].append(values[at])
                at += 1
                continue
            length = int(values[at])
            at += 1 + length
            if length < 0 or at > len(values):
                raise ValueError("a list ends early")
            lengths[part.name].append(length)
            items[part.name].extend(values[at - length : at])
    kinds = {part.name: part.kind for part in element.properties}
    return _Columns(
        numbers={name: np.array(found).astype(kinds[name]) for name, found in numbers.items()},
        lists={
            name: (np.array(found, np.int64), np.array(items[name]).astype(kinds[name]))
            for name, found in lengths.items()
        },
    )


def _rewritten(
    vertex: _Columns, face: _Columns, polygons: tuple[Ints, Ints], comments: Sequence[bytes], path: Path
) -> bytes:
    """Return a binary PLY file of the triangles of `polygons`: their sizes (P,), and the vertices of all corners.

    Raises LookupError if a vertex is missing, or vertices have no places.
    """
    sizes, corners = polygons
    count = int(np.maximum(sizes - 2, 0).sum())
    check_triangle_count(count, path)
    check_mesh_memory(len(vertex.numbers[b"x"]), count, path)
    positions = np.column_stack([vertex.numbers[name].astype(np.float64) for name in (b"x", b"y", b"z")])
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(positions):
        raise LookupError("a face refers to a vertex that does not exist")
    rows, polygon = triangulated(positions[corners], sizes)
    fields: list[tuple[str, Any]] = [("length", "u1"), ("corners", "<i4", 3)]  # type: ignore[list-item]
    lines = [b"property list uchar int vertex_indices"]
    values: dict[str, Any] = {"length": 3, "corners": corners[rows]}
    lengths, coordinates = face.lists.get(_TEXTURE_COORDINATES, (None, None))
    if lengths is not None and coordinates is not None and (lengths == 2 * sizes).all():
        fields += [("pairs", "u1"), ("uv", "<f4", 6)]  # type: ignore[list-item]
        lines.append(b"property list uchar float texcoord")
        values |= {"pairs": 6, "uv": coordinates.reshape(-1, 2)[rows].reshape(-1, 6)}
    records = [_records(vertex.numbers), _records({n: v[polygon] for n, v in face.numbers.items()}, fields, values)]
    head = [
        b"ply",
        b"format binary_little_endian 1.0",
        *comments,
        b"element vertex %d" % len(positions),
        *_declared(vertex.numbers),
        b"element face %d" % len(rows),
        *lines,
        *_declared(face.numbers),
        b"end_header\n",
    ]
    return b"\n".join(head) + b"".join(record.tobytes() for record in records)


def _declared(numbers: dict[bytes, NDArray[Any]]) -> list[bytes]:
    """Return the lines of a header that declare these properties."""
    return [b"property %s %s" % (_NAMES[values.dtype.str[1:]], name) for name, values in numbers.items()]


def _records(
    numbers: dict[bytes, NDArray[Any]],
    fields: Sequence[tuple[str, Any]] = (),
    values: dict[str, Any] | None = None,
) -> NDArray[np.void]:
    """Return records of the given `fields`, of the given `values`, and then of these properties, little-endian."""
    count = len(next(iter(numbers.values()))) if numbers else len((values or {})["corners"])
    own = [(f"own{number}", "<" + column.dtype.str[1:]) for number, column in enumerate(numbers.values())]
    records = np.zeros(count, np.dtype([*fields, *own]))
    for name, value in (values or {}).items():
        records[name] = value
    for (name, _), column in zip(own, numbers.values(), strict=True):
        records[name] = column
    return records
