"""Compare ways to draw a planar depth image: Table 2 of Liu, Liu and Wu 2007.

`python -m tools.rivals` draws a relief of 512 × 512 texels that fills much of 1024 × 768 pixels, from several views and
in every representation that a relief has. The camera moves from frame to frame and nothing is reused, so each impostor
is re-warped. All ways alternate, frame by frame. Pictures are compared with the true displaced surface, all of its
triangles drawn with 16 samples per pixel.

Times are processor time of all threads: if a software rasteriser shares the cores with other programs, wall-clock time
says little.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tools.make_reliefs import RELIEFS, make_relief

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.equal import SUPERSAMPLING, supersampled
from depthwalk.gpu.timers import PassTimers
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import HEIGHT_FIELDS, Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.types import Mask, Picture

VIEWS = {"front": 8.0, "aside": 40.0, "flat": 65.0}  # degrees from the picture's axis
_AWAY, _FOV = 1.2, 45.0  # metres from a picture of a square metre; degrees
_SWAY = 0.4  # degrees from frame to frame
WARM = 2  # frames of each way that are not counted
_SCENE = """version: 1
assets:
  relief: {{depth_image: {{depth: depth.png, colour: colour.png, size: [1, 1], range: {range}, method: paper}}}}
objects: [{{asset: relief}}]
environment: {{sun: {{direction: [0.6, -0.5, -0.6], intensity: 0.9}}, ambient: {{intensity: 0.25}}}}
render: {{aa: none, {render}}}
"""


@dataclass(frozen=True)
class Way:
    """Describe how the relief is drawn: representation, timed passes, and settings as YAML."""

    representation: Representation
    passes: tuple[str, ...]
    render: str = "preset: default"


WAYS = {
    "dpci": Way(Representation.DPCI, ("warp", "composite")),
    "dpci, preset paper": Way(Representation.DPCI, ("warp", "composite"), "preset: paper"),
    **{kind.label: Way(kind, (kind.name.lower(),)) for kind in (Representation.DMESH, *HEIGHT_FIELDS)},
    "relief, 100 steps": Way(Representation.RELIEF, ("relief",), "relief: {linear_steps: 100}"),
}
# Times as long as the warp: 68.14 frames a second / theirs; of bar textures the paper's text says about 2.
PUBLISHED = {"relief": 11.6, "distance": 3.7, "dmesh": 3.9, "bar-texture": 2.0}


@dataclass
class Times:
    """Hold the times of one way in one view, milliseconds of processor time per frame; `clock`: wall-clock time."""

    frame: list[float] = field(default_factory=list)
    passes: list[float] = field(default_factory=list)
    clock: list[float] = field(default_factory=list)


def write_scenes(folder: Path, name: str, side: int, depth: float) -> dict[str, Scene]:
    """Write a relief `side` texels wide and `depth` metres deep; return its scene by the settings of `WAYS`."""
    for kind, image in zip(("depth", "colour"), make_relief(RELIEFS[name], side), strict=True):
        image.save(folder / f"{kind}.png")
    scenes, file = {}, folder / "scene.yaml"
    for render in dict.fromkeys(way.render for way in WAYS.values()):
        file.write_text(_SCENE.format(range=depth, render=render), encoding="utf-8")
        scenes[render] = load_scene(file)
    return scenes


def camera_at(degrees: float) -> Camera:
    """Return the camera that looks at the relief's centre from `degrees` to its side."""
    turn = np.radians(degrees)
    middle = np.array([0.0, 0.5, -0.1])
    place = middle + _AWAY * np.array([np.sin(turn), 0.12, np.cos(turn)])
    return Camera(tuple(place.tolist()), tuple(middle.tolist()), float(np.radians(_FOV)))


def time_ways(
    ways: Mapping[str, HeadlessRenderer], passes: Mapping[str, Sequence[str]], cameras: Sequence[Camera]
) -> dict[str, Times]:
    """Return the times of all ways, which alternate frame by frame; the first `WARM` frames are not counted.

    passes: by way, the passes that are timed in addition to the whole frame.
    """
    times: dict[str, Times] = defaultdict(Times)
    spent: dict[str, float] = defaultdict(float)

    @contextmanager
    def timed(timers: PassTimers, name: str) -> Iterator[None]:
        start = time.process_time()
        yield
        timers._context.finish()
        spent[name] += 1e3 * (time.process_time() - start)

    before, PassTimers.measure = PassTimers.measure, timed  # type: ignore[method-assign,assignment]
    try:
        for number, camera in enumerate(cameras):
            for name, headless in ways.items():
                spent.clear()
                clock, start = time.perf_counter(), time.process_time()
                headless.draw(View(camera, headless.size))
                headless.finish()
                if number >= WARM:
                    times[name].frame.append(1e3 * (time.process_time() - start))
                    times[name].clock.append(1e3 * (time.perf_counter() - clock))
                    times[name].passes.append(sum(spent[part] for part in passes[name]))
    finally:
        PassTimers.measure = before  # type: ignore[method-assign]
    return times


def picture(headless: HeadlessRenderer, camera: Camera) -> tuple[Picture, Mask]:
    """Return a picture (H, W, 3) and which of its pixels show the relief."""
    headless.draw(View(camera, headless.size))
    shown = headless.pixels()[..., :3].copy()
    headless.draw(View(camera, headless.size), transparent=True)
    return shown, headless.pixels()[..., 3] > 0


def ratio(times: Sequence[float], base: Sequence[float]) -> float:
    """Return the median, over frames, of one way's time relative to that of `base` in the same turn."""
    return statistics.median(own / other for own, other in zip(times, base, strict=True))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each view."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--relief", choices=RELIEFS, default="man")
    parser.add_argument("--side", type=int, default=512, help="width and height of the depth image, texels")
    parser.add_argument("--depth", type=float, default=0.4, help="of the relief, metres; it is a metre wide")
    parser.add_argument("--frames", type=int, default=9)
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768), help="of the pictures, pixels")
    args = parser.parse_args(arguments)
    kernels.load()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        scenes = write_scenes(folder, args.relief, args.side, args.depth)
        library = SceneLibrary(scenes[WAYS["dpci"].render].assets)
        size = tuple(args.size)

        def opened(way: Way, scale: int = 1) -> HeadlessRenderer:
            headless = HeadlessRenderer(
                scenes[way.render], library, (size[0] * scale, size[1] * scale), way.representation
            )
            return stack.enter_context(headless)

        ways = {name: opened(way) for name, way in WAYS.items()}
        truth = opened(WAYS["displacement"], SUPERSAMPLING)
        for view, degrees in VIEWS.items():
            cameras = [camera_at(degrees + _SWAY * (number % 8)) for number in range(WARM + args.frames)]
            times = time_ways(ways, {name: way.passes for name, way in WAYS.items()}, cameras)
            camera = camera_at(degrees)
            (true,) = supersampled(truth, [camera])
            solid = picture(ways["displacement"], camera)[1]
            print(f"{view}, {degrees:g}° aside, {solid.mean():.0%} of the pixels\n")
            print("| | passes, ms | × dpci | published | frame, ms | × dpci | clock, ms | PSNR, dB | FLIP |")
            print("|---|---|---|---|---|---|---|---|---|")
            for name, headless in ways.items():
                shown, covered = picture(headless, camera)
                own, where = times[name], covered | solid
                passes, frame, clock = (
                    f"{statistics.median(values):.1f}" for values in (own.passes, own.frame, own.clock)
                )
                longer = [ratio(own.passes, times["dpci"].passes), ratio(own.frame, times["dpci"].frame)]
                published = f"{PUBLISHED[name]}" if name in PUBLISHED else ""
                quality = f"{psnr(true, shown, where):.1f} | {mean_flip(true, shown, where):.4f}"
                print(
                    f"| `{name}` | {passes} | {longer[0]:.2f} | {published} | {frame} | {longer[1]:.2f} | {clock} "
                    f"| {quality} |",
                    flush=True,
                )
            print(flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
