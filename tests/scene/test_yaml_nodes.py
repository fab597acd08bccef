"""YAML text as nodes: the types of YAML 1.2, positions, and what libyaml's messages become."""

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.yaml_nodes import MappingNode, ScalarNode, SequenceNode, compose


def root(text: str) -> object:
    node = compose(text, "file")
    return node.value() if isinstance(node, ScalarNode) else node


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("~", None), ("Null", None), ("TRUE", True), ("False", False), ("017", 17), ("0o17", 15), ("-0x1f", -31),
        ("0b101", 5), ("1_000", 1000), ("+1.", 1.0), ("-.5e+3", -500.0), ("1e3", 1000.0), ("-.Inf", float("-inf")),
        ("no", "no"), ("On", "On"), ("1:30", "1:30"), ("1_", "1_"), ("0x", "0x"), ("1e", "1e"), ("2026-01-01",) * 2,
        ("'1'", "1"), ('"\\x41"', "A"), ("! 1", "1"), ("!!str 1", "1"), ("!!float 1", 1.0), ("|\n 1\n", "1\n"),
        ("٣", "٣"),
    ],
)  # fmt: skip
def test_scalars_are_those_of_yaml_1_2(text: str, value: object) -> None:
    found = root(text)
    assert found == value and type(found) is type(value)


def test_nodes_know_their_position() -> None:
    node = compose("a:\n- é: [1, 2]\n", "file")
    assert isinstance(node, MappingNode)
    ((_, items),) = node.pairs()
    assert isinstance(items, SequenceNode) and isinstance(items.items[0], MappingNode)
    ((key, value),) = items.items[0].pairs()
    found = [(one.line, one.column, one.tag) for one in (items, key, value)]
    assert found == [(1, 0, "seq"), (1, 2, "str"), (1, 5, "seq")]


def test_an_alias_is_the_node_that_it_names() -> None:
    node = compose("- &a [1]\n- *a\n", "file")
    assert isinstance(node, SequenceNode) and node.items[0] is node.items[1]


@pytest.mark.parametrize("text", ["", "# nothing\n", "\ufeff"])
def test_nothing_is_no_node(text: str) -> None:
    assert compose(text, "file") is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: *b", "1:4: not valid YAML: no anchor 'b' before"),
        ("a: [1\n", "1:4: not valid YAML: expected ',' or ']' before the end of the text"),
        ("a: {b: 1 c: 2}", "1:11: not valid YAML: expected ',' or '}', not ':'"),
        ("a: @b", "1:4: not valid YAML: '@' cannot start a value"),
        ("a: 'b", "1:4: not valid YAML: expected a closing quote before the end of the text"),
        ("a: \x01", "1:4: character U+0001 is not allowed in YAML"),
        ("a: b\ufeff", "1:5: character U+FEFF is not allowed in YAML"),
        ("a: \ud800", "1:4: character U+D800 is not allowed in YAML"),
        ('"\\ud800"', "1:4: not valid YAML: found invalid Unicode character escape code"),
        ("a: 1\n...\nb: 2\n", "3:1: not valid YAML: expected '---' before this"),
    ],
)
def test_what_is_not_yaml_is_said_with_its_place(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        compose(text, "file")
    assert str(caught.value) == f"file:{message}"
