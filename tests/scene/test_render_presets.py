"""Presets: what a word stands for, and that what a file says itself wins."""

import logging
from typing import Any

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.render_presets import PRESETS, with_preset
from depthwalk.scene.render_settings import RenderSettings

SCENE = "version: 1\nrender: {render}\n"


def changed(settings: RenderSettings, group: str) -> dict[str, Any]:
    """What differs from the defaults in a group."""
    own, default = (getattr(each, group).model_dump() for each in (settings, RenderSettings()))
    return {key: value for key, value in own.items() if value != default[key]}


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_holds_settings_that_differ_from_the_defaults(name: str) -> None:
    settings = RenderSettings(preset=name)  # type: ignore[arg-type]  # one of the literals
    assert {group: changed(settings, group) for group in PRESETS[name]} == PRESETS[name]
    others = RenderSettings.model_fields.keys() - PRESETS[name].keys() - {"preset"}
    assert all(getattr(settings, key) == getattr(RenderSettings(), key) for key in others)


def test_the_names_are_those_that_a_file_may_say() -> None:
    assert list(PRESETS) == RenderSettings.model_json_schema()["properties"]["preset"]["enum"]


def test_what_a_file_says_wins_key_by_key(tmp_path: Any) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE.format(render="{preset: paper, lod: {mode: error, bias: 1}}"))
    settings = load_scene(file, overrides={"render.warp.tile_mapping": "screen"}).render
    assert (settings.lod.mode, settings.lod.bias, settings.lod.cases) == ("error", 1, "paper")
    assert (settings.warp.tile_mapping, settings.warp.order) == ("screen", "epipole")
    again = load_scene(file, overrides={"render.preset": "default"}).render
    assert again.lod.bias == 1 and again.warp == RenderSettings().warp


def test_former_names_win_too(tmp_path: Any, caplog: pytest.LogCaptureFixture) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE.format(render="{preset: paper, warp: {tiles: screen}}"))
    with caplog.at_level(logging.WARNING):
        assert load_scene(file).render.warp.tile_mapping == "screen"
    assert "is now called" in caplog.text


@pytest.mark.parametrize(
    ("render", "message"),
    [
        ("{preset: papers}", "2:18: render.preset: must be 'default' or 'paper', not 'papers'"),
        ("{preset: [paper]}", "2:18: render.preset: must be 'default' or 'paper', not a list"),
        ("{preset: paper, lod: {cases: none}}", "render.lod.cases: must be"),
        ("{preset: paper, lod: 3}", "render.lod: must be a mapping of keys, not 3"),
    ],
)
def test_mistakes_are_located_as_without_a_preset(tmp_path: Any, render: str, message: str) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE.format(render=render))
    with pytest.raises(InputError) as error:
        load_scene(file)
    assert message in str(error.value)


def test_settings_of_a_preset_are_changed_like_any_others() -> None:
    settings = RenderSettings(preset="paper")
    settings.aa, settings.lod.bias = "fxaa", 2.0
    assert (settings.aa, settings.lod.bias, settings.warp.order) == ("fxaa", 2.0, "epipole")
    assert RenderSettings.model_validate(settings.model_dump()) == settings


def test_the_data_stay_as_they_are() -> None:
    values = {"preset": "paper", "lod": {"bias": 1}}
    with_preset(values)["light"]["mode"] = "deferred"
    assert values == {"preset": "paper", "lod": {"bias": 1}}
    assert PRESETS["paper"]["light"] == {"mode": "warp"}
