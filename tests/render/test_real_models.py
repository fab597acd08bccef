"""The real bust along its twelve poses: depth images against polygons, as the goals state them."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path

SIZE = (640, 480)


@pytest.mark.slow
@pytest.mark.gl
def test_the_bust_agrees_with_its_mesh_at_every_pose(real_scenes: Path) -> None:
    scene = load_scene(real_scenes / "bust.yaml", overrides={"render.lod.magnification": "0"})
    path = load_path(real_scenes / "poses.yaml")
    overlap, quality = [], []
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE) as headless:
        for time in path.frames():
            pictures = []
            for representation in (Representation.DPCI, Representation.MESH):
                headless.renderer.world.representation = representation
                headless.draw(View(path.sample(time), SIZE), transparent=True)
                pictures.append(headless.pixels().astype(float) / 255)
            masks = [picture[..., 3] > 0 for picture in pictures]
            union = masks[0] | masks[1]
            overlap.append((masks[0] & masks[1]).sum() / union.sum())
            quality.append(-10 * np.log10(np.mean((pictures[0] - pictures[1])[union][:, :3] ** 2)))
    assert len(overlap) == 12
    assert min(overlap) >= 0.99
    assert np.mean(quality) >= 27
