"""Play a camera path in the window."""

from dataclasses import dataclass

from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath


@dataclass
class Playback:
    """Play a camera path, and hold how far it has been played.

    Attributes
    ----------
    path : the path.
    time : position in the path, seconds from its beginning.
    playing : whether `time` advances.
    loop : whether the path starts again at its end.
    """

    path: CameraPath
    time: float = 0.0
    playing: bool = False
    loop: bool = False

    @property
    def duration(self) -> float:
        """Seconds to the last keyframe."""
        return float(self.path.times[-1])

    @property
    def camera(self) -> Camera:
        """The path's camera at `time`."""
        return self.path.sample(self.time)

    def toggle(self) -> None:
        """Stop the path, or play on, from the beginning if the end was reached."""
        self.playing = not self.playing
        if self.playing and self.time >= self.duration:
            self.time = 0.0

    def advance(self, dt: float) -> None:
        """Play for `dt` seconds. At its end the path starts again if it loops, and stops if not."""
        if not self.playing:
            return
        self.time += dt
        if self.time >= self.duration:
            again = self.loop and self.duration > 0
            self.time = self.time % self.duration if again else self.duration
            self.playing = again
