"""Parse YAML text into plain values that remember their position, so that every error can cite line and column.

`yaml_nodes` composes the text into nodes with positions. This module turns them into values, because scene files need
few of YAML's types, and because it limits what aliases may take.
"""

import codecs
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from depthwalk.errors import InputError, missing_file, quoted
from depthwalk.ingest.formats import MESH_SUFFIXES, SCENE_SUFFIXES, content
from depthwalk.limits import MAX_SCENE_BYTES
from depthwalk.scene.yaml_nodes import (
    MAX_YAML_DEPTH,
    SCALAR_TYPES,
    TEXT_TYPES,
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    at_offset,
    compose,
    located,
)

Loc = tuple[str | int, ...]
"""Location of a value in a document: keys and list indices from the root."""

MAX_ALIASED_NODES = 10_000  # that aliases may add to the text; a "billion laughs" file adds 10^9
_OTHER_TEXTS = ".html", ".csv"  # endings of text files that are no scenes; others may be, whatever they are called
_LONGEST_LABEL = 68  # characters; the label of 64 nested groups would fill a screen
_MAX_INTEGER = 2**53  # above it a double no longer holds every integer


@dataclass(frozen=True)
class Document:
    """Hold a parsed YAML file: its values, and the position of each in the text.

    Attributes
    ----------
    name
        The path as the user gave it; errors cite it.
    root
        The root node of the text, with positions.
    value
        The values of the file: None, bool, int, float, str, list or dict, nested.
    empty
        The locations of the keys after which nothing stands, which YAML takes for null.
    """

    name: str
    root: Node
    value: Any
    empty: tuple[Loc, ...] = ()

    def holds(self, loc: Loc) -> bool:
        """Return whether the text itself holds a value at the location `loc`, keys and list indices from the root."""
        return len(list(_nodes_along(self.root, loc))) == len(loc) + 1

    def where(self, loc: Loc, *, at_key: bool = False) -> str:
        """Return the position of a value in the text, or of its nearest parent that the text holds.

        Parameters
        ----------
        loc
            Keys and list indices from the root to the value.
        at_key
            Whether to return the position of the value's key instead.

        Returns
        -------
        str
            `file:line:column`, counted from 1.
        """
        key, value = list(_nodes_along(self.root, loc))[-1]
        nothing = isinstance(value, ScalarNode) and value.text == ""  # `key:` alone: YAML puts the value a line later
        return _where(self.name, key if key is not None and (at_key or nothing) else value)

    def places(self, key: str) -> dict[str, str]:
        """Return where the members of the mapping at a `key` of the root stand, as an error about each begins."""
        value = list(_nodes_along(self.root, (key,)))[-1][1]
        members = value.pairs() if isinstance(value, MappingNode) else ()
        named = [(name.text, child) for name, child in members if isinstance(name, ScalarNode)]
        return {name: f"{_where(self.name, child)}: {label((key, name))}" for name, child in named}

    def error(self, loc: Loc, message: str, *, at_key: bool = False) -> InputError:
        """Return an error about a value of the document.

        Parameters
        ----------
        loc
            Keys and list indices from the root to the value.
        message
            What is wrong with it.
        at_key
            Whether to cite the position of the value's key instead of its own.

        Returns
        -------
        InputError
            `file:line:column: loc: message`, counted from 1.
        """
        return _labelled(self.where(loc, at_key=at_key), loc, message)


def label(loc: Loc) -> str:
    """Return the location `loc` as text: `objects[3].scale` for ("objects", 3, "scale")."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{_printable(part)}" for part in loc).removeprefix(".")
    return text if len(text) <= _LONGEST_LABEL else f"{text[: _LONGEST_LABEL // 2]}...{text[-_LONGEST_LABEL // 2 :]}"


def read_document(path: Path) -> Document:
    """Parse a YAML file.

    Parameters
    ----------
    path
        The file; errors cite it as given.

    Returns
    -------
    Document
        The values of the file and their positions.

    Raises
    ------
    InputError
        With line and column, if the file cannot be read, is not YAML, or is larger or nested deeper than the limits.
    """
    return parse_document(decoded(read_bytes(path), path), str(path))


def parse_document(text: str, name: str) -> Document:
    """Parse YAML text, which errors cite as the file `name`.

    Raises InputError, with line and column, if the text is not YAML or is nested deeper than the limits.
    """
    root = compose(text, name)
    if root is None:
        raise located(name, 0, 0, "the file is empty")
    reader = _Reader(name, text)
    value = reader.value(root, ())
    return Document(name, root, value, tuple(reader.empty))


def read_bytes(path: Path) -> bytes:
    """Return the contents of the YAML file `path`. Raises InputError if it cannot be read or is too large."""
    try:
        if not path.is_file():  # reading a named pipe would block
            raise missing_file(path)
        with path.open("rb") as file:
            data = file.read(MAX_SCENE_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    suffix = path.suffix.lower()
    is_other = suffix in _OTHER_TEXTS or (b"\0" in data and suffix not in SCENE_SUFFIXES)
    if is_other and (known := content(path)):
        raise InputError(f"{path}: {known[0]}, no scene; {known[1]}")
    if len(data) > MAX_SCENE_BYTES:
        raise located(str(path), 0, 0, f"the file is larger than {MAX_SCENE_BYTES >> 20} MiB")
    return data


def decoded(data: bytes, path: Path) -> str:
    """Return the text of the YAML file `path`, which holds `data`, without its byte order mark.

    Raises InputError, with line and column, if it is not UTF-8.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) and len(data) % 2 == 0:
            raise located(str(path), 0, 0, "UTF-16 text; save it as UTF-8") from None
        if b"\0" in data:  # depth images, say
            meshes = ", ".join(MESH_SUFFIXES)
            message = f"binary, not UTF-8 text; scenes and camera paths are YAML, meshes end in {meshes}"
            raise located(str(path), 0, 0, message) from None
        before = data[: error.start].decode("utf-8-sig", errors="replace")
        raise at_offset(str(path), before, f"not UTF-8 text (byte 0x{data[error.start]:02x})") from None


def _nodes_along(root: Node, loc: Loc) -> Iterator[tuple[Node | None, Node]]:
    """Yield (key node, value node) from the root towards `loc`, as far as the text holds it."""
    key: Node | None = None
    node = root
    yield key, node
    for part in loc:
        if isinstance(node, SequenceNode) and isinstance(part, int) and part < len(node.items):
            key, node = None, node.items[part]
        elif isinstance(node, MappingNode):
            pairs = node.pairs()
            found = next((pair for pair in pairs if isinstance(pair[0], ScalarNode) and pair[0].text == part), None)
            if found is None:
                return
            key, node = found
        else:
            return
        yield key, node


class _Reader:
    """Turn nodes into plain values. Raises a located InputError for YAML features that scene files do not use."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.text = text
        self.seen: set[int] = set()
        self.aliased = 0
        self.empty: list[Loc] = []

    @cached_property
    def lines(self) -> list[str]:
        return self.text.splitlines()

    def error(self, node: Node, loc: Loc, message: str) -> InputError:
        return _labelled(_where(self.name, node), loc, message)

    def value(self, node: Node, loc: Loc) -> Any:
        if len(loc) > MAX_YAML_DEPTH:  # an alias may hold itself
            raise self.error(node, loc, "nested too deeply")
        if id(node) in self.seen:
            self.aliased += 1
            if self.aliased > MAX_ALIASED_NODES:
                raise self.error(node, loc, f"aliases repeat more than {MAX_ALIASED_NODES} values")
        self.seen.add(id(node))
        if isinstance(node, ScalarNode):
            return self.scalar(node, loc)
        if node.tag not in ("map", "seq"):
            raise self.error(node, loc, f"the tag {quoted(node.tag)} is not allowed")
        if isinstance(node, SequenceNode):
            return [self.value(child, (*loc, i)) for i, child in enumerate(node.items)]
        assert isinstance(node, MappingNode)
        return self.mapping(node, loc)

    def mapping(self, node: MappingNode, loc: Loc) -> dict[str, Any]:
        values: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key_node, child in node.pairs():
            if not isinstance(key_node, ScalarNode) or key_node.tag not in TEXT_TYPES:
                raise self.error(key_node, loc, "a key must be text; put it in quotes")
            key = key_node.text
            if not key.isprintable():
                raise self.error(key_node, loc, f"the key {quoted(key)} is not printable")
            if key == "<<":  # without this, the complaint would be about what it does not bring
                raise self.error(key_node, loc, "YAML 1.2 has no merge keys (<<); write the keys out")
            if key in values:
                raise self.error(key_node, (*loc, key), f"duplicate key; it is in line {lines[key]} too")
            lines[key] = key_node.line + 1
            if isinstance(child, ScalarNode) and not child.text:
                self.check_colour(key_node, (*loc, key))
                if child.tag == "null":
                    self.empty.append((*loc, key))
            values[key] = self.value(child, (*loc, key))
        return values

    def check_colour(self, key: ScalarNode, loc: Loc) -> None:
        """Raise the error about a colour without quotes, which is a comment, after a key without a value."""
        line = self.lines[key.line]
        if "#" not in line:
            return
        from depthwalk.scene.yaml_problems import colour_in_comment, colour_message  # here: only mistakes need them

        if (column := colour_in_comment(line, key.column)) is not None:
            raise _labelled(f"{self.name}:{key.line + 1}:{column + 1}", loc, colour_message(line, column))

    def scalar(self, node: ScalarNode, loc: Loc) -> bool | int | float | str | None:
        if node.tag in TEXT_TYPES:
            return node.text
        if node.tag not in SCALAR_TYPES:
            raise self.error(node, loc, f"the tag {quoted(node.tag)} is not allowed")
        try:
            value = node.value()
        except ValueError:  # an explicit tag that does not fit its text, as in `!!int many`
            raise self.error(node, loc, f"{_shown(node.text)} is not a YAML {node.tag}") from None
        if isinstance(value, float) and not math.isfinite(value):
            raise self.error(node, loc, f"must be a finite number, not {_shown(node.text)}")
        if isinstance(value, int) and abs(value) > _MAX_INTEGER:
            raise self.error(node, loc, f"the number {_shown(node.text)} is too large")
        return value


def _where(name: str, node: Node) -> str:
    return f"{name}:{node.line + 1}:{node.column + 1}"


def _labelled(where: str, loc: Loc, message: str) -> InputError:
    return InputError(f"{where}: {label(loc)}: {message}" if loc else f"{where}: {message}")


def _printable(text: str) -> str:
    return text if text.isprintable() else repr(text)


def _shown(text: str) -> str:
    return _printable(text if len(text) <= 24 else text[:21] + "...")
