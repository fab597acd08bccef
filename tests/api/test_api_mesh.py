"""Baking and measuring from Python."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import depthwalk as dw
from balls import write_balls
from depthwalk.gpu.device import Device


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    write_balls(tmp_path)
    return tmp_path / "ball.ply"


def test_a_mesh_is_baked_once(mesh: Path, capfd: pytest.CaptureFixture[str]) -> None:
    stages: list[Any] = []
    file = dw.bake_mesh(mesh, resolution=64, layers=1, force=True, progress=stages.append)
    assert file == mesh.with_name("ball.dpci.exr") and stages[0] == "read" and stages[-1] == "write"
    stamp = file.stat().st_mtime_ns
    assert dw.bake_mesh(str(mesh), resolution=64, layers=1) == file and file.stat().st_mtime_ns == stamp
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"out": "ball.png"}, "ball.png: must end in .dpci.exr"),
        ({"height": -1.0}, "height -1: must be above 0"),
        ({"height": "2"}, "height '2': must be above 0"),
        ({"up": "x"}, "up 'x': must be 'y' or 'z'"),
        ({"resolution": 3}, "resolution 3: must be at least 16"),
        ({"resolution": 100_000}, "resolution 100000: must be at most 4096"),
        ({"resolution": 64.5}, "resolution 64.5: must be a whole number"),
        ({"layers": 99}, "layers 99: must be auto or a whole number from 1 to 8"),
        ({"layers": True}, "layers true: must be auto or a whole number from 1 to 8"),
        ({"parts": 0}, "parts 0: must be auto or a whole number from 1 to 16"),
        ({"axis": "w"}, "axis 'w': must be auto, x, y, z or a direction [x, y, z]"),
        ({"coordinates": "x"}, "coordinates 'x': must be 'auto' or 'never'"),
        ({"method": "foo"}, "method 'foo': must be 'raycast', 'six-view' or 'paper'"),
        ({"method": "six-view"}, "layers 3: method six-view sees one surface per ray"),
        ({"mesh": "no.ply"}, "no.ply: no such file"),
    ],
)
def test_baking_refuses(mesh: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(dw.InputError) as caught:
        dw.bake_mesh(**{"mesh": mesh} | options)
    assert message in str(caught.value)


def test_numbers_of_arrays_and_lists_are_taken(mesh: Path, tmp_path: Path) -> None:
    out = tmp_path / "ball.dpci.exr"
    found = dw.bake_mesh(mesh, out, resolution=np.int32(16), layers=1, axis=[0, 2, 0])  # type: ignore[arg-type]
    assert found == out and out.is_file()


def test_finer_images_are_better(mesh: Path, tmp_path: Path, gl_device: Device) -> None:
    coarse, fine = (
        dw.compare(
            mesh,
            dw.bake_mesh(mesh, tmp_path / f"{side}.dpci.exr", resolution=side, layers=1),
            size=(96, 72),
            views=6,
        )
        for side in (32, 128)
    )
    assert coarse.views == fine.views == 6
    assert coarse.mean["psnr"] < fine.mean["psnr"] and coarse.worst["iou"] < fine.worst["iou"]
    assert coarse.gpu_bytes < fine.gpu_bytes


def test_comparing_refuses_other_numbers_of_views(mesh: Path) -> None:
    with pytest.raises(dw.InputError, match="views 7: must be 6 or 42"):
        dw.compare(mesh, mesh, views=7)  # type: ignore[arg-type]
