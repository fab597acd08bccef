"""The file of advice: what is written is read again, and mistakes are located."""

from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.scene.advice import Advice, advice_text, load_advice
from depthwalk.scene.loader import load_scene

SIZES = [
    {"pixels": 300.0, "mesh": True, "quickest": "mesh", "measured": {"mesh": {"ms": 1.5, "flip": 0.02}}},
    {"pixels": 40.0, "mesh": False, "quickest": "dpci"},
]


def test_what_is_written_is_read_again_by_rising_size(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text(advice_text("llvmpipe", 0.1, {"bust": SIZES, "none": []}))
    assert load_advice(file) == {"bust": Advice(pixels=(40.0, 300.0), mesh=(False, True))}


def test_a_scene_names_it(tiny_scene: Path) -> None:
    assert load_scene(tiny_scene).advice == {}
    (tiny_scene.parent / "a.json").write_text(advice_text("x", 0.1, {"ball": SIZES}))
    assert load_scene(tiny_scene, overrides={"advice": "a.json"}).advice["ball"].mesh == (False, True)


@pytest.mark.parametrize(
    ("text", "message"),
    (
        ('{"version": 1}', "1:1: missing key 'renderer'"),
        (
            '{"version": 1, "renderer": "x", "want_flip": 0.1, "assets": {"a": [{"pixels": -1, "mesh": true, '
            '"quickest": "x"}]}}',
            "assets.a[0].pixels",
        ),
        ("[", "a.json"),
    ),
)
def test_mistakes_are_located(tiny_scene: Path, text: str, message: str) -> None:
    (tiny_scene.parent / "a.json").write_text(text)
    with pytest.raises(InputError) as caught:
        load_scene(tiny_scene, overrides={"advice": "a.json"})
    assert message in str(caught.value) and "a.json" in str(caught.value)


def test_a_file_that_is_not_there_is_located(tiny_scene: Path) -> None:
    with pytest.raises(InputError, match=r"advice: file 'no.json' not found"):
        load_scene(tiny_scene, overrides={"advice": "no.json"})


def test_auto_needs_depth_images_and_a_mesh(tiny_scene: Path) -> None:
    lone = tiny_scene.with_name("lone.yaml")
    lone.write_text("version: 1\nassets: {a: {mesh: ball.ply}}\nobjects: [{asset: a, representation: auto}]\n")
    with pytest.raises(InputError, match=r"must be 'mesh', .* or 'billboard', not 'auto'.*has no dpci"):
        load_scene(lone)
