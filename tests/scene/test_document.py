"""YAML text as values that know where they stand."""

import cProfile
import pstats
from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.document import label, parse_document, read_document
from depthwalk.scene.yaml_nodes import MAX_YAML_DEPTH

TEXT = "version: 1\nobjects:\n  - {asset: box, yaw: 90}\nwalk:\n"


def test_values_are_plain() -> None:
    document = parse_document("a: [1, 2.5, true, null, text, 2026-01-01]", "file")
    assert document.value == {"a": [1, 2.5, True, None, "text", "2026-01-01"]}  # a date is text


@pytest.mark.parametrize(
    ("loc", "at_key", "where"),
    [
        ((), False, "file:1:1"),
        (("objects", 0, "yaw"), False, "file:3:23"),
        (("objects", 0, "yaw"), True, "file:3:18"),
        (("objects", 0, "scale"), False, "file:3:5"),  # not in the text: its parent
        (("walk",), False, "file:4:1"),  # without a value: its key
    ],
)
def test_where_a_value_stands(loc: tuple[str | int, ...], at_key: bool, where: str) -> None:
    assert parse_document(TEXT, "file").where(loc, at_key=at_key) == where


def test_what_the_text_holds() -> None:
    document = parse_document(TEXT, "file")
    assert document.holds(("objects", 0, "asset")) and document.holds(())
    assert not document.holds(("objects", 1)) and not document.holds(("objects", 0, "asset", "x"))


def test_errors_are_labelled() -> None:
    error = parse_document(TEXT, "file").error(("objects", 0, "yaw"), "is wrong")
    assert str(error) == "file:3:23: objects[0].yaw: is wrong"


def test_long_labels_are_shortened_in_the_middle() -> None:
    assert label(("objects", 3, "scale")) == "objects[3].scale"
    long = label(("group",) * 40)
    assert len(long) == 71 and long.startswith("group.") and long.endswith(".group") and "..." in long


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_document(path).value == {"a": 1}


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder"):
        read_document(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: !!int many", "file:1:4: a: many is not a YAML int"),
        ("a: 99999999999999999999", "file:1:4: a: the number 99999999999999999999 is too large"),
        ("a: 1\nb: 2\na: 3", "file:3:1: a: duplicate key; it is in line 1 too"),
        ("? [a]\n: 1", "file:1:3: a key must be text; put it in quotes"),
        ("a: &b {c: 1}\nd: {<<: *b, e: 2}", "file:2:5: d: YAML 1.2 has no merge keys (<<); write the keys out"),
        ("a: .inf", "file:1:4: a: must be a finite number, not .inf"),
    ],
)
def test_what_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_document(text, "file")
    assert str(caught.value) == message


@pytest.mark.parametrize("before", ["", "objects: ", "a:\n  - "])
def test_brackets_too_deep_are_refused_at_their_place_and_at_once(before: str) -> None:
    """Scanning all thousand of them took a million calls; that many characters are read ahead."""
    profile = cProfile.Profile()
    with pytest.raises(InputError, match="nested too deeply") as error, profile:
        parse_document(f"{before}{'[' * 1000}{']' * 1000}", "file")
    column = MAX_YAML_DEPTH + 1 if not before else MAX_YAML_DEPTH + len("objects: ")
    if "\n" not in before:
        assert str(error.value) == f"file:1:{column}: not valid YAML: nested too deeply"
    assert pstats.Stats(profile).total_calls < 300_000  # type: ignore[attr-defined]
