"""Change values in YAML text in place: everything else stays as it is, to the byte.

Only scalars are replaced, one by one also within lists, and keys are added where they are missing. So comments, order,
quotes and layout are kept without knowing anything about them.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from depthwalk.errors import InputError
from depthwalk.scene.document import label
from depthwalk.scene.fields import colour_of_text
from depthwalk.scene.yaml_nodes import located
from depthwalk.scene.yaml_pieces import Piece, compose_pieces
from depthwalk.scene.yaml_text import block_lines, double_quoted, float32_value, flow_text

Place = tuple[str, ...]  # keys from the root
_BREAK = re.compile(r"(?:\r\n|\r(?!\n)|[\n\x85\u2028\u2029])")  # line breaks of YAML 1.1 (§5.4), which libyaml parses
_NULL = "~", "null", "Null", "NULL"
_STEP = 2  # spaces by which a mapping is indented, where the text has none that shows how many


def with_values(text: str, name: str, values: Mapping[str, Any]) -> str:
    """Return YAML text with some of its values changed or added.

    Parameters
    ----------
    text
        One document that `yaml_nodes.compose` accepts, whose root is a mapping, without a byte order mark.
    name
        The file's name in error messages.
    values
        The values, in nested mappings like the document's: those that it has are replaced, others are added. A colour
        such as `"#rrggbb"` becomes three numbers where the text has a list.

    Returns
    -------
    str
        The text, in which nothing else has changed.

    Raises
    ------
    InputError
        With line and column, where a value cannot be replaced by itself: if it is shared through an alias, for example.
    """
    root, aliased = compose_pieces(text)
    editor = _Editor(text=text, name=name, root=root, aliased=aliased)
    editor.set_all(root, values, ())
    return editor.edited()


@dataclass(kw_only=True)
class _Editor:
    """Collect edits of a text, each of which replaces a part of it, or adds something where that is empty."""

    text: str
    name: str
    root: Piece
    aliased: frozenset[str]
    edits: list[tuple[int, int, str]] = field(default_factory=list)

    def edited(self) -> str:
        """Return the text with all edits; those of one position in the order in which they were made."""
        parts, end = [], 0
        for start, after, new in sorted(self.edits, key=lambda edit: edit[0]):
            parts += [self.text[end:start], new]
            end = after
        return "".join([*parts, self.text[end:]])

    def set_all(self, mapping: Piece, values: Mapping[str, Any], place: Place) -> None:
        """Set the values of a mapping that is written as such. Raises InputError."""
        if mapping.kind != "mapping":
            raise self._refusal(mapping, place, "is not a mapping of keys")
        self._check_unshared(mapping, place)
        missing = {}
        for key, value in values.items():
            if (pair := mapping.value_of(key)) is None:
                missing[key] = value
            else:
                self._set(mapping, *pair, value, (*place, key))
        if missing:
            add = self._add_in_flow if mapping.flow else self._add_in_block
            add(mapping, missing)

    def _set(self, parent: Piece, key: Piece, old: Piece, value: Any, place: Place) -> None:
        self._check_unshared(old, place)
        is_empty = old.kind == "scalar" and not old.style and old.text in ("", *_NULL)
        if is_empty and old.start == old.end:
            self._fill(parent, key, value)
        elif isinstance(value, Mapping) and not is_empty:
            self.set_all(old, value, place)
        elif old.kind == "sequence":
            self._set_items(old, value, place)
        elif old.kind == "scalar":
            self._replace(old, value, place)
        else:
            raise self._refusal(old, place, "is a mapping of keys, not a value")

    def _set_items(self, old: Piece, value: Any, place: Place) -> None:
        """Replace those items of a list that differ, which keeps its layout."""
        items = _colour_parts(value) if isinstance(value, str) else value
        if value is None and old.flow and "#" not in self.text[old.start : old.end]:
            self._replace(old, None, place)
            return
        if not isinstance(items, Sequence) or len(items) != len(old.children):
            raise self._refusal(old, place, "is a list of another length")
        for item, new in zip(old.children, items, strict=True):
            self._check_unshared(item, place)
            if item.kind != "scalar":
                raise self._refusal(item, place, "holds no numbers")
            if not _is_number(item.text, new):
                self._replace(item, new, place)

    def _replace(self, old: Piece, value: Any, place: Place) -> None:
        """Replace a scalar that is not empty, or a list in brackets."""
        if self.text[old.start] in "&!":
            raise self._refusal(old, place, "has an anchor or a tag")
        if not isinstance(value, str) or old.style not in ("'", '"'):
            new = flow_text(value)
        else:
            new = double_quoted(value) if old.style == '"' else "'{}'".format(value.replace("'", "''"))
        self.edits.append((old.start, old.end, new))

    def _fill(self, parent: Piece, key: Piece, value: Any) -> None:
        """Write a value behind a key that has none."""
        colon = re.compile(r"[ \t]*:").match(self.text, key.end)
        end = colon.end() if colon else key.end
        if isinstance(value, Mapping) and not parent.flow:
            self._add_lines(end, key.column + 1, block_lines(value, " " * (key.column + self._step), self._step))
        else:
            self.edits.append((end, end, " " + flow_text(value) if colon else ": " + flow_text(value)))

    def _add_in_block(self, mapping: Piece, missing: Mapping[str, Any]) -> None:
        """Add keys in lines of their own behind the last one of a mapping."""
        first, last = mapping.children[0], mapping.children[-2]
        lines = block_lines(missing, " " * first.column, self._step)
        if mapping is self.root and self._has_empty_line(first.start, last.start):
            lines = ["", *lines]  # between the parts of the file
        self._add_lines(mapping.end, first.column, lines)

    def _add_lines(self, end: int, column: int, lines: Sequence[str]) -> None:
        """Add lines behind the one in which the text at `end` is, and the comments below it from `column` on."""
        place = self._line_end(end)
        while comment := re.compile(rf"(?:[ \t]*{_BREAK.pattern})+ {{{column},}}\#").match(self.text, place):
            place = self._line_end(comment.end())
        found = _BREAK.search(self.text)
        line_break = found.group() if found else "\n"
        self.edits.append((place, place, "".join(line_break + line for line in lines)))

    def _add_in_flow(self, mapping: Piece, missing: Mapping[str, Any]) -> None:
        """Add keys behind the last one of a mapping in braces, in lines of their own if that begins its line."""
        pairs = [f"{flow_text(key)}: {flow_text(value)}" for key, value in missing.items()]
        if not mapping.children:
            brace = self.text.index("{", mapping.start) + 1  # behind an anchor
            space = " " if self.text.startswith("#", brace) else ""
            self.edits.append((brace, brace, ", ".join(pairs) + space))
            return
        key, last = mapping.children[-2:]
        end = last.end
        before = self.text[self._line_start(key.start) : key.start]
        rest = re.compile(r"(?P<comma>[ \t]*,)?(?P<end>[ \t]*(?:[ \t]#.*)?)(?=[\r\n])").match(self.text, end)
        if before.strip(" \t") or rest is None:
            self.edits.append((end, end, "".join(", " + pair for pair in pairs)))
            return
        if not rest["comma"]:
            self.edits.append((end, end, ","))
        found = _BREAK.search(self.text, rest.end())
        assert found is not None
        closing = "," if rest["comma"] else ""
        new = ",".join(f"{found.group()}{before}{pair}" for pair in pairs)
        self.edits.append((rest.end(), rest.end(), new + closing))

    @property
    def _step(self) -> int:
        """Return by how many spaces the text indents a mapping within another."""
        for key, value in () if self.root.flow else self.root.pairs():
            if value.kind == "mapping" and not value.flow:
                return value.children[0].column - key.column
        return _STEP

    def _has_empty_line(self, start: int, end: int) -> bool:
        return bool(re.compile(rf"{_BREAK.pattern}[ \t]*{_BREAK.pattern}").search(self.text, start, end))

    def _line_end(self, index: int) -> int:
        """Return where the line of a character ends, without its line break."""
        found = _BREAK.search(self.text, index)
        return found.start() if found else len(self.text)

    def _line_start(self, index: int) -> int:
        return max((found.end() for found in _BREAK.finditer(self.text, 0, index)), default=0)

    def _check_unshared(self, piece: Piece, place: Place) -> None:
        """Raise InputError about a part of the text that stands for several places of the document."""
        if piece.kind == "alias":
            raise self._refusal(piece, place, f"is an alias of &{piece.anchor}")
        if piece.anchor in self.aliased:
            raise self._refusal(piece, place, f"is used elsewhere as *{piece.anchor}")

    def _refusal(self, piece: Piece, place: Place, why: str) -> InputError:
        return located(self.name, piece.line, piece.column, f"{label(place) or 'the file'} {why}")


def _colour_parts(value: str) -> Sequence[float]:
    """Return the numbers of a colour such as `"#rrggbb"`, 0 to 1; none for other text."""
    return [float32_value(part) for part in colour_of_text(value) or ()]


def _is_number(text: str, value: Any) -> bool:
    """Return whether a scalar's text is this number."""
    try:
        return bool(float(text) == value)
    except ValueError:
        return False
