"""Parse XML of unknown origin: no document type, so no entities that grow or name files; bounded depth and memory."""

from collections.abc import Callable, Iterator
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError

_DEPTH = 256  # elements within elements: COLLADA's nodes nest as deep as a scene does
_TEXT_BYTES, _ELEMENT_BYTES = 16, 500  # memory per byte of text, most of which is numbers, and per element


class Element:
    """Hold an element: its tag without a namespace, its attributes, its children, and the text between its tags."""

    __slots__ = ("_text", "attributes", "children", "tag")

    def __init__(self, tag: str, attributes: dict[str, str]) -> None:
        """Begin an element without content."""
        self.tag, self.attributes = tag, attributes
        self.children: list[Element] = []
        self._text: list[str] = []

    @property
    def text(self) -> str:
        """Return its own text, without blanks around it."""
        return "".join(self._text).strip()

    def all(self, tag: str) -> Iterator["Element"]:
        """Yield its children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def find(self, *tags: str) -> "Element | None":
        """Return the first descendant along a path of tags, None if there is none."""
        found: Element | None = self
        for tag in tags:
            found = next(found.all(tag), None) if found is not None else None
        return found

    def numbers(self) -> NDArray[np.float64]:
        """Return the numbers in its text, (n,), also those with a decimal comma. Raises ValueError for other words."""
        words = self.text.split()
        try:
            return np.array(words, np.float64)
        except ValueError:  # programs in some countries write commas
            return np.array([word.replace(",", ".") for word in words], np.float64)

    def integers(self) -> NDArray[np.int64]:
        """Return the integers in its text, (n,). Raises ValueError for other words."""
        return np.array(self.text.split(), np.int64)


def parse_tree(data: bytes, path: Path, root: str) -> Element:
    """Parse an XML file whose root has the tag `root`.

    Raises
    ------
    InputError
        `path:line: defect`, also for a document type, elements nested too deep, and another root.
    """
    check_memory(path, _TEXT_BYTES * len(data) + _ELEMENT_BYTES * data.count(b"<") // 2, f"{len(data)} bytes of XML")
    top = Element("", {})
    open_elements = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(_local(tag), attributes)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def text(content: str) -> None:
        open_elements[-1]._text.append(content)

    run_expat(data, path, start, lambda tag: open_elements.pop(), text)
    found = top.children[0]
    if found.tag != root:
        raise InputError(f"{path}: its root is {found.tag!r}, not {root!r}")
    return found


def run_expat(
    data: bytes,
    path: Path,
    start: Callable[[str, dict[str, str]], object],
    end: Callable[[str], object],
    text: Callable[[str], object] | None = None,
) -> None:
    """Call functions for the start and end of each element, and for text.

    Raises InputError, `path:line: defect`, if the file is not well-formed, nests too deep or has a document type.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    depth = 0

    def opened(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEPTH:
            raise InputError(f"{path}:{parser.CurrentLineNumber}: elements nest deeper than {_DEPTH}")
        start(tag, attributes)

    def closed(tag: str) -> None:
        nonlocal depth
        depth -= 1
        end(tag)

    def refused(*_: object) -> None:
        raise InputError(f"{path}:{parser.CurrentLineNumber}: document types are not read")

    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    parser.StartDoctypeDeclHandler = refused
    if text:
        parser.CharacterDataHandler = text
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}:{error.lineno}: not well-formed: {expat.ErrorString(error.code)}") from None


def _local(tag: str) -> str:
    return tag.rsplit(":", 1)[-1]
