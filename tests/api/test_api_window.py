"""The window from Python."""

from pathlib import Path
from typing import Any

import pytest

import depthwalk as dw
from balls import write_balls
from depthwalk import walk
from depthwalk.assets.library import SceneLibrary
from depthwalk.scene.scene import Scene


def test_the_window_gets_the_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = []
    monkeypatch.setattr(walk, "run", lambda *shown, **window: opened.append((*shown, window)))
    scene = dw.load_scene(write_balls(tmp_path))
    scene.move("ball", position=(1, 2, 3))
    dw.view(scene, size=(320, 200))
    ((shown, _, options, window),) = opened
    assert shown.objects.position[0].tolist() == [1, 2, 3]
    assert (options, window) == (walk.WalkOptions(), {"size": (320, 200), "fullscreen": False})
    dw.view(scene)
    assert opened[1][-1]["size"] is None  # as large as the command line's, which fits the screen


def test_no_display_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise walk.NoDisplayError("cannot open a window: no")

    monkeypatch.setattr(walk, "run", refuse)
    with pytest.raises(dw.GpuError, match="cannot open a window: no"):
        dw.view(dw.load_scene(write_balls(tmp_path)))


def test_a_path_that_is_none(tmp_path: Path) -> None:
    scene = dw.load_scene(write_balls(tmp_path))
    with pytest.raises(dw.InputError, match="is a scene file, not a camera path"):
        dw.view(scene, path=scene.path)


def test_a_program_moves_the_scene_between_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = dw.load_scene(write_balls(tmp_path))
    times: list[float] = []
    told: list[list[slice]] = []

    def before_frame(seconds: float) -> None:
        times.append(seconds)
        if len(times) == 2:
            scene.move("row", yaw=1.0)

    def run(scene: Scene, library: SceneLibrary, options: walk.WalkOptions, **_: Any) -> None:
        assert options.change is not None
        told.extend(list(options.change()) for _ in range(3))

    monkeypatch.setattr(walk, "run", run)
    dw.view(scene, before_frame=before_frame)
    assert times[0] == 0 and times == sorted(times)
    assert told == [[], [slice(1, 4)], []]
