"""A scene that is opened before its depth images exist: polygons first, and no jump when depth images take over."""

import itertools
import time
from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.gpu.device import Device
from depthwalk.render.image import read_pixels
from depthwalk.render.view.view import View
from depthwalk.scene.loader import load_scene
from stage import OnScreen

pytestmark = [pytest.mark.gl, pytest.mark.slow]
SIZE = (160, 120)
PATIENCE = 120  # s, on a busy machine


def test_depth_images_take_over_without_a_jump(
    gl_device: Device, tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    scene = load_scene(tiny_scene, overrides={"assets.ball.dpci.resolution": "144", "render.lod.magnification": "0"})
    library = BackgroundLibrary(scene.assets, processes=1)
    shown: list[str] = []
    pictures: list[np.ndarray] = []
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        stage.renderer.assets.background = library
        stage.renderer.upload_seconds = 0.008
        assert scene.camera is not None
        end = time.monotonic() + PATIENCE
        while shown[-3:] != ["dpci"] * 3 and time.monotonic() < end:
            stage.draw(View(scene.camera, SIZE))
            counts = stage.renderer.plan.counts if stage.renderer.plan else {}
            shown += [next((kind for kind in ("dpci", "mesh") if counts.get(kind)), "nothing")]
            time.sleep(0.02)  # leaves the cores to the process that bakes
            pictures.append(read_pixels(stage.screen)[..., :3].astype(np.int16))
    library.close()
    assert [kind for kind, before in zip(shown, ["", *shown], strict=False) if kind != before] == [
        "nothing",
        "mesh",
        "dpci",
    ]
    seen = [picture for picture, kind in zip(pictures, shown, strict=True) if kind != "nothing"]
    background = pictures[0]
    assert (np.abs(seen[0] - background).max(-1) > 30).mean() > 0.1  # the ball is there
    steps = [np.abs(after - before).mean() for before, after in itertools.pairwise(seen)]
    assert max(steps) < 0.5, "the picture jumps"
