"""Model the lens of a picture: the circle of confusion at a distance, and views from points all over the lens."""

from collections.abc import Iterator
from dataclasses import replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import DofParams

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # radians; its multiples never line up

# The middle, and 12 points of the unit disc at least 0.47 apart: a Poisson disk.
DISC = (
    *((0.0, 0.0), (-0.2, -0.98), (0.25, 0.96), (0.97, 0.2), (-0.71, 0.68), (-0.88, -0.2), (0.65, -0.66)),
    *((-0.13, 0.57), (0.08, -0.52), (0.41, 0.4), (-0.41, -0.38), (-0.45, 0.2), (0.44, -0.21)),
)
DISC_POINTS = len(DISC)
GAUSSIAN_RADIUS = 6  # taps of the kernel on either side of its middle one
TILE = 16  # pixels along a tile of the picture, whose circles are classified together
# For rays through the depth buffer (`gather`):
SHARP_RADIUS = 0.5  # pixels: a circle of this radius reaches no other pixel's centre
RAY_STRIDE = 4.0  # pixels that a ray moves sideways per step
RAY_DENSITY = 0.5  # rays per square of the radius, in the whole picture
MIN_RAYS = 6  # rays per pixel of it
HIDDEN_WEIGHT = 1e-3  # weight of rays that meet hidden surfaces: these count only where all rays do
LEAST_HALF = 5.0  # pixels: if all circles are this large, they are gathered at half the width and height
LEAST_QUARTER = 8.0  # pixels: likewise, at a quarter of the width and height
NEARLY = 0.75  # of `LEAST_HALF`: circles that a reduced picture still gathers for its neighbours
REDUCED_RAYS = 14  # traced rays per pixel of reduced pictures
EVEN_RAYS = 20  # points of the lens per pixel there, where no ray needs to be traced
MIP_RADIUS = 6.0  # pixels of the reduced picture: radius above which its first mip-map is averaged
HIGHEST_MIP = 2  # of the smallest reduced picture; in the other, circles are hardly larger than `MIP_RADIUS`
LARGEST_BLOCK = 4  # pixels of the whole picture along a pixel of the smallest reduced one
LINEAR_BLUR = 2 / 3  # radius², pixels, of the disc that blurs as linear filtering does: 4 variances of a tent
ONE_SURFACE = 0.5  # pixels of the whole picture: circles in a block that differ by less belong to one surface
EVEN = 0.2  # by how much neighbouring circles may differ, relative to the least, where no ray needs to be traced
LEAST_STEP = 1.0  # pixels that they may always differ by


class TileClass(IntEnum):
    """Enumerate how a tile of the picture is gathered, as bits that can be combined."""

    SHARP = 1  # unchanged
    EVEN = 2
    MIXED = 4
    HALF_EVEN = 8
    HALF = 16
    QUARTER_EVEN = 32
    QUARTER = 64


ALL_EVEN = TileClass.EVEN | TileClass.HALF_EVEN | TileClass.QUARTER_EVEN  # where no ray needs to be traced


def lens_radius(lens: DofParams) -> float:
    """Return the radius of the aperture of `lens`, metres: half of its focal length over its f-number."""
    return lens.focal_length / lens.f_number / 2000


def circle_radius(lens: DofParams, view: View, distance: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the radius of the circle of confusion of points at given distances.

    This is the thin-lens formula of Huang et al. 2008, signed, and measured in pixels of the picture.

    Parameters
    ----------
    lens : the lens; its focus distance is where the radius is 0.
    view : the view, whose size and angle of view determine the size of a pixel.
    distance : distances of the points, metres along the view axis, of any shape; +inf is allowed.

    Returns
    -------
    Pixels, of the shape of `distance`; negative for points nearer than the focus distance.
    """
    return lens_radius(lens) * view.focal_pixels * (1 / lens.focus_distance - 1 / distance)


def largest_radius(lens: DofParams, view: View) -> float:
    """Return the largest circle of confusion, as a radius, that the modes `paper` and `gather` allow.

    Parameters
    ----------
    lens : the lens, whose `max_blur` is that limit relative to the picture's height.
    view : the view of the picture.

    Returns
    -------
    Pixels.
    """
    return lens.max_blur / 200 * view.size[1]


def lens_points(count: int) -> NDArray[np.float64]:
    """Return `count` points (count, 2) spread evenly over the unit disc, its middle last (Vogel 1979)."""
    order = np.arange(count)[::-1]
    radius, angle = np.sqrt(order / max(count - 1, 1)), order * GOLDEN_ANGLE
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


def lens_views(view: View, lens: DofParams) -> Iterator[View]:
    """Yield the views of the frames that make up a picture.

    In the mode `accumulate` these are views from many points of the lens, whose pictures are averaged. Each is sheared
    so that points at the focus distance keep their place in the picture. In all other modes it is `view` alone.

    Parameters
    ----------
    view : the view from the middle of the lens.
    lens : the lens and its mode.

    Yields
    ------
    The views, the one from the middle of the lens last.
    """
    if lens.mode != "accumulate":
        yield view
        return
    for offset in lens_radius(lens) * lens_points(lens.samples):
        camera = view.camera.moved(glm.dvec3(offset @ view.axes[:2]))
        right, up = (offset / lens.focus_distance).tolist()
        yield replace(view, camera=camera, shear=(right, up))


def gaussian() -> NDArray[np.float64]:
    """Return one half of a Gaussian kernel with a standard deviation of 3 pixels; the whole kernel sums to 1.

    Returns
    -------
    (`GAUSSIAN_RADIUS` + 1,) weights, by the distance from the kernel's middle in pixels, 0 first.
    """
    weights = np.exp(-0.5 * (np.arange(GAUSSIAN_RADIUS + 1) / 3) ** 2)
    normalised: NDArray[np.float64] = weights / (2 * weights.sum() - weights[0])
    return normalised
