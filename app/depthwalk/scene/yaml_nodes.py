"""Compose YAML text into nodes that know their position and type, by the core schema of YAML 1.2 (§10.3.2).

PyYAML binds libyaml, which parses the text into events. They become nodes here rather than in PyYAML's composer, which
resolves scalars as YAML 1.1 does (where `no` is false and `1:30` is 90) and follows nesting without a limit.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml
from yaml import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceStartEvent,
)

from depthwalk.errors import InputError, quoted
from depthwalk.limits import MAX_GROUP_DEPTH

MAX_YAML_DEPTH = 3 * MAX_GROUP_DEPTH + 32  # each nested group is a list, its item and the group's own mapping

_TAG = "tag:yaml.org,2002:"
SCALAR_TYPES = {"null", "bool", "int", "float"}
TEXT_TYPES = {"str", "timestamp", "merge", "value"}  # those of YAML 1.1 besides; no field holds a date: it is text
_TYPES = SCALAR_TYPES | TEXT_TYPES | {"seq", "map"}

# What YAML allows (§5.1), without the halves of surrogate pairs; the byte order mark is allowed at the start only.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")

# The core schema, and binary numbers and underscores between digits, as in Python.
_PLAIN = re.compile(
    r"(?P<null>|~|null|Null|NULL)"
    r"|(?P<bool>true|True|TRUE|false|False|FALSE)"
    r"|(?P<int>[-+]?(?:\d+(?:_\d+)*|0b[01]+(?:_[01]+)*|0o[0-7]+(?:_[0-7]+)*|0x[\da-fA-F]+(?:_[\da-fA-F]+)*))"
    r"|(?P<float>[-+]?(?:\.inf|\.Inf|\.INF|(?:\d+(?:_\d+)*(?:\.(?:\d+(?:_\d+)*)?)?|\.\d+(?:_\d+)*)(?:[eE][-+]?\d+)?)"
    r"|\.nan|\.NaN|\.NAN)",
    re.ASCII,
)


@dataclass(slots=True)
class Node:
    """Hold where a node of YAML text stands, and its type.

    Attributes
    ----------
    line, column
        Its position in the text, counted from 0.
    tag
        Its type: the name of a type of the core schema (`null`, `bool`, `int`, `float`, `str`, `seq`, `map`), or else
        the tag as the text gives it.
    """

    line: int
    column: int
    tag: str


@dataclass(slots=True)
class ScalarNode(Node):
    """Hold a scalar as `text`, without its quotes and escapes."""

    text: str

    def value(self) -> bool | int | float | str | None:
        """Return the value of a scalar of the core schema. Raises ValueError if the text does not fit the tag."""
        if self.tag == "str":
            return self.text
        found = _PLAIN.fullmatch(self.text)
        kind = found.lastgroup if found else None
        if kind != self.tag and (self.tag, kind) != ("float", "int"):
            raise ValueError(f"not of type {self.tag}")
        return _value_of(self.tag, self.text)


@dataclass(slots=True)
class SequenceNode(Node):
    """Hold a sequence: its `items`, in order."""

    items: list[Node] = field(default_factory=list)


@dataclass(slots=True)
class MappingNode(Node):
    """Hold a mapping: in `flat` the first key, its value, the second key and so on."""

    flat: list[Node] = field(default_factory=list)

    def pairs(self) -> Iterator[tuple[Node, Node]]:
        """Return the keys, each with its value, in the order of the text."""
        return zip(self.flat[::2], self.flat[1::2], strict=True)


def located(name: str, line: int, column: int, message: str) -> InputError:
    """Return an error about a position in a file.

    Parameters
    ----------
    name
        The file's name in the message.
    line, column
        Line and column of the position, counted from 0.
    message
        What is wrong.

    Returns
    -------
    InputError
        `name:line:column: message`, counted from 1.
    """
    return InputError(f"{name}:{line + 1}:{column + 1}: {message}")


def at_offset(name: str, before: str, message: str) -> InputError:
    """Return an error about the position in the file `name` that follows the text `before`."""
    return located(name, before.count("\n"), len(before) - (before.rfind("\n") + 1), message)


def compose(text: str, name: str) -> Node | None:
    """Compose one YAML document.

    Parameters
    ----------
    text
        The document.
    name
        The file's name in error messages.

    Returns
    -------
    Node or None
        The root, None if the text is empty. An alias is the very node that it names, so nodes may hold themselves.

    Raises
    ------
    InputError
        With line and column, if the text is not YAML, nested deeper than `MAX_YAML_DEPTH`, or more than one document.
    """
    forbidden = _FORBIDDEN.search(text, 1 if text.startswith("\ufeff") else 0)
    if forbidden:
        message = f"character U+{ord(forbidden.group()):04X} is not allowed in YAML"
        raise at_offset(name, text[: forbidden.start()], message)
    try:
        return _root(text, name)
    except yaml.MarkedYAMLError as error:
        from depthwalk.scene.yaml_problems import explained, offset_of  # here: only mistakes need them

        if "nesting" in (error.problem or ""):  # libyaml read ahead to a deeper bracket than the first one too deep
            return compose(text[: offset_of(text, error.problem_mark)], name)
        line, column, problem = explained(error, text)
        raise located(name, line, column, f"not valid YAML: {problem}") from None
    except yaml.YAMLError as error:
        raise located(name, 0, 0, f"not valid YAML: {' '.join(str(error).split())}") from None


def _root(text: str, name: str) -> Node | None:
    """Return the root of the events' tree, see `compose`."""
    holder = SequenceNode(0, 0, "seq")  # of the documents
    opened: list[SequenceNode | MappingNode] = [holder]
    anchors: dict[str, Node] = {}
    for event in yaml.parse(text, Loader=yaml.CBaseLoader):
        line, column = (mark.line, mark.column) if (mark := event.start_mark) else (0, 0)
        if isinstance(event, DocumentStartEvent) and holder.items:
            raise located(name, line, column, "not valid YAML: a second document starts here")
        if not isinstance(event, NodeEvent):
            if isinstance(event, CollectionEndEvent):
                opened.pop()
            continue
        if isinstance(event, AliasEvent):
            if event.anchor not in anchors:
                raise located(name, line, column, f"not valid YAML: no anchor {quoted(str(event.anchor))} before")
            node = anchors[event.anchor]
        else:
            assert isinstance(event, ScalarEvent | CollectionStartEvent)
            node = _node(event, line, column)
        if event.anchor is not None:
            anchors[event.anchor] = node
        parent = opened[-1]
        (parent.items if isinstance(parent, SequenceNode) else parent.flat).append(node)
        if isinstance(event, CollectionStartEvent):
            if len(opened) > MAX_YAML_DEPTH:
                raise located(name, line, column, "not valid YAML: nested too deeply")
            assert isinstance(node, SequenceNode | MappingNode)
            opened.append(node)
    return holder.items[0] if holder.items else None


def _node(event: ScalarEvent | CollectionStartEvent, line: int, column: int) -> Node:
    """Return the node that an event at this position starts, without what it holds."""
    tag = "" if event.tag in (None, "!") else event.tag
    if tag.removeprefix(_TAG) in _TYPES:
        tag = tag.removeprefix(_TAG)
    if isinstance(event, ScalarEvent):
        if not tag:
            found = _PLAIN.fullmatch(event.value) if event.implicit[0] and event.tag is None else None
            tag = (found and found.lastgroup) or "str"
        return ScalarNode(line, column, tag, event.value)
    if isinstance(event, SequenceStartEvent):
        return SequenceNode(line, column, tag or "seq")
    return MappingNode(line, column, tag or "map")


def _value_of(tag: str, text: str) -> bool | int | float | None:
    """Return the value of a scalar's text that fits its tag."""
    if tag == "null":
        return None
    if tag == "bool":
        return text.lower() == "true"
    if tag == "int":
        base = {"b": 2, "o": 8, "x": 16}.get(text.lstrip("-+")[1:2], 10)
        return int(text, base)
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
