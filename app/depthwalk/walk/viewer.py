"""Move the camera by keys and mouse, along a path or about a target; show messages.

This module draws nothing and is independent of the window, so that it can be tested without one.
"""

import math
import time
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
from depthwalk.walk import orbit
from depthwalk.walk.collision.obstacles import Obstacles
from depthwalk.walk.controls import EYE_HEIGHT, EYE_HEIGHTS, LONGEST_STEP, HeldKeys, Move, Walker, natural_speed
from depthwalk.walk.playback import Playback

_TOAST_SECONDS = 4.0  # shortest time
_READING = 15.0  # characters per second
_SAME_SIDE = math.cos(math.radians(1.0))
_EMPTY = 10.0  # metres: radius assumed for an empty scene


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


def home_in(scene: Scene, renderer: Renderer, aspect: float) -> Camera:
    """Return the first camera of a scene: its own, or one that shows all objects.

    Parameters
    ----------
    scene
        The scene.
    renderer
        The renderer that draws it.
    aspect
        Width / height of the window.

    Returns
    -------
    Camera
        The camera, world; of a single model also while it turns.
    """
    return scene.camera or renderer.frame_all(aspect, turns=is_model_file(scene.path))


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
    turned
        In Mode.ORBIT the camera that turns about its target; otherwise None.
    shown
        Knows the surfaces that the window shows; if None, the renderer does.
    held
        The moves whose keys are down.
    fast
        Whether Shift is held.
    turntable
        Whether the camera keeps turning about its target.
    jumps
        How often the camera has jumped, as by the key Home: from the picture before, nothing follows for the next one.
    obstacles
        Stops a walking viewer at surfaces, where the scene asks for it; None: nothing does.
    """

    scene: Scene
    renderer: Renderer
    walker: Walker
    home: Camera
    playback: Playback | None = None
    turned: Camera | None = None
    shown: Surfaces | None = None
    held: HeldKeys = field(default_factory=HeldKeys)
    fast: bool = False
    turntable: bool = False
    jumps: int = 0
    obstacles: Obstacles | None = None
    _aimed: glm.dvec3 | None = None  # the point that the camera is turning towards, in orbit
    _pace: float = 0.0  # the speed at the beginning of the walk, until the whole scene is shown
    _toast: str = ""
    _toast_end: float = 0.0

    @property
    def surfaces(self) -> Surfaces:
        """Return the object that knows the surfaces that the window shows."""
        return self.shown or self.renderer

    def tell(self, message: str) -> None:
        """Show `message` for a few seconds, or longer if it takes longer to read."""
        self._toast, self._toast_end = message, time.monotonic() + max(_TOAST_SECONDS, len(message) / _READING)

    @property
    def toast(self) -> str:
        """Return the message to show now, or an empty string if there is none or its time is over."""
        return self._toast if time.monotonic() < self._toast_end else ""

    @property
    def notice(self) -> str:
        """Return the message to show now, and why objects are missing from the picture; "" if there is neither."""
        missing = ""
        if not len(self.scene.objects):
            missing = "The scene has no objects"
        elif not self.renderer.world.is_whole and self.renderer.assets.meshes.reader.is_busy:
            missing = "Reading models \u2026"
        return "\n".join(filter(None, (self.toast, missing)))

    @property
    def ground(self) -> float:
        """Return the height of the ground, metres, world y; 0 if the scene has none."""
        ground = self.scene.environment.ground
        return ground.height if ground is not None else 0.0

    @property
    def extent(self) -> tuple[NDArray[np.float64], float]:
        """Return the centre (3,), metres, world, and the radius, metres, of a sphere that holds all objects."""
        bounds = self.renderer.world.bounds()
        return bounds.sphere() if len(bounds.bounding_radius) else (np.zeros(3), _EMPTY)

    @property
    def mode(self) -> Mode:
        """Return the way in which keys and mouse move the camera now."""
        if self.turned is not None:
            return Mode.ORBIT
        return Mode.WALK if self.walker.walking else Mode.FLY

    @property
    def camera(self) -> Camera:
        """Return the camera to draw with: that of the path while it plays, otherwise that of the viewer."""
        if self.playback is not None and self.playback.playing:
            return self.playback.camera
        return self.turned or self.walker.camera

    def arrive(self) -> None:
        """Begin the walk in a scene, with the camera at `home` and a speed that suits the scene.

        A mesh that is shown without a scene file is viewed in orbit. Otherwise the viewer walks if the camera is at eye
        height, and flies if not.
        """
        self._pace = self.walker.speed = self.scene.walk.speed or natural_speed(self.extent[1])
        self.turned = self.home if is_model_file(self.scene.path) else None
        self.walker.walking = self.turned is None
        self._place(self.home)

    def take_pace(self) -> None:
        """Set the speed that suits the whole scene, once all objects of the scene are shown.

        `arrive` could only judge by the objects loaded at that time. This does nothing while some are missing, after
        the first time, or if the user has changed the speed since `arrive`.
        """
        if self._pace and self.renderer.world.is_whole:
            if self.walker.speed == self._pace:
                self.walker.speed = self.scene.walk.speed or natural_speed(self.extent[1])
            self._pace = 0.0

    def advance(self, dt: float) -> None:
        """Move the camera for `dt` seconds: along the path while it plays, otherwise by the keys that are held.

        A key that moves the viewer stops path and turntable. Moving up or down changes from walking to flying.
        """
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
        if self.turned is not None:
            shift = self.walker.position - before
            self._turn_to(self.turned.moved(shift))
            if self._aimed is not None:
                self._aimed = self._aimed + shift
                camera, arrived = orbit.aim(self.turned, self._aimed, dt)
                self._aimed = None if arrived else self._aimed
                self._turn_to(camera)
            self.turntable = self.turntable and not held
            if self.turntable:
                step = orbit.TURNTABLE * min(dt, LONGEST_STEP)
                self._turn_to(orbit.turn(self.turned, step / orbit.RADIANS_PER_PIXEL, 0.0))

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
        if self.turned is None:
            self.walker.look(right, down)
        else:
            self._turn_to(orbit.turn(self.turned, right, down))

    def pan(self, right: float, down: float) -> None:
        """Move the camera sideways by a mouse drag, so that the target follows the mouse.

        Does nothing in modes other than orbit.

        Parameters
        ----------
        right, down
            How far the mouse moved, in heights of the window.
        """
        if self.turned is not None:
            self._take_over()
            self._aimed = None
            self._turn_to(orbit.pan(self.turned, right, down))

    def wheel(self, notches: float) -> None:
        """Change the speed or, in orbit, the distance to the target, by `notches` of the wheel.

        Positive numbers make the viewer faster, or bring the target nearer.
        """
        if self.turned is None:
            self.walker.change_speed(notches)
            self.tell(f"Speed {self.walker.speed:.3g} m/s")
        else:
            self._take_over()
            self._turn_to(orbit.dolly(self.turned, notches))

    def set_fov(self, fov: float) -> None:
        """Change the vertical field of view to `fov`, radians, within what scene files allow, and stop the path."""
        self._take_over()
        self.walker.fov = glm.clamp(fov, math.radians(MIN_FOV), math.radians(MAX_FOV))
        if self.turned is not None:
            self.turned = replace(self.turned, fov=self.walker.fov)

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

    def toggle_turntable(self) -> None:
        """Start or stop the camera's continuous turn about its target, in orbit; any other move stops it too."""
        if self.turntable:
            self.turntable = False
            return
        self._take_over()
        self.set_mode(Mode.ORBIT)
        self.turntable = True
        self.tell("Turning about the target; N or any movement stops it")

    def set_mode(self, mode: Mode) -> None:
        """Change the way in which keys and mouse move the camera, without moving it now.

        In orbit, the surface in the middle of the picture becomes the target.
        """
        self.walker.walking = mode is Mode.WALK
        self.walker.eye_height = EYE_HEIGHT
        self._aimed, self.turntable = None, False
        if mode is not Mode.ORBIT:
            self.turned = None
        elif self.turned is None:
            distance = self.surfaces.distance_at(0.5, 0.5)
            if np.isinf(distance):
                distance = self._distance_to_all()
            self.turned = orbit.with_distance(self.camera, distance)
        self.tell({Mode.FLY: "Flying", Mode.WALK: "Walking on the ground", Mode.ORBIT: "Orbiting a target"}[mode])

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
        if self.turned is None:
            self.set_mode(Mode.ORBIT)
        self._aimed = point

    def frame_all(self, aspect: float, side: orbit.Side | None = None) -> None:
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
            if glm.dot(glm.normalize(look), side.look) > _SAME_SIDE:
                side = side.opposite
            look = side.look
            self.tell(f"From {side.name.lower()}" if side.look.y else f"From the {side.name.lower()}")
        self.walker.walking = False
        self.jumps += 1
        self._place(self.renderer.frame_all(aspect, camera.fov, -look, turns=self.turned is not None))

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
        self._aimed = None
        if self.turned is not None:
            self.turned = camera

    def _look_from(self, camera: Camera) -> None:
        """Place the camera as `_place` does; in orbit, keep the distance to the target."""
        self._place(camera if self.turned is None else orbit.with_distance(camera, orbit.distance(self.turned)))

    def _turn_to(self, camera: Camera) -> None:
        """Move the orbit's camera and, with it, the walker, who keeps the velocity from the keys."""
        velocity = self.walker.velocity
        self.walker.place(camera)
        self.walker.velocity = velocity
        self.turned = camera

    def _distance_to_all(self) -> float:
        """Return the distance along the view axis to the centre of all objects; their radius if that is behind."""
        middle, radius = self.extent
        camera = self.camera
        ahead = glm.dot(glm.dvec3(middle) - glm.dvec3(*camera.position), glm.normalize(camera.look))
        return ahead if ahead > 0 else radius
