"""Move the camera: on foot or in flight, in orbit about a target, or along a path.

A `Walker`, `OrbitControls` and a `Playback` each move a camera of their own; the viewer decides which of them does, and
hands the camera over from one to the next. This module draws nothing and is independent of the window, so that it can
be tested without one.
"""

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.ingest.formats import is_model_file
from depthwalk.limits import MAX_FOV, MIN_FOV
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from depthwalk.walk.collision.obstacles import Obstacles
from depthwalk.walk.controls import (
    EYE_HEIGHT,
    EYE_HEIGHTS,
    LONGEST_STEP,
    SPEED_RANGE,
    HeldKeys,
    Move,
    Walker,
    natural_speed,
)
from depthwalk.walk.framing import distance_to_all, extent_in
from depthwalk.walk.orbit import LOOK_AROUND, TURNTABLE, Side, distance, with_distance
from depthwalk.walk.orbit_controls import OrbitControls
from depthwalk.walk.playback import Playback
from depthwalk.walk.toast import Toast


class Surfaces(Protocol):
    """Describe an object that knows the surfaces that a picture shows."""

    def distance_at(self, across: float, down: float) -> float:
        """Return the distance along the view axis, metres, shown at a position; see `Renderer.distance_at`."""
        ...

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        """Return the world point that is shown at a position; see `Renderer.point_at`."""
        ...


class Mode(Enum):
    """Name the ways in which keys and mouse move the camera; a value is the mode's name in the panel."""

    FLY = "fly"
    WALK = "walk on the ground"
    ORBIT = "orbit"


@dataclass
class Viewer:
    """Hold the camera of a walk, and move it.

    Attributes
    ----------
    scene
        The scene that is shown.
    renderer
        The renderer that draws the scene.
    walker
        Position and direction of a viewer who flies or walks. In orbit they follow the camera.
    home
        The camera that the key Home returns to.
    playback
        The camera path that can be played; None if there is none.
    orbit
        The camera that turns about its target, in Mode.ORBIT; None in other modes.
    turntable
        Whether the camera keeps turning by itself: about its target or, of a walking viewer, on the spot.
    shown_surfaces
        Knows the surfaces that the window shows; if None, the renderer does.
    held
        The moves whose keys are down.
    fast
        Whether Shift is held.
    jumps
        How often the camera has jumped, as by the key Home. What was seen before a jump does not tell what is seen
        after it.
    obstacles
        Stops a walking viewer at surfaces, where the scene asks for it; None: nothing does.
    moment
        How long the scene's animations have run, seconds; 0 in a scene without animations.
    is_animated
        Whether they run; not while the user has paused them.
    complaint
        What is wrong with the files of the scene, and not in the picture therefore; it is shown until they are read
        without it, since somebody who edits them looks elsewhere when they are. "" if there is nothing.
    chosen_fov
        The vertical field of view that the user chose last, radians; None if none was. Paths and the first camera have
        their own.
    """

    scene: Scene
    renderer: Renderer
    walker: Walker
    home: Camera
    playback: Playback | None = None
    orbit: OrbitControls | None = None
    turntable: bool = False
    shown_surfaces: Surfaces | None = None
    held: HeldKeys = field(default_factory=HeldKeys)
    fast: bool = False
    jumps: int = 0
    obstacles: Obstacles | None = None
    moment: float = 0.0
    is_animated: bool = True
    complaint: str = ""
    chosen_fov: float | None = None
    _first_speed: float = 0.0  # m/s: the one that `arrive` set; 0 once the whole scene is shown
    _toast: Toast = field(default_factory=Toast)

    @property
    def surfaces(self) -> Surfaces:
        """Return the object that knows the surfaces that the window shows."""
        return self.shown_surfaces or self.renderer

    def tell(self, message: str) -> None:
        """Show `message` for a few seconds, or longer if it takes longer to read."""
        self._toast.show(message)

    def complain(self, complaint: str) -> None:
        """Show `complaint` until the files of the scene are read without it."""
        self.complaint = complaint
        self.tell("")  # the last message may say the opposite

    @property
    def toast(self) -> str:
        """Return the message to show now, or an empty string if there is none or its time is over."""
        return self._toast.text

    @property
    def notice(self) -> str:
        """Return the message to show now, and why the picture is not what the files say; "" if there is neither."""
        missing = ""
        if not len(self.scene.objects):
            missing = "The scene has no objects"
        elif not self.renderer.world.is_whole and self.renderer.assets.meshes.reader.is_busy:
            missing = "Reading models \u2026"
        return "\n".join(filter(None, (self.toast, self.complaint, missing)))

    @property
    def ground(self) -> float:
        """Return the height of the ground, metres, world y; 0 if the scene has none."""
        ground = self.scene.environment.ground
        return ground.height if ground is not None else 0.0

    @property
    def extent(self) -> tuple[NDArray[np.float64], float]:
        """Return the centre (3,), metres, world, and the radius, metres, of a sphere that holds all objects."""
        return extent_in(self.renderer)

    @property
    def mode(self) -> Mode:
        """Return the way in which keys and mouse move the camera now."""
        if self.orbit is not None:
            return Mode.ORBIT
        return Mode.WALK if self.walker.walking else Mode.FLY

    @property
    def camera(self) -> Camera:
        """Return the camera to draw with, at this moment: that of the path while it plays, else that of the viewer."""
        if self.playback is not None and self.playback.playing:
            camera = self.playback.camera
        else:
            camera = self.walker.camera if self.orbit is None else self.orbit.camera
        return replace(camera, time=self.moment)

    def arrive(self) -> None:
        """Begin the walk in a scene, with the camera at `home` and a speed that suits the scene.

        A mesh that is shown without a scene file is viewed in orbit. Otherwise the viewer walks if the camera is at eye
        height, and flies if not.
        """
        self._first_speed = self.walker.speed = self._natural_speed()
        self.turntable = False
        if not is_model_file(self.scene.path):
            self.orbit = None
        elif self.orbit is None:
            self.orbit = OrbitControls(self.walker, self.home)
        self.walker.walking = self.orbit is None
        self._place(self.home)

    def adjust_speed(self) -> None:
        """Set the speed that suits the whole scene, once all objects of the scene are shown.

        `arrive` could only judge by the objects loaded at that time. This does nothing while some are missing, after
        the first time, or if the user has changed the speed since `arrive`.
        """
        if self._first_speed and self.renderer.world.is_whole:
            if self.walker.speed == self._first_speed:
                self.walker.speed = self._natural_speed()
            self._first_speed = 0.0

    def advance(self, dt: float) -> None:
        """Move the camera for `dt` seconds: along the path while it plays, otherwise by the keys that are held.

        A key that moves the viewer stops path and turntable. Moving up or down changes from walking to flying. The
        scene's animations run meanwhile.
        """
        if self.scene.animations is not None and self.is_animated:
            self.moment += dt
        held = self.held.take(dt)
        if self.playback is not None and self.playback.playing:
            if held:
                self.playback.playing = False
            else:
                before = self.playback.time
                self.playback.advance(dt)
                self.jumps += self.playback.time < before  # it starts again
                self._look_from(self.playback.camera)
                return
        if self.walker.walking and not held.keys().isdisjoint((Move.UP, Move.DOWN)):
            self.set_mode(Mode.FLY)
        before = self.walker.position
        if (obstacles := self._obstacles) is not None:
            obstacles.walk(self.walker, held, dt, fast=self.fast)
        else:
            self.walker.advance(held, dt, fast=self.fast, ground=self.ground)
        if self.orbit is not None:
            self.orbit.advance(self.walker.position - before, dt)
        self.turntable &= not held
        if self.turntable:
            rate = LOOK_AROUND if self.orbit is None else TURNTABLE
            (self.orbit or self.walker).spin(rate * min(dt, LONGEST_STEP))

    @property
    def _obstacles(self) -> Obstacles | None:
        """Return what stops the viewer now; None while nothing does."""
        return self.obstacles if self.walker.walking and self.scene.walk.collide else None

    def reachable(self, camera: Camera) -> Camera:
        """Return how far the viewer gets on the way to `camera`, where obstacles are in the way."""
        obstacles, plays = self._obstacles, self.playback is not None and self.playback.playing
        return camera if obstacles is None or plays else obstacles.reachable(self.walker, camera)

    def look(self, right: float, down: float) -> None:
        """Turn the camera by a mouse movement of `right` and `down` pixels, and stop the path.

        In orbit the camera turns about its target, otherwise about its own position.
        """
        self._take_over()
        if self.orbit is None:
            self.walker.look(right, down)
        else:
            self.orbit.turn(right, down)

    def pan(self, right: float, down: float) -> None:
        """Move the camera sideways by a mouse drag, so that the target follows the mouse.

        Does nothing in modes other than orbit.

        Parameters
        ----------
        right, down
            How far the mouse moved, in heights of the window.
        """
        if self.orbit is not None:
            self._take_over()
            self.orbit.pan(right, down)

    def wheel(self, notches: float) -> None:
        """Change the speed or, in orbit, the distance to the target, by `notches` of the wheel.

        Positive numbers make the viewer faster, or bring the target nearer.
        """
        if self.orbit is None:
            self.walker.change_speed(notches)
            self.tell(f"Speed {self.walker.speed:.3g} m/s")
        else:
            self._take_over()
            self.orbit.dolly(notches)

    def set_speed(self, speed: float) -> None:
        """Change the walking speed, m/s, within what scene files allow, and let the scene ask for it from now on."""
        self.walker.speed = self.scene.walk.speed = glm.clamp(speed, *SPEED_RANGE)

    def reset_speed(self) -> None:
        """Set the speed that the scene asks for, or else the one that suits the objects shown so far."""
        self.walker.speed = self._natural_speed()

    def set_fov(self, fov: float) -> None:
        """Change the vertical field of view to `fov`, radians, within what scene files allow, and stop the path."""
        self._take_over()
        self.walker.fov = self.chosen_fov = glm.clamp(fov, math.radians(MIN_FOV), math.radians(MAX_FOV))
        if self.orbit is not None:
            self.orbit.set_fov(self.walker.fov)

    def seek(self, seconds: float) -> None:
        """Move the camera to the path's position at `seconds` after its beginning; do nothing without a path."""
        if self.playback is not None:
            self.playback.time = seconds
            self.jumps += 1
            self._look_from(self.playback.camera)

    def toggle_path(self) -> None:
        """Play or stop the camera path; if there is none, tell the user how to get one."""
        if self.playback is None:
            self.tell("No camera path: drop a path file on the window, start with --path FILE, or record one with K")
        else:
            self.turntable = False
            self.playback.toggle()
            self.jumps += self.playback.playing

    def toggle_animation(self) -> None:
        """Stop the scene's animations, or let them go on."""
        if self.scene.animations is None:
            self.tell("Nothing in this scene is animated")
            return
        self.is_animated = not self.is_animated
        self.tell("Animations go on" if self.is_animated else f"Animations stopped at {self.moment:.2f} s")

    def toggle_turntable(self) -> None:
        """Start or stop the camera's continuous turn about its target, in orbit; any other move stops it too.

        A walking viewer stays on foot and looks around, since a circle about what is far away leads through everything.
        """
        turns = not self.turntable
        self._take_over()
        if turns:
            if self.mode is not Mode.WALK:
                self._begin_orbit()
            self.turntable = True
            self.tell(
                f"{'Looking around' if self.orbit is None else 'Turning about the target'}; N or any movement stops it"
            )

    def set_mode(self, mode: Mode) -> None:
        """Change the way in which keys and mouse move the camera, without moving it now.

        In orbit, the surface in the middle of the picture becomes the target.
        """
        if mode is Mode.ORBIT:
            self._begin_orbit()
        else:
            self.orbit, self.turntable = None, False
            self.walker.walking, self.walker.eye_height = mode is Mode.WALK, EYE_HEIGHT
            self.tell("Walking on the ground" if self.walker.walking else "Flying")

    def toggle_walking(self) -> None:
        """Change from walking to flying, and from any other mode to walking."""
        self.set_mode(Mode.FLY if self.mode is Mode.WALK else Mode.WALK)

    def toggle_orbit(self) -> None:
        """Change from orbit to flying, and from any other mode to orbit."""
        self.set_mode(Mode.FLY if self.mode is Mode.ORBIT else Mode.ORBIT)

    def turn_about(self, across: float, down: float) -> None:
        """Turn towards the surface at a position in the window, and orbit about it from then on.

        Parameters
        ----------
        across
            Part of the window's width, from the left edge, 0 to 1.
        down
            Part of the window's height, from the upper edge, 0 to 1.
        """
        point = self.surfaces.point_at(across, down)
        if point is None:
            self.tell("No surface under the mouse to orbit about")
            return
        self._take_over()
        (self.orbit or self._begin_orbit()).aim_at(point)

    def frame_all(self, aspect: float, side: Side | None = None) -> None:
        """Move the camera to where it sees all objects; this changes from walking to flying.

        Parameters
        ----------
        aspect
            Width / height of the window.
        side
            The side to look from; if the camera already does so, it looks from the opposite one. None keeps the
            direction.
        """
        self._take_over()
        camera = self.camera
        look = camera.look
        if side is not None:
            side = side.unless_seen_along(look)
            look = side.look
            self.tell(f"From {side.name.lower()}" if side.look.y else f"From the {side.name.lower()}")
        self.walker.walking = False
        self.jumps += 1
        self._place(self.renderer.frame_all(aspect, camera.fov, -look, turns=self.orbit is not None))

    def go_home(self) -> None:
        """Return to `home`, the camera at the beginning of the walk, and stop the path."""
        self._take_over()
        self.jumps += 1
        self._place(self.home)

    def _take_over(self) -> None:
        """Stop path and turntable: the user moves the camera."""
        self.turntable = False
        if self.playback is not None:
            self.playback.playing = False

    def _place(self, camera: Camera) -> None:
        """Place the viewer at `camera`, at rest, and fly if this is not at the eye height of a walking viewer.

        In orbit, the target of `camera` becomes the target.
        """
        self.walker.place(camera)
        height, (lowest, highest) = camera.position[1] - self.ground, EYE_HEIGHTS
        if self.walker.walking and lowest <= height <= highest:
            self.walker.eye_height = height
        else:
            self.walker.walking = False
        if self.orbit is not None:
            self.orbit.place(camera)

    def _look_from(self, camera: Camera) -> None:
        """Place the camera as `_place` does; in orbit, keep the distance to the target."""
        self._place(camera if self.orbit is None else with_distance(camera, distance(self.orbit.camera)))

    def _begin_orbit(self) -> OrbitControls:
        """Change to Mode.ORBIT and return what moves the camera from now on, or stop it if it is in that mode."""
        if self.orbit is None:
            metres = self.surfaces.distance_at(0.5, 0.5)
            metres = distance_to_all(self.renderer, self.camera) if math.isinf(metres) else metres
            self.orbit = OrbitControls(self.walker, with_distance(self.camera, metres))
        self.orbit.stop()
        self.turntable = False
        self.walker.walking, self.walker.eye_height = False, EYE_HEIGHT
        self.tell("Orbiting a target")
        return self.orbit

    def _natural_speed(self) -> float:
        """Return the speed that the scene asks for, m/s, or else the one that suits the objects shown so far."""
        return self.scene.walk.speed or natural_speed(self.extent[1])
