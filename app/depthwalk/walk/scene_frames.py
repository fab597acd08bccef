"""Draw frames of the scene for a window: at once, or in slices between which the window shows something else.

Frames in slices are drawn for a `Reprojection`, which shows them through newer cameras. So they have a margin; and they
have fewer pixels, and limited work, while the viewer moves.
"""

import time
from collections import deque
from dataclasses import replace

import moderngl

from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection.reprojection import Reprojection
from depthwalk.render.view.field_of_view import reduced, widened
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.walk.frame_scale import FrameScale
from depthwalk.walk.slices import FrameSlices

_SLOW = 0.033  # s: frames that take longer are drawn in slices
_QUICK = 0.025  # s: frames that take less are drawn whole again
_MEASURED = 2  # frames that decide: the first one compiles shaders, so it says only that it may be slow
_WARP_LIMIT = 1_600_000  # triangles, of a frame of all pixels: more than most need, less than a quick turn brings
_FIRST_WARP_LIMIT = 400_000  # in the first pictures of a window


class SceneFrames:
    """Draw one frame at a time, and learn from each how to draw the next.

    Parameters
    ----------
    renderer
        Draws the frames.
    reprojection
        Takes those that are drawn in slices once they are finished.

    Attributes
    ----------
    seconds
        Time spent on the last frame, seconds; 0 before the first.
    scale
        How many pixels the last frame had per pixel of the window, along either axis.
    source
        The view of the frame in progress, or of the last one that was drawn for the reprojection.
    is_interactive
        Whether the frame is for a viewer who moves or sees nothing yet.
    """

    def __init__(self, renderer: Renderer, reprojection: Reprojection) -> None:
        self._renderer, self._reprojection = renderer, reprojection
        self._slices = FrameSlices(renderer.device)
        self._durations: deque[float] = deque(maxlen=_MEASURED)
        self._is_slow = False
        self._frame_scale = FrameScale()
        self._is_first_pending = False  # whether the first frame is in the canvas, to be reprojected from now on
        self.seconds = 0.0
        self.scale = 1.0
        self.source: View | None = None
        self.is_interactive = False

    @property
    def is_drawing(self) -> bool:
        """Return whether a frame is in progress."""
        return self._slices.is_drawing

    @property
    def delay(self) -> float:
        """Return the seconds from beginning to end of the last frame in slices; 0 before the first."""
        return self._slices.delay

    @property
    def are_new(self) -> bool:
        """Return whether the first frames are being drawn, which must appear soon and are refined by later ones."""
        return len(self._durations) < _MEASURED

    @property
    def are_slow(self) -> bool:
        """Return whether frames have turned out to take long; False while they are new."""
        return self._is_slow

    def draw(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a frame of `view` into `screen` at once, after which there is no picture to reproject."""
        self.is_interactive = self.are_new
        self._renderer.warp_limit = _FIRST_WARP_LIMIT if self.is_interactive else None
        self.scale = 1.0
        self._reprojection.forget_picture()
        start = time.perf_counter()
        self._renderer.render(view, screen)
        if self._renderer.device.software:
            self._renderer.device.context.finish()
        of_passes = sum(self._renderer.timers.milliseconds.values()) / 1e3  # a GPU works behind the CPU
        self._note(max(time.perf_counter() - start, of_passes))

    def draw_first(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a frame at once, in a way that `reproject_first` can have it reprojected if it took long.

        Then the window need not wait for the second frame. The frame has no margin, which would delay it.
        """
        self.source = view
        self.draw(view, self._reprojection.canvas(view.size))
        self._reprojection.show_canvas(screen)
        self._is_first_pending = self.seconds > _SLOW

    def reproject_first(self) -> None:
        """From now on, reproject the frame of `draw_first` if it took long; call this when it is on the screen."""
        if self._is_first_pending:
            self._is_first_pending = False
            self._reproject_canvas()

    def begin(self, camera: Camera, view: View, moves: bool) -> None:
        """Begin a frame in slices, for the reprojection; discard one in progress.

        Parameters
        ----------
        camera
            The camera to draw for.
        view
            The view of the viewer, which gives the frame its size, before a margin is added.
        moves
            Whether the viewer moves; then the frame has fewer pixels and limited work.
        """
        settings = self._renderer.settings.reprojection
        self.is_interactive = moves or self.are_new
        self.source = widened(View(camera, view.size), settings.margin)
        if self.is_interactive:
            self.source = reduced(self.source, settings.scale * self._frame_scale.factor)
        limit = _FIRST_WARP_LIMIT if self.are_new else round(_WARP_LIMIT * self._frame_scale.factor)
        self._renderer.warp_limit = limit if self.is_interactive else None
        self._slices.begin(self._renderer.steps(self.source, self._reprojection.canvas(self.source.size)))

    def advance(self, seconds: float) -> bool:
        """Continue with the frame in progress for about `seconds`; return whether it is finished, and reprojected."""
        if not self._slices.advance(seconds):
            return False
        self._reproject_canvas()
        work = self._slices.end()
        if self.is_interactive:
            self._frame_scale.note(self.delay, self._renderer.settings.reprojection.frame_limit / 1e3)
        self._note(work)
        return True

    def drop(self) -> None:
        """Discard a frame in progress."""
        self._slices.drop()

    def _reproject_canvas(self) -> None:
        """From now on, reproject the frame in the canvas."""
        targets, fitted, source = self._renderer.targets, self._renderer.view, self.source
        assert targets is not None and fitted is not None and source is not None
        near, far = fitted.depth_range
        self.scale = source.scale
        moving = self._renderer.world.moving(source)
        self._reprojection.take(targets, replace(source, near=near, far=far), moving)

    def _note(self, seconds: float) -> None:
        """Record how long a frame took."""
        self.seconds = seconds
        self._durations.append(seconds)
        if not self.are_new:
            self._is_slow = min(self._durations) > (_QUICK if self._is_slow else _SLOW)
