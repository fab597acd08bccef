"""What the window shows and what keys and panel change."""

import time
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.walk.controls import HeldKeys, Walker
from depthwalk.walk.focus import FocusPull
from depthwalk.walk.playback import Playback

_TOAST_SECONDS = 4.0
_AVERAGED = 0.5  # s of frames in the smoothed time


class FrameTimes:
    """Seconds of the last frames."""

    def __init__(self, length: int = 120) -> None:
        self._seconds: deque[float] = deque(maxlen=length)

    def add(self, seconds: float) -> None:
        self._seconds.append(seconds)

    @property
    def milliseconds(self) -> NDArray[np.float32]:
        """(n,), oldest first."""
        return np.array(self._seconds, np.float32) * 1e3

    @property
    def smoothed(self) -> float:
        """Mean seconds of a frame over about the last half second; 0 before the first."""
        total, count = 0.0, 0
        for seconds in reversed(self._seconds):
            total, count = total + seconds, count + 1
            if total >= _AVERAGED:
                break
        return total / count if count else 0.0


@dataclass
class State:
    """One walk. home: the camera that R returns to; playback: None without a path."""

    scene: Scene
    renderer: Renderer
    walker: Walker
    home: Camera
    playback: Playback | None = None
    held: HeldKeys = field(default_factory=HeldKeys)
    times: FrameTimes = field(default_factory=FrameTimes)
    pull: FocusPull = field(default_factory=FocusPull)
    fast: bool = False
    hud: bool = True
    panel: bool = False
    help: bool = False
    atlas: bool = False
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
    def camera(self) -> Camera:
        """What is looked through: the path's camera while it plays."""
        if self.playback is not None and self.playback.playing:
            return self.playback.camera
        return self.walker.camera

    def advance(self, dt: float) -> None:
        """dt: seconds since the last frame. Moving takes the camera over from a path that plays."""
        held = self.held.take(dt)
        if self.playback is not None and self.playback.playing:
            if held:
                self.playback.playing = False
            else:
                self.playback.advance(dt)
                self.walker.place(self.playback.camera)
                return
        self.walker.advance(held, dt, fast=self.fast, ground=self.ground)

    def look(self, right: float, down: float) -> None:
        """Turn, by pixels of the mouse; takes the camera over from a path that plays."""
        if self.playback is not None:
            self.playback.playing = False
        self.walker.look(right, down)

    def seek(self, seconds: float) -> None:
        """Look from the path's camera at `seconds`."""
        if self.playback is not None:
            self.playback.time = seconds
            self.walker.place(self.playback.camera)

    def toggle_path(self) -> None:
        if self.playback is None:
            self.tell("No path: start with --path FILE")
        else:
            self.playback.toggle()

    def change_speed(self, notches: float) -> None:
        self.walker.change_speed(notches)
        self.tell(f"{self.walker.speed:.3g} m/s")

    def toggle_walking(self) -> None:
        self.walker.walking = not self.walker.walking
        self.tell("Walking" if self.walker.walking else "Flying")

    def go_home(self) -> None:
        if self.playback is not None:
            self.playback.playing = False
        self.walker.place(self.home)

    def focus(self) -> None:
        """Turn the lens to what is in the middle of the window."""
        self.pull.start(self.renderer.middle_distance())
        off = self.renderer.settings.dof.mode == "none"
        self.tell(f"Focus at {self.pull.target:.3g} m" + ("; dof is off, see the panel" if off else ""))

    def pull_focus(self, dt: float) -> None:
        """dt: seconds since the last frame."""
        lens = self.renderer.settings.dof
        if lens.autofocus and lens.mode != "none":
            self.pull.start(self.renderer.middle_distance())
        self.pull.advance(lens, dt)

    def represent(self, wanted: Representation | None) -> None:
        self.renderer.placed.representation = wanted
        self.tell(f"Representation: {representation_name(wanted)}")


def representation_name(representation: Representation | None) -> str:
    return "as in the scene" if representation is None else representation.label
