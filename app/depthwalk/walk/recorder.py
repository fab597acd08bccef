"""Record the camera as a path with few keyframes that is close to every recorded camera."""

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
LONGEST_STEP = 1.0  # s between frames; longer pauses (a moved window) are shortened to this
_SHORTEST_STEP = 0.9 / FPS  # s between samples: the path's frames show no more
_POSITION = 0.005  # metres by which a path may be off
_POSITION_OF_RADIUS = 2e-4  # the same, in radii of the scene


@dataclass(frozen=True)
class Tolerance:
    """Set how far a path may differ from the recording.

    Attributes
    ----------
    position
        Greatest distance between positions, metres.
    angle
        Greatest angle between viewing directions, and greatest difference between fields of view, radians. The default
        is the angle of a pixel when 1000 pixels show 60°.
    """

    position: float
    angle: float = np.radians(0.06)


def tolerance_in(radius: float) -> Tolerance:
    """Return an invisible tolerance in a scene whose objects are within a sphere of `radius`, metres."""
    return Tolerance(min(_POSITION, _POSITION_OF_RADIUS * radius))


class Recorder:
    """Collect the cameras of a walk frame by frame, and turn them into a path.

    Attributes
    ----------
    seconds
        Length of the recording, seconds.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._times: list[float] = []
        self._cameras: list[Camera] = []

    @property
    def full(self) -> bool:
        """Return whether the recording has as many cameras as a path file may have keyframes; more are ignored."""
        return len(self._times) == MAX_KEYFRAMES

    def add(self, dt: float, camera: Camera) -> None:
        """Add the `camera` of a frame, drawn `dt` seconds after the last one; at most LONGEST_STEP of this counts.

        Cameras that follow faster than the frames of the path are skipped.
        """
        self.seconds += min(dt, LONGEST_STEP) if self._times else 0.0
        if not self.full and (not self._times or self.seconds - self._times[-1] >= _SHORTEST_STEP):
            self._times.append(self.seconds)
            self._cameras.append(camera)

    def path(self, tolerance: Tolerance) -> CameraPath:
        """Return a path that differs from every recorded camera by at most `tolerance`.

        At least one camera must have been added.
        """
        views = np.array([(*camera.position, *camera.target) for camera in self._cameras])
        return thinned(np.array(self._times), views, np.array([camera.fov for camera in self._cameras]), tolerance)


def thinned(
    times: NDArray[np.float64], views: NDArray[np.float64], fovs: NDArray[np.float64], tolerance: Tolerance
) -> CameraPath:
    """Return a smooth path through few of n recorded cameras that differs from all of them by at most a tolerance.

    Cameras are added where the path is farthest off, until it is good enough.

    Parameters
    ----------
    times
        (n,) times of the cameras, seconds, increasing.
    views
        (n, 6) position and target of each camera, metres, world.
    fovs
        (n,) vertical fields of view, radians.
    tolerance
        How far the path may be off.

    Returns
    -------
    CameraPath
        The path, whose keyframes are the chosen cameras.
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
    """Return how far n cameras are off the true ones, (n,), in multiples of the tolerance."""
    moved = np.linalg.norm(views[:, :3] - true_views[:, :3], axis=1)
    turned = np.linalg.norm(_looks(views) - _looks(true_views), axis=1)  # equals the angle if that is small
    turned = np.maximum(turned, np.abs(fovs - true_fovs))
    off: NDArray[np.float64] = np.maximum(moved / tolerance.position, turned / tolerance.angle)
    return off


def _looks(views: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit directions of cameras, (n, 3)."""
    looks: NDArray[np.float64] = views[:, 3:] - views[:, :3]
    looks /= np.maximum(np.linalg.norm(looks, axis=1, keepdims=True), 1e-12)
    return looks


def save_path(path: CameraPath, folder: Path | None = None) -> Path:
    """Write a camera path to a new file; it is read back before it gets its name.

    Parameters
    ----------
    path
        The path to write.
    folder
        The folder to write to; None is the working directory or, if that cannot be written to, the user's documents.

    Returns
    -------
    Path
        The new file.

    Raises
    ------
    OSError
        If no folder can be written to.
    InputError
        If a path file may not hold such a path.
    """

    def write(file: Path) -> None:
        write_bytes(file, path_text(path).encode())
        load_path(file)

    return save_new(".yaml", write, [folder] if folder is not None else [Path.cwd(), user_documents_path()])
