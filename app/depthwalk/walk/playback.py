"""Play a camera path in the window."""

from dataclasses import dataclass

from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath


@dataclass
class Playback:
    """Play a camera path, and hold the position in it.

    Attributes
    ----------
    path
        The path.
    time
        Position in the path, seconds from its beginning.
    playing
        Whether `advance` moves along the path.
    loop
        Whether the path starts again at its end.
    """

    path: CameraPath
    time: float = 0.0
    playing: bool = False
    loop: bool = False

    @property
    def duration(self) -> float:
        """Return the time of the path's last keyframe, seconds from its beginning."""
        return float(self.path.times[-1])

    @property
    def camera(self) -> Camera:
        """Return the camera of the path at `time`."""
        return self.path.sample(self.time)

    def toggle(self) -> None:
        """Stop the path, or resume it; a path that has reached its end plays from the beginning."""
        self.playing = not self.playing
        if self.playing and self.time >= self.duration:
            self.time = 0.0

    def advance(self, dt: float) -> None:
        """Play the path for `dt` more seconds. At its end it starts again if `loop` is set, and stops if not."""
        if not self.playing:
            return
        self.time += dt
        if self.time >= self.duration:
            again = self.loop and self.duration > 0
            self.time = self.time % self.duration if again else self.duration
            self.playing = again
