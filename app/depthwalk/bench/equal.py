"""Equal pictures: how coarse each of two ways to draw a scene may be until both differ alike from a better picture."""

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
    """Pictures (H, W, 3), sRGB, by a renderer of `SUPERSAMPLING` times that size, averaged in linear light."""
    return [_reduced(headless, camera) for camera in cameras]


def _reduced(headless: HeadlessRenderer, camera: Camera) -> Picture:
    headless.draw(View(camera, headless.size))
    colour = np.clip(headless.linear_image().colour[..., :3], 0, 1)  # what is too bright is white, not a glare
    height, width = (side // SUPERSAMPLING for side in colour.shape[:2])
    return srgb8_from_linear(colour.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3).mean((1, 3)))


def path_flip(
    headless: HeadlessRenderer, moments: Sequence[Sequence[Camera]], references: Sequence[Picture], pool: Executor
) -> float:
    """Mean FLIP, over the whole of all pictures, of the last frame of each moment against its reference."""
    pending = []
    for cameras, reference in zip(moments, references, strict=True):
        for camera in cameras:
            headless.draw(View(camera, headless.size))
        pending.append(pool.submit(_picture_flip, reference, headless.pixels()[..., :3].copy()))
    return float(np.mean([each.result() for each in pending]))


def _picture_flip(reference: Picture, test: Picture) -> float:
    differs = (reference != test).any(axis=-1)
    if not differs.any():
        return 0.0
    window = bounding_window(differs, FLIP_REACH)  # beyond it FLIP is 0, and takes as long as here
    return float(flip_map(reference[window], test[window]).sum(dtype=np.float64) / differs.size)


def coarsened(flip_at: Callable[[float], float], fine: float, coarse: float, target: float) -> tuple[float, float]:
    """The coarsest setting between `fine` and `coarse` whose FLIP is the `target`, within `TOLERANCE`, and its FLIP.

    flip_at: rises; `fine` itself is at most the target. Where FLIP hardly rises, the last percent may halve the cost,
    so the bisection goes on after the first setting that would do.
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
