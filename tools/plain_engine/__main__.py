"""Measure a frame that shows one object, drawn by depthwalk and by the plainest engine that could draw it.

`python -m tools.plain_engine SCENE` walks about the first object of a scene, so that it stays whole in the picture. The
engine draws forward, by decimated levels, with nothing around it (`engine.py`); its level may be as coarse as its
pictures' FLIP stays at that of the scene's own. All ways take turns, a few frames each.

What is compared is processor time, of all threads: where a software rasteriser shares the cores with others, the clock
says little.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from tools.plain_engine.engine import PlainEngine

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.equal import SUPERSAMPLING, coarsened, picture_flip, supersampled
from depthwalk.errors import InputError
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.types import Picture

_STEP = 0.15  # degrees from frame to frame: 1.4 m/s at 18 m, 0.25 m/s at 3 m
_TURN = 6  # frames of one way, before the next one has its turn
_WARM = 12  # frames of each way that are not counted
_JUDGED = 5  # pictures of the walk whose FLIP is measured
_COARSEST = 16.0  # pixels that the engine's level may be off
Draw = Callable[[View], None]


def walk_about(camera: Camera, distance: float, frames: int) -> list[Camera]:
    """Return cameras that walk about the target of `camera`, as high as it stands, at so many metres."""
    target, place = np.array(camera.target), np.array(camera.position)
    start = np.arctan2(place[0] - target[0], place[2] - target[2])
    turns = start + np.radians(_STEP) * np.arange(frames)
    level = np.full(frames, place[1] - target[1])
    places = target + np.stack([distance * np.sin(turns), level, distance * np.cos(turns)], -1)
    return [replace(camera, position=tuple(place)) for place in places.tolist()]


def time_turns(
    ways: Mapping[str, Draw], finish: Callable[[str], None], views: Sequence[View]
) -> dict[str, list[float]]:
    """Return the times of all ways, which take turns, milliseconds of processor time per frame of each turn."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for first in range(0, len(views) - _TURN + 1, _TURN):
        for name, draw in ways.items():
            start = time.process_time()
            for view in views[first : first + _TURN]:
                draw(view)
                finish(name)
            if first >= _WARM:
                times[name].append(1e3 * (time.process_time() - start) / _TURN)
    return times


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each distance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--distances", type=float, nargs="+", default=(3.2, 6.0), help="from the target, metres")
    parser.add_argument("--frames", type=int, default=72)
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768), help="of the pictures, pixels")
    args = parser.parse_args(arguments)
    kernels.load()
    size = tuple(args.size)
    try:
        scene = load_scene(args.scene)
    except InputError as error:
        parser.error(str(error))
    if scene.camera is None or scene.environment.sky or scene.environment.ground or scene.environment.lights:
        parser.error(f"{args.scene}: must have a camera, and neither sky, ground nor lights")
    library = SceneLibrary(scene.assets)
    with ExitStack() as stack:
        drawn: dict[str, HeadlessRenderer | PlainEngine] = {}
        for name, kind in (("scene", None), ("dpci", Representation.DPCI), ("mesh-lod", Representation.MESH_LOD)):
            drawn[name] = headless = stack.enter_context(HeadlessRenderer(scene, library, size, kind))
            headless.renderer.remembers = True
        large = size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING
        truth = stack.enter_context(HeadlessRenderer(scene, library, large, Representation.MESH))
        levels = library.mesh_levels(int(scene.objects.asset[0]))
        engine = PlainEngine(scene, levels, size, _COARSEST)
        stack.callback(engine.release)
        drawn["engine"] = engine
        for distance in args.distances:
            views = [View(camera, size) for camera in walk_about(scene.camera, distance, args.frames)]
            _measure(f"{distance:g} m", drawn, truth, engine, views)


def _measure(
    title: str,
    drawn: Mapping[str, HeadlessRenderer | PlainEngine],
    truth: HeadlessRenderer,
    engine: PlainEngine,
    views: Sequence[View],
) -> None:
    judged = views[:: max(len(views) // _JUDGED, 1)]
    references = supersampled(truth, [view.camera for view in judged])

    def flip(name: str) -> float:
        def shown(view: View) -> Picture:
            drawn[name].draw(view)
            return drawn[name].pixels()[..., :3]

        return float(np.mean([picture_flip(true, shown(view)) for true, view in zip(references, judged, strict=True)]))

    def engine_flip(error: float) -> float:
        engine.error = error
        return flip("engine")

    flips = {name: flip(name) for name in drawn if name != "engine"}
    engine.error, flips["engine"] = coarsened(engine_flip, 0.0, _COARSEST, flips["scene"])
    times = time_turns(
        {name: way.draw for name, way in drawn.items()}, lambda name: drawn[name].device.context.finish(), views
    )
    covered = _covered(drawn["scene"], judged[0])
    print(f"{title}: {covered:.0%} of the pixels; engine: level {engine.level}, error {engine.error:.2f} pixels\n")
    print("| drawn as | frame, ms | engine ÷ it | FLIP |\n|---|---|---|---|")
    for name, own in times.items():
        ratio = statistics.median(base / mine for base, mine in zip(times["engine"], own, strict=True))
        print(f"| `{name}` | {statistics.median(own):.1f} | {ratio:.2f} | {flips[name]:.5f} |", flush=True)
    print()


def _covered(headless: HeadlessRenderer | PlainEngine, view: View) -> float:
    assert isinstance(headless, HeadlessRenderer)
    headless.draw(view, transparent=True)
    return float((headless.pixels()[..., 3] > 0).mean())


if __name__ == "__main__":
    main(sys.argv[1:])
