"""Parse FBX files, binary or text, into a tree of nodes; arrays are decoded only where they are asked for."""

import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError

_MAGIC = b"Kaydara FBX Binary  \x00"
_FIRST = 27  # where the first node of a binary file begins
_OLDEST = 7000  # earlier files store geometry in other nodes
_WIDE = 7500  # from this version on, lengths have 64 bits
_DEPTH = 64
_NODE_BYTES = 700  # memory per node; a binary node takes at least 13 bytes
_TEXT_BYTES = 8  # per byte of text, which is mostly arrays of numbers that are decoded one by one
_ARRAYS = {"f": "<f4", "d": "<f8", "l": "<i8", "i": "<i4", "b": "i1", "c": "i1"}
_SCALARS = {"Y": "<h", "C": "<B", "B": "<B", "I": "<i", "F": "<f", "D": "<d", "L": "<q"}
_TOKEN = re.compile(
    r"""(?:\s|;[^\n]*(?:\n|\Z))*+(?:
        (?P<open>\{) | (?P<close>\}) | (?P<comma>,) |
        (?P<key>[A-Za-z_][\w|.-]*)[ \t]*: |
        "(?P<text>[^"]*)" | \*(?P<length>\d+) | (?P<word>[^\s,{}";:*]+)
    )""",
    re.VERBOSE | re.ASCII,
)


class FbxArray:
    """Hold an array that is not decoded yet."""

    __slots__ = ("_budget", "_data", "_encoding", "_kind", "count")

    def __init__(self, kind: str, count: int, encoding: int, data: memoryview | str, budget: "ArrayBudget") -> None:
        self._kind, self.count, self._encoding, self._data = kind, count, encoding, data
        self._budget = budget

    def values(self) -> NDArray[Any]:
        """Return the numbers, (count,). Raises ValueError if there are others than announced."""
        if isinstance(self._data, str):
            self._budget.take(8 * self.count)
            numbers = np.array(self._data.replace(",", " ").split(), np.float64)
            if len(numbers) != self.count:
                raise ValueError(f"{len(numbers)} of {self.count} numbers")
            return numbers
        kind = np.dtype(_ARRAYS[self._kind])
        length = self.count * kind.itemsize
        data: bytes | memoryview = self._data
        if self._encoding:
            self._budget.take(length)
            decoder = zlib.decompressobj()
            data = decoder.decompress(self._data, length + 1)
        if len(data) != length:
            raise ValueError(f"{len(data)} of {length} bytes of an array")
        return np.frombuffer(data, kind)


class ArrayBudget:
    """Count the bytes of arrays that are decoded."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.decoded = 0

    def take(self, length: int) -> None:
        """Count further bytes. Raises InputError if all are too many for the memory."""
        self.decoded += length
        check_memory(self._path, 4 * self.decoded, f"{self.decoded} bytes of arrays")


class Node:
    """Hold a node: its name, its properties (numbers, text, bytes or arrays), and the nodes in it."""

    __slots__ = ("children", "name", "properties")

    def __init__(self, name: str, properties: list[Any]) -> None:
        self.name, self.properties = name, properties
        self.children: list[Node] = []

    def all(self, name: str) -> Iterator["Node"]:
        """Yield the nodes in it that have a name."""
        return (child for child in self.children if child.name == name)

    def find(self, name: str) -> "Node | None":
        """Return the first node in it that has a name; None if there is none."""
        return next(self.all(name), None)

    def first(self, name: str, default: Any = None) -> Any:
        """Return the first property of the first node in it that has a name; `default` if there is none."""
        found = self.find(name)
        return found.properties[0] if found is not None and found.properties else default

    def array(self, name: str) -> NDArray[Any] | None:
        """Return the numbers of an array in it; None if there is none."""
        found = self.find(name)
        if found is None or not found.properties:
            return None
        first = found.properties[0]
        return first.values() if isinstance(first, FbxArray) else np.array(found.properties, np.float64)


def parse_nodes(data: bytes, path: Path) -> tuple[Node, ArrayBudget]:
    """Parse an FBX file of version 7.0 or later.

    Returns
    -------
    A node of the nodes at the top, and the count of bytes that its arrays are decoded to.

    Raises
    ------
    InputError
        `path: defect`, also for an earlier version; damaged data also raise ValueError, struct.error and others.
    """
    budget = ArrayBudget(path)
    if data.startswith(_MAGIC):
        (version,) = struct.unpack_from("<I", data, 23)
        _check_version(version, path)
        return _Binary(data, path, budget, wide=version >= _WIDE).parse(), budget
    head = data[:4096].decode("latin-1")
    if "FBX" not in head:
        raise InputError(f"{path}: not an FBX file")
    found = re.search(r"FBXVersion[ \t]*:[ \t]*(\d+)", data[: 1 << 16].decode("latin-1"))
    if found is None:
        raise InputError(f"{path}: an FBX file without a version")
    _check_version(int(found[1]), path)
    return _parse_text(data, path, budget), budget


def _check_version(version: int, path: Path) -> None:
    if version < _OLDEST:
        raise InputError(
            f"{path}: FBX {version / 1000:.1f} is not read; save it as FBX 2011 (7.1) or later, or as .glb"
        )


class _Binary:
    """Parse a binary file."""

    def __init__(self, data: bytes, path: Path, budget: ArrayBudget, *, wide: bool) -> None:
        self._data, self._view = data, memoryview(data)
        self._path, self._budget = path, budget
        self._head = struct.Struct("<QQQB" if wide else "<IIIB")
        self._count = 0

    def parse(self) -> Node:
        root = Node("", [])
        self._nodes(_FIRST, len(self._data), root, 0)
        return root

    def _nodes(self, at: int, end: int, parent: Node, depth: int) -> None:
        """Parse the nodes between two places of the file into `parent`, up to an empty one."""
        if depth > _DEPTH:
            raise InputError(f"{self._path}: nodes nest deeper than {_DEPTH}")
        while at + self._head.size <= end:
            stop, count, length, named = self._head.unpack_from(self._data, at)
            if stop == 0:
                return
            start = at + self._head.size + named
            if stop > end or start + length > stop:
                raise InputError(f"{self._path}: truncated or damaged: a node at byte {at} does not fit")
            self._count += 1
            if self._count % 1024 == 0:
                check_memory(self._path, _NODE_BYTES * self._count, f"{self._count} nodes")
            name = self._data[start - named : start].decode("utf-8", "replace")
            node = Node(name, self._properties(start, start + length, count))
            parent.children.append(node)
            if stop > start + length:
                self._nodes(start + length, stop, node, depth + 1)
            at = stop

    def _properties(self, at: int, end: int, count: int) -> list[Any]:
        found: list[Any] = []
        data = self._data
        while at < end and len(found) < count:
            kind = chr(data[at])
            at += 1
            if kind in _SCALARS:
                found.append(struct.unpack_from(_SCALARS[kind], data, at)[0])
                at += struct.calcsize(_SCALARS[kind])
            elif kind in "SR":
                (length,) = struct.unpack_from("<I", data, at)
                raw = data[at + 4 : min(at + 4 + length, end)]
                found.append(raw.decode("utf-8", "replace") if kind == "S" else raw)
                at += 4 + length
            elif kind in _ARRAYS:
                items, encoding, length = struct.unpack_from("<III", data, at)
                length = length if encoding else items * np.dtype(_ARRAYS[kind]).itemsize
                found.append(FbxArray(kind, items, encoding, self._view[at + 12 : at + 12 + length], self._budget))
                at += 12 + length
            else:
                raise ValueError(f"property of the unknown kind {kind!r}")
        if at > end:
            raise ValueError("a property does not fit into its node")
        return found


def _parse_text(data: bytes, path: Path, budget: ArrayBudget) -> Node:
    """Parse a file of text."""
    check_memory(path, _TEXT_BYTES * len(data) + _NODE_BYTES * data.count(b":"), f"{len(data)} bytes of FBX text")
    text = data.decode("utf-8", "replace")
    root = Node("", [])
    open_nodes = [root]
    node = root
    at, length = 0, None
    match = _TOKEN.match
    while token := match(text, at):
        at = token.end()
        kind = token.lastgroup
        if kind == "key":
            node = Node(token["key"], [])
            open_nodes[-1].children.append(node)
            if node.name == "a" and length is not None:
                end = text.find("}", at)
                numbers = text[at : end if end >= 0 else len(text)]
                open_nodes[-1].properties = [FbxArray("d", length, 0, numbers, budget)]
                length, at = None, end if end >= 0 else len(text)
        elif kind == "open":
            open_nodes.append(node)
            if len(open_nodes) > _DEPTH:
                raise InputError(f"{path}: nodes nest deeper than {_DEPTH}")
        elif kind == "close":
            if len(open_nodes) == 1:
                raise InputError(f"{path}:{_line(text, at)}: a '}}' too many")
            open_nodes.pop()
        elif kind == "text":
            node.properties.append(token["text"].replace("&quot;", '"'))
        elif kind == "length":
            length = int(token["length"])
        elif kind == "word":
            node.properties.append(_word(token["word"]))
    if len(open_nodes) > 1:
        raise InputError(f"{path}: truncated: {len(open_nodes) - 1} nodes do not end")
    if text[at:].strip() and not text[at:].lstrip().startswith(";"):
        raise InputError(f"{path}:{_line(text, at)}: not FBX text")
    return root


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _word(word: str) -> Any:
    """Return a number, or the word as it is, such as T or Y for what is true."""
    try:
        return int(word)
    except ValueError:
        pass
    try:
        return float(word)
    except ValueError:
        return word
