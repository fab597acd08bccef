"""Recording the camera as a path: what was seen, in as few keyframes as show it again."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_documents_path

from depthwalk.files import write_bytes
from depthwalk.limits import MAX_KEYFRAMES
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath, load_path, path_text
from depthwalk.walk.files import save_new

FPS = 30.0  # of the path
LONGEST_STEP = 1.0  # s between frames: while the window is moved or something is loaded, nothing is seen
_SHORTEST_STEP = 0.9 / FPS  # s between samples: nobody sees more of the path
_POSITION = 0.005  # metres
_POSITION_OF_RADIUS = 2e-4  # in scenes so small that this is less


@dataclass(frozen=True)
class Tolerance:
    """How far a path may be off what was recorded. position: metres; angle: of the look and the angle of view, radians,
    the default being a pixel of a thousand at 60°."""

    position: float
    angle: float = np.radians(0.06)


def tolerance_in(radius: float) -> Tolerance:
    """What nobody sees in a scene whose objects are within a sphere of `radius`, metres."""
    return Tolerance(min(_POSITION, _POSITION_OF_RADIUS * radius))


class Recorder:
    """Cameras over time, frame by frame."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._times: list[float] = []
        self._cameras: list[Camera] = []

    @property
    def full(self) -> bool:
        """No path file takes more."""
        return len(self._times) == MAX_KEYFRAMES

    def add(self, dt: float, camera: Camera) -> None:
        """What was seen `dt` seconds after what was added last."""
        self.seconds += min(dt, LONGEST_STEP) if self._times else 0.0
        if not self.full and (not self._times or self.seconds - self._times[-1] >= _SHORTEST_STEP):
            self._times.append(self.seconds)
            self._cameras.append(camera)

    def path(self, tolerance: Tolerance) -> CameraPath:
        """What was recorded; there must be one camera at least."""
        views = np.array([(*camera.position, *camera.target) for camera in self._cameras])
        return thinned(np.array(self._times), views, np.array([camera.fov for camera in self._cameras]), tolerance)


def thinned(
    times: NDArray[np.float64], views: NDArray[np.float64], fovs: NDArray[np.float64], tolerance: Tolerance
) -> CameraPath:
    """A smooth path through some of the n samples that comes as near as `tolerance` to all; arrays as `CameraPath`'s.

    Begins with the first and the last, and adds the worst sample of every span that is off, until none is.
    """
    chosen = np.array(sorted({0, len(times) - 1}))
    while True:
        path = CameraPath(fps=FPS, interpolation="smooth", times=times[chosen], views=views[chosen], fovs=fovs[chosen])
        if len(chosen) == len(times):
            return path
        off = _distance(*path.curve(times), views, fovs, tolerance)
        span = np.searchsorted(chosen, np.arange(len(times)), side="right")
        order = np.lexsort((off, span))
        worst = order[np.flatnonzero(np.diff(span[order], append=-1))]  # the last of each span
        worst = worst[off[worst] > 1]
        if not len(worst):
            return path
        chosen = np.union1d(chosen, worst)


def _distance(
    views: NDArray[np.float64],
    fovs: NDArray[np.float64],
    true_views: NDArray[np.float64],
    true_fovs: NDArray[np.float64],
    tolerance: Tolerance,
) -> NDArray[np.float64]:
    """How far n cameras are off the true ones, in tolerances (n,)."""
    moved = np.linalg.norm(views[:, :3] - true_views[:, :3], axis=1)
    turned = np.linalg.norm(_looks(views) - _looks(true_views), axis=1)  # of small angles
    return np.maximum(moved / tolerance.position, np.maximum(turned, np.abs(fovs - true_fovs)) / tolerance.angle)


def _looks(views: NDArray[np.float64]) -> NDArray[np.float64]:
    looks = views[:, 3:] - views[:, :3]
    return looks / np.maximum(np.linalg.norm(looks, axis=1, keepdims=True), 1e-12)


def save_path(path: CameraPath, folder: Path | None = None) -> Path:
    """Writes a new path file, which is read again before it has its name; returns its path.

    folder: None means the working directory or, where that cannot be written to, the user's documents. Raises OSError
    when no folder takes it, InputError where no path file may hold such a path.
    """

    def write(file: Path) -> None:
        write_bytes(file, path_text(path).encode())
        load_path(file)

    return save_new(".yaml", write, [folder] if folder is not None else [Path.cwd(), user_documents_path()])
