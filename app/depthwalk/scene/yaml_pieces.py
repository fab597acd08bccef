"""Compose YAML text into pieces that know where they begin and end, so that the text can be edited in place.

The nodes of `yaml_nodes`, by which files are read, know only where they begin. Aliases are pieces of their own here,
instead of what they stand for, since it is their text that an editor finds.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import yaml
from yaml import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent, ScalarEvent, SequenceStartEvent

Kind = Literal["scalar", "sequence", "mapping", "alias"]


@dataclass(slots=True, kw_only=True)
class Piece:
    """Hold the part of a YAML text that one node takes.

    Attributes
    ----------
    kind
        What kind of node it is.
    start, end
        Its part of the text, characters; with anchor and tag, and without what follows the last item of a block
        collection, such as comments.
    line, column
        The position of its start, counted from 0.
    text
        A scalar's text, without quotes and escapes.
    style
        How a scalar is written: `'` or `"` for quotes, `|` or `>` for a block; "" for a plain one.
    flow
        Whether it is a collection in brackets or braces.
    anchor
        The name of its anchor, or of the one that an alias refers to; "" for none.
    children
        The items of a sequence; or the first key of a mapping, its value, the second key and so on.
    """

    kind: Kind
    start: int
    end: int
    line: int
    column: int
    text: str = ""
    style: str = ""
    flow: bool = False
    anchor: str = ""
    children: list["Piece"] = field(default_factory=list)

    def pairs(self) -> Iterator[tuple["Piece", "Piece"]]:
        """Return the keys of a mapping, each with its value, in the order of the text."""
        return zip(self.children[::2], self.children[1::2], strict=True)

    def value_of(self, key: str) -> tuple["Piece", "Piece"] | None:
        """Return the key of a mapping whose text is `key`, with its value; None if it has none."""
        return next((pair for pair in self.pairs() if pair[0].kind == "scalar" and pair[0].text == key), None)


def compose_pieces(text: str) -> tuple[Piece, frozenset[str]]:
    """Compose one YAML document, which `yaml_nodes.compose` has accepted.

    Parameters
    ----------
    text
        The document, without a byte order mark.

    Returns
    -------
    tuple
        The root, and the names of the anchors to which aliases refer.
    """
    holder = Piece(kind="sequence", start=0, end=0, line=0, column=0)
    opened, aliased = [holder], set()
    for event in yaml.parse(text, Loader=yaml.CBaseLoader):
        if isinstance(event, CollectionEndEvent):
            _close(opened.pop(), event)
        elif isinstance(event, NodeEvent):
            piece = _piece(event, text)
            opened[-1].children.append(piece)
            if piece.kind == "alias":
                aliased.add(piece.anchor)
            if isinstance(event, CollectionStartEvent):
                opened.append(piece)
    return holder.children[0], frozenset(aliased)


def _piece(event: Any, text: str) -> Piece:
    """Return the piece that an event of a node begins."""
    start, end = event.start_mark, event.end_mark
    kind: Kind = "sequence" if isinstance(event, SequenceStartEvent) else "mapping"
    piece = Piece(
        kind=kind,
        start=start.index,
        end=end.index,
        line=start.line,
        column=start.column,
        anchor=event.anchor or "",
    )
    if isinstance(event, AliasEvent):
        piece.kind = "alias"
    elif isinstance(event, ScalarEvent):
        piece.kind, piece.text, piece.style = "scalar", event.value, event.style or ""
        if piece.style in ("|", ">"):  # the line breaks after it are counted in
            piece.end = len(text[: piece.end].rstrip())
    else:
        piece.flow = bool(event.flow_style)
    return piece


def _close(piece: Piece, event: Any) -> None:
    """Set where a collection ends. A block has no closing sign: libyaml takes what follows it for its end."""
    if piece.flow:
        piece.end = event.end_mark.index
    elif piece.children:
        piece.end = max(piece.children[-1].end, piece.end)
