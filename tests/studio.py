"""Renders scenes to arrays, for tests of the renderer."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.library import Library
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from depthwalk.types import Array

Size = tuple[int, int]


class Studio:
    """Renders scenes to arrays on one headless device."""

    def __init__(self, device: Device) -> None:
        self.device = device

    def picture(
        self, scene: Scene, library: Library, camera: Camera, size: Size = (160, 120), transparent: bool = False
    ) -> Array:
        """RGBA in [0, 1] (H, W, 4), top row first."""
        with self._drawn(scene, library, camera, size, transparent) as (_, pixels):
            return pixels

    def measured(
        self, scene: Scene, library: Library, camera: Camera, size: Size = (160, 120), transparent: bool = False
    ) -> tuple[Array, Array, FrameDrawLists]:
        """As `picture`, with the G-buffer's depth in metres (H, W), and what was drawn."""
        with self._drawn(scene, library, camera, size, transparent) as (renderer, pixels):
            assert renderer.targets is not None and renderer.view is not None and renderer.plan is not None
            stored = np.frombuffer(renderer.targets.depth.read(), np.float32).reshape(size[1], size[0])[::-1]
            near, far = renderer.view.depth_range
            with np.errstate(divide="ignore"):
                metres = np.where(stored == 1, np.inf, 2 * near * far / (far + near - (2 * stored - 1) * (far - near)))
            return pixels, metres, renderer.plan

    def surfaces(self, scene: Scene, library: Library, camera: Camera, size: Size = (160, 120)) -> NDArray[np.uint32]:
        """The words of the G-buffer, (H, W, 2) uint32, top row first."""
        with self._drawn(scene, library, camera, size, False) as (renderer, _):
            assert renderer.targets is not None
            words = np.frombuffer(renderer.targets.surface.read(), np.uint32).reshape(size[1], size[0], 2)
            return words[::-1].copy()

    @contextmanager
    def _drawn(
        self, scene: Scene, library: Library, camera: Camera, size: Size, transparent: bool
    ) -> Iterator[tuple[Renderer, Array]]:
        scope = self.device.scope("test")
        renderer = Renderer(self.device, scene, library)
        try:
            screen = scope.framebuffer([scope.texture(size, 4)])
            renderer.render(View(camera, size), screen, transparent=transparent)
            yield renderer, read_pixels(screen).astype(float) / 255
        finally:
            renderer.release()
            scope.release()
