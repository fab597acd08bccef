"""A frame by the paper's rules, all at once: what it counts, and what it shows."""

import numpy as np
import pytest

from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from shapes import ShapeLibrary, bake, scene_of, sphere
from stage import WALK_SIZE, Walk

BESIDE, ABOVE = Camera((0, 0.5, 3.0), (0, 0.5, 0), 0.6), Camera((0, 3.0, 2.5), (0, 0.2, -0.8), 0.9)


@pytest.fixture(scope="module")
def library():
    ball = sphere(0.5, columns=64, rows=32)
    return ShapeLibrary([ball], [bake(ball, resolution=64, layers=1)])


def paper(**settings):
    """A ball, and one behind it."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), (0, (0, 0.1, -2), 0.0, 0.5))
    scene.render = RenderSettings.model_validate({"preset": "paper"} | settings)
    return scene


def seen(walk):
    """Where the frame shows anything, (H, W)."""
    depth = np.frombuffer(walk.renderer.targets.depth.read(alignment=1), np.float32)
    return depth.reshape(WALK_SIZE[::-1]) < 1


def test_every_frame_warps_everything_in_sight(gl_device, library):
    with Walk(gl_device, paper(), library, seconds=None) as walk:
        walk.renderer.remembers = True
        for _ in range(2):
            walk.look(BESIDE)
            counts = walk.counts
            assert (counts["dpci"], counts["warped"], counts["occluded"], counts["mesh_fallbacks"]) == (2, 2, 0, 0)
            assert counts["case_side"] == 2
        walk.look(ABOVE)
        assert walk.counts["case_side_and_top"] == 2
        walk.renderer.world.representation = Representation.MESH
        images = seen(walk)
        walk.look(ABOVE)
        both = images | seen(walk)
    assert (images & both).sum() > 0.95 * both.sum()


def test_side_and_cap_alone_are_parts_of_the_picture(gl_device, library):
    shown = {}
    for cases in ("paper", "side", "cap"):
        for name, camera in (("beside", BESIDE), ("above", ABOVE)):
            with Walk(gl_device, paper(lod={"cases": cases}), library, seconds=None) as walk:
                walk.renderer.render(View(camera, WALK_SIZE), walk.screen)
                shown[cases, name] = int(seen(walk).sum())
    assert shown["cap", "beside"] == 0 < shown["cap", "above"] < shown["paper", "above"]
    assert shown["side", "beside"] == shown["paper", "beside"] and shown["side", "above"] > 0
