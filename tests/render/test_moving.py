"""A node of the scene graph that is moved: its slice of the objects, and the picture."""

import numpy as np

from depthwalk.library import SceneLibrary
from depthwalk.render.renderer import Renderer, read_pixels
from depthwalk.render.view import View
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import set_node_transform


def test_a_moved_node_moves_in_the_picture(gl_device, tiny_scene):
    scene = load_scene(tiny_scene)
    scope = gl_device.scope("test")
    renderer = Renderer(gl_device, scene, SceneLibrary(scene.assets))
    screen = scope.framebuffer([scope.texture((160, 120), 4)])

    def middle():
        renderer.render(View(scene.camera, (160, 120)), screen, transparent=True)
        return np.flatnonzero(read_pixels(screen)[..., 3].any(0)).mean()

    before = middle()
    set_node_transform(scene, 0, (0.5, 0.0, 0.0), 0.0, 1.0)
    renderer.objects_moved()
    after = middle()
    renderer.release()
    scope.release()
    focal = 120 / (2 * np.tan(np.radians(45) / 2))
    assert abs(before - 79.5) < 1
    assert abs(after - before - 0.5 * focal / 4) < 3
