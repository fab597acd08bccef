"""Commands tell of a picture that may be the texture of a mesh."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

TEXTURED = "v 0 0 0\nv 1 0 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.mark.gl
def test_commands_tell_of_it(run: Callable[..., Any], tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4, 3), 200, np.uint8)).save(tmp_path / "cow.png")
    (mesh := tmp_path / "cow.obj").write_text(TEXTURED)
    told = f"{mesh}: names no texture; if cow.png is its texture: "
    options = "--resolution", "32,24", "-o", tmp_path / "a.png"
    picture = tmp_path / "cow.png"
    assert run("render", mesh, *options).stderr == f"{told}--texture {picture}\n"
    assert run("render", mesh, *options, "--texture", picture).stderr == ""
    assert run("render", mesh, *options, "--set", "assets.model.texture=cow.png").stderr == ""
    (other := tmp_path / "ox").mkdir()
    (other / "ox.obj").write_text(TEXTURED)
    several = run("render", other / "ox.obj", mesh, *options)
    assert several.stderr == "cow.obj: names no texture; if cow.png is its texture: --set assets.cow.texture=cow.png\n"
    assert run("render", other / "ox.obj", mesh, *options, "--set", "assets.cow.texture=cow.png").stderr == ""
    assert f"if cow.png is its texture: --texture {picture}, or" in run("info", mesh).stdout
    bake = "--dpci-resolution", 16, "--layers", 1, "--force"
    assert f"{told}--texture {picture}\n" in run("bake", mesh, *bake).stderr
    assert "texture" not in run("bake", mesh, *bake, "--texture", tmp_path / "cow.png").stderr
