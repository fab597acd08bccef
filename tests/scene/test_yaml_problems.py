"""libyaml's errors in words: the place of the mistake, not of its consequence, and what would be right."""

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.document import parse_document
from depthwalk.scene.yaml_nodes import compose


def told(text: str) -> str:
    with pytest.raises(InputError) as caught:
        compose(text, "file")
    where, _, message = str(caught.value).partition(": not valid YAML: ")
    return f"{where.removeprefix('file:')}: {message}"


@pytest.mark.parametrize(
    ("text", "colour"),
    [
        ("a: 1\nb: {colour: #7a8466}\nc: [d]\n", "#7a8466"),
        ("a: 1\nb: {colour: #7a8466, size: 2}\nc: {d: 1}\n", "#7a8466"),
        ("a: 1\nb: {colour: #7a8466,\n  size: 2}\nc: 1\n", "#7a8466"),
        ("a: 1\nb: {size: 2, colour: #ABC}", "#ABC"),
        ("a: 1\nb: [[1], #7a8466]\n", "#7a8466"),
        ("a: 1\nb: [#7a8466]\nc: 1\n", "#7a8466"),
    ],
)
def test_a_colour_without_quotes_within_brackets(text: str, colour: str) -> None:
    column = text.splitlines()[1].index("#") + 1
    assert told(text) == f"2:{column}: '#' starts a comment; put the colour in quotes: \"{colour}\""


@pytest.mark.parametrize("text", ["a:\n  colour: #7a8466\n  b: 1\n", "a:\n  {b: 1, 'colour': #7a8466\n}\n"])
def test_a_colour_without_quotes_in_place_of_a_value(text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_document(text, "file")
    place = f"file:2:{text.splitlines()[1].index('#') + 1}: a.colour"
    assert str(caught.value) == f"{place}: '#' starts a comment; put the colour in quotes: \"#7a8466\""


@pytest.mark.parametrize("text", ["a: # 7a8466\n", "a: #decades\n", "a: {b: , c: 1} #7a8466\n", "a: x #7a8466\n"])
def test_other_comments_are_no_colours(text: str) -> None:
    assert parse_document(text, "file").value["a"] in (None, {"b": None, "c": 1}, "x")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a:\n  b: 1\n c: 2\n", "3:2: indented unlike 'b' of line 2 (column 3) or 'a' of line 1 (column 1)"),
        ("a:\n  b: 1\n   c: 2\n", "3:4: indented unlike 'b' of line 2 (column 3)"),
        ("a: 'x'\n  b: 2\n", "2:3: indented unlike 'a' of line 1 (column 1)"),
        ("a: {b: 1}\n c: 2\n", "2:2: indented unlike 'a' of line 1 (column 1)"),
        ("a:\n  b: 1\n  # c\n\n d: 2\n", "5:2: indented unlike 'b' of line 2 (column 3) or 'a' of line 1 (column 1)"),
        ("a: b\n  c d\n  e: 1\n", "3:3: indented unlike 'a' of line 1 (column 1)"),  # `c d` continues `b`
        ("a:\n - b: 1\n   c: 2\n  d: 3", "4:3: indented unlike 'c' of line 3 (column 4) or 'a' of line 1 (column 1)"),
        ("a:\n- b: 1\n   c: 2\n", "3:4: indented unlike 'b' of line 2 (column 3)"),
        ("a:\n  - b: 1\n - c: 2\n", "3:2: indented unlike '-' of line 2 (column 3)"),
        ("a:\n - b: 1\n- c: 2\n", "3:1: indented unlike '-' of line 2 (column 2)"),
        ("a:\n - b\n- c: 2\n", "3:1: indented unlike '-' of line 2 (column 2)"),
        ("a: [b,\n  c]\n d: 2\n", "3:2: indented unlike 'a' of line 1 (column 1)"),
        ("a:\n  'b'\n  c: 2\n", "3:3: indented unlike 'a' of line 1 (column 1)"),
        ("a: 1\n- b: 2\n", "2:1: expected a key, not '-'"),
    ],
)
def test_lines_that_are_not_aligned(text: str, message: str) -> None:
    assert told(text) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("version 1\nassets:\n  a: 2\n", "1:1: expected ':' after 'version'"),
        ("version 1\n\n# c\nassets:\n", "1:1: expected ':' after 'version'"),
        ("# c\nversion:1\n\nassets:\n", "2:1: expected a space after 'version:'"),
        ("a: 1\nassets\n  b: 2\n", "2:1: expected ':' after 'assets'"),
        ("a:\n  - b c\n    d: 2\n", "2:5: expected ':' after 'b'"),
        ("a:\n  mesh spot.obj # c\n  b: 2\n", "2:3: expected ':' after 'mesh'"),
        ("a:\n  b: 2\n  mesh:spot.obj\n", "3:3: expected a space after 'mesh:'"),
        ("a: 1\n'b'\nc: 2\n", "2:1: expected ':' after this"),
        ("a:\n  b: 1\nc: d: e\n", "3:5: a second ':'; put a value that has one in quotes"),
    ],
)
def test_colons(text: str, message: str) -> None:
    assert told(text) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a:\n  b: {c: 1\n  d: {e: 1}\n", "3:4: expected ',' or '}', not ':'; the '{' of line 2 is open"),
        ("a: [1, 2\n\nb:\n- c: 1\n", "3:2: expected ',' or ']', not ':'; the '[' of line 1 is open"),
        ("a: [{b: 1},\n  [2], {c: 3\nd: 4\n", "3:2: expected ',' or '}', not ':'; the '{' of line 2 is open"),
        ("a: 1\nb: {c: 1,\n", "2:4: expected ',' or '}' before the end of the text"),
        ("a: [1,\nb", "1:4: expected ',' or ']' before the end of the text"),
        ("a: [1, 'b\n", "1:8: expected a closing quote before the end of the text"),
        ("a: [1, {b: 2]\n", "1:13: expected ',' or '}', not ']'"),
        ("a: {b: 1}}\n", "1:10: '}' without '{' before"),
        ("a: ]\n", "1:4: ']' without '[' before"),
        ("a: [1,,2]\n", "1:7: expected a value, not ','"),
        ("a: 'b\nc: 'd'\n", "2:5: the quote of line 1 ends before this"),
    ],
)
def test_brackets_and_quotes(text: str, message: str) -> None:
    assert told(text) == message
