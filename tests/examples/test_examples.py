"""The scripts in examples/ run, each in a process of its own."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from balls import write_balls
from depthwalk.gpu.device import Device

EXAMPLES = Path(__file__).parents[2] / "examples"
SMALL = ["80", "60"]
LONGEST = 40  # lines


@pytest.fixture
def run(tmp_path: Path, cache_home: Path) -> Callable[..., Any]:
    """Runs an example in a folder with a small scene and without a display; returns what it prints."""
    write_balls(tmp_path)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    environment = {name: value for name, value in environment.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}

    def run(script: str, *arguments: str, code: int = 0) -> str:
        command = [sys.executable, "-W", "error", str(EXAMPLES / script), *arguments]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stdout if code == 0 else done.stderr

    return run


def picture(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file))


def test_there_is_a_test_for_each() -> None:
    tests = Path(__file__).read_text()
    for script in EXAMPLES.glob("*.py"):
        assert f'run("{script.name}"' in tests, script.name
        assert len(script.read_text().splitlines()) <= LONGEST


def test_a_still(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    run("render_still.py", "scene.yaml", "still.png", *SMALL)
    assert picture(tmp_path / "still.png").shape == (60, 80, 4)


def test_a_turntable(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    assert "write" in run("turntable.py", "ball.ply", "frames", "2", "64", *SMALL)
    assert (tmp_path / "ball.dpci.exr").is_file()
    assert sorted(os.listdir(tmp_path / "frames")) == ["0000.png", "0001.png"]


def test_objects_move(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    run("move_objects.py", "scene.yaml", "ball", "frames", "3", *SMALL)
    frames = [picture(tmp_path / "frames" / f"{number:04}.png") for number in range(3)]
    assert (frames[0] != frames[1]).any() and (frames[1] != frames[2]).any()


@pytest.mark.slow
def test_a_video(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    run("video.py", "scene.yaml", "round.mp4", "3", *SMALL)
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "round.mp4"))[0] == 3


def test_an_own_pass(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    run("own_pass.py", "scene.yaml", "sepia.png", *SMALL)
    red, green, blue, _ = picture(tmp_path / "sepia.png")[30, 40]
    assert red > green > blue


def test_depth_and_object_ids(run: Callable[..., Any], gl_device: Device) -> None:
    lines = run("depth_and_ids.py", "scene.yaml", *SMALL).splitlines()
    assert [line.split(":")[0] for line in lines] == [
        "object 0 of ball", "object 1 of row", "object 3 of row", "object 4 of node 2"
    ]  # fmt: skip
    assert lines[0].endswith(("from 4.00 m", "from 4.01 m"))


def test_bake_and_compare(run: Callable[..., Any], tmp_path: Path, gl_device: Device) -> None:
    lines = run("bake_and_compare.py", "ball.ply", "32", "64").splitlines()
    assert [line.split(":")[0] for line in lines] == ["32²", "64²"]
    assert sorted(os.listdir(tmp_path)) == ["ball.ply", "scene.yaml"]


@pytest.mark.slow
def test_the_window_says_why_there_is_none(run: Callable[..., Any]) -> None:
    assert "cannot open a window" in run("open_window.py", "scene.yaml", code=1)
    assert "cannot open a window" in run("moving_window.py", "scene.yaml", "ball", code=1)


@pytest.mark.parametrize("script", sorted(path.name for path in EXAMPLES.glob("*.py")))
@pytest.mark.parametrize("arguments", [[], ["a.yaml", "b", "c", "much", "too", "much", "7", "8", "9"]])
def test_wrong_arguments_are_told_with_what_is_expected(
    run: Callable[..., Any], script: str, arguments: list[str]
) -> None:
    assert run(script, *arguments, code=2).startswith(f"usage: {script} ")
