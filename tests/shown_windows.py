"""What a window shows while its frames are slow, without a window."""

from typing import Literal

from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import GroundParams, SkyParams
from depthwalk.walk.shown_frames import ShownFrames
from shapes import ShapeLibrary, bake, box, scene_of
from stage import OnScreen

SIZE = (160, 120)


class Window(OnScreen):
    """What a window in front of two crates does, round by round."""

    def __init__(self, device: Device, mode: Literal["auto", "on", "off"], slice_ms: float = 1.0) -> None:
        crate = box(1.0, 1.0, 1.0, (0, 0.5, 0))
        scene = scene_of((0, (-0.6, 0, 0), 0.4, 1.0), (0, (0.9, 0, 0.8), 0.0, 1.0))
        scene.environment.ground, scene.environment.sky = GroundParams(), SkyParams()
        scene.render.shadows.enabled = True
        scene.render.reprojection.mode = mode
        scene.render.reprojection.slice = slice_ms
        super().__init__(device, scene, ShapeLibrary([crate], [bake(crate)]), SIZE)
        self.renderer.remembers = True
        self.frames = ShownFrames(self.renderer)
        self.finished = 0

    def __exit__(self, *_: object) -> None:
        self.frames.release()
        super().__exit__()

    def round(self, right: float = 0.0) -> bool:
        """Return whether a frame was finished, with the camera so far to the right."""
        camera = Camera((right, 1.2, 4.0), (right, 0.6, 0.0), 0.8)
        self.frames.note(camera, 0.02, SIZE)
        finished = self.frames.draw(View(camera, SIZE), self.screen)
        self.frames.work()
        self.finished += finished
        return finished

    def rest(self) -> int:
        """Return how many rounds it takes until nothing is left to draw."""
        for rounds in range(1, 500):
            self.round()
            if self.frames.is_current:
                return rounds
        raise AssertionError("never at rest")
