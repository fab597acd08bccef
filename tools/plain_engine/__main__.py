"""Measure frames drawn by depthwalk and by the plainest engine that could draw them.

`python -m tools.plain_engine SCENE` walks about the first object of a scene, so that it stays whole in the picture. The
engine draws forward, by decimated levels, with nothing around it (`engine.py`); its level may be as coarse as its
pictures' FLIP stays at that of the scene's own.

`python -m tools.plain_engine SCENE --path P --counts 1000,10000` walks past many objects along a camera path. Each gets
the coarsest level whose edges are two pixels long at most (`--edges`), and what the frustum does not hold is left out.

All ways take turns, a few frames each. What is compared is processor time, of all threads: where a software rasteriser
shares the cores with others, the clock says little.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from tools.plain_engine.engine import PlainEngine, edge_length
from tools.plain_engine.walks import walk_about

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.equal import SUPERSAMPLING, coarsened, picture_flip, supersampled
from depthwalk.bench.rows import references
from depthwalk.bench.table_walk import SETTLING, Walk, most_seen
from depthwalk.errors import InputError
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture

_TURN = 6  # frames of one way, before the next one has its turn
_WARM = 12  # frames of each way that are not counted
_JUDGED = 5  # pictures of the walk whose FLIP is measured
_COARSEST = 16.0  # pixels that the engine's level may be off
_MOMENTS = 6  # of a camera path


def time_turns(
    ways: Mapping[str, HeadlessRenderer | PlainEngine], views: Sequence[View], warm: int = _WARM
) -> dict[str, list[float]]:
    """Return the times of all ways, which take turns, milliseconds of processor time per frame of each turn.

    The first `warm` frames of each are not counted.
    """
    times: dict[str, list[float]] = {name: [] for name in ways}
    for first in range(0, len(views) - _TURN + 1, _TURN):
        for name, way in ways.items():
            start = time.process_time()
            for view in views[first : first + _TURN]:
                way.draw(view)
                way.finish()
            if first >= warm:
                times[name].append(1e3 * (time.process_time() - start) / _TURN)
    return times


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each distance, or for each number of objects."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--distances", type=float, nargs="+", default=(3.2, 6.0), help="from the target, metres")
    parser.add_argument("--frames", type=int, default=72)
    parser.add_argument("--path", type=Path, help="of the camera, past many objects, instead of about one")
    parser.add_argument("--counts", default="1000,10000", help="of objects along the path")
    parser.add_argument(
        "--edges", type=float, default=2.0, help="of the engine's levels of many objects, pixels at most"
    )
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768), help="of the pictures, pixels")
    args = parser.parse_args(arguments)
    size = tuple(args.size)
    if args.frames < _WARM + _TURN:
        parser.error(f"--frames: must be at least {_WARM + _TURN}")
    if min(args.size) < 1 or min(*args.distances, args.edges) <= 0:
        parser.error("--size, --distances and --edges: must be more than 0")
    try:
        scene = load_scene(args.scene)
        walk = None if args.path is None else Walk.along(load_path(args.path), _MOMENTS, _TURN, 0.0, size)
    except InputError as error:
        parser.error(str(error))
    if scene.camera is None or scene.environment.sky or scene.environment.ground or scene.environment.lights:
        parser.error(f"{args.scene}: must have a camera, and neither sky, ground nor lights")
    library = SceneLibrary(scene.assets)
    if walk is None:
        kernels.load()
        _about_one(
            scene, library, [walk_about(scene.camera, distance, args.frames) for distance in args.distances], size
        )
        return
    if len(np.unique(scene.objects.asset)) != 1:
        parser.error(f"{args.scene}: must have objects, all of the same asset")
    counts = args.counts.split(",")
    if not all(count.isdecimal() and 1 <= int(count) <= len(scene.objects) for count in counts):
        parser.error(f"--counts {args.counts}: must be N,…, each from 1 to the {len(scene.objects)} of {args.scene}")
    kernels.load()
    for count in map(int, counts):
        chosen = scene.objects.take(most_seen(scene, walk, count))
        _measure_crowd(replace(scene, objects=chosen), library, walk, args.edges)


@contextmanager
def _opened(
    scene: Scene, library: SceneLibrary, size: tuple[int, int], kinds: Mapping[str, Representation | None]
) -> Iterator[dict[str, HeadlessRenderer]]:
    """Yield renderers of a scene by the names of what they draw, which remember the frame before."""
    with ExitStack() as stack:
        drawn = {
            name: stack.enter_context(HeadlessRenderer(scene, library, size, kind)) for name, kind in kinds.items()
        }
        for headless in drawn.values():
            headless.renderer.remembers = True
        yield drawn


def _about_one(scene: Scene, library: SceneLibrary, walks: Sequence[Sequence[Camera]], size: tuple[int, int]) -> None:
    """Print a table for each walk about the first object of a scene."""
    kinds = {"scene": None, "dpci": Representation.DPCI, "mesh-lod": Representation.MESH_LOD}
    with ExitStack() as stack:
        drawn: dict[str, HeadlessRenderer | PlainEngine] = {}
        drawn.update(stack.enter_context(_opened(scene, library, size, kinds)))
        large = size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING
        truth = stack.enter_context(HeadlessRenderer(scene, library, large, Representation.MESH))
        levels = library.mesh_levels(int(scene.objects.asset[0]))
        first = replace(scene, objects=scene.objects.take(slice(1)))
        engine = PlainEngine(first, levels, [level.error for level in levels], size, _COARSEST)
        stack.callback(engine.release)
        drawn["engine"] = engine
        for cameras in walks:
            views = [View(camera, size) for camera in cameras]
            distance = np.hypot(*(np.array(cameras[0].position) - cameras[0].target)[[0, 2]])
            _measure(f"{distance:.3g} m", drawn, truth, engine, views)


def _measure_crowd(scene: Scene, library: SceneLibrary, walk: Walk, edges: float) -> None:
    """Print a table of a walk past the objects of a scene; the engine's `edges` are so many pixels long at most."""
    described, pictures = references(walk, scene, library)
    kinds = {"scene": None, "mesh-lod": Representation.MESH_LOD, "mesh-clusters": Representation.MESH_CLUSTERS}
    levels = library.mesh_levels(int(scene.objects.asset[0]))
    with ExitStack() as stack:
        drawn: dict[str, HeadlessRenderer | PlainEngine] = {}
        drawn.update(stack.enter_context(_opened(scene, library, walk.size, kinds)))
        engine = PlainEngine(scene, levels, [edge_length(level.mesh) for level in levels], walk.size, edges)
        stack.callback(engine.release)
        drawn["engine"] = engine
        times: dict[str, list[float]] = {name: [] for name in drawn}
        flips: dict[str, list[float]] = {name: [] for name in drawn}
        triangles = []
        for moment, picture in zip(walk.moments, pictures, strict=True):
            for name, way in drawn.items():
                for camera in moment[: SETTLING + 1] if name == "scene" else moment[SETTLING - 1 : SETTLING + 1]:
                    way.draw(View(camera, walk.size))
                flips[name].append(picture_flip(picture, way.pixels()[..., :3]))
            triangles.append(engine.triangles)
            views = [View(camera, walk.size) for camera in moment[SETTLING:]]
            for name, found in time_turns(drawn, views, 0).items():
                times[name] += found
    print(f"{len(scene.objects):,} objects; engine: {np.mean(triangles):,.0f} triangles; reference: {described}\n")
    _print_table(times, {name: float(np.mean(found)) for name, found in flips.items()}, np.mean)


def _print_table(
    times: Mapping[str, Sequence[float]], flips: Mapping[str, float], mean: Callable[[Sequence[float]], float]
) -> None:
    """Print a row for each way: the `mean` of its times, milliseconds, what the engine takes of it, and FLIP."""
    print("| drawn as | frame, ms | engine ÷ it | FLIP |\n|---|---|---|---|")
    for name, own in times.items():
        print(
            f"| `{name}` | {mean(own):.1f} | {mean(times['engine']) / mean(own):.2f} | {flips[name]:.5f} |", flush=True
        )
    print()


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
        engine.allowed = error
        return flip("engine")

    flips = {name: flip(name) for name in drawn if name != "engine"}
    engine.allowed, flips["engine"] = coarsened(engine_flip, 0.0, _COARSEST, flips["scene"])
    times = time_turns(drawn, views)
    covered = _covered(drawn["scene"], judged[0])
    drawn_so = f"{engine.triangles:,} triangles, error {engine.allowed:.2f} pixels"
    print(f"{title}: {covered:.0%} of the pixels; engine: {drawn_so}\n")
    _print_table(times, flips, statistics.median)


def _covered(headless: HeadlessRenderer | PlainEngine, view: View) -> float:
    assert isinstance(headless, HeadlessRenderer)
    headless.draw(view, transparent=True)
    return float((headless.pixels()[..., 3] > 0).mean())


if __name__ == "__main__":
    main(sys.argv[1:])
