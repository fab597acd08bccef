"""A frame's key tells whether it would look the same."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from depthwalk.commands.cluster_render import spans
from depthwalk.commands.frame_keys import frame_keys
from depthwalk.commands.options import RepresentationName
from depthwalk.commands.output import Output
from depthwalk.errors import InputError
from depthwalk.scene.advice import advice_text
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene

CAMERA = Camera((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.8)


LOOK: dict[str, Any] = {
    "size": (96, 64),
    "representation": RepresentationName.SCENE,
    "output": Output("{frame}.png"),
    "sky": None,
}


def key_of(scene: Path, camera: Camera = CAMERA, aa: str = "none", **look: Any) -> str:
    return frame_keys(load_scene(scene, overrides={"render.aa": aa}), (), **LOOK | look).key(camera)


@pytest.fixture
def places(tiny_scene: Path) -> Path:
    tiny_scene.with_name("at.csv").write_text("x,y,z\n1,0,0\n")
    text = tiny_scene.read_text().replace("{asset: ball}", "{places: {asset: ball, file: at.csv}}", 1)
    tiny_scene.with_name("advice.json").write_text(advice_text("a GPU", 0.1, {}))
    tiny_scene.write_text(f"{text}\nadvice: advice.json\n")
    return tiny_scene


CHANGES: dict[str, Callable[[Path], object]] = {
    "the scene": lambda scene: scene.write_text(scene.read_text() + "\n"),
    "a mesh": lambda scene: scene.with_name("ball.ply").write_bytes(scene.with_name("ball.ply").read_bytes() + b"\n"),
    "places": lambda scene: scene.with_name("at.csv").write_text("x,y,z\n2,0,0\n"),
    "advice": lambda scene: scene.with_name("advice.json").write_text(advice_text("another", 0.1, {})),
}


@pytest.mark.parametrize("what", CHANGES)
def test_what_a_scene_is_made_of_decides(places: Path, what: str) -> None:
    before = key_of(places)
    assert key_of(places) == before
    CHANGES[what](places)
    assert key_of(places) != before


def test_cameras_settings_and_looks_decide(tiny_scene: Path) -> None:
    keys = [
        key_of(tiny_scene),
        key_of(tiny_scene, size=(64, 48)),
        key_of(tiny_scene, representation=RepresentationName.MESH),
        key_of(tiny_scene, output=Output("{frame}.jpg")),
        key_of(tiny_scene, output=Output("{frame}.png", transparent=True)),
        key_of(tiny_scene, camera=replace(CAMERA, fov=0.81)),
        key_of(tiny_scene, camera=replace(CAMERA, position=(0.0, 1.0, 4.0 + 1e-12))),
        key_of(tiny_scene, aa="fxaa"),
    ]
    assert len(set(keys)) == len(keys)


def test_the_picture_of_the_sky_decides(tiny_scene: Path, tmp_path: Path) -> None:
    (sky := tmp_path / "sky.png").write_bytes(b"one")
    scenes = [load_scene(tiny_scene, sky=given) for given in (None, sky)]
    keys = [frame_keys(scene, (), **LOOK).key(CAMERA) for scene in scenes]
    sky.write_bytes(b"another")
    keys.append(frame_keys(scenes[1], (), **LOOK).key(CAMERA))
    keys.append(frame_keys(scenes[1], (), **LOOK | {"sky": sky}).key(CAMERA))
    assert len(set(keys)) == 4


def test_models_in_a_row_have_keys_of_their_own(tiny_scene: Path) -> None:
    scene = load_scene(tiny_scene)
    assert frame_keys(replace(scene, side_by_side=True), (), **LOOK) != frame_keys(scene, (), **LOOK)


def test_neither_names_nor_depth_images_beside_a_mesh_decide(tiny_scene: Path) -> None:
    before = key_of(tiny_scene)
    tiny_scene.with_name("ball.dpci.exr").write_bytes(b"baked")
    moved = tiny_scene.parent.rename(tiny_scene.parent.with_name("elsewhere")) / tiny_scene.name
    assert key_of(moved) == before


def test_a_missing_file_is_named(tiny_scene: Path) -> None:
    scene = load_scene(tiny_scene)
    tiny_scene.with_name("ball.ply").unlink()
    with pytest.raises(InputError, match=r"ball\.ply"):
        frame_keys(scene, (), **LOOK)


@pytest.mark.parametrize(
    ("numbers", "text"), [([], ""), ([4], "4-4"), ([3, 1, 2], "1-3"), ([9, 1, 2, 8, 5], "1-2,5-5,8-9")]
)
def test_frames_are_told_as_the_option_takes_them(numbers: list[int], text: str) -> None:
    assert spans(numbers) == text
