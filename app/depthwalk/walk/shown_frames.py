"""Decide what a window shows at each moment: a new frame, the last one reprojected, or nothing new.

Frames that take long are drawn in slices of a few passes. Between slices the window shows the last finished frame,
reprojected to the newest camera (`render.reprojection`), so that the picture follows keys and mouse much more often
than frames are finished. Such frames have a margin, and are drawn for a predicted camera: where the viewer will be
while they are shown. If nothing changes any more, nothing is drawn.
"""

import time
from collections import deque
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from pyglm import glm

from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection import Reprojection
from depthwalk.render.view.field_of_view import reduced, widened
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.walk.frame_scale import FrameScale
from depthwalk.walk.look_around import LookAround
from depthwalk.walk.motion import Motion
from depthwalk.walk.slices import FrameSlices, longest
from depthwalk.walk.still_slices import StillSlices

_SLOW = 0.033  # s: frames that take longer are drawn in slices
_QUICK = 0.025  # s: frames that take less are drawn whole again
_MEASURED = 2  # frames that decide: the first one compiles shaders, so it says only that it may be slow
_SETTLING = 2, 8  # fewest and most frames that are drawn after the last change
_MOST_UNSEEN = 0.5  # of the window: if the last frame lacks more, the window waits for the next one
_SHOWN_FOR = 1.5  # times the time to draw a frame: its mean age while it is shown
_FARTHEST_AHEAD = 1.0  # s
_WARP_LIMIT = 1_600_000  # triangles, of a frame of all pixels: more than most need, less than a quick turn brings
_FIRST_WARP_LIMIT = 400_000  # in the first pictures of a window


class ShownFrames:
    """Draw what a window shows of one renderer.

    Parameters
    ----------
    renderer
        Draws the scene's frames.
    reachable
        Called with a camera at which the viewer may be soon; returns how far the viewer gets on the way there.

    Attributes
    ----------
    scene_seconds
        Time spent on the last frame of the scene, seconds; 0 before the first.
    in_slices
        Whether frames are drawn in slices, and reprojected in between.
    """

    def __init__(self, renderer: Renderer, reachable: Callable[[Camera], Camera] = lambda camera: camera) -> None:
        self._renderer, self._reachable = renderer, reachable
        self._reprojection = Reprojection(renderer.device)
        self._around = LookAround(renderer, self._reprojection.surround)
        self._motion = Motion()
        self.scene_seconds = 0.0
        self.in_slices = False
        self._is_slow = False  # whether frames have turned out to take long
        self._refines = True
        self._durations: deque[float] = deque(maxlen=_MEASURED)
        self._frame = FrameSlices(renderer.device)
        self._source: View | None = None  # view of the frame that is being drawn in slices
        self._view: View | None = None  # view that is shown
        self._camera: Camera | None = None  # of the last call of `note`
        self._moved = False  # whether that differed from the call before
        self._jumps = 0  # in that call
        self._has_jumped = False  # whether the last frame shows another place
        self._known: tuple[Any, ...] = ()  # everything else in that call
        self._scale = FrameScale()
        self._finished_scale = 1.0  # of the last frame
        self._interactive = False  # whether the frame is for a viewer who moves or sees nothing yet
        self._settled = 0  # frames drawn since either changed, without interactive ones
        self._still = StillSlices(renderer)
        self._unshown = False  # whether something is finished that no picture has shown
        self._is_untaken = False  # whether the frame on the screen is in the canvas and must be reprojected from now on

    @property
    def refines(self) -> bool:
        """Return whether pictures other than frames may be drawn, such as the still one; not while targets are viewed.

        Setting it to False redraws a frame, since the targets may be those of another picture.
        """
        return self._refines

    @refines.setter
    def refines(self, refines: bool) -> None:
        if self._refines and not refines:
            self._still.drop()
            self._around.drop()
            self._settled = 0
        self._refines = refines

    @property
    def is_current(self) -> bool:
        """Return whether the window shows the scene as it is, so that nothing needs to be drawn."""
        knows_around = self._around.knows_all or not (self.in_slices and self.refines)
        return (
            not self._unshown
            and self._is_settled
            and knows_around
            and (self._still.is_finished or not self._wants_still)
        )

    @property
    def _is_settled(self) -> bool:
        """Return whether further frames would be no better than the last one, or than the still picture."""
        plan = self._renderer.plan
        if self._frame.is_drawing or plan is None or self._settled < _SETTLING[0]:
            return False
        if self._renderer.assets.is_waiting or plan.noted.get("shadow_maps_waiting"):
            return False
        if self._wants_still:  # it has impostors of its own
            return True
        return not plan.warp.batches or (self._settled >= _SETTLING[1] and not plan.noted["provisional"])

    @property
    def _is_new(self) -> bool:
        """Return whether the first frames are being drawn, which must appear soon and are refined by later ones."""
        return len(self._durations) < _MEASURED

    @property
    def is_drawing(self) -> bool:
        """Return whether a frame or another picture is in progress."""
        return self._frame.is_drawing or self._still.is_drawing or self._around.is_drawing

    @property
    def scale(self) -> float:
        """Return how many pixels the last frame had per pixel of the window, along either axis."""
        return self._finished_scale

    @property
    def _wants_still(self) -> bool:
        """Return whether the picture is drawn once more, with more samples, when the viewer is at rest."""
        settings = self._renderer.settings
        return self.refines and settings.reprojection.refine and settings.aa == "none" and settings.dof.mode == "none"

    def note(self, camera: Camera, dt: float, size: tuple[int, int], jumps: int = 0) -> None:
        """Record what is to be shown; call this once per iteration of the frame loop.

        Parameters
        ----------
        camera
            The camera of the viewer.
        dt
            Seconds since the last call.
        size
            (width, height) of the window, pixels.
        jumps
            How often the camera has jumped: it was not on its way to where it is now.
        """
        renderer, world = self._renderer, self._renderer.world
        state = size, renderer.settings, renderer.scene.environment, world.representation, world.generation
        if jumps != self._jumps:
            self._jumps, self._has_jumped, self._motion = jumps, True, Motion()
        self._motion.follow(camera, dt)
        if state != self._known:
            self._known, self._settled = deepcopy(state), 0
            self._around.note_change()
        self._moved = camera != self._camera
        if self._moved:
            self._camera, self._settled = camera, 0
            self._around.knows_all = False

    def draw(self, view: View, screen: moderngl.Framebuffer) -> bool:
        """Show the scene; if frames are drawn in slices, what `work` has finished of it.

        Parameters
        ----------
        view
            The camera of the viewer, and the size of `screen`.
        screen
            The framebuffer to draw into.

        Returns
        -------
        bool
            Whether a frame of the scene was finished since the last call. Only then do the renderer's targets and plan
            belong together.
        """
        self._view = view
        self._choose_way()
        if not self.in_slices:
            return self._draw_whole_or_still(view, screen)
        finished, self._unshown = self._unshown and not self._still.is_finished, False
        if self._still.is_finished and self._is_settled:
            self._still.show(screen)
            return finished
        if self._has_jumped or self._reprojection.unseen(view) > _MOST_UNSEEN:  # or before the first frame
            view = self._view = self._catch_up(view)
            finished = True
        self._reprojection.show(view, screen)
        return finished

    def work(self) -> None:
        """Continue for a slice with what the window is to show next, if frames are drawn in slices.

        Call this once per iteration of the frame loop, after the picture is on the screen: the next one then follows
        the newest input.
        """
        if self._is_untaken:
            self._is_untaken = False
            self._take_finished()
        if not self.in_slices or self._view is None or self.is_current:
            return
        if self._looks_around(self._view):
            self._around.advance(self._slice_seconds(self._view))
        elif not self._is_settled:
            self._unshown |= self._draw_slice(self._view)
        elif self._wants_still and not self._still.is_finished:
            seconds = longest(self._renderer.settings.reprojection.slice / 1e3)
            self._unshown |= self._still.advance(self._view, seconds)

    def _looks_around(self, view: View) -> bool:
        """Return whether the surroundings of `view` are being drawn now, beginning with them if they are needed."""
        if self._around.is_drawing:
            return True
        if self.is_drawing or not self.refines or self._reprojection.view is None:
            return False
        if self._moved:
            return self._around.begin_for_walk([view, View(self._ahead(self._frame.delay), view.size)])
        return self._is_settled and self._around.begin_at_rest(view.position)

    def _draw_whole_or_still(self, view: View, screen: moderngl.Framebuffer) -> bool:
        """Draw a frame at once, or the still picture; return whether it was a frame."""
        self._unshown = False
        if not (self._is_settled and self._wants_still):
            self._still.drop()
            if self._durations or self._renderer.settings.reprojection.mode == "off":
                self._draw_whole(view, screen)
            else:
                self._draw_first(view, screen)
            return True
        if not self._still.is_finished:
            self._still.advance(view, np.inf)
            self._renderer.render(view, screen)  # so that targets are those of the plan again
        self._still.show(screen)
        return False

    def _catch_up(self, view: View) -> View:
        """Finish one or two frames at once, until one covers the view; return the viewer's view at that time."""
        start = time.perf_counter()
        if self._has_jumped:
            self._frame.drop()
        elif self._frame.is_drawing:
            self.finish()
            view = View(self._ahead(time.perf_counter() - start), view.size)
        if self._has_jumped or self._reprojection.unseen(view) > _MOST_UNSEEN:
            coming = time.perf_counter() - start + self.scene_seconds
            view = View(self._ahead(min(coming, _FARTHEST_AHEAD)), view.size)
            self._begin(view.camera, view, interactive=True)
            self.finish()
        self._has_jumped = False
        return view

    def finish(self) -> None:
        """Draw the rest of a frame in progress; call this before the scene or its settings change."""
        self._still.drop()
        self._around.drop()
        while self._frame.is_drawing:
            self._advance(np.inf)

    def _ahead(self, seconds: float) -> Camera:
        """Return where the viewer is expected to be in `seconds`."""
        return self._reachable(self._motion.ahead(seconds))

    def _choose_way(self) -> None:
        """Decide whether frames are drawn in slices, unless one is in progress."""
        settings = self._renderer.settings
        if self.is_drawing:
            return
        mode, before = settings.reprojection.mode, self.in_slices
        if not self._is_new:
            self._is_slow = min(self._durations) > (_QUICK if self._is_slow else _SLOW)
        self.in_slices = self._is_slow if mode == "auto" else mode == "on"
        if mode == "auto" and self._is_new:
            self.in_slices = self._reprojection.view is not None  # the second frame, see `_draw_first`
        if settings.dof.mode != "none" and settings.dof.autofocus:
            self.in_slices = False  # the lens changes from frame to frame
        if self.in_slices and not before:
            self._settled = 0  # draw one frame with a margin, for when the viewer starts

    def _draw_whole(self, view: View, screen: moderngl.Framebuffer) -> None:
        self._has_jumped = False
        self._interactive = self._is_new
        self._renderer.warp_limit = _FIRST_WARP_LIMIT if self._interactive else None
        self._finished_scale = 1.0
        self._reprojection.forget_picture()
        start = time.perf_counter()
        self._renderer.render(view, screen)
        if self._renderer.device.software:
            self._renderer.device.context.finish()
        of_passes = sum(self._renderer.timers.milliseconds.values()) / 1e3  # a GPU works behind the CPU
        self._end_frame(max(time.perf_counter() - start, of_passes))

    def _draw_first(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a frame at once, in a way that it can be reprojected if it took long.

        Then the window need not wait for the second frame. The frame has no margin, which would delay it.
        """
        self._source = view
        self._draw_whole(view, self._reprojection.canvas(view.size))
        self._reprojection.show_canvas(screen)
        self._is_untaken = self._durations[-1] > _SLOW

    def _end_frame(self, seconds: float) -> None:
        self._durations.append(seconds)
        self.scene_seconds = seconds
        self._settled += not self._interactive

    def _draw_slice(self, view: View) -> bool:
        """Begin a frame, or continue with the one in progress; return whether it is finished now."""
        if not self._frame.is_drawing:
            ahead = min(_SHOWN_FOR * self._frame.delay, _FARTHEST_AHEAD)
            self._begin(self._ahead(ahead), view, interactive=self._moved)
        return self._advance(self._slice_seconds(view))

    def _begin(self, camera: Camera, view: View, interactive: bool) -> None:
        """Begin a frame seen from `camera`, wider than `view` by the margin.

        interactive: whether it has fewer pixels and limited work, since the viewer moves.
        """
        self._still.drop()
        self._around.drop()
        settings = self._renderer.settings.reprojection
        self._interactive = interactive or self._is_new
        self._source = widened(View(camera, view.size), settings.margin)
        if self._interactive:
            self._source = reduced(self._source, settings.scale * self._scale.factor)
        limit = _FIRST_WARP_LIMIT if self._is_new else round(_WARP_LIMIT * self._scale.factor)
        self._renderer.warp_limit = limit if self._interactive else None
        self._frame.begin(self._renderer.steps(self._source, self._reprojection.canvas(self._source.size)))

    def _slice_seconds(self, view: View) -> float:
        """Return how long a slice may take, see `FrameSlices.seconds`."""
        settings = self._renderer.settings.reprojection
        return self._frame.seconds(
            least=settings.slice / 1e3,
            margin=settings.margin,
            half_width=view.half_extent[0],
            turn_rate=self._motion.turn_rate,
            work=0.0 if self._is_new else self.scene_seconds,  # the first frame compiles shaders
        )

    def _advance(self, seconds: float) -> bool:
        """Continue with the frame for about `seconds`; return whether it is finished."""
        if not self._frame.advance(seconds):
            return False
        self._take_finished()
        self._around.note_frame()
        work = self._frame.end()
        if self._interactive:
            self._scale.note(self._frame.delay, self._renderer.settings.reprojection.frame_limit / 1e3)
        self._end_frame(work)
        return True

    def _take_finished(self) -> None:
        """From now on, show the frame that was drawn in slices."""
        targets, fitted, source = self._renderer.targets, self._renderer.view, self._source
        assert targets is not None and fitted is not None and source is not None
        near, far = fitted.depth_range
        self._finished_scale = source.scale
        self._reprojection.take(targets, replace(source, near=near, far=far))

    @property
    def view(self) -> View | None:
        """Return the view of the picture that is shown; None before the first."""
        return self._view

    @property
    def unseen(self) -> float:
        """Return the part of the shown picture that no frame covers, 0 to 1; see `Reprojection.unseen`."""
        return self._reprojection.unseen(self._view) if self.in_slices and self._view is not None else 0.0

    def distance_at(self, across: float, down: float) -> float:
        """Return the distance of the surface that the window shows at a position; see `Renderer.distance_at`."""
        if self._view is None or not self.in_slices:
            return self._renderer.distance_at(across, down)
        return self._reprojection.distance_at(self._view, across, down)

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        """Return the world point that the window shows at a position; see `Renderer.point_at`."""
        distance = self.distance_at(across, down)
        if self._view is None or np.isinf(distance):
            return None
        return self._view.unproject(across, down, distance)

    def release(self) -> None:
        """Free everything on the GPU, and discard a frame in progress."""
        self._frame.drop()
        self._around.drop()
        self._still.release()
        self._reprojection.release()
