"""Measure the processor time that cull, occlusion test and plan take per frame of a walk, with NumPy and compiled."""

import argparse
import statistics
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from depthwalk.bench.measure import sample_path
from depthwalk.commands.frame_drawing import open_headless
from depthwalk.gpu.timers import PassTimers
from depthwalk.render import kernels
from depthwalk.render.view.view import View
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path

STEPS = "cull", "plan", "occlusion"
SIZE = 1024, 768
WARM = 6  # frames that are not counted


def measure(scene: Path, path: Path, first: int, frames: int) -> dict[str, float]:
    """Return the median over `frames` of each step's processor time on the drawing thread, milliseconds."""
    spent: dict[str, list[float]] = defaultdict(list)
    frame: dict[str, float] = defaultdict(float)

    @contextmanager
    def timed(timers: PassTimers, name: str) -> Iterator[None]:
        start = time.thread_time()
        yield
        frame[name] += (time.thread_time() - start) * 1e3

    PassTimers.measure_cpu = timed  # type: ignore[method-assign,assignment]
    cameras = sample_path(load_path(path), None)[first : first + WARM + frames]
    with open_headless(load_scene(scene), SIZE, None) as headless:
        headless.renderer.remembers = True
        for number, camera in enumerate(cameras):
            frame.clear()
            headless.draw(View(camera, SIZE))
            headless.finish()
            for name in STEPS if number >= WARM else ():
                spent[name].append(frame[name])
    return {name: statistics.median(times) for name, times in spent.items()}


def main() -> None:
    """Print a line for each way to compute."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("path", type=Path)
    parser.add_argument("--first", type=int, default=100, help="first frame of the path")
    parser.add_argument("--frames", type=int, default=40)
    args = parser.parse_args()
    for name in ("numpy", "compiled"):
        kernels.unload()
        if name == "compiled" and not kernels.load():
            parser.error("numba is not installed")
        steps = measure(args.scene, args.path, args.first, args.frames)
        shown = ", ".join(f"{step} {milliseconds:.1f}" for step, milliseconds in steps.items())
        print(f"{name}: {sum(steps.values()):.1f} ms of processor time per frame: {shown}")


if __name__ == "__main__":
    main()
