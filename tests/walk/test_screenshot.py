import json
import math
import re
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngImageFile

from depthwalk.scene.arrays import Camera
from depthwalk.types import Picture
from depthwalk.walk.files import save_new
from depthwalk.walk.screenshot import Screenshots, save_screenshot

CAMERA = Camera((0.1, 2.0, -3.5), (0.0, 1.0, 0.0), math.radians(50))


def picture(value: int) -> Picture:
    return np.full((4, 6, 3), value, np.uint8)


def test_screenshots_never_overwrite(tmp_path: Path) -> None:
    files = [save_screenshot(picture(value), tmp_path / "s.yaml", CAMERA, tmp_path) for value in range(4)]
    assert len(set(files)) == 4
    assert [np.asarray(Image.open(file))[0, 0, 0] for file in files] == [0, 1, 2, 3]


def test_a_failing_screenshot_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write_bytes(file: Path, data: bytes) -> None:
        with open(file, "wb") as half:
            half.write(data[: len(data) // 2])
        raise OSError("disk full")

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    with pytest.raises(OSError, match="disk full"):
        save_screenshot(picture(1), tmp_path / "s.yaml", CAMERA, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_screenshot_appears_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []
    save = Image.Image.save

    def watched(image: Image.Image, *arguments: Any, **options: Any) -> None:
        save(image, *arguments, **options)
        seen.extend(tmp_path.glob("*.png"))

    monkeypatch.setattr(Image.Image, "save", watched)
    file = save_screenshot(picture(1), tmp_path / "s.yaml", CAMERA, tmp_path)
    assert (seen, list(tmp_path.iterdir())) == ([], [file])


def test_a_screenshot_knows_its_camera(tmp_path: Path) -> None:
    image = Image.open(save_screenshot(picture(9), tmp_path / "müsli.yaml", CAMERA, tmp_path))
    assert isinstance(image, PngImageFile)
    texts = image.text
    assert json.loads(texts["Camera"]) == {"position": [0.1, 2.0, -3.5], "target": [0, 1, 0], "fov": pytest.approx(50)}
    assert texts["Scene"].endswith("müsli.yaml")
    assert texts["Options"] == "--camera-position 0.1,2,-3.5 --camera-target 0,1,0 --camera-view-angle 50"


def test_it_falls_back_to_the_pictures_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    monkeypatch.setattr("depthwalk.walk.screenshot.Path.cwd", lambda: tmp_path / "gone")
    monkeypatch.setattr("depthwalk.walk.screenshot.user_pictures_path", lambda: tmp_path)
    assert save_screenshot(picture(1), tmp_path / "s.yaml", CAMERA).parent == tmp_path


def test_the_message_names_each_folder_and_no_temporary_file(tmp_path: Path) -> None:
    folders = [tmp_path / "nowhere", tmp_path / "gone"]
    why = "; ".join(f"{folder}: No such file or directory" for folder in folders)
    with pytest.raises(OSError, match=f"^{re.escape(why)}$"):
        save_new(".png", lambda file: None, folders)


def test_no_folder_raises(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"nowhere: No such file or directory$"):
        save_screenshot(picture(1), tmp_path / "s.yaml", CAMERA, tmp_path / "nowhere")


def test_screenshots_are_written_beside_the_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    go_on, shots = threading.Event(), Screenshots()
    save, scene = save_screenshot, tmp_path / "s.yaml"

    def slow(pixels: Picture, scene: Path, camera: Camera) -> Path:
        assert go_on.wait(60)
        if not pixels.any():
            raise OSError("the disk is full")
        return save(pixels, scene, camera)

    monkeypatch.setattr("depthwalk.walk.screenshot.save_screenshot", slow)
    for value in (1, 0, 2):
        shots.save(picture(value), scene, CAMERA)
    assert shots.news() == "" and not list(tmp_path.iterdir())
    go_on.set()
    shots.close()
    first, failed, last = shots.news().splitlines()
    assert failed == "Screenshot failed: the disk is full"
    assert {first, last} == {f"Saved {file}" for file in tmp_path.glob("*.png")} and first != last
    assert shots.news() == ""
