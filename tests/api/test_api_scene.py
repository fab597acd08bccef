"""Scenes as the library hands them out: nodes, objects, and moving them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import depthwalk as dw
from balls import write_balls
from depthwalk.api.scene import Scene


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return dw.load_scene(write_balls(tmp_path))


def test_nodes_and_objects_lead_to_each_other(scene: Scene) -> None:
    for number in range(len(scene.nodes)):
        assert {scene.node_of(found) for found in scene.objects_of(number)} == {number}
    assert [len(scene.objects_of(number)) for number in range(3)] == [1, 3, 1]


def test_what_is_not_given_stays(scene: Scene) -> None:
    scene.move("row", position=(1, 2, 3))
    scene.move("row", yaw=math.pi / 2, scale=2.0)
    assert scene.position_of("row") == (1, 2, 3)
    ends = scene.loaded.objects.position[[1, 3]]  # of a row of 4 m, turned from x to −z
    assert ends == pytest.approx(np.array([(1, 2, 7), (1, 2, -1)]), abs=1e-5)
    assert scene.loaded.objects.scale[1:4].tolist() == [2, 2, 2]


def test_each_angle_stays_unless_it_is_given(scene: Scene) -> None:
    angles: dict[str, Any] = {"yaw": 0.4, "pitch": -1.2, "roll": 2.5}
    scene.move("row", **angles)
    wanted = scene.loaded.objects.rotation[1].copy()
    scene.move("row", yaw=1.0, pitch=1.0, roll=1.0)
    for name, angle in angles.items():
        assert np.abs(scene.loaded.objects.rotation[1] - wanted).max() > 0.01
        scene.move("row", **{name: angle})
    np.testing.assert_allclose(scene.loaded.objects.rotation[1:4], np.tile(wanted, (3, 1)), atol=1e-7)


def test_a_row_is_stood_on_its_end(scene: Scene) -> None:
    scene.move("row", position=(1, 2, 3), roll=math.pi / 2)
    ends = scene.loaded.objects.position[[1, 3]]  # of a row of 4 m, turned from x to y
    assert ends == pytest.approx(np.array([(1, 0, 3), (1, 4, 3)]), abs=1e-5)


def test_only_what_hangs_on_the_node_moves(scene: Scene) -> None:
    before = scene.loaded.objects.position.copy()
    told = []

    class Watcher:
        def note(self, changed: slice) -> None:
            told.append(changed)

    watcher = Watcher()
    scene.watch(watcher.note)
    scene.move("row", position=(0, 5, 0))
    assert told == [slice(1, 4)]
    assert (scene.loaded.objects.position[[0, 4]] == before[[0, 4]]).all()
    del watcher
    scene.move("ball", position=(0, 5, 0))
    assert told == [slice(1, 4)]


@pytest.mark.parametrize(
    ("node", "values", "message"),
    [
        ("bal", {}, "no node 'bal'; did you mean 'ball'?"),
        ("", {}, "no node ''"),
        (3, {}, "no node 3: the scene has 3"),
        (-1, {}, "no node -1: the scene has 3"),
        ("ball", {"position": (0, 1)}, "node 'ball': position (0, 1) must be three numbers"),
        ("ball", {"position": 1}, "node 'ball': position 1 must be three numbers"),
        ("ball", {"scale": (1, 2, 1)}, "node 'ball': scale (1, 2, 1) must be a number"),
        ("ball", {"scale": 0.0}, "node 'ball': a node's transform must be finite, its scale positive"),
        ("ball", {"pitch": math.nan}, "node 'ball': a node's transform must be finite, its scale positive"),
        ("ball", {"position": (0, math.inf, 0)}, "node 'ball': a node's transform must be finite, its scale positive"),
    ],
)
def test_moving_refuses(scene: Scene, node: str, values: dict[str, Any], message: str) -> None:
    with pytest.raises(dw.InputError) as caught:
        scene.move(node, **values)
    assert str(caught.value) == message


def test_a_name_that_two_nodes_have(tmp_path: Path) -> None:
    file = write_balls(tmp_path)
    file.write_text(file.read_text().replace("name: row", "name: ball"))
    with pytest.raises(dw.InputError, match=r"2 nodes are named 'ball': give a number, one of \[0, 1\]"):
        dw.load_scene(file).move("ball", yaw=1)


def test_an_object_that_is_none(scene: Scene) -> None:
    with pytest.raises(dw.InputError, match="no object -1: the scene has 5"):
        scene.node_of(-1)


def test_a_mesh_is_a_scene(tmp_path: Path) -> None:
    write_balls(tmp_path)
    scene = dw.load_scene(str(tmp_path / "ball.ply"))
    assert (scene.object_count, scene.camera, scene.path.name) == (1, None, "ball.ply")


def test_overrides_are_values_or_their_text(tmp_path: Path) -> None:
    file = write_balls(tmp_path)
    plain = {
        "render.dof.f_number": 1.4,
        "render.shadows.enabled": True,
        "camera.position": [1, 2, 3],
        "render.aa": "smaa",
    }
    text = {key: value if isinstance(value, str) else str(value).lower() for key, value in plain.items()}
    one, other = dw.load_scene(file, overrides=plain), dw.load_scene(file, overrides=text)
    assert one.settings == other.settings and one.settings.dof.f_number == 1.4
    assert one.loaded.camera == other.loaded.camera


def test_an_override_that_no_scene_file_could_hold(tmp_path: Path) -> None:
    with pytest.raises(dw.InputError, match=r"^overrides: camera.fov: must be text, a number, .*, not ndarray$"):
        dw.load_scene(write_balls(tmp_path), overrides={"camera.fov": np.zeros(3)})


@pytest.mark.parametrize("wrong", ["models", Path("models"), {"render.aa": "smaa"}])
def test_asset_roots_are_a_list(wrong: Any, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="asset_roots: must be a list of folders, not"):
        dw.load_scene(write_balls(tmp_path), wrong)


def test_a_setting_that_is_not_allowed_is_an_input_error(scene: Scene) -> None:
    with pytest.raises(dw.InputError, match=r"aa: must be 'none', .* or 'ssaa', not 'most'"):
        scene.settings.aa = "most"  # type: ignore[assignment]
    with pytest.raises(dw.InputError, match="direction: must not be the zero vector"):
        scene.environment.sun.direction = (0.0, 0.0, 0.0)


def test_a_camera_without_field_of_view_has_that_of_scene_files() -> None:
    assert math.degrees(dw.Camera((0, 0, 1), (0, 0, 0)).fov) == pytest.approx(60)
