"""Measure frames of the scenes' walks on this machine's GPU: `python -m tools.gpu_table` prints tables for the docs.

Measured for each walk, after warm-up frames: *frame*, wall-clock time from the first call until the picture is
finished; *in a row*, the time of one of many frames drawn without waiting in between, as a window does; *GPU*, the sum
of the timer queries of all passes; *Python*, the processor time of the drawing thread until it has submitted a frame,
without waiting for the GPU, which is the CPU's part of each: Python, NumPy, and the driver within its calls. A second
table lists the passes, a third how far pictures differ from those of another machine.

`--pictures DIR` writes a picture of each walk, as `render` would draw it; `--compare DIR` gives the FLIP against the
pictures of the same names in a folder. A software rasteriser is refused unless `--software` is given: with it, neither
queries nor the drawing thread show what a GPU would take.
"""

import argparse
import os
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from PIL import Image
from tools.vitals import ROOT, Walk, walks

from depthwalk.bench.equal import picture_flip
from depthwalk.bench.measure import sample_path
from depthwalk.commands.frame_drawing import open_headless
from depthwalk.errors import InputError
from depthwalk.files import write_bytes
from depthwalk.pictures import png_bytes
from depthwalk.provenance import commit, machine
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.types import Picture

_WARM = 30  # frames that are not counted: shaders are compiled, assets uploaded, impostors warped
_MILLION = {"objects.0.grid.count": "[1000, 1000]"}  # of the plaza
# Goals for the GPU time of a frame at 1920 × 1080, and for Python's time in each, milliseconds.
_GOALS = {"plaza": 4.0, "plaza, 1,000,000": 16.0, "garden": 6.0}
_PYTHON_GOAL = 3.0


@dataclass(kw_only=True)
class Measured:
    """Hold the times of the frames of one walk, milliseconds.

    Attributes
    ----------
    frame : wall-clock time of each frame until it was finished.
    in_a_row : time of one of the frames that are drawn without waiting.
    python : processor time of the drawing thread in each of the former, without waiting for the GPU.
    passes : time of each pass in each frame whose times are known, including steps of the CPU.
    picture : (H, W, 3) the last frame.
    """

    frame: list[float] = field(default_factory=list)
    in_a_row: float = 0.0
    python: list[float] = field(default_factory=list)
    passes: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    picture: Picture


def measure(headless: HeadlessRenderer, cameras: Sequence[Camera]) -> Measured:
    """Draw the frames of `cameras` twice, waiting for each and for none, after `_WARM` frames of the first of them."""
    headless.renderer.remembers = True
    finish, timers = headless.finish, headless.renderer.timers
    views = [View(camera, headless.size) for camera in cameras]
    for _ in range(_WARM):
        headless.draw(views[0])
    finish()
    found = Measured(picture=np.zeros((0, 0, 3), np.uint8))
    known = timers.frame - 1
    for view in views:
        start, began = time.perf_counter(), time.thread_time() - timers.busy_waiting
        headless.draw(view)
        found.python.append(1e3 * (time.thread_time() - timers.busy_waiting - began))
        finish()
        found.frame.append(1e3 * (time.perf_counter() - start))
        if timers.of_frame > known:
            known = timers.of_frame
            for name, spent in timers.milliseconds.items():
                found.passes[name].append(spent)
    start = time.perf_counter()
    for view in views:
        headless.draw(view)
    finish()
    found.in_a_row = 1e3 * (time.perf_counter() - start) / len(views)
    headless.renderer.remembers = False  # what is reused from earlier frames depends on how they were drawn
    headless.draw(views[-1])
    found.picture = headless.pixels()[..., :3]
    return found


def _gpu(found: Measured, steps: Sequence[str] = ("cull", "upload", "plan", "occlusion")) -> dict[str, float]:
    """Return the median milliseconds of each pass, the longest first, without the `steps` of the CPU."""
    passes = {name: statistics.median(spent) for name, spent in found.passes.items() if name not in steps}
    return dict(sorted(passes.items(), key=lambda item: -item[1]))


def _row(name: str, found: Measured) -> str:
    """Return the row of a walk, with its goals if it has any."""
    p50, p99 = np.percentile(found.frame, (50, 99))
    gpu, python = sum(_gpu(found).values()), statistics.median(found.python)
    goal = f"{_GOALS[name]:g} · {_PYTHON_GOAL:g}" if name in _GOALS else ""
    return f"| {name} | {p50:.2f} · {p99:.2f} | {found.in_a_row:.2f} | {gpu:.2f} | {python:.2f} | {goal} |"


def _compared(name: str, picture: Picture, folder: Path) -> str:
    """Return how far a picture differs from that of the same name in `folder`."""
    file = folder / f"{name}.png"
    try:
        with Image.open(file) as image:
            other = np.asarray(image.convert("RGB"))
    except OSError as error:
        return f"{file}: {error.strerror or error}"
    if other.shape != picture.shape:
        return f"{file}: is of another size"
    return f"FLIP {picture_flip(other, picture):.5f}, {(other != picture).any(axis=-1).mean():.2%} of the pixels differ"


def _walks(extra: Path | None) -> list[tuple[Walk, dict[str, str]]]:
    """Return the walks with the values to replace in their scenes; None: without those of the folder `extra`."""
    found: list[tuple[Walk, dict[str, str]]] = [(walk, {}) for walk in walks(extra)]
    night = Walk(name="night", scene=ROOT / "scenes/night.yaml", path=ROOT / "scenes/paths/night.yaml")
    found.insert(1, (night, {}))
    for walk, _ in found[:]:
        if walk.name == "plaza":
            found.append((Walk(name="plaza, 1,000,000", scene=walk.scene, path=walk.path), _MILLION))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the name of the GPU, then the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, nargs=2, default=(1920, 1080), help="of the pictures, pixels")
    parser.add_argument("--frames", type=int, default=120, help="of each walk")
    parser.add_argument("--only", nargs="+", help="names of the walks, as the table has them")
    parser.add_argument("--pictures", type=Path, help="folder to write the last frame of each walk to")
    parser.add_argument("--compare", type=Path, help="folder of such pictures to compare with")
    parser.add_argument("--software", action="store_true", help="measure a software rasteriser, too")
    args = parser.parse_args(arguments)
    if min(*args.size, args.frames) < 1:
        parser.error("--size and --frames: must be at least 1")
    chosen = _walks(Path(os.environ.get("DEPTHWALK_TEST_SCENES", ROOT.parent / "shared" / "scenes")))
    if unknown := set(args.only or ()) - {walk.name for walk, _ in chosen}:
        parser.error(f"--only: no walk {', '.join(sorted(unknown))}; there are {', '.join(w.name for w, _ in chosen)}")
    kernels.load()
    passes: dict[str, dict[str, float]] = {}
    compared: dict[str, str] = {}
    for walk, changes in chosen:
        if args.only and walk.name not in args.only:
            continue
        try:
            scene, path = load_scene(walk.scene, (), changes), load_path(walk.path)
        except InputError as error:
            parser.error(str(error))
        with open_headless(scene, tuple(args.size), None) as headless:
            if headless.device.software and not args.software:
                parser.error("a software rasteriser draws here; --software measures it all the same")
            if not passes:
                about, info = machine(), headless.device.context.info
                print(f"{info['GL_RENDERER']}, {info['GL_VERSION']}")
                print(f"{about.processor}, {about.cores} cores; {about.system}")
                print(f"{datetime.now(UTC).date()}, {commit() or 'installed'}, {args.size[0]} × {args.size[1]}\n")
                print("| walk | frame, ms: median · 99 % | in a row, ms | GPU, ms | Python, ms | goals: GPU · Python |")
                print("|---|---|---|---|---|---|")
            found = measure(headless, sample_path(path, None)[: args.frames])
        print(_row(walk.name, found), flush=True)
        passes[walk.name] = _gpu(found)
        if args.pictures is not None:
            args.pictures.mkdir(parents=True, exist_ok=True)
            write_bytes(args.pictures / f"{walk.name}.png", png_bytes(found.picture))
        if args.compare is not None:
            compared[walk.name] = _compared(walk.name, found.picture, args.compare)
    print("\n| walk | passes, ms |\n|---|---|")
    for name, spent in passes.items():
        print(f"| {name} | {', '.join(f'{pass_} {time_:.2f}' for pass_, time_ in spent.items() if time_ >= 0.005)} |")
    if compared:
        print("\n| walk | against the picture of another machine |\n|---|---|")
        for name, difference in compared.items():
            print(f"| {name} | {difference} |")


if __name__ == "__main__":
    main(sys.argv[1:])
