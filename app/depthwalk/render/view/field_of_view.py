"""Make views with a wider angle or fewer pixels, and test which points lie within a view."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask

LEVEL_MARGIN = 1 / 3  # margin above and below, as a part of that at the sides


def widened(view: View, margin: float) -> View:
    """Return `view` with a margin on every side; the pixels that both have in common are the same.

    Parameters
    ----------
    view : the view of the window.
    margin : part of its width that is added on the left and on the right. Above and below, `LEVEL_MARGIN` of that part
        of its height is added, as viewers turn more than they look up and down.

    Returns
    -------
    The wider view, larger by whole pixels.
    """
    width, height = view.size
    size = width + 2 * round(margin * width), height + 2 * round(LEVEL_MARGIN * margin * height)
    fov = 2 * math.atan(math.tan(view.camera.fov / 2) * size[1] / height)
    return replace(view, camera=replace(view.camera, fov=fov), size=size)


def reduced(view: View, scale: float) -> View:
    """Return `view` with fewer pixels, but with the same levels of detail.

    Parameters
    ----------
    view : the view of the whole picture.
    scale : factor for the number of pixels along either axis, 0 to 1.

    Returns
    -------
    The view, of at least one pixel.
    """
    size = max(round(scale * view.size[0]), 1), max(round(scale * view.size[1]), 1)
    return replace(view, size=size, scale=view.scale * size[1] / view.size[1])


def shows(view: View, points: Array, wider: float = 1.0) -> Mask:
    """Return which points lie within a picture.

    Parameters
    ----------
    view : the view of the picture.
    points : (…, 3), right, up and ahead of its camera, metres.
    wider : the factor by which the picture is widened, and heightened, for the test.

    Returns
    -------
    (…), whether each lies within.
    """
    within: Mask = np.abs(points[..., :2]) <= points[..., 2:] * (wider * np.array(view.half_extent))
    return np.logical_and(within[..., 0], within[..., 1])


def spread_rays(view: View, columns: int, rows: int) -> NDArray[np.float64]:
    """Return rays that are spread evenly over a picture.

    Parameters
    ----------
    view : the view of the picture.
    columns, rows : numbers of rays along its edges.

    Returns
    -------
    (rows · columns, 3), world, one metre long along the view axis, lowest row first.
    """
    x, y = np.meshgrid(*(2 * (np.arange(count) + 0.5) / count - 1 for count in (columns, rows)))
    return np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) @ view.ray_from_screen.T
