"""Find how coarsely a scene may be drawn before its pictures become worse than a target.

Two ways to draw one scene can be compared by time only if their pictures are equally good. Pictures are judged by FLIP
against a supersampled reference, and a setting is made coarser until FLIP reaches the target.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from depthwalk.colour import srgb8_from_linear
from depthwalk.quality.metrics import FLIP_REACH, bounding_window, flip_map
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Picture

SUPERSAMPLING = 4  # along either axis
TOLERANCE = 0.02  # of FLIP, within which two pictures are equally good
_BISECTIONS = 8


def supersampled(headless: HeadlessRenderer, cameras: Sequence[Camera]) -> list[Picture]:
    """Render reference pictures with many samples per pixel, averaged in linear light.

    Parameters
    ----------
    headless
        A renderer of `SUPERSAMPLING` times the width and height of the returned pictures.
    cameras
        The camera of each picture.

    Returns
    -------
    list[Picture]
        A picture (H, W, 3) uint8, sRGB, for each camera.
    """
    return [_reduced(headless, camera) for camera in cameras]


def _reduced(headless: HeadlessRenderer, camera: Camera) -> Picture:
    headless.draw(View(camera, headless.size), linear=True)
    colour = np.clip(headless.linear_image().colour[..., :3], 0, 1)  # overexposed samples count as white, not as glare
    height, width = (side // SUPERSAMPLING for side in colour.shape[:2])
    return srgb8_from_linear(colour.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3).mean((1, 3)))


def path_flip(
    headless: HeadlessRenderer, moments: Sequence[Sequence[Camera]], references: Sequence[Picture], pool: Executor
) -> float:
    """Measure how far the pictures of a camera path are from their references.

    Parameters
    ----------
    headless
        The renderer that draws the pictures.
    moments
        For each moment, the cameras of successive frames. The last is compared; those before it fill the tile cache, as
        on a walk.
    references
        For each moment, a reference picture (H, W, 3) uint8, sRGB.
    pool
        Processes that compute FLIP while the next frames are drawn.

    Returns
    -------
    float
        The mean of FLIP over all pixels and moments, 0 to 1.
    """
    pending = []
    for cameras, reference in zip(moments, references, strict=True):
        for camera in cameras:
            headless.draw(View(camera, headless.size))
        pending.append(pool.submit(picture_flip, reference, headless.pixels()[..., :3].copy()))
    return float(np.mean([flip.result() for flip in pending]))


def picture_flip(reference: Picture, test: Picture) -> float:
    """Return the mean of FLIP, 0 to 1, over all pixels of a picture against a reference, (H, W, 3) uint8 each."""
    differs = (reference != test).any(axis=-1)
    if not differs.any():
        return 0.0
    window = bounding_window(differs, FLIP_REACH)  # outside, FLIP is 0 but takes as long to compute
    return float(flip_map(reference[window], test[window]).sum(dtype=np.float64) / differs.size)


def coarsened(flip_at: Callable[[float], float], fine: float, coarse: float, target: float) -> tuple[float, float]:
    """Find by bisection the coarsest setting whose FLIP is at most a target, within `TOLERANCE`.

    The bisection does not stop at the first setting that is good enough: where FLIP hardly rises with the setting, the
    last per cent of FLIP may halve the cost.

    Parameters
    ----------
    flip_at
        Returns the FLIP of a setting, 0 to 1. FLIP must rise from `fine`, where it is at most the target, to `coarse`.
    fine, coarse
        Ends of the range of settings to search.
    target
        The greatest FLIP that is good enough, 0 to 1.

    Returns
    -------
    tuple[float, float]
        The setting and its FLIP.
    """
    most = (1 + TOLERANCE) * target
    flip = flip_at(coarse)
    if flip <= most:
        return coarse, flip
    best, best_flip = fine, flip_at(fine)
    for _ in range(_BISECTIONS):
        middle = (best + coarse) / 2
        flip = flip_at(middle)
        if flip > most:
            coarse = middle
        else:
            best, best_flip = middle, flip
    return best, best_flip
