"""Decide what a window shows at each moment: a new frame, a part of the work for one, or nothing new.

Where a frame takes longer than the eye forgives, it is drawn in slices of a few passes. After each slice the window
shows the last finished frame, moved to the newest camera (`render.reprojection`). So the picture follows keys and mouse many
times as often as frames are finished. The frame that is drawn meanwhile has a margin around it, and a camera that looks
ahead to where the viewer will be while it is shown. Where nothing changes any more, nothing is drawn.
"""

import time
from collections import deque
from copy import deepcopy
from typing import Any

import moderngl
import numpy as np
from pyglm import glm

from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection import Reprojection, widened
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

_SLOW = 0.033  # s that a frame takes from which on it is drawn in slices
_QUICK = 0.025  # s below which it is drawn whole again
_MEASURED = 3  # frames that decide: the first one compiles shaders, which tells of no other
_MOST_SETTLING = 8  # frames, after the last change, until nothing is drawn any more
_LEAST_SETTLING = 2
_SMOOTHED = 0.1  # s over which the camera's velocity is averaged
_FARTHEST_AHEAD = 0.6  # s that a frame's camera looks ahead at most


class Motion:
    """Follow a camera, to tell where it will be."""

    def __init__(self) -> None:
        self._camera: Camera | None = None
        self._velocity = glm.dvec3()  # m/s, world
        self._turn = glm.dvec3()  # axis times rad/s, world
        self._zoom = 0.0  # of the angle of view, rad/s

    def follow(self, camera: Camera, dt: float) -> None:
        """Note that the camera is at `camera`, `dt` seconds after the last call."""
        before, self._camera = self._camera, camera
        if before is None or dt <= 0:
            return
        moved = glm.dvec3(*camera.position) - glm.dvec3(*before.position)
        turned = _rotation_between(before.look, camera.look)
        if before == camera:  # a viewer who stops, stops at once
            self._velocity, self._turn = glm.dvec3(), glm.dvec3()
            return
        weight = min(1.0, dt / _SMOOTHED)
        self._velocity = glm.mix(self._velocity, moved / dt, weight)
        self._turn = glm.mix(self._turn, turned / dt, weight)

    def ahead(self, seconds: float) -> Camera:
        """Return where the camera will be in `seconds`, if it goes on as it did."""
        assert self._camera is not None
        camera = self._camera
        angle = glm.length(self._turn) * seconds
        look = camera.look
        if angle > 1e-9:
            look = glm.angleAxis(angle, glm.normalize(self._turn)) * look
        position = glm.dvec3(*camera.position) + self._velocity * seconds
        if position == glm.dvec3(*camera.position) and angle <= 1e-9:
            return camera
        return Camera(position.to_tuple(), (position + look).to_tuple(), camera.fov)


def _rotation_between(before: glm.dvec3, after: glm.dvec3) -> glm.dvec3:
    """Return the axis, of the length of the angle in radians, about which one look turns into another."""
    before, after = glm.normalize(before), glm.normalize(after)
    axis = glm.cross(before, after)
    sine = glm.length(axis)
    return axis / sine * np.arctan2(sine, glm.dot(before, after)) if sine > 1e-12 else glm.dvec3()


class ShownFrames:
    """Draw what a window shows of one renderer.

    Parameters
    ----------
    renderer
        Draws the scene's frames.

    Attributes
    ----------
    scene_seconds
        How long the work for the last frame of the scene took; 0 before the first.
    """

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self._reprojection = Reprojection(renderer.device)
        self._durations: deque[float] = deque(maxlen=_MEASURED)
        self._in_slices = False
        self._steps: Any = None  # of the frame that is drawn in slices
        self._source: View | None = None  # what that frame is seen through
        self._spent = 0.0  # s of work for it so far
        self._began = 0.0  # when it was begun, by the clock
        self._delay = 0.0  # s from a frame's begin to its end, with all that was shown meanwhile
        self._costs: dict[int, float] = {}  # s of each step of the last frame, by its number
        self._motion = Motion()
        self._view: View | None = None  # that was shown last
        self._known_camera: Camera | None = None
        self._known: tuple[Any, ...] = ()  # what the last call of `note` was told, beside the camera
        self._settling = 0  # frames since that changed
        self.scene_seconds = 0.0

    @property
    def is_current(self) -> bool:
        """Return whether the window shows the scene as it is, so that nothing needs to be drawn."""
        plan, assets = self._renderer.plan, self._renderer.assets
        if self._steps is not None or plan is None or assets.is_waiting or self._settling < _LEAST_SETTLING:
            return False
        return not plan.counts["warped"] or self._settling >= _MOST_SETTLING

    def note(self, camera: Camera, dt: float, *state: Any) -> None:
        """Note, once per round of the window, what is to be shown.

        Parameters
        ----------
        camera
            The camera of the viewer.
        dt
            Seconds since the last call.
        *state
            Everything else that the picture depends on; anything that can be compared and copied.
        """
        self._motion.follow(camera, dt)
        if state != self._known:
            self._known, self._settling = deepcopy(state), 0
        if camera != self._known_camera:
            self._known_camera, self._settling = camera, 0

    def draw(self, view: View, screen: moderngl.Framebuffer) -> bool:
        """Show the scene.

        Parameters
        ----------
        view
            The camera of the viewer, and the size of `screen`.
        screen
            The framebuffer to draw into.

        Returns
        -------
        bool
            Whether a frame of the scene was finished; only then is what the renderer knows of it up to date.
        """
        self._view = view
        self._choose_way()
        if not self._in_slices:
            self.finish()
            return self._draw_whole(view, screen)
        finished = not self.is_current and self._draw_slice(view)
        if self._reprojection.view is None:  # the first frame in slices, or of another size
            if not self.is_drawing:
                self._draw_slice(view)
            self.finish()
            finished = True
        self._reprojection.show(view, screen)
        return finished

    def finish(self) -> None:
        """Draw what is left of a frame that has been begun. Whoever changes the scene or its settings calls this."""
        while self._steps is not None:
            self._advance(float("inf"))

    def _choose_way(self) -> None:
        """Decide whether frames are drawn whole or in slices; not while one is drawn."""
        settings = self._renderer.settings
        if self._steps is not None or len(self._durations) < _MEASURED:
            return
        mode = settings.reprojection.mode
        quickest = min(self._durations)
        wanted = quickest > (_QUICK if self._in_slices else _SLOW) if mode == "auto" else mode == "on"
        if settings.dof.mode != "none" and settings.dof.autofocus:
            wanted = False  # the focus follows each frame
        self._in_slices = wanted

    def _draw_whole(self, view: View, screen: moderngl.Framebuffer) -> bool:
        start = time.perf_counter()
        self._renderer.render(view, screen)
        if len(self._durations) < _MEASURED or self._settling < _LEAST_SETTLING:
            self._renderer.device.context.finish()
        self._end_frame(time.perf_counter() - start)
        return True

    def _end_frame(self, seconds: float) -> None:
        self._durations.append(seconds)
        self.scene_seconds = seconds
        self._settling += 1

    def _draw_slice(self, view: View) -> bool:
        """Begin a frame, or go on with the one that was begun; return whether it is finished now."""
        if self._steps is None:
            settings = self._renderer.settings.reprojection
            ahead = min(1.5 * self._delay, _FARTHEST_AHEAD)
            self._source = widened(View(self._motion.ahead(ahead), view.size), settings.margin)
            canvas = self._reprojection.canvas(self._source.size)
            self._steps = enumerate(self._renderer.steps(self._source, canvas))
            self._spent, self._began = 0.0, time.perf_counter()
        return self._advance(self._renderer.settings.reprojection.slice / 1e3)

    def _advance(self, seconds: float) -> bool:
        """Go on with the frame in slices for about `seconds`; return whether it is finished."""
        assert self._source is not None
        start = last = time.perf_counter()
        number = 0
        while True:
            step = next(self._steps, None)
            if step is None:
                break
            number = step[0]
            self._renderer.device.context.finish()
            now = time.perf_counter()
            self._costs[number] = now - last; self.__dict__.setdefault("_named",{}); self._named[step[1]]=self._named.get(step[1],0)+now-last
            last = now
            if now - start + self._costs.get(number + 1, 0.0) > seconds:
                self._spent += now - start
                return False
        targets, fitted = self._renderer.targets, self._renderer.view
        assert targets is not None and fitted is not None
        near, far = fitted.depth_range
        self._reprojection.take(targets, View(self._source.camera, self._source.size, near, far))
        self._steps = None
        self._delay = time.perf_counter() - self._began
        self._end_frame(self._spent + time.perf_counter() - start)
        return True

    @property
    def is_drawing(self) -> bool:
        """Return whether a frame has been begun that is not finished yet."""
        return self._steps is not None

    def distance_at(self, across: float, down: float) -> float:
        """Return how far ahead the surface is that the window shows at a place; see `Renderer.distance_at`."""
        if self._view is None or not self._in_slices:
            return self._renderer.distance_at(across, down)
        return self._reprojection.distance_at(self._view, across, down)

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        """Return the world point that the window shows at a place; see `Renderer.point_at`."""
        distance = self.distance_at(across, down)
        if self._view is None or np.isinf(distance):
            return None
        return self._view.unproject(across, down, distance)

    def release(self) -> None:
        """Free everything on the GPU, and forget a frame that has been begun."""
        if self._steps is not None:
            self._steps = None
        self._reprojection.release()
