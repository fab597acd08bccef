"""The way of a pixel from the file to the screen: what is read back agrees, and what would not is told."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.bake.file import write_baked
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from shapes import bake, model_of, sphere
from tools import one_pixel

ROOT = Path(__file__).parents[2]


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """A ball of radius 0.4 m as depth images."""
    file = tmp_path / "ball.dpci.exr"
    write_baked(file, model_of(bake(sphere(0.4, 24, 12), 32, 1)))
    return file


@pytest.mark.gl
@pytest.mark.slow
def test_a_pixel_is_followed_to_the_surface(
    ball: Path, gl_device: Device, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    traces: list[one_pixel.Trace] = []
    undo = one_pixel.trace

    def noted(read: one_pixel.Read) -> one_pixel.Trace:
        traces.append(undo(read))
        return traces[-1]

    monkeypatch.setattr(one_pixel, "trace", noted)
    one_pixel.main([str(ball), "30", "20", "--size", "64", "48"])
    told = capsys.readouterr().out.splitlines()
    page = (ROOT / "docs" / "one-pixel.md").read_text(encoding="utf-8")
    example, rows = re.findall(r"^ {4}(\w+) +[^-]", page, re.MULTILINE), re.findall(r"^\| `(\w+)`", page, re.MULTILINE)
    assert [line.split()[0] for line in told] == rows == example
    (found,) = traces
    middle = np.array([0, found.point[1], 0])
    assert abs(np.linalg.norm(found.point - middle) - np.sqrt(max(0.16 - (found.point[1] - 0.4) ** 2, 0))) < 0.02
    with pytest.raises(InputError, match="0 0: shows no impostor"):
        one_pixel.follow(ball, (0, 0), (64, 48))


def test_a_point_elsewhere_is_told() -> None:
    """A viewer at (0, 0, 3) sees the origin in the middle of the picture, 3 m away."""
    (record,) = np.zeros(1, [("viewer", "4f4"), ("rotation", "4f4")])
    record["viewer"], record["rotation"] = (0, 0, 3, 1), (0, 0, 0, 1)
    read = one_pixel.Read(
        record=record, texel=np.zeros(2, int), stored=0.0, owner=0, distance=3.0, albedo=np.zeros(3), lit=np.zeros(3)
    )
    found = one_pixel.Trace(place=np.zeros(2), lam=1.0, depth=0.0, sample=np.zeros(2), point=np.zeros(3))
    view = View(Camera(position=(0, 0, 3), target=(0, 0, 0), fov=1.0), (5, 5))
    one_pixel.check(found, read, view, (2, 2), 3.0)
    for wrong in (replace(found, point=np.array([0.0, 0.1, 0])), replace(found, point=np.array([0, 0, -0.1]))):
        with pytest.raises(RuntimeError, match="pixels off"):
            one_pixel.check(wrong, read, view, (2, 2), 3.0)


def test_a_pixel_outside_is_told(ball: Path) -> None:
    with pytest.raises(InputError, match=r"64 0: is outside the picture of 64 × 48 pixels"):
        one_pixel.follow(ball, (64, 0), (64, 48))
