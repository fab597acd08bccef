"""The scripts in examples/ run: one in a process of its own, the others in this one, which has its libraries."""

import os
import runpy
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
def folder(tmp_path: Path, cache_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a small scene; there is no display."""
    write_balls(tmp_path)
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture
def run(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Runs an example as `python script …` does; returns what it prints, or the message that it ends with."""

    def run(script: str, *arguments: str, code: int = 0) -> str:
        file = str(EXAMPLES / script)
        monkeypatch.setattr(sys, "argv", [file, *arguments])
        if code == 0:
            runpy.run_path(file, run_name="__main__")
            return capsys.readouterr().out
        with pytest.raises(SystemExit) as stopped:
            runpy.run_path(file, run_name="__main__")
        told, ended = capsys.readouterr().err, stopped.value.code
        if isinstance(ended, str):  # which Python prints, and exits with 1
            told, ended = ended, 1
        assert ended == code
        return told

    return run


def picture(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file))


def test_there_is_a_test_for_each() -> None:
    tests = Path(__file__).read_text()
    for script in EXAMPLES.glob("*.py"):
        assert f'run("{script.name}"' in tests or f'EXAMPLES / "{script.name}"' in tests, script.name
        assert len(script.read_text().splitlines()) <= LONGEST


def test_a_still_in_a_process_of_its_own(folder: Path, gl_device: Device) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-W", "error", str(EXAMPLES / "render_still.py"), "scene.yaml", "still.png", *SMALL]
    subprocess.run(command, env=environment, check=True)
    assert picture(folder / "still.png").shape == (60, 80, 4)


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
