"""Changing values in YAML text, in which everything else stays as it is."""

import copy
import itertools
import re
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.errors import InputError
from depthwalk.scene.document import parse_document
from depthwalk.scene.yaml_edit import with_values
from depthwalk.scene.yaml_text import block_lines, float32_value, flow_text


def value_of(text: str) -> Any:
    return parse_document(text, "file").value


@pytest.mark.parametrize(
    ("text", "values", "expected"),
    [
        ("a: 1  # one\nb: 2\n", {"a": 3.5}, "a: 3.5  # one\nb: 2\n"),
        ("a: 1\nb: 2", {"b": True, "c": None}, "a: 1\nb: true\nc: null"),
        ("a:\t1\t# tab\r\nb: 2\r\n", {"a": 2, "c": 3}, "a:\t2\t# tab\r\nb: 2\r\nc: 3\r\n"),
        ("ä: 'ü'  # ö\n", {"ä": "y-z", "ö": "on"}, "ä: 'y-z'  # ö\n\"ö\": on\n"),
        ('a: "x"\n', {"a": "it's"}, 'a: "it\'s"\n'),
        ("a: 'x'\n", {"a": "it's"}, "a: 'it''s'\n"),
        ("a: x\n", {"a": "true"}, 'a: "true"\n'),
        ("r:\n    a: 1\n\n# end\n", {"r": {"b": {"c": 1}}}, "r:\n    a: 1\n    b: {c: 1}\n\n# end\n"),
        ("r:\n  a: 1\n  # b: 2\ns: 1\n", {"r": {"b": 3}}, "r:\n  a: 1\n  # b: 2\n  b: 3\ns: 1\n"),
        ("r:  # why\ns: 1\n", {"r": {"b": 3}}, "r:  # why\n  b: 3\ns: 1\n"),
        ("q:\n    a: 1\nr:\n", {"r": {"b": 3}}, "q:\n    a: 1\nr:\n    b: 3\n"),  # indented as the rest
        ("r:\n  # b: 2\ns: 1\n", {"r": {"b": 3}}, "r:\n  # b: 2\n  b: 3\ns: 1\n"),
        ("r:   # why\n", {"r": 3}, "r: 3   # why\n"),
        ("r: ~  # why\n", {"r": {"b": {"c": 3}}}, "r: {b: {c: 3}}  # why\n"),
        ("r: {}\n", {"r": {"b": 3}}, "r: {b: 3}\n"),
        ("r: {# why\n}\n", {"r": {"b": 3}}, "r: {b: 3 # why\n}\n"),
        ("r: {a: 1, b: 2,}\n", {"r": {"c": 3}}, "r: {a: 1, b: 2, c: 3,}\n"),
        ("{a: {x, y: }}", {"a": {"x": 1, "y": {"z": 2}, "w": 3}}, "{a: {x: 1, y: {z: 2} , w: 3}}"),
        (
            "r: {\n  a: 1,  # one\n  b: 2  # two\n}\n",
            {"r": {"b": 3, "c": 4, "d": 5}},
            "r: {\n  a: 1,  # one\n  b: 3,  # two\n  c: 4,\n  d: 5\n}\n",
        ),
        (
            "r: {\n  a: 1,\n  b: 2,  # two\n}\n",
            {"r": {"c": {"x": 1}}},
            "r: {\n  a: 1,\n  b: 2,  # two\n  c: {x: 1},\n}\n",
        ),
        ("r: {a: 1  # one\n}\n", {"r": {"c": 3}}, "r: {a: 1, c: 3  # one\n}\n"),
        ("r: {a: 1,  # one\n  b: 2, c: 3,\n}\n", {"r": {"d": 4}}, "r: {a: 1,  # one\n  b: 2, c: 3, d: 4,\n}\n"),
        ("v: [1, 2.0,  3]  # vector\n", {"v": [1.0, 2.5, 3.0]}, "v: [1, 2.5,  3]  # vector\n"),
        ("v:\n- 1  # x\n- 2\n", {"v": [4.0, 2.0]}, "v:\n- 4  # x\n- 2\n"),
        ("c: [0.2, 0, 1]\n", {"c": "#3300ff"}, "c: [0.2, 0, 1]\n"),
        ("c: [0.2, 0, 1]\n", {"c": "#ff0000"}, "c: [1, 0, 0]\n"),
        ("c: '#ff0000'\n", {"c": "#00ff00"}, "c: '#00ff00'\n"),
        ("c: '#ff0000'\n", {"c": [0.5, 0.0, 1.0]}, "c: [0.5, 0, 1]\n"),
        ("c: [0.2, 0, 1]\n", {"c": None}, "c: null\n"),
        ("a: {x: 1}\n\nb: 2\n\n\n# end", {"r": {"s": {"t": 1}}}, "a: {x: 1}\n\nb: 2\n\n\n# end\n\nr:\n  s: {t: 1}"),
        ("---\na: 1\n...\n", {"b": 2}, "---\na: 1\nb: 2\n...\n"),
        ("t: |\n  one\n  two\n\n# end\n", {"b": 2}, "t: |\n  one\n  two\n\n# end\n\nb: 2\n"),
        ("k: &k {a: 1}\nr: {b: 2}\n", {"r": {"b": 3}}, "k: &k {a: 1}\nr: {b: 3}\n"),
        ("k: &k {a: 1}\n", {"k": {"a": 3, "b": 4}}, "k: &k {a: 3, b: 4}\n"),
        ("b: &b 1\nl:\n- 1\n- *b\n", {"c": 3}, "b: &b 1\nl:\n- 1\n- *b\nc: 3\n"),
        ("? a\n: 1\n", {"a": 2}, "? a\n: 2\n"),
        ("a: plain\n  text  # c\n", {"a": "b"}, "a: b  # c\n"),
    ],
)
def test_values_are_replaced_and_added_in_place(text: str, values: dict[str, Any], expected: str) -> None:
    found = with_values(text, "file", values)
    if "t: |" in text:  # the blank line belongs to the block, or to the end: either is right
        assert value_of(found) == value_of(text) | values
    else:
        assert found == expected
        value_of(found)


@pytest.mark.parametrize(
    ("text", "values", "message"),
    [
        ("k: &k {a: 1}\nr: *k\n", {"r": {"a": 2}}, r"f:2:4: r is an alias of &k"),
        ("k: &k {a: 1}\nr: *k\n", {"k": {"a": 2}}, r"f:1:4: k is used elsewhere as \*k"),
        ("k: &k 1\nr: *k\n", {"k": 2}, r"f:1:4: k is used elsewhere as \*k"),
        ("k: &k 1\n", {"k": 2}, r"f:1:4: k has an anchor or a tag"),
        ("k: !!int 1\n", {"k": 2}, r"f:1:4: k has an anchor or a tag"),
        ("k: &k\nr: 1\n", {"k": 2}, r"f:1:4: k has an anchor or a tag"),
        ("v: &v 1\nr: [*v, 2]\n", {"r": [3.0, 2.0]}, r"f:2:5: r is an alias of &v"),
        ("k: [1]\n", {"k": {"a": 2}}, r"f:1:4: k is not a mapping of keys"),
        ("k: 1\n", {"k": {"a": {"b": 2}}}, r"f:1:4: k is not a mapping of keys"),
        ("k: {a: 1}\n", {"k": 2}, r"f:1:4: k is a mapping of keys, not a value"),
        ("k: [1, 2]\n", {"k": [1.0, 2.0, 3.0]}, r"f:1:4: k is a list of another length"),
        ("k:\n- 1\n", {"k": None}, r"f:2:1: k is a list of another length"),
        ("k: [1, [2]]\n", {"k": [1.0, 2.0]}, r"f:1:8: k holds no numbers"),
        ("- 1\n", {"k": 2}, r"f:1:1: the file is not a mapping of keys"),
    ],
)
def test_what_cannot_be_changed_by_itself_is_refused(text: str, values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        with_values(text, "f", values)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.30000001192092896, "0.3"), (1e-5, "0.00001"), (1e6, "1000000"), (-0.0, "0"), (-2.0, "-2"),
        (1 / 3, "0.33333334"),
    ],
)  # fmt: skip
def test_numbers_have_the_digits_that_a_slider_means(value: float, text: str) -> None:
    assert flow_text(float32_value(value)) == text


def test_long_and_nested_mappings_become_lines() -> None:
    long = {f"number_{count}": count for count in range(9)}
    lines = block_lines({"a": {"b": {"c": [1, 2.5]}, "d": "#ff0000"}, "e": {}, "long": long})
    assert lines[:6] == ["a:", "  b: {c: [1, 2.5]}", '  d: "#ff0000"', "e: {}", "long:", "  number_0: 0"]
    assert value_of("\n".join(lines)) == {"a": {"b": {"c": [1, 2.5]}, "d": "#ff0000"}, "e": {}, "long": long}


class Writer:
    """Writes nested values in a layout that hypothesis draws; counts comments, and marks every scalar."""

    def __init__(self, draw: st.DrawFn) -> None:
        self.draw, self.numbers = draw, itertools.count()
        self.step = draw(st.integers(1, 4))

    def some(self, *choices: str) -> str:
        return self.draw(st.sampled_from(choices))

    def comment(self) -> str:
        """The end of a line, perhaps with a comment."""
        return self.some("", "", "  ", f" # c{next(self.numbers)}: [é, {{", f"\t# c{next(self.numbers)}")

    def lines_between(self, indent: int) -> list[str]:
        one = st.sampled_from(["", "   ", " " * indent + "#c{}", "#c{} - x: y", " " * (indent + 3) + "# c{}: 'z'"])
        return [line.replace("{}", str(next(self.numbers))) for line in self.draw(st.lists(one, max_size=2))]

    def scalar(self, value: Any) -> str:
        if not isinstance(value, str):
            return flow_text(value)
        quoted = f"'{value}'", f'"{value}"'
        return self.some(*quoted) if value.startswith("#") else self.some(value, *quoted)

    def flow(self, value: Any, indent: int) -> str:
        if not isinstance(value, dict | list):
            return self.scalar(value)
        pad = " " * (indent + self.step)
        items = [self.flow(each, indent + self.step) for each in value] if isinstance(value, list) else []
        if isinstance(value, dict):
            items = [f"{key}: {self.flow(each, indent + self.step)}" for key, each in value.items()]
        opened, closed = "[]" if isinstance(value, list) else "{}"
        comma = "," if self.draw(st.booleans()) and items else ""
        if self.draw(st.booleans()):
            return opened + self.some("", " ") + ", ".join(items) + self.some("", " ") + comma + closed
        lines = [f"{pad}{item}{',' if k < len(items) - 1 else comma}{self.comment()}" for k, item in enumerate(items)]
        return "\n".join([opened + self.comment(), *lines, " " * indent + self.some("", " ") + closed])

    def block(self, value: dict[str, Any], indent: int) -> list[str]:
        lines = []
        for key, each in value.items():
            lines += self.lines_between(indent)
            pad = " " * indent
            written = f"{pad}{self.some(key, repr(key))}{self.some(':', ' :')}"
            if each is None and self.draw(st.booleans()):
                lines.append(written + self.comment())
            elif isinstance(each, dict) and each and self.draw(st.booleans()):
                lines += [written + self.comment(), *self.block(each, indent + self.step)]
            elif isinstance(each, list) and each and self.draw(st.booleans()):
                items = [f"{pad}{self.some('-', ' -')} ".ljust(indent + 2) for _ in range(1)] * len(each)
                lines.append(written + self.comment())
                lines += [start + self.scalar(one) + self.comment() for start, one in zip(items, each, strict=True)]
            else:
                lines.append(f"{written} {self.flow(each, indent)}{self.comment()}")
        return lines


scalars = st.one_of(
    st.none(), st.booleans(), st.integers(-99, 99), st.floats(-1e6, 1e6, width=32).map(float32_value),
    st.from_regex(r"w[a-z]{1,3}", fullmatch=True), st.just("#a0b1c2"),
)  # fmt: skip
vectors = st.lists(st.floats(-9, 9, width=32).map(float32_value), min_size=3, max_size=3)
keys = st.from_regex(r"k[a-e]", fullmatch=True)
trees = st.recursive(st.one_of(scalars, vectors), lambda inner: st.dictionaries(keys, inner, max_size=4), max_leaves=16)
documents = st.dictionaries(keys, trees, min_size=1, max_size=5)


@st.composite
def layouts(draw: st.DrawFn) -> tuple[dict[str, Any], str]:
    value = draw(documents)
    writer = Writer(draw)
    is_flow = draw(st.integers(0, 4)) == 0
    lines = [writer.flow(value, 0)] if is_flow else writer.block(value, 0)
    text = "\n".join([*draw(st.sampled_from([[], ["# first"], ["---"]])), *lines, *writer.lines_between(0)])
    return value, draw(st.sampled_from([text, text + "\n", text + "\n\n", (text + "\n").replace("\n", "\r\n")]))


@st.composite
def changes_of(draw: st.DrawFn, value: dict[str, Any]) -> dict[str, Any]:
    """New values for some keys of a mapping, and new keys."""
    found: dict[str, Any] = {}
    for key in draw(st.lists(st.sampled_from([*value, "ka", "kf", "kg"]), unique=True, max_size=4)):
        old = value.get(key)
        if isinstance(old, dict):
            if inner := draw(changes_of(old)):
                found[key] = inner
        elif isinstance(old, list):
            found[key] = draw(vectors)
        elif old is None:
            found[key] = draw(st.one_of(scalars, st.dictionaries(keys, st.one_of(scalars, vectors), min_size=1)))
        else:
            found[key] = draw(st.one_of(scalars, vectors))
    return found


def merged(value: Any, values: dict[str, Any]) -> dict[str, Any]:
    result = copy.copy(value) if isinstance(value, dict) else {}
    for key, new in values.items():
        result[key] = merged(result.get(key), new) if isinstance(new, dict) else new
    return result


def comments(text: str) -> list[str]:
    return re.findall(r"# ?c\d+[^\r\n]*", text)


def kept_parts(old: str, new: str) -> Iterator[str]:
    """The characters of the old text that are not found, in their order, in the new one."""
    rest = iter(new)
    for character in old:
        if character not in rest:
            yield character


@given(st.data())
def test_only_the_intended_values_change_in_any_layout(data: st.DataObject) -> None:
    value, text = data.draw(layouts())
    assert value_of(text) == value  # or the writer is wrong
    values = data.draw(changes_of(value))
    new = with_values(text, "file", values)
    assert value_of(new) == merged(value, values), f"{text}\n---\n{values}\n---\n{new}"
    assert comments(new) == comments(text)
    assert with_values(text, "file", {}) == text
    again = with_values(new, "file", values)
    assert again == new or value_of(again) == value_of(new)


@given(st.data())
def test_what_is_added_leaves_every_character_of_the_text(data: st.DataObject) -> None:
    value, text = data.draw(layouts())
    added = data.draw(st.dictionaries(st.sampled_from(["na", "nb", "nc"]), st.one_of(scalars, vectors, documents)))
    new = with_values(text, "file", added)
    assert not list(kept_parts(text, new))
    assert value_of(new) == value | added
