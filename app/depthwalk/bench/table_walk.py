"""Choose the frames of a camera path, and the objects of a scene, that the table of docs/bench.md measures."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene

SETTLING = 30  # frames before each moment's timed ones, so that cached impostors are as old as on a walk


@dataclass(frozen=True)
class Walk:
    """Choose which frames of a camera path are timed and compared.

    Attributes
    ----------
    moments
        The cameras of each moment: first those of `SETTLING` frames that lead up to it, then those of the frames to be
        timed. The first of the latter is also compared with a reference picture.
    seconds
        Time to spend on timing each way to draw the objects, seconds.
    size
        Width and height of the pictures, pixels.
    """

    moments: tuple[tuple[Camera, ...], ...]
    seconds: float
    size: tuple[int, int]

    @classmethod
    def along(cls, path: CameraPath, moments: int, run: int, seconds: float, size: tuple[int, int]) -> Self:
        """Spread moments evenly over a camera path.

        Parameters
        ----------
        path
            The camera path.
        moments
            Number of moments.
        run
            Number of successive frames that are timed at each moment.
        seconds
            Time to spend on timing each way to draw the objects, seconds.
        size
            Width and height of the pictures, pixels.

        Returns
        -------
        Self
            The walk along the moments.

        Raises
        ------
        InputError
            For a path with too few frames.
        """
        times = path.frames()
        last = len(times) - SETTLING - run
        if last < 0:
            raise InputError(f"--path: has {len(times)} frames, but each moment needs {SETTLING + run}")
        starts = np.linspace(0, last, moments).astype(int).tolist()
        cameras = [tuple(path.sample(time) for time in times[k : k + SETTLING + run]) for k in starts]
        return cls(tuple(cameras), seconds, size)

    @property
    def compared(self) -> list[Camera]:
        """Return for each moment the camera of the frame that is compared with a reference picture."""
        return [moment[SETTLING] for moment in self.moments]

    @property
    def approaches(self) -> list[tuple[Camera, ...]]:
        """Return for each moment the cameras that lead up to the compared frame, with its own as the last."""
        return [moment[: SETTLING + 1] for moment in self.moments]


def most_seen(scene: Scene, walk: Walk, count: int) -> NDArray[np.intp]:
    """Choose the objects that are in view most often on a walk, since objects out of view cost next to nothing.

    Parameters
    ----------
    scene
        The scene.
    walk
        The walk, whose compared frames count.
    count
        Number of objects to choose.

    Returns
    -------
    numpy.ndarray
        (count,) ascending numbers of the objects whose positions are in view at the greatest number of moments;
        among equals, the nearest.
    """
    position = scene.objects.position
    places, seen = Bounds(position, np.zeros(len(position))), np.zeros(len(position), np.int64)
    nearest = np.full(len(position), np.inf)
    for camera in walk.compared:
        view = View(camera, walk.size)
        seen[places.visible(view)[0]] += 1
        nearest = np.minimum(nearest, np.linalg.norm(position - view.position, axis=1))
    return np.sort(np.lexsort((nearest, -seen))[:count])
