"""Camera paths: files, frames and curves."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath, load_path

KEYS = [(0, 3, 1), (1, -2, 4), (2, 0.5, 7), (3, 5, -1)]


def path_of(folder: Path, header: str, keys: str) -> CameraPath:
    (folder / "path.yaml").write_text(f"version: 1\n{header}\nkeyframes:\n{keys}")
    return load_path(folder / "path.yaml")


def keyframes(scale: float = 1) -> str:
    return "".join(
        f"  - {{time: {t * scale}, position: [{x}, 1, {z}], target: [0, {x}, 0], fov: {40 + 5 * t}}}\n"
        for t, x, z in KEYS
    )


def test_step_at_one_frame_a_second_is_the_keyframes(tmp_path: Path) -> None:
    path = path_of(tmp_path, "fps: 1\ninterpolation: step", keyframes())
    assert path.frames() == [0, 1, 2, 3]
    for (t, x, z), time in zip(KEYS, path.frames(), strict=True):
        assert path.sample(time) == Camera((x, 1, z), (0, x, 0), math.radians(40 + 5 * t), time)
    assert replace(path.sample(1.99), time=1) == path.sample(1)
    assert replace(path.sample(99), time=3) == path.sample(3)


def test_smooth_passes_through_the_keyframes(tmp_path: Path) -> None:
    path = path_of(tmp_path, "fps: 10", keyframes(0.7))
    for t, x, z in KEYS:
        camera = path.sample(t * 0.7)
        np.testing.assert_allclose(camera.position, (x, 1, z), atol=1e-12)
        np.testing.assert_allclose(camera.target, (0, x, 0), atol=1e-12)
        assert camera.fov == pytest.approx(math.radians(40 + 5 * t))


def test_smooth_has_a_continuous_velocity(tmp_path: Path) -> None:
    path = path_of(tmp_path, "fps: 30", keyframes())

    def speed(time: float) -> np.ndarray:
        return (np.array(path.sample(time + 1e-6).position) - path.sample(time).position) / 1e-6

    for t in (1, 2):
        np.testing.assert_allclose(speed(t - 2e-6), speed(t + 1e-6), atol=1e-3)
        assert np.linalg.norm(speed(t)) > 0.1


def test_smooth_is_straight_at_even_speed(tmp_path: Path) -> None:
    keys = "".join(f"  - {{time: {t}, position: [{2 * t}, 0, 0], target: [9, 0, 0]}}\n" for t in (0, 1, 3))
    path = path_of(tmp_path, "fps: 30", keys)
    assert path.sample(0.3).position[0] == pytest.approx(0.6)
    assert path.sample(2.2).position[0] == pytest.approx(4.4)
    assert path.sample(2.2).fov == pytest.approx(math.radians(60))


def test_frames_end_with_the_last_keyframe(tmp_path: Path) -> None:
    path = path_of(tmp_path, "fps: 30", keyframes(0.1))
    assert len(path.frames()) == 10
    assert path.frames()[3] == pytest.approx(0.1)


def test_a_single_keyframe_holds(tmp_path: Path) -> None:
    path = path_of(tmp_path, "fps: 30", "  - {time: 0, position: [1, 2, 3], target: [0, 0, 0]}\n")
    assert path.frames() == [0]
    assert path.sample(5).position == (1, 2, 3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "fps: 1\nkeyframes:\n- {time: 1, position: [0, 0, 0], target: [0, 0, 1]}\n"
            "- {time: 1, position: [0, 0, 0], target: [0, 0, 1]}\n",
            "5:10: keyframes[1].time: must be later than the keyframe before (1 s)",
        ),
        ("keyframes: []\n", "2:12: keyframes: must hold at least 1, not 0"),
        (
            "fps: 1000\nkeyframes:\n- {time: 100000, position: [0, 0, 0], target: [0, 0, 1]}\n",
            "2:6: fps: the path has 100000001 frames; the limit is 1000000",
        ),
        (
            "interpolation: smoth\nkeyframes:\n- {time: 0, position: [0, 0, 0], target: [0, 0, 1]}\n",
            "2:16: interpolation: must be 'smooth' or 'step', not 'smoth'",
        ),
        (
            "keyframes:\n- {tiem: 0, position: [0, 0, 0], target: [0, 0, 1]}\n",
            "3:4: keyframes[0].tiem: unknown key; did you mean 'time'?",
        ),
    ],
)
def test_messages(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "path.yaml"
    path.write_text("version: 1\n" + text)
    with pytest.raises(InputError) as caught:
        load_path(path)
    assert str(caught.value).replace(f"{path}:", "") == message
