"""Measure how close depth of field comes to the mean of many frames.

The measurements are for `depthwalk quality` and docs/depth-of-field.md.

A scene is seen by its camera through a fast lens, focused on the middle of the picture. Many points on the lens also
smooth edges that are out of focus by a quarter of a pixel, which no filter of a single frame can do; so all modes are
compared with the same anti-aliasing. Pixels in focus are compared without it, so that no averaging hides changes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.gpu.timers import frame_clock
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.quality.rows import Row, side_by_side
from depthwalk.reference.dof_tiles import ranges
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.lens import SHARP_RADIUS, TILE, circle_radius, largest_radius
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import FARTHEST_FOCUS, NEAREST_FOCUS, DofParams
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture

TRUTH = 256  # points of the lens
REPEATS = 5  # of each timing, of which the median counts
FOCAL_LENGTH, F_NUMBER = 85.0, 1.2  # mm; over the diameter
SMOOTHED: Any = "ssaa"  # `render.aa` of pictures that are compared with many frames
OURS = "gather"
MODES = "none", "paper", OURS, "accumulate"
LEAST_PSNR = 32.0  # dB
MOST_CHANGED = 1  # of 255, in focus
MOST_TIME = 1 / 20  # of the time of `TRUTH` frames


@dataclass(frozen=True)
class TimedPicture:
    """Hold a picture and the time of its frame.

    Attributes
    ----------
    picture
        (H, W, 3) uint8, sRGB.
    seconds
        Seconds: processor time of all cores with software OpenGL, otherwise wall-clock time.
    """

    picture: Picture
    seconds: float


def examine(scenes: Sequence[Scene], size: tuple[int, int], report: Report) -> Iterator[Row]:
    """Compare each mode of depth of field with the last of `MODES`, the mean of many frames; an `Examine`."""
    for scene in scenes:
        lens = scene.render.dof
        lens.focal_length, lens.f_number = FOCAL_LENGTH, F_NUMBER
        scene.render.output.dither = False  # what changes shall be what the lens changes
        with HeadlessRenderer(scene, SceneLibrary(scene.assets, report), size) as headless:
            view = View(scene.camera or headless.frame_all(), size)
            scene.render.aa = "none"
            still = _focus(headless, view, lens)
            single = {mode: _draw(headless, view, lens, mode, scene.path.stem, report) for mode in MODES[:-1]}
            scene.render.aa = SMOOTHED
            shots = {mode: _draw(headless, view, lens, mode, scene.path.stem, report) for mode in MODES}
        changed = {mode: _changed(single["none"].picture, shot.picture, still) for mode, shot in single.items()}
        yield from _rows(scene.path.stem, shots, changed)


def _focus(headless: HeadlessRenderer, view: View, lens: DofParams) -> NDArray[np.bool_]:
    """Focus on the middle, and return the pixels (H, W) in focus that no blur in front of them reaches."""
    lens.mode = "none"
    headless.draw(view)
    distance = headless.distances()
    height, width = distance.shape
    lens.focus_distance = float(np.clip(distance[height // 2, width // 2], NEAREST_FOCUS, FARTHEST_FOCUS))
    largest = largest_radius(lens, view)
    circles = np.clip(circle_radius(lens, view, distance), -largest, largest)  # as in the shaders
    return np.asarray((np.abs(circles) < SHARP_RADIUS) & (ranges(circles[::-1], TILE)[0, ::-1] > -SHARP_RADIUS))


def _draw(
    headless: HeadlessRenderer, view: View, lens: DofParams, mode: str, name: str, report: Report
) -> TimedPicture:
    accumulates = mode == "accumulate"
    report(name, f"depth of field: {f'{TRUTH} points of the lens' if accumulates else mode}")
    few, lens.samples, lens.mode = lens.samples, TRUTH if accumulates else lens.samples, mode  # type: ignore[assignment]
    clock = frame_clock(headless.device)
    times = []
    for _ in range(1 if accumulates else REPEATS):
        start = clock()
        headless.draw(view)
        picture = np.ascontiguousarray(headless.pixels()[..., :3])
        times.append(clock() - start)
    lens.samples = few
    return TimedPicture(picture, median(times))


def _changed(sharp: Picture, picture: Picture, still: NDArray[np.bool_]) -> float:
    """Return the largest error, of 255, among the pixels `still` (H, W)."""
    return float(np.abs(picture.astype(int) - sharp)[still].max(initial=0))


def _rows(subject: str, shots: dict[str, TimedPicture], changed: dict[str, float]) -> Iterator[Row]:
    truth = shots["accumulate"]
    everywhere = np.ones(truth.picture.shape[:2], bool)
    for mode, shot in shots.items():
        if shot is truth:
            continue
        asked, picture = mode == OURS, shot.picture
        details = {"FLIP": mean_flip(truth.picture, picture, everywhere), "ms": shot.seconds * 1e3}
        panels = side_by_side(mode, picture, truth.picture)
        near = psnr(truth.picture, picture, everywhere)
        cost = shot.seconds / truth.seconds
        yield Row(
            subject=subject,
            name=f"{mode}, dB",
            measured=near,
            goal=LEAST_PSNR if asked else None,
            details=details,
            pictures=panels,
        )
        if mode != "none":
            most = (MOST_CHANGED, MOST_TIME) if asked else (None, None)
            yield Row(
                subject=subject,
                name=f"{mode}: changed in focus, of 255",
                measured=changed[mode],
                goal=most[0],
                more_is_better=False,
                digits=0,
            )
            yield Row(
                subject=subject,
                name=f"{mode}: time, × {TRUTH} frames",
                measured=cost,
                goal=most[1],
                more_is_better=False,
                digits=4,
            )
