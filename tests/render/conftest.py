import numpy as np
import pytest

from depthwalk.render.renderer import Renderer, read_pixels
from depthwalk.render.view.view import View


class Studio:
    """Renders scenes to arrays on one headless device."""

    def __init__(self, device):
        self.device = device

    def picture(self, scene, library, camera, size=(160, 120), transparent=False, **targets):
        """RGBA in [0, 1] (H, W, 4), top row first; with `depth=True` also the G-buffer's depth in metres."""
        scope = self.device.scope("test")
        renderer = Renderer(self.device, scene, library)
        try:
            screen = scope.framebuffer([scope.texture(size, 4)])
            view = View(camera, size)
            renderer.render(view, screen, transparent=transparent)
            pixels = read_pixels(screen).astype(float) / 255
            if not targets:
                return pixels
            stored = np.frombuffer(renderer.targets.depth.read(), np.float32).reshape(size[1], size[0])[::-1]
            near, far = renderer.view.depth_range
            with np.errstate(divide="ignore"):
                metres = np.where(stored == 1, np.inf, 2 * near * far / (far + near - (2 * stored - 1) * (far - near)))
            return pixels, metres, renderer.plan
        finally:
            renderer.release()
            scope.release()


@pytest.fixture(scope="session")
def studio(gl_device):
    return Studio(gl_device)
