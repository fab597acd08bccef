"""Time several ways to draw one object on a walk past it, and measure the quality of their pictures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.bench.equal import supersampled
from depthwalk.bench.measure import Run, measure
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Picture

FOV = math.radians(45)  # vertical
STEP = 1.4 / 30  # metres from frame to frame: a walk, at 30 frames a second
FRAMES, WARMUP = 24, 5
FILLED = 0.8  # of the picture's height, filled by a nearby object


@dataclass(frozen=True, kw_only=True)
class Quality:
    """Hold how close a picture is to the reference of 16 samples per pixel, where either shows the object.

    Attributes
    ----------
    psnr
        Decibels.
    flip
        Mean FLIP, 0 to 1.
    """

    psnr: float
    flip: float

    def __str__(self) -> str:
        """Return both as text."""
        return f"{self.psnr:.1f} dB, {self.flip:.4f}"


def near_distance(height: float) -> float:
    """Return the distance from which an object of a given height fills `FILLED` of the picture, both in metres."""
    return height / FILLED / 2 / math.tan(FOV / 2)


def past(centre: Sequence[float], distance: float) -> list[Camera]:
    """Return the cameras of a walk past an object.

    Parameters
    ----------
    centre
        (3,) the point that the viewer looks at, metres, world, at half the object's height.
    distance
        Smallest distance of the viewer, metres.

    Returns
    -------
    list[Camera]
        `FRAMES` cameras on a line along x; the middle one is nearest.
    """
    x, y, z = centre
    along = (np.arange(FRAMES) - FRAMES // 2) * STEP
    return [Camera((x + float(offset), y, z + distance), (x, y, z), FOV) for offset in along]


def walk_past(drawn: Mapping[str, HeadlessRenderer], centre: Sequence[float], distance: float) -> dict[str, Run]:
    """Time each way to draw an object on a walk past it, alternating between them; see `past`."""
    runs = measure(drawn, past(centre, distance), WARMUP, lambda: None)
    return {run.representation: run for run in runs}


def truth(headless: HeadlessRenderer, centre: Sequence[float], distance: float) -> Picture:
    """Return the reference picture from the middle of a walk; `headless` is `equal.SUPERSAMPLING` times as large."""
    (picture,) = supersampled(headless, [past(centre, distance)[FRAMES // 2]])
    return picture


def quality(headless: HeadlessRenderer, reference: Picture, centre: Sequence[float], distance: float) -> Quality:
    """Compare the picture from the middle of a walk with the reference; see `past`."""
    return compared(headless, reference, past(centre, distance)[FRAMES // 2])


def compared(headless: HeadlessRenderer, reference: Picture, camera: Camera) -> Quality:
    """Compare a picture with the reference, (H, W, 3) uint8, whose first pixel shows the background."""
    headless.draw(View(camera, headless.size))
    picture = np.ascontiguousarray(headless.pixels()[..., :3])
    backdrop = reference[0, 0]
    shown = (reference != backdrop).any(-1) | (picture != backdrop).any(-1)
    return Quality(psnr=psnr(reference, picture, shown), flip=mean_flip(reference, picture, shown))
