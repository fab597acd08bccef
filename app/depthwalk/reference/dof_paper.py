"""Mix a sharp and a blurred picture, as the twin of shaders/dof/blur.frag and paper.frag (Huang et al. 2008).

Pictures and circles of confusion are as in `reference.dof`.
"""

import numpy as np

from depthwalk.render.view.lens import GAUSSIAN_RADIUS
from depthwalk.types import Array


def paper(lit: Array, circles: Array, weights: Array, disc: Array, most: float) -> Array:
    """Mix the sharp and a blurred picture by the circles of confusion (Huang et al. 2008, §2.2 and §2.3).

    Parameters
    ----------
    lit
        (H, W, 4) linear, premultiplied picture in which everything is sharp.
    circles
        (H, W) radii, pixels, negative before the focus.
    weights
        (7,) weights of the Gaussian that blurs `lit`, at distances of 0 to 6 pixels.
    disc
        (13, 2) x and y of points of the unit disc. A pixel looks up its surroundings at these points, scaled by its
        circle.
    most
        The radius above which only the blurred picture counts, pixels.

    Returns
    -------
    Array
        (H, W, 4) linear, premultiplied picture.
    """
    height, width = circles.shape
    kernel = np.concatenate([weights[:0:-1], weights])
    blurred = np.asarray(lit, float)
    border = GAUSSIAN_RADIUS, GAUSSIAN_RADIUS
    for axis in (1, 0):
        padded = np.pad(blurred, [border if axis == k else (0, 0) for k in range(3)], mode="edge")
        blurred = np.lib.stride_tricks.sliding_window_view(padded, len(kernel), axis) @ kernel
    y, x = np.mgrid[:height, :width]
    out, total = np.zeros(lit.shape), np.zeros((height, width, 1))
    for right, up in disc:
        beside_x, beside_y = (np.floor(np.abs(circles) * offset + 0.5).astype(int) for offset in (right, up))
        at = np.clip(y + beside_y, 0, height - 1), np.clip(x + beside_x, 0, width - 1)
        blur = np.minimum(np.abs(circles[at]) / most, 1)
        weight = np.where(circles[at] >= circles, 1.0, blur)[..., None]
        out += weight * (lit[at] + blur[..., None] * (blurred[at] - lit[at]))
        total += weight
    return out / total
