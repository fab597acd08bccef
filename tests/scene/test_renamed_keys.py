"""Keys under the names that they had in an earlier version."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from depthwalk.errors import InputError
from depthwalk.scene import renamed_keys
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.schema import SceneFile

Caplog = pytest.LogCaptureFixture


def scene(folder: Path, text: str) -> str:
    (folder / "scene.yaml").write_text(f"version: 1\n{text}")
    return str(folder / "scene.yaml")


def told(folder: Path, text: str, overrides: dict[str, str] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_scene(scene(folder, text), overrides=overrides)
    return str(caught.value)


SCHEMA = cache(SceneFile.model_json_schema)


def properties(former: str) -> dict[str, Any]:
    """The properties in the JSON schema of the mapping that held a key."""
    schema = SCHEMA()
    node = schema
    for part in former.split(".")[:-1]:
        node = node["properties"][part]
        references = [choice["$ref"] for choice in node.get("anyOf", [node]) if "$ref" in choice]
        node = schema["$defs"][references[0].rsplit("/", 1)[1]]
    found: dict[str, Any] = node["properties"]
    return found


@pytest.mark.parametrize(("former", "name"), renamed_keys.RENAMED_KEYS.items())
def test_the_schema_has_the_present_name_only(former: str, name: str) -> None:
    assert name in properties(former)
    assert former.rsplit(".", 1)[1] not in properties(former)


def test_a_former_name_works_and_is_warned_of_once(tmp_path: Path, caplog: Caplog) -> None:
    path = scene(tmp_path, "render:\n  fxaa: {contrast: 0.5}\n")
    assert load_scene(path).render.fxaa.edge_threshold == 0.5
    assert caplog.messages == [f"{path}:3:10: render.fxaa.contrast is now called render.fxaa.edge_threshold"]


def test_a_present_name_is_not_warned_of(tmp_path: Path, caplog: Caplog) -> None:
    path = scene(tmp_path, "render: {fxaa: {edge_threshold: 0.5}}\n")
    assert load_scene(path, overrides={"render.warp.triangle_budget": "5"}).render.fxaa.edge_threshold == 0.5
    assert not caplog.messages


def test_an_option_may_use_a_former_name(tmp_path: Path, caplog: Caplog) -> None:
    path = scene(tmp_path, "")
    assert load_scene(path, overrides={"render.warp.budget": "7"}).render.warp.triangle_budget == 7
    assert caplog.messages == ["--set render.warp.budget: render.warp.budget is now called render.warp.triangle_budget"]


def test_the_value_of_an_option_may_hold_a_former_name(tmp_path: Path, caplog: Caplog) -> None:
    settings = load_scene(scene(tmp_path, ""), overrides={"render": "{dof: {largest: 3}}"}).render
    assert settings.dof.max_blur == 3
    assert caplog.messages == ["--set render: render.dof.largest is now called render.dof.max_blur"]


@pytest.mark.parametrize("option", ["render.dof.largest", "render.dof.max_blur"])
@pytest.mark.parametrize("key", ["largest", "max_blur"])
def test_an_option_wins_over_the_file_by_either_name(tmp_path: Path, option: str, key: str) -> None:
    path = scene(tmp_path, f"render: {{dof: {{{key}: 3}}}}\n")
    assert load_scene(path, overrides={option: "4"}).render.dof.max_blur == 4


def test_both_names_at_once(tmp_path: Path) -> None:
    text = "environment: {ground: {size: 2, half_size: 3}}\n"
    said = "environment.ground.size: is the former name of environment.ground.half_size, which is given too"
    assert told(tmp_path, text) == f"{tmp_path}/scene.yaml:2:24: {said}"
    assert told(tmp_path, "", {"environment.ground": "{size: 2, half_size: 3}"}) == f"--set environment.ground: {said}"


def test_a_mistake_is_found_where_the_former_name_stands(tmp_path: Path) -> None:
    said = "environment.ground.size: must be greater than 0, not 0"
    assert told(tmp_path, "environment: {ground: {size: 0}}\n") == f"{tmp_path}/scene.yaml:2:30: {said}"
    said = "--set environment.ground.size: must be greater than 0, not -1"
    assert told(tmp_path, "", {"environment.ground.size": "-1"}) == said


def test_an_alias_is_renamed_in_both_places(tmp_path: Path, caplog: Caplog) -> None:
    settings = load_scene(scene(tmp_path, "render: {fxaa: &a {contrast: 0.5}, smaa: *a}\n")).render
    assert (settings.fxaa.edge_threshold, settings.smaa.edge_threshold) == (0.5, 0.5)
    assert len(caplog.messages) == 2


def test_keys_of_path_files_and_of_lists(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: Caplog) -> None:
    monkeypatch.setattr(renamed_keys, "RENAMED_KEYS", {"rate": "fps", "keyframes.*.when": "time"})
    path = tmp_path / "path.yaml"
    path.write_text(
        "version: 1\nrate: 5\nkeyframes:\n"
        "  - {time: 0, position: [0, 0, 0], target: [0, 0, 1]}\n"
        "  - {when: 2, position: [0, 0, 0], target: [0, 0, 1]}\n"
    )
    read = load_path(path)
    assert (read.fps, read.times.tolist()) == (5, [0, 2])
    assert caplog.messages == [
        f"{path}:2:1: rate is now called fps",
        f"{path}:5:6: keyframes[1].when is now called keyframes[1].time",
    ]


def test_only_keys_at_their_former_place_are_renamed() -> None:
    value = {"contrast": 1}
    renamed_keys.rename_keys(value, ("render", "smaa", "longest"), lambda *told: pytest.fail(str(told)))
    renamed_keys.rename_keys(value, ("render", "lod"), lambda *told: pytest.fail(str(told)))
    assert value == {"contrast": 1}
    assert renamed_keys.present_place(("render", "smaa", "contrast", "x")) == ("render", "smaa", "edge_threshold", "x")
    assert renamed_keys.present_place(("render", "lod", "bias")) == ("render", "lod", "bias")


def test_a_group_that_is_no_mapping(tmp_path: Path) -> None:
    assert told(tmp_path, "render: {fxaa: 3}\n").endswith("render.fxaa: must be a mapping of keys, not 3")
