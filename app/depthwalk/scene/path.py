"""Read, write and sample camera paths.

A path file holds `version: 1`, `fps`, `interpolation` and `keyframes`, each the camera at one moment.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from depthwalk.errors import InputError
from depthwalk.limits import MAX_FRAMES, MAX_KEYFRAMES
from depthwalk.params import param
from depthwalk.scene.arrays import Camera
from depthwalk.scene.document import Loc, read_document
from depthwalk.scene.environment import CameraParams
from depthwalk.scene.fields import FileParams, Version
from depthwalk.scene.validate import Source, check_model, raise_all

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

MIN_GAP = 1e-3  # seconds between keyframes
_ROUNDING = 1e-9  # a frame's time k / fps may miss its keyframe by this


class KeyframeParams(CameraParams):
    """Describe the camera at one moment."""

    time: float = param(..., "Time of the keyframe", unit="s", ge=0, le=1e6)


class PathFile(FileParams):
    """Describe a path file as it is written."""

    version: Version = param(..., "Version of the file format")
    fps: float = param(30.0, "Frames per second", unit="1/s", ge=0.001, le=1000)
    interpolation: Literal["smooth", "step"] = param(
        "smooth", "Between keyframes: a smooth curve, or the camera of the previous keyframe until the next"
    )
    keyframes: Annotated[list[KeyframeParams], Field(min_length=1, max_length=MAX_KEYFRAMES)] = param(
        ..., "The camera at different times, in order"
    )


@dataclass(frozen=True, kw_only=True)
class CameraPath:
    """Hold a camera that moves over time, as k keyframes.

    Attributes
    ----------
    fps
        Frames per second.
    interpolation
        "smooth", a curve through the keyframes, or "step", which holds each keyframe until the next.
    times
        (k,) float64, seconds, ascending: the time of each keyframe.
    views
        (k, 6) float64, position and target of the camera at each keyframe, metres, world.
    fovs
        (k,) float64, vertical field of view at each keyframe, radians.
    """

    fps: float
    interpolation: Literal["smooth", "step"]
    times: NDArray[np.float64]
    views: NDArray[np.float64]
    fovs: NDArray[np.float64]

    def frames(self) -> list[float]:
        """Return the times of the frames, seconds: frame k at k / fps, from 0 to the last keyframe."""
        return [k / self.fps for k in range(_frame_count(self.fps, self.times[-1]))]

    def sample(self, time: float) -> Camera:
        """Return the camera at `time`, seconds. It stands still before the first and after the last keyframe.

        The scene's animations run along with the path: its `time` is theirs.
        """
        k = int(np.searchsorted(self.times, time + _ROUNDING, side="right")) - 1
        last = len(self.times) - 1
        if self.interpolation == "step" or k < 0 or k >= last:
            k = min(max(k, 0), last)
            view, fov = self.views[k], float(self.fovs[k])
        else:
            view, fov = self._view_curve(time), float(self._fov_curve(time))
        x, y, z, u, v, w = (float(value) for value in view)
        return Camera((x, y, z), (u, v, w), fov, time)

    def curve(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Sample a smooth path of at least two keyframes at many times at once.

        Parameters
        ----------
        times
            (n,) seconds, none before the first or after the last keyframe.

        Returns
        -------
        tuple
            Positions and targets (n, 6) float64, metres, world; and vertical fields of view (n,) float64, radians.
        """
        return self._view_curve(times), self._fov_curve(times)

    @cached_property
    def _view_curve(self) -> "CubicHermiteSpline":
        """The Catmull–Rom spline for uneven times: continuous velocity, tangents by second-order differences."""
        from scipy.interpolate import CubicHermiteSpline  # takes half a second, and only smooth paths need it

        return CubicHermiteSpline(self.times, self.views, np.gradient(self.views, self.times, axis=0))

    @cached_property
    def _fov_curve(self) -> "PchipInterpolator":
        """A curve that is monotone between keyframes: an overshoot could leave the range of a lens."""
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.times, self.fovs)


def load_path(path: Path) -> CameraPath:
    """Read the camera path in the file `path`. Raises InputError with one located line per mistake."""
    document = read_document(Path(path))
    if document.holds(("assets",)):
        raise InputError(f"{path}: is a scene file, not a camera path")
    file, source = check_model(document, PathFile)
    times = np.array([key.time for key in file.keyframes])
    raise_all(order_errors(times, ("keyframes",), source))
    if (count := _frame_count(file.fps, times[-1])) > MAX_FRAMES:
        raise source.error(("fps",), f"the path has {count} frames; the limit is {MAX_FRAMES}")
    views = np.array([(*key.position, *key.target) for key in file.keyframes])
    fovs = np.radians([key.fov for key in file.keyframes])
    return CameraPath(fps=file.fps, interpolation=file.interpolation, times=times, views=views, fovs=fovs)


def order_errors(times: NDArray[np.float64], loc: Loc, source: Source) -> list[InputError]:
    """Return an error for each of the keyframes at `times` (k,), seconds, that is not later than the one before.

    Parameters
    ----------
    times
        (k,) seconds.
    loc
        Location of the list of keyframes in the file.
    source
        Origin of the values, to locate errors.
    """
    late = (np.flatnonzero(np.diff(times) < MIN_GAP) + 1).tolist()
    return [
        source.error((*loc, number, "time"), f"must be later than the keyframe before ({times[number - 1]:g} s)")
        for number in late
    ]


def is_path_file(path: Path) -> bool:
    """Return whether the file `path` is a camera path rather than a scene.

    Raises InputError if it cannot be read as YAML.
    """
    return read_document(path).holds(("keyframes",))


def path_text(path: CameraPath) -> str:
    """Return the text of a path file that `load_path` reads back as `path`; numbers have nine digits."""
    header = f"version: 1\nfps: {_number(path.fps)}\ninterpolation: {path.interpolation}\nkeyframes:\n"
    keys = zip(path.times, path.views[:, :3], path.views[:, 3:], np.degrees(path.fovs), strict=True)
    return header + "".join(
        f"  - {{time: {_number(time)}, position: {_vector(eye)}, target: {_vector(target)}, fov: {_number(fov)}}}\n"
        for time, eye, target, fov in keys
    )


def _vector(values: NDArray[np.float64]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    return f"{value:.9g}"


def _frame_count(fps: float, last: float) -> int:
    return math.floor(last * fps + _ROUNDING) + 1
