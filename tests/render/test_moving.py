"""A node of the scene graph that is moved: its slice of the objects, and the picture."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import set_node_transform

SIZE = 160, 120


@pytest.mark.parametrize("told", [True, False])
def test_a_moved_node_moves_in_the_picture(gl_device: Device, tiny_scene: Path, told: bool) -> None:
    """told: what the renderer is told to have moved, only that; else everything may have."""
    tiny_scene.write_text(
        tiny_scene.read_text().replace("objects:\n", "objects:\n  - {asset: ball, position: [9, 0, 0]}\n")
    )
    scene = load_scene(tiny_scene)
    scope = gl_device.scope("test")
    renderer = Renderer(gl_device, scene, SceneLibrary(scene.assets))
    screen = scope.framebuffer([scope.texture(SIZE, 4)])

    def middle() -> float:
        assert scene.camera is not None
        renderer.render(View(scene.camera, SIZE), screen, transparent=True)
        return np.flatnonzero(read_pixels(screen)[..., 3].any(0)).mean()

    before = middle()
    changed = set_node_transform(scene, 1, (0.5, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
    renderer.world.moved(changed if told else None)
    after = middle()
    objects, bounds = renderer.world.objects(), renderer.world.bounds()
    renderer.release()
    scope.release()
    focal = 120 / (2 * np.tan(np.radians(45) / 2))
    assert abs(before - 79.5) < 1
    assert abs(after - before - 0.5 * focal / 4) < 3
    np.testing.assert_array_equal(objects.position[:, 0], [9, 0.5])
    np.testing.assert_allclose(bounds.centre[:, 0], [9, 0.5], atol=1e-3)
