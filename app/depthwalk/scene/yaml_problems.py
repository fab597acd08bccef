"""Word libyaml's errors for people who write scene files: where the mistake is, and what would be right.

libyaml reports where it could not go on, which is often a line after the mistake. The tokens before that place tell
what the mistake is: an open bracket, a colon left out, lines that are not aligned, a colour without quotes.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import yaml
from yaml import (
    BlockEntryToken,
    FlowEntryToken,
    FlowMappingEndToken,
    FlowMappingStartToken,
    FlowSequenceEndToken,
    FlowSequenceStartToken,
    KeyToken,
    ScalarToken,
    Token,
    ValueToken,
)

from depthwalk.errors import quoted

Place = tuple[int, int]
"""Line and column in a text, counted from 0."""

_AT_END = " before the end of the text"
_OPENING, _CLOSING = (FlowMappingStartToken, FlowSequenceStartToken), (FlowMappingEndToken, FlowSequenceEndToken)
_CLOSER = {"{": "}", "[": "]"}

_COLOUR = re.compile(r"\s*(#(?:[\da-fA-F]{3}){1,2})\b")
_COLOUR_ALONE = re.compile(rf"[^:#]*:\s{_COLOUR.pattern}")
_WORD = re.compile(r"[^\s#\[\]{},\"'][^\s#\[\]{},]*")
_INDENT = re.compile(r"^\s*(?:-\s+)*")
_COLON = re.compile(r":(?:\s|$)")
_PAIR = re.compile(r"(\s*(?:-\s+)*)([^\s:#][^:#]*):\s+[^\s#]")


@dataclass(frozen=True)
class _Entry:
    """Hold a key, or the `-` of an item, that lines below may be aligned with."""

    line: int
    column: int
    name: str

    def __str__(self) -> str:
        return f"{quoted(self.name)} of line {self.line + 1} (column {self.column + 1})"


def explained(error: yaml.MarkedYAMLError, text: str) -> tuple[int, int, str]:
    """Explain why a text is not YAML.

    Parameters
    ----------
    error
        What libyaml found.
    text
        The text.

    Returns
    -------
    tuple
        Line and column of the mistake, counted from 0, and what is wrong there.
    """
    return _Explanation(error, text).found()


def colour_in_comment(line: str, key: int) -> int | None:
    """Return the column of a colour without quotes, which YAML takes for a comment, as in `colour: #7a8466`.

    Parameters
    ----------
    line
        A line of YAML text.
    key
        The column of a key in it.

    Returns
    -------
    int or None
        The column of `#`; None if such a comment does not follow the key directly.
    """
    found = _COLOUR_ALONE.match(line, key)
    return found.start(1) if found else None


def colour_message(line: str, column: int) -> str:
    """Return what to do about the colour without quotes at a column of a line."""
    found = _COLOUR.match(line, column)
    assert found is not None
    return f"'#' starts a comment; put the colour in quotes: \"{found[1]}\""


def offset_of(text: str, mark: Any) -> int:
    """Return how many characters of the text precede a mark of PyYAML."""
    line, column = _place_of(mark)
    return sum(map(len, text.splitlines(keepends=True)[:line])) + column


def _place_of(mark: Any) -> Place:
    """Return line and column of a mark of PyYAML, counted from 0; the start of the text if there is none."""
    return (mark.line, mark.column) if mark else (0, 0)


def _has_no_colon(line: str) -> bool:
    """Return whether a line has plain text without a colon that ends a key."""
    bare = _INDENT.sub("", re.sub(r"(?:^|\s)#.*", "", line)).strip()
    return bool(bare) and bare[0] not in "[]{}'\"" and not _COLON.search(bare)


class _Explanation:
    """Find what is wrong, from an error of libyaml and the tokens before it."""

    def __init__(self, error: yaml.MarkedYAMLError, text: str) -> None:
        self.problem = " ".join((error.problem or error.context or "malformed").split())
        self.place = _place_of(error.problem_mark or error.context_mark)
        self.context = _place_of(error.context_mark) if error.context_mark else None
        self.lines = text.splitlines()
        self.tokens = list(_tokens_before(text, self.place))
        self.open = self._open_brackets()
        line, column = self.place
        self.character = self.lines[line][column : column + 1] if line < len(self.lines) else ""

    def found(self) -> tuple[int, int, str]:
        """Return line and column of the mistake, and what it is."""
        for guess in (self._colour, self._two_colons, self._no_colon, self._misaligned, self._unopened, self._quote):
            if found := guess():
                return found
        if "end of stream" in self.problem or (self.place[0] >= len(self.lines) and (self.open or self.context)):
            return self._unfinished()
        problem = self._plain()
        if self.open and (opened := _place_of(self.open[-1].start_mark))[0] < self.place[0]:
            problem += f"; the {quoted(self._bracket(opened))} of line {opened[0] + 1} is open"
        return *self.place, problem

    def _colour(self) -> tuple[int, int, str] | None:
        """Explain a colour without quotes within the open brackets: the rest of its line is a comment."""
        if not self.open:
            return None
        first = self.tokens.index(self.open[0])
        for token in self.tokens[first:]:
            line, column = _place_of(token.end_mark)
            before_value = isinstance(token, ValueToken | FlowEntryToken | FlowSequenceStartToken)
            if before_value and (colour := _COLOUR.match(self.lines[line], column)):
                return line, colour.start(1), colour_message(self.lines[line], colour.start(1))
        return None

    def _no_colon(self) -> tuple[int, int, str] | None:
        """Explain a key without its colon, of which libyaml makes one text with the lines that follow."""
        if self.open:
            return None
        if "could not find expected ':'" in self.problem and self.context:
            return self._colon_after(*self.context)
        if "<document start>" in self.problem:
            line = next((n for n, text in enumerate(self.lines) if text.strip() and text.lstrip()[0] != "#"), 0)
        elif "mapping values are not allowed" in self.problem:
            line = self._first_line_of_text()
        elif "expected key" in self.problem and self._ends_with_value():  # a comment ended the text
            line = self.tokens[-1].start_mark.line
        else:
            return None
        if line == self.place[0] or not _has_no_colon(self.lines[line]):
            return None
        return self._colon_after(line, len(self.lines[line]) - len(_INDENT.sub("", self.lines[line], count=1)))

    def _ends_with_value(self) -> bool:
        """Return whether the mistake follows the plain text that is the value of a key."""
        before = self.tokens[-2:]
        return len(before) == 2 and isinstance(before[0], ValueToken) and getattr(before[1], "plain", False)

    def _first_line_of_text(self) -> int:
        """Return the first of the lines without a colon above the mistake; its own line if they continue a value."""
        first = self.place[0]
        for line in range(first - 1, -1, -1):
            text = self.lines[line]
            if text.strip() and not _has_no_colon(text):
                return self.place[0] if _PAIR.match(text) else first
            first = line if text.strip() else first
        return first

    def _colon_after(self, line: int, column: int) -> tuple[int, int, str]:
        word = _WORD.match(self.lines[line], column)
        if word is None:
            return line, column, "expected ':' after this"
        key, colon, _ = word[0].partition(":")
        expected = f"a space after {quoted(key + ':')}" if key and colon else f"':' after {quoted(word[0])}"
        return line, column, f"expected {expected}"

    def _misaligned(self) -> tuple[int, int, str] | None:
        """Explain a key or an item that starts in another column than those it belongs to."""
        line, column = self.place
        if "mapping values are not allowed" in self.problem:
            column = self._key_column()
        elif "expected key" not in self.problem and "expected '-' indicator" not in self.problem:
            return None
        if self.open or line >= len(self.lines) or self.lines[line][:column].strip():
            return None
        peers = self._peers(column, is_item=self.lines[line].startswith("- ", column))
        return (line, column, f"indented unlike {' or '.join(map(str, peers))}") if peers else None

    def _key_column(self) -> int:
        line = self.lines[self.place[0]]
        return len(line) - len(line.lstrip(" "))

    def _peers(self, column: int, is_item: bool) -> list[_Entry]:
        """Return the entries above that one in this column may belong beside: the nearest on either side."""
        above = [entry for entry in self._entries() if entry.column != column]
        if is_item:
            return [entry for entry in above if entry.name == "-"][-1:]
        deeper = next((entry for entry in reversed(above) if entry.column > column and entry.name != "-"), None)
        keys = (entry for entry in reversed(above) if entry.column < column and entry.name != "-")
        return [entry for entry in (deeper, next(keys, None)) if entry is not None]

    def _entries(self) -> list[_Entry]:
        """Return the keys and items of block collections before the mistake."""
        found: list[_Entry] = []
        depth = 0
        for token, after in zip(self.tokens, self.tokens[1:], strict=False):
            depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
            if depth == 0 and isinstance(token, BlockEntryToken):
                found.append(_Entry(*_place_of(token.start_mark), "-"))
            elif depth == 0 and isinstance(token, KeyToken) and isinstance(after, ScalarToken):
                found.append(_Entry(*_place_of(after.start_mark), after.value))
        return [entry for entry in found if entry.line < self.place[0]]

    def _two_colons(self) -> tuple[int, int, str] | None:
        line, column = self.place
        if self.open or "mapping values are not allowed" not in self.problem:
            return None
        second = _COLON.search(self.lines[line][:column])
        return (line, column, "a second ':'; put a value that has one in quotes") if second else None

    def _unopened(self) -> tuple[int, int, str] | None:
        """Explain a closing bracket without an opening one."""
        if self.open or not self.character or self.character not in "]}":
            return None
        opening = next(one for one, closer in _CLOSER.items() if closer == self.character)
        return *self.place, f"{quoted(self.character)} without {quoted(opening)} before"

    def _quote(self) -> tuple[int, int, str] | None:
        """Explain text after a closing quote, which may have been meant to open one."""
        last = self.tokens[-1] if self.tokens else None
        if self.open or "expected key" not in self.problem or not isinstance(last, ScalarToken) or last.plain:
            return None
        return *self.place, f"the quote of line {last.start_mark.line + 1} ends before this"

    def _unfinished(self) -> tuple[int, int, str]:
        """Explain what the end of the text leaves unfinished, at the place where it began."""
        problem = self.problem.replace("found unexpected end of stream", "expected a closing quote")
        line, column = self.context or self.place
        if self.open and "closing quote" not in problem:
            line, column = _place_of(self.open[-1].start_mark)
            problem = f"expected ',' or '{_CLOSER[self._bracket((line, column))]}'"
        return line, column, _shortened(problem) + _AT_END

    def _plain(self) -> str:
        """Return libyaml's message in plain words, with the character that it is about."""
        if self.character == "\t" and "cannot start any token" in self.problem:
            return "a tab cannot indent; use spaces"
        if self.character and "cannot start any token" in self.problem:
            return f"{quoted(self.character)} cannot start a value"
        if self.character and self.problem.endswith(("']'", "'}'", "node content", "key")):
            return f"{_shortened(self.problem)}, not {quoted(self.character)}"
        return _shortened(self.problem)

    def _bracket(self, place: Place) -> str:
        return self.lines[place[0]][place[1]]

    def _open_brackets(self) -> list[Token]:
        """Return the brackets that are open where the mistake was found, the innermost last."""
        found: list[Token] = []
        for token in self.tokens:
            if isinstance(token, _OPENING):
                found.append(token)
            elif isinstance(token, _CLOSING) and found:
                found.pop()
        return found


def _tokens_before(text: str, place: Place) -> Iterator[Token]:
    """Yield the tokens of a text that start before a place, as far as libyaml can tell them."""
    try:
        for token in yaml.scan(text, Loader=yaml.CBaseLoader):
            if _place_of(token.start_mark) >= place:
                return
            yield token
    except yaml.YAMLError:
        return


def _shortened(problem: str) -> str:
    plain = {
        "did not find expected": "expected",
        "expected key": "expected a key",
        "<document start>": "'---' before this",
        "node content": "a value",
        "mapping values are not allowed in this context": "':' is not allowed here",
    }
    for libyamls, plainer in plain.items():
        problem = problem.replace(libyamls, plainer)
    return problem
