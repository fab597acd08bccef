"""Measure the cost of each pass of a frame, alternating between the shaders of several folders.

`python -m tools.pass_times SCENE --distance 3.2 --shaders shaders tried` walks about the target of the scene's camera.
After each pass it waits for the picture and takes the processor time of all threads, which says more than wall-clock
time if other programs share the cores. Folders alternate frame by frame; ratios are medians of those of frames.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from tools.plain_engine.walks import walk_about

from depthwalk.assets.library import SceneLibrary
from depthwalk.errors import InputError
from depthwalk.gpu.failures import GpuError
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.resources import shader_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene

_WARM = 6  # frames that are not counted
Times = dict[str, list[float]]


def measure_frame(headless: HeadlessRenderer, view: View) -> dict[str, float]:
    """Draw a frame; return the milliseconds of processor time of each pass, and of all."""
    found: dict[str, float] = {}
    with headless.device.context:
        finish = headless.device.context.finish
        finish()
        start = last = time.process_time()
        for name in headless.renderer.steps(view, headless.screen):
            finish()
            now = time.process_time()
            found[name] = found.get(name, 0.0) + 1e3 * (now - last)
            last = now
        found["frame"] = 1e3 * (time.process_time() - start)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table: a row for each pass, a column for each folder, milliseconds and ratios to the first's."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--shaders", type=Path, nargs="+", default=[shader_root()], help="folders, in turn")
    parser.add_argument("--distance", type=float, help="from the target, metres; the camera's own if left out")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768), help="of the pictures, pixels")
    parser.add_argument("--as-scene", action="store_true", help="draw as the scene says, not all as depth images")
    args = parser.parse_args(arguments)
    kernels.load()
    try:
        scene = load_scene(args.scene)
    except InputError as error:
        parser.error(str(error))
    if scene.camera is None:
        parser.error(f"{args.scene}: must have a camera")
    for folder in args.shaders:
        if not (folder / "warp").is_dir():
            parser.error(f"{folder}: is no folder of shaders")
    if args.frames <= _WARM:
        parser.error(f"--frames: must be more than {_WARM}")
    if args.distance is not None and args.distance <= 0:
        parser.error("--distance: must be more than 0")
    if min(args.size) < 1:
        parser.error("--size: must be at least 1 1")
    camera, size, kind = scene.camera, tuple(args.size), None if args.as_scene else Representation.DPCI
    own = float(np.linalg.norm(np.subtract(camera.position, camera.target)))
    places = walk_about(camera, own if args.distance is None else args.distance, args.frames)
    library = SceneLibrary(scene.assets)
    with ExitStack() as stack:
        drawn = [stack.enter_context(HeadlessRenderer(scene, library, size, kind)) for _ in args.shaders]
        try:
            times = measure(args.shaders, drawn, [View(place, size) for place in places])
        except GpuError as error:
            parser.error(str(error))
    _print(args.shaders, times)


def measure(folders: Sequence[Path], drawn: Sequence[HeadlessRenderer], views: Sequence[View]) -> list[Times]:
    """Return the times of the counted frames for each folder, whose own renderer in `drawn` draws all `views`.

    Raises GpuError, with a message that begins with the folder, if one of its shaders does not compile.
    """
    times: list[Times] = [{} for _ in folders]
    for folder, headless in zip(folders, drawn, strict=True):
        headless.renderer.remembers = True
        headless.device.shaders = folder
    for number, view in enumerate(views):
        for folder, headless, own in zip(folders, drawn, times, strict=True):
            try:
                found = measure_frame(headless, view)
            except GpuError as error:
                raise GpuError(f"{folder}: {error}") from error
            for name, milliseconds in found.items():
                if number >= _WARM:
                    own.setdefault(name, []).append(milliseconds)
    return times


def _print(folders: Sequence[Path], times: Sequence[Times]) -> None:
    print(f"| pass | {' | '.join(map(str, folders))} |\n|---|{'---|' * len(folders)}")
    for name in sorted(times[0], key=lambda name: -sum(times[0][name])):
        cells = []
        for own in times:
            ratio = statistics.median(new / old for new, old in zip(own[name], times[0][name], strict=False))
            cells.append(f"{statistics.mean(own[name]):.2f} ({ratio:.2f})")
        print(f"| `{name}` | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
