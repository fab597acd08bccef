"""Decide what a window shows at each moment: a new frame, the last one reprojected, or nothing new.

Frames that take long are drawn in slices of a few passes. Between slices the window shows the last finished frame,
reprojected to the newest camera (`render.reprojection`), so that the picture follows keys and mouse much more often
than frames are finished. Such frames have a margin, and are drawn for a predicted camera: where the viewer will be
while they are shown. If nothing changes any more, nothing is drawn.
"""

import time
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection.reprojection import Reprojection
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.walk.look_around import LookAround
from depthwalk.walk.motion import Motion
from depthwalk.walk.scene_frames import SceneFrames
from depthwalk.walk.slices import longest
from depthwalk.walk.still_slices import StillSlices

_SETTLING = 2, 8  # fewest and most frames that are drawn after the last change
_MOST_UNSEEN = 0.5  # of the window: if the last frame lacks more, the window waits for the next one
_MOST_UNCOVERED = 0.2  # of the picture: if the steps since the last frame uncover more, the last of them are not shown
_SHOWN_FOR = 1.5  # times the time to draw a frame: its mean age while it is shown
_FARTHEST_AHEAD = 1.0  # s


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
    in_slices
        Whether frames are drawn in slices, and reprojected in between.
    """

    def __init__(self, renderer: Renderer, reachable: Callable[[Camera], Camera] = lambda camera: camera) -> None:
        self._renderer, self._reachable = renderer, reachable
        self._reprojection = Reprojection(renderer.device)
        self._scene_frames = SceneFrames(renderer, self._reprojection)
        self._around = LookAround(renderer, self._reprojection.surround)
        self._motion = Motion()
        self.in_slices = False
        self._refines = True
        self._view: View | None = None  # view that is shown
        self._camera: Camera | None = None  # of the last call of `note`
        self._moved = False  # whether that differed from the call before
        self._jumps = 0  # in that call
        self._has_jumped = False  # whether the last frame shows another place
        self._known: tuple[Any, ...] = ()  # everything else in that call
        self._settled = 0  # frames drawn since either changed, without interactive ones
        self._still = StillSlices(renderer)
        self._is_outrun = False  # whether the last picture showed the viewer on the way, see `_within_reach`
        self._unshown = False  # whether something is finished that no picture has shown

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
            and (self._still.is_finished or not self._is_refined_at_rest)
        )

    @property
    def is_shown(self) -> bool:
        """Return whether the window shows the last finished picture from where the viewer is.

        Then showing it again would change nothing, and all time is left for the next frame.
        """
        shown = self._view
        return (
            self.in_slices
            and not (self._unshown or self._has_jumped)
            and shown is not None
            and (shown.camera, shown.size) == (self._camera, self._known[0])
        )

    @property
    def _is_settled(self) -> bool:
        """Return whether further frames would be no better than the last one, or than the still picture."""
        plan = self._renderer.plan
        if self._scene_frames.is_drawing or plan is None or self._settled < _SETTLING[0]:
            return False
        if self._renderer.assets.is_waiting or plan.noted.get("shadow_maps_waiting"):
            return False
        if self._is_refined_at_rest:  # it has impostors of its own
            return True
        return not plan.warp.batches or (self._settled >= _SETTLING[1] and not plan.noted["provisional"])

    @property
    def is_drawing(self) -> bool:
        """Return whether a frame or another picture is in progress."""
        return self._scene_frames.is_drawing or self._still.is_drawing or self._around.is_drawing

    @property
    def scale(self) -> float:
        """Return how many pixels the last frame had per pixel of the window, along either axis."""
        return self._scene_frames.scale

    @property
    def scene_seconds(self) -> float:
        """Return the time spent on the last frame of the scene, seconds; 0 before the first."""
        return self._scene_frames.seconds

    @property
    def _is_refined_at_rest(self) -> bool:
        """Return whether the picture is drawn once more, with more samples, when the viewer is at rest.

        False colours tell how frames are drawn, and this picture has impostors and levels of its own.
        """
        settings = self._renderer.settings
        is_told = settings.inspection.how_drawn is not None
        plain = settings.aa == "none" and settings.dof.mode == "none" and not is_told
        return self.refines and settings.reprojection.refine and plain

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
        state = size, renderer.settings, renderer.scene.environment, world.representation, world.edits
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

    def redraw(self) -> None:
        """Draw another frame, even if nothing has changed since the last one."""
        self._still.drop()
        self._settled = 0

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
        self._choose_slices()
        if not self.in_slices:
            return self._draw_whole_or_still(view, screen)
        finished, self._unshown = self._unshown and not self._still.is_finished, False
        if self._still.is_finished and self._is_settled:
            self._still.show(screen)
            return finished
        if self._has_jumped or self._reprojection.unseen(view) > _MOST_UNSEEN:  # or before the first frame
            view = self._view = self._catch_up(view)
            finished = True
        view = self._view = self._within_reach(view)
        self._reprojection.show(view, screen)
        return finished

    def show_again(self, screen: moderngl.Framebuffer) -> None:
        """Show the last picture, or one of the same view, in a framebuffer of its size; nothing before the first."""
        if self._view is None:
            return
        if self.in_slices:
            self._reprojection.show(self._view, screen)
        else:
            self._renderer.render(self._view, screen)

    def work(self) -> None:
        """Continue for a slice with what the window is to show next, if frames are drawn in slices.

        Call this once per iteration of the frame loop, after the picture is on the screen: the next one then follows
        the newest input.
        """
        self._scene_frames.reproject_first()
        if not self.in_slices or self._view is None or self.is_current:
            return
        if self._looks_around(self._view):
            self._around.advance(self._slice_seconds)
        elif not self._is_settled:
            self._unshown |= self._draw_slice(self._view)
        elif self._is_refined_at_rest and not self._still.is_finished:
            self._unshown |= self._still.advance(self._view, self._slice_seconds)

    def _looks_around(self, view: View) -> bool:
        """Return whether the surroundings of `view` are being drawn now, beginning with them if they are needed."""
        if self._around.is_drawing:
            return True
        if self.is_drawing or not self.refines or self._reprojection.view is None:
            return False
        if self._moved:
            return self._around.begin_for_moving_viewer([view, View(self._ahead(self._scene_frames.delay), view.size)])
        return self._is_settled and self._around.begin_for_resting_viewer(view)

    def _draw_whole_or_still(self, view: View, screen: moderngl.Framebuffer) -> bool:
        """Draw a frame at once, or the still picture; return whether it was a frame."""
        self._unshown = False
        if not (self._is_settled and self._is_refined_at_rest):
            self._still.drop()
            self._draw_whole(view, screen)
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
            self._scene_frames.drop()
        elif self._scene_frames.is_drawing:
            self.finish()
            view = View(self._ahead(time.perf_counter() - start), view.size)
        if self._has_jumped or self._reprojection.unseen(view) > _MOST_UNSEEN:
            coming = time.perf_counter() - start + self.scene_seconds
            view = View(self._ahead(min(coming, _FARTHEST_AHEAD)), view.size)
            self._begin(view.camera, view, moves=True)
            self.finish()
        self._has_jumped = False
        return view

    def _within_reach(self, view: View) -> View:
        """Return the view, or one on the way to it, up to where the last frame still holds most of what is seen there.

        It looks where the viewer looks. Torn pictures would show the last steps of a viewer who is too quick for the
        frames; waiting for the next frame would stop the picture altogether.
        """
        uncovered, source = self._reprojection.uncovered(view.position), self._reprojection.view
        self._is_outrun = uncovered > _MOST_UNCOVERED
        if source is None or not self._is_outrun:  # without a picture nothing is uncovered
            return view
        back = glm.dvec3(*(1 - _MOST_UNCOVERED / uncovered) * (source.position - view.position))
        place, target = (components(glm.dvec3(*at) + back) for at in (view.camera.position, view.camera.target))
        return View(replace(view.camera, position=place, target=target), view.size)

    def finish(self) -> None:
        """Draw the rest of a frame in progress; call this before the scene or its settings change."""
        self._still.drop()
        self._around.drop()
        while self._scene_frames.is_drawing:
            self._advance(np.inf)

    def _ahead(self, seconds: float) -> Camera:
        """Return where the viewer is expected to be in `seconds`."""
        return self._reachable(self._motion.ahead(seconds))

    def _choose_slices(self) -> None:
        """Decide whether frames are drawn in slices, unless one is in progress."""
        settings = self._renderer.settings
        if self.is_drawing:
            return
        mode, before = settings.reprojection.mode, self.in_slices
        frames = self._scene_frames
        self.in_slices = frames.are_slow if mode == "auto" else mode == "on"
        if mode == "auto" and frames.are_new:
            self.in_slices = self._reprojection.view is not None  # the second frame, see `SceneFrames.draw_first`
        if settings.dof.mode != "none" and settings.dof.autofocus:
            self.in_slices = False  # the lens changes from frame to frame
        if self.in_slices and not before:
            self._settled = 0  # draw one frame with a margin, for when the viewer starts

    def _draw_whole(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a frame at once; the first one so that the window need not wait for the second."""
        self._has_jumped = False
        frames = self._scene_frames
        if frames.seconds or self._renderer.settings.reprojection.mode == "off":
            frames.draw(view, screen)
        else:
            frames.draw_first(view, screen)
        self._settled += not frames.is_interactive

    def _draw_slice(self, view: View) -> bool:
        """Begin a frame, or continue with the one in progress; return whether it is finished now."""
        if not self._scene_frames.is_drawing:
            ahead = min(_SHOWN_FOR * self._scene_frames.delay, _FARTHEST_AHEAD)
            self._begin(self._ahead(ahead), view, moves=self._moved)
        return self._advance(self._slice_seconds)

    def _begin(self, camera: Camera, view: View, moves: bool) -> None:
        """Begin a frame in slices, see `SceneFrames.begin`, and discard any other picture in progress."""
        self._still.drop()
        self._around.drop()
        self._scene_frames.begin(camera, view, moves)

    @property
    def _slice_seconds(self) -> float:
        """Return how long to draw between pictures: longer if those show little that is new."""
        seconds = self._renderer.settings.reprojection.slice / 1e3
        return seconds if self._moved and not self._is_outrun else longest(seconds)

    def _advance(self, seconds: float) -> bool:
        """Continue with the frame for about `seconds`; return whether it is finished."""
        if not self._scene_frames.advance(seconds):
            return False
        self._around.note_frame()
        self._settled += not self._scene_frames.is_interactive
        return True

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
        self._scene_frames.drop()
        self._around.drop()
        self._still.release()
        self._reprojection.release()
