"""Mistakes of a document in words, and overrides."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import Field

from depthwalk.errors import InputError
from depthwalk.params import Params, param, shown
from depthwalk.scene.document import parse_document
from depthwalk.scene.key_hints import MAX_KEYS_NAMED
from depthwalk.scene.loader import load_scene
from depthwalk.scene.validate import MAX_MESSAGES, check_model, raise_all


class Inner(Params):
    size: float = param(1.0, "Size", ge=0, le=10)
    name: str | None = param(None, "Name")


class Outer(Params):
    inner: Inner = param(Inner(), "Inner")
    flags: list[bool] = param([], "Flags")
    count: int = param(1, "Count")


def told(text: str, overrides: dict[str, str] | None = None, model: type[Params] = Outer) -> list[str]:
    with pytest.raises(InputError) as caught:
        check_model(parse_document(text, "file"), model, overrides)
    return str(caught.value).splitlines()


def test_overrides_make_mappings_and_reach_into_lists() -> None:
    document = parse_document("flags: [true, true]", "file")
    model, source = check_model(document, Outer, {"inner.size": "3", "flags[1]": "false"})
    assert (model.inner.size, model.flags) == (3, [True, False])
    assert str(source.error(("inner", "size"), "is bad")) == "--set inner.size: is bad"
    assert str(source.error(("flags", 0), "is bad")) == "file:1:9: flags[0]: is bad"


def test_an_empty_override_is_null() -> None:
    assert check_model(parse_document("inner: {name: x}", "file"), Outer, {"inner.name": " "})[0].inner.name is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inner: {size: big}", "file:1:15: inner.size: must be a number, not 'big'"),
        ("inner: {size: 11}", "file:1:15: inner.size: must be at most 10, not 11"),
        ("inner: 3", "file:1:8: inner: must be a mapping of keys, not 3"),
        ("flags: [maybe]", "file:1:9: flags[0]: must be true or false, not 'maybe'"),
        ("count: many", "file:1:8: count: must be a whole number, not 'many'"),
        ("inner: {name: [1]}", "file:1:15: inner.name: must be text, not a list"),
        ("inner: {sise: 1}", "file:1:9: inner.sise: unknown key; did you mean 'size'?"),
        ("flags: {a: 1}", "file:1:8: flags: must be a list, not a mapping"),
        ("inner: {xyz: 1}", "file:1:9: inner.xyz: unknown key; known here: 'size', 'name'"),
    ],
)
def test_messages_are_in_plain_words(text: str, message: str) -> None:
    assert told(text) == [message]


class Node(Params):
    yaw: float = param(0.0, "Yaw")
    roll: float = param(0.0, "Roll")
    representation: str = param("", "Representation")


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("rotation", "'yaw' or 'roll'"),
        ("Euler", "'yaw' or 'roll'"),
        ("tilt", "'roll'"),
        ("represent", "'representation'"),
        ("path", None),
    ],
)
def test_words_of_other_programs_are_understood(key: str, meant: str | None) -> None:
    hint = f"; did you mean {meant}?" if meant else "; known here: 'yaw', 'roll', 'representation'"
    assert told(f"{key}: 1", model=Node) == [f"file:1:1: {key}: unknown key{hint}"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inner: {size:3}", "file:1:9: inner.size:3: unknown key; a space is missing after 'size:'"),
        ("inner: size:3", "file:1:8: inner: must be a mapping of keys, not 'size:3'; a space is missing after 'size:'"),
        ("inner: {far:3}", "file:1:9: inner.far:3: unknown key; known here: 'size', 'name'"),
        ("inner: far:3", "file:1:8: inner: must be a mapping of keys, not 'far:3'"),
    ],
)
def test_a_space_that_is_missing(text: str, message: str) -> None:
    assert told(text) == [message]


def test_many_keys_are_not_listed() -> None:
    fields: dict[str, Any] = {f"key{i}": (int, 0) for i in range(MAX_KEYS_NAMED + 1)}
    from pydantic import create_model

    model = create_model("Many", __base__=Params, **fields)
    assert told("xyz: 1", model=model) == ["file:1:1: xyz: unknown key"]


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("flags.2", "--set flags.2: flags has no item '2', it has 1"),
        ("count.x", "--set count.x: count is 1, it has no keys"),
        ("a..b", "--set a..b: must be a dotted path such as render.lod.bias"),
    ],
)
def test_overrides_that_lead_nowhere(key: str, message: str) -> None:
    assert told("flags: [true]\ncount: 1", {key: "1"}) == [message]


class Fog(Params):
    density: float = param(0.01, "Density")


class Shadows(Params):
    enabled: bool = param(False, "Enabled")


class Eye(Params):
    height: float = param(..., "Height")


class Empties(Params):
    fog: Fog | None = param(None, "Fog")
    shadows: Shadows = Field(default_factory=Shadows, description="Shadows")
    eye: Eye | None = param(None, "Eye")
    name: str | None = param(None, "Name")
    items: list[Fog] = Field(default_factory=list, description="Items")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("fog:\n\nname: x", "file:1:1: fog: is empty; indent its keys below it, or write {} for its defaults"),
        ("eye:\nheight: 2", "file:1:1: eye: is empty; indent its keys below it"),
        (
            "items: [{density: 1}, ]\nfog: # later",
            "file:2:1: fog: is empty; indent its keys below it, or write {} for its defaults",
        ),
        ("fog: true", "file:1:6: fog: must be a mapping of keys, not true; write {} for its defaults"),
        ("shadows: true", "file:1:10: shadows: must be a mapping of keys, not true; write {enabled: true}"),
        ("shadows: no", "file:1:10: shadows: must be a mapping of keys, not 'no'"),
        ("eye: true", "file:1:6: eye: must be a mapping of keys, not true"),
    ],
)
def test_what_stands_in_place_of_keys(text: str, message: str) -> None:
    """`fog:` with nothing behind it is null to YAML, as if it were left out, whatever its author meant."""
    assert told(text, model=Empties) == [message]


def test_null_is_as_if_left_out_where_it_is_written_out_or_needs_no_keys() -> None:
    for text, overrides in (("fog: null\nname:", {}), ("fog: ~", {}), ("fog:", {"fog": "null"})):
        assert check_model(parse_document(text, "file"), Empties, overrides)[0] == Empties()
    fog = check_model(parse_document("fog:", "file"), Empties, {"fog.density": "0.5"})[0].fog
    assert fog is not None and fog.density == 0.5


def test_keys_known_of_one_kind_of_node_are_those_of_no_other(tmp_path: Path) -> None:
    """Those of all kinds together would be too many to name."""
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nobjects: [{asset: a, seed: 3}]")
    known = "'name', 'position', 'yaw', 'pitch', 'roll', 'animation', 'asset', 'scale', 'representation'"
    with pytest.raises(InputError, match=rf"objects\[0\]\.seed: unknown key; known here: {known}$"):
        load_scene(scene)


def test_not_more_errors_than_fit_a_screen() -> None:
    with pytest.raises(InputError) as caught:
        raise_all([InputError(str(i)) for i in range(MAX_MESSAGES + 5)])
    assert str(caught.value).splitlines()[-1] == "... and 5 more"
    raise_all([])


def test_values_are_shown_as_they_are_written() -> None:
    values: tuple[object, ...] = (None, True, {}, [], 0.5, "x")
    assert [shown(value) for value in values] == [
        "null", "true", "a mapping", "a list", "0.5", "'x'",
    ]  # fmt: skip
    assert len(shown("x" * 100)) == 40
