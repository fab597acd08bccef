"""What the window shows and what keys and panel change."""

import time
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.errors import InputError
from depthwalk.ingest.formats import is_mesh_file
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.walk import orbit
from depthwalk.walk.controls import HeldKeys, Walker, natural_speed
from depthwalk.walk.focus import FocusPull
from depthwalk.walk.playback import Playback
from depthwalk.walk.recorder import Recorder, save_path, tolerance_in
from depthwalk.walk.times import FrameTimes

_TOAST_SECONDS = 4.0
_EMPTY = 10.0  # metres: radius of a scene that holds nothing


class Mode(Enum):
    """How keys and mouse move the camera; the value is what the panel calls it."""

    FLY = "fly"
    WALK = "walk on the ground"
    ORBIT = "orbit"


@dataclass
class State:
    """One walk. home: the camera that Home returns to; playback: None without a path; recorder: None while nothing is
    recorded; turned: the camera in Mode.ORBIT, which turns about its target, else None; the walker goes with it."""

    scene: Scene
    renderer: Renderer
    walker: Walker
    home: Camera
    playback: Playback | None = None
    recorder: Recorder | None = None
    turned: Camera | None = None
    held: HeldKeys = field(default_factory=HeldKeys)
    times: FrameTimes = field(default_factory=FrameTimes)
    pull: FocusPull = field(default_factory=FocusPull)
    fast: bool = False
    hud: bool = True
    panel: bool = False
    help: bool = False
    atlas: bool = False
    _aimed: glm.dvec3 | None = None  # where the next target is
    _toast: str = ""
    _toast_end: float = 0.0

    def tell(self, message: str) -> None:
        """Shows `message` for some seconds."""
        self._toast, self._toast_end = message, time.monotonic() + _TOAST_SECONDS

    @property
    def toast(self) -> str:
        return self._toast if time.monotonic() < self._toast_end else ""

    @property
    def ground(self) -> float:
        """The ground's y; 0 where the scene has none."""
        ground = self.scene.environment.ground
        return ground.height if ground is not None else 0.0

    @property
    def extent(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,), world, and radius, metres, of a sphere that holds all objects; of some where there are none."""
        bounds = self.renderer.world.bounds()
        return bounds.sphere() if len(bounds.bounding_radius) else (np.zeros(3), _EMPTY)

    @property
    def mode(self) -> Mode:
        if self.turned is not None:
            return Mode.ORBIT
        return Mode.WALK if self.walker.walking else Mode.FLY

    @property
    def camera(self) -> Camera:
        """What is looked through: the path's camera while it plays."""
        if self.playback is not None and self.playback.playing:
            return self.playback.camera
        return self.turned or self.walker.camera

    def arrive(self) -> None:
        """Begin in a scene: at home, with the speed that suits it; turning about it where it is a mesh alone."""
        self.walker.speed = self.scene.walk.speed or natural_speed(self.extent[1])
        self.walker.walking = False
        self.turned = self.home if is_mesh_file(self.scene.path) else None
        self._place(self.home)

    def show(self, scene: Scene, renderer: Renderer, aspect: float) -> None:
        """Another scene, or what has become of this one, which keeps camera and path. aspect: see `frame_all`."""
        again = scene.path == self.scene.path
        self.tell(f"{scene.path.name}, read again" if again else scene.path.name)
        self.end_recording()  # which tells more
        self.scene, self.renderer = scene, renderer
        self.home = scene.camera or renderer.frame_all(aspect)
        if not again:
            self.playback = None
            self.arrive()

    def advance(self, dt: float) -> None:
        """dt: seconds since the last frame. Moving takes the camera over from a path that plays."""
        held = self.held.take(dt)
        if self.playback is not None and self.playback.playing:
            if held:
                self.playback.playing = False
            else:
                self.playback.advance(dt)
                self._look_from(self.playback.camera)
                return
        before = self.walker.position
        self.walker.advance(held, dt, fast=self.fast, ground=self.ground)
        if self.turned is not None:
            shift = self.walker.position - before
            self._turn_to(self.turned.moved(shift))
            if self._aimed is not None:
                self._aimed = self._aimed + shift
                camera, arrived = orbit.aim(self.turned, self._aimed, dt)
                self._aimed = None if arrived else self._aimed
                self._turn_to(camera)

    def look(self, right: float, down: float) -> None:
        """Turn, or turn about the target, by pixels of the mouse; takes the camera over from a path that plays."""
        self._take_over()
        if self.turned is None:
            self.walker.look(right, down)
        else:
            self._turn_to(orbit.turn(self.turned, right, down))

    def pan(self, right: float, down: float) -> None:
        """Move sideways with what is about as far as the target, by heights of the window."""
        if self.turned is not None:
            self._take_over()
            self._aimed = None
            self._turn_to(orbit.pan(self.turned, right, down))

    def wheel(self, notches: float) -> None:
        """Change the speed, or the distance to the target."""
        if self.turned is None:
            self.walker.change_speed(notches)
            self.tell(f"{self.walker.speed:.3g} m/s")
        else:
            self._take_over()
            self._turn_to(orbit.dolly(self.turned, notches))

    def seek(self, seconds: float) -> None:
        """Look from the path's camera at `seconds`."""
        if self.playback is not None:
            self.playback.time = seconds
            self._look_from(self.playback.camera)

    def toggle_path(self) -> None:
        if self.playback is None:
            self.tell("No path: start with --path FILE, or record one with K")
        else:
            self.playback.toggle()

    def set_mode(self, mode: Mode) -> None:
        """Go on from the same view; about what is in the middle of the window, where the target is to turn about."""
        self.walker.walking = mode is Mode.WALK
        self._aimed = None
        if mode is not Mode.ORBIT:
            self.turned = None
        elif self.turned is None:
            distance = self.renderer.distance_at()
            if np.isinf(distance):
                distance = self._distance_to_all()
            self.turned = orbit.with_distance(self.camera, distance)
        self.tell({Mode.FLY: "Flying", Mode.WALK: "Walking", Mode.ORBIT: "Turning about a target"}[mode])

    def toggle_walking(self) -> None:
        self.set_mode(Mode.FLY if self.mode is Mode.WALK else Mode.WALK)

    def toggle_orbit(self) -> None:
        self.set_mode(Mode.FLY if self.mode is Mode.ORBIT else Mode.ORBIT)

    def turn_about(self, across: float, down: float) -> None:
        """Look at what the window shows there, and turn about that. across, down: parts of its width and height."""
        point = self.renderer.point_at(across, down)
        if point is None:
            self.tell("Nothing is there to turn about")
            return
        self._take_over()
        if self.turned is None:
            self.set_mode(Mode.ORBIT)
        self._aimed = point

    def frame_all(self, aspect: float) -> None:
        """See all objects, in the direction of the present look. aspect: width / height of the window."""
        self._take_over()
        camera = self.camera
        self.walker.walking = False
        self._place(self.renderer.frame_all(aspect, camera.fov, -camera.look))

    def go_home(self) -> None:
        self._take_over()
        self._place(self.home)

    def _take_over(self) -> None:
        """The viewer leads the camera, not the path."""
        if self.playback is not None:
            self.playback.playing = False

    def _place(self, camera: Camera) -> None:
        """Stand still where `camera` is; with its target, where one is turned about."""
        self.walker.place(camera)
        self._aimed = None
        if self.turned is not None:
            self.turned = camera

    def _look_from(self, camera: Camera) -> None:
        """As `_place`, but the target stays as far."""
        self._place(camera if self.turned is None else orbit.with_distance(camera, orbit.distance(self.turned)))

    def _turn_to(self, camera: Camera) -> None:
        """The walker goes along, whose velocity is that of the keys."""
        velocity = self.walker.velocity
        self.walker.place(camera)
        self.walker.velocity = velocity
        self.turned = camera

    def _distance_to_all(self) -> float:
        """Metres along the view axis to the middle of all objects; what they reach, where that is behind."""
        middle, radius = self.extent
        camera = self.camera
        ahead = glm.dot(glm.dvec3(middle) - glm.dvec3(*camera.position), glm.normalize(camera.look))
        return ahead if ahead > 0 else radius

    def toggle_recording(self) -> None:
        if self.recorder is None:
            self.recorder = Recorder()
            self.tell("Recording the camera; K ends it")
        else:
            self.end_recording()

    def record(self, dt: float) -> None:
        """Adds the camera, `dt` seconds after the last frame, to what is recorded; ends that where it is full."""
        if self.recorder is not None:
            self.recorder.add(dt, self.camera)
            if self.recorder.full:
                self.end_recording()

    def end_recording(self) -> None:
        """Saves what was recorded, which P plays from then on."""
        recorder, self.recorder = self.recorder, None
        if recorder is None:
            return
        if not recorder.seconds:
            self.tell("Nothing was recorded")
            return
        path = recorder.path(tolerance_in(self.extent[1]))
        try:
            file = save_path(path)
        except (OSError, InputError) as error:
            self.tell(f"Recording failed: {error}")
            return
        self.playback = Playback(path)
        self.tell(f"Saved {file}: {recorder.seconds:.1f} s in {len(path.times)} keyframes")

    def focus(self) -> None:
        """Turn the lens to what is in the middle of the window."""
        self.pull.start(self.renderer.distance_at())
        off = self.renderer.settings.dof.mode == "none"
        self.tell(f"Focus at {self.pull.target:.3g} m" + ("; dof is off, see the panel" if off else ""))

    def pull_focus(self, dt: float) -> None:
        """dt: seconds since the last frame."""
        lens = self.renderer.settings.dof
        if lens.autofocus and lens.mode != "none":
            self.pull.start(self.renderer.distance_at())
        self.pull.advance(lens, dt)

    def represent(self, wanted: Representation | None) -> None:
        self.renderer.world.representation = wanted
        self.tell(f"Representation: {representation_name(wanted)}")


def representation_name(representation: Representation | None) -> str:
    return "as in the scene" if representation is None else representation.label
