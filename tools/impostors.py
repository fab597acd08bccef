"""Compare impostors of whole objects: warped depth images, octahedral impostors and billboards.

`python -m tools.impostors MESH …` draws each mesh in every representation, near and far, alone and in a crowd, while
the camera walks around it. Octahedral impostors get as many bytes of textures as the object's depth images take on the
GPU. All ways alternate, frame by frame. Pictures are compared with the mesh, drawn with 16 samples per pixel.

Times are processor time of all threads: if a software rasteriser shares the cores with other programs, wall-clock time
says little.
"""

import argparse
import math
import statistics
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tools.rivals import WARM, Times, picture, ratio, time_ways

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.equal import SUPERSAMPLING, supersampled
from depthwalk.cook.cook import CookOptions
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene

PLACES = {"near": 1.6, "aside": 4.0, "far": 12.0, "crowd": 6.0}  # metres from the middle of an object of one metre
_CROWD, _SPACING = 12, 1.2  # objects along either side of the crowd; metres
_FOV, _STEP = 45.0, 0.8  # degrees; of the walk around the object, from frame to frame
_TURN, _UP = 25.0, 12.0  # degrees: where the walk begins, and above the horizon
_TEXEL_BYTES = 8 * 4 / 3  # of a captured view, with mip-maps
_SCENE = """version: 1
assets:
  model: {{mesh: {file}, height: 1.0, up: {up}, dpci: {{}}}}
objects: [{objects}]
environment: {{sun: {{direction: [0.6, -0.5, -0.6], intensity: 0.9}}, ambient: {{intensity: 0.25}}}}
render: {{aa: none{render}}}
"""
_ALONE = "{asset: model}"
_MANY = f"{{grid: {{asset: model, count: [{_CROWD}, {_CROWD}], spacing: [{_SPACING}, {_SPACING}]}}}}"


@dataclass(frozen=True)
class Way:
    """Describe how objects are drawn: representation, passes, and further settings as YAML."""

    representation: Representation
    passes: tuple[str, ...]
    render: str = ""


def ways(resolution: int) -> dict[str, Way]:
    """Return the ways to compare, the octahedral ones with views of `resolution` texels."""
    octahedral = f"resolution: {resolution}"
    drawn = Representation.OCTAHEDRAL, ("octahedral",)
    return {
        "dpci": Way(Representation.DPCI, ("warp", "composite", "material_resolve")),
        "octahedral": Way(*drawn, f", octahedral: {{{octahedral}}}"),
        "octahedral, hemisphere": Way(*drawn, f", octahedral: {{{octahedral}, hemisphere: true}}"),
        "octahedral, 3 steps": Way(*drawn, f", octahedral: {{{octahedral}, parallax_steps: 3}}"),
        "billboard": Way(Representation.BILLBOARD, ("billboard",)),
        "mesh-lod": Way(Representation.MESH_LOD, ("mesh",)),
    }


def scene_with(folder: Path, mesh: Path, up: str, objects: str, render: str) -> Scene:
    """Write and load a scene of one mesh, alone or in a crowd."""
    file = folder / "scene.yaml"
    file.write_text(_SCENE.format(file=mesh.name, up=up, objects=objects, render=render), encoding="utf-8")
    return load_scene(file, asset_roots=[mesh.parent])


def cameras_at(metres: float, frames: int) -> list[Camera]:
    """Return the cameras of a walk around the object, looking at the point half a metre above its base."""
    middle = np.array([0.0, 0.5, 0.0])
    found = []
    for number in range(frames):
        turn, up = math.radians(_TURN + _STEP * number), math.radians(_UP)
        away = np.array([math.sin(turn) * math.cos(up), math.sin(up), math.cos(turn) * math.cos(up)])
        place = middle + metres * away
        found.append(Camera(tuple(place.tolist()), tuple(middle.tolist()), math.radians(_FOV)))
    return found


def equal_resolution(library: SceneLibrary, views: int) -> tuple[int, int]:
    """Return the side, texels, of octahedral views that fit the bytes of an asset's depth images, and those bytes."""
    size = sum(part.bytes for part in library.cooked(0, CookOptions()))
    return min(max(int(math.sqrt(size / _TEXEL_BYTES) / views), 8), 256), size


def measure(mesh: Path, up: str, size: tuple[int, int], frames: int, views: int) -> None:
    """Print a table of one mesh."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        library = SceneLibrary(scene_with(folder, mesh, up, _ALONE, "").assets)
        resolution, size_bytes = equal_resolution(library, views)
        chosen = ways(resolution)
        print(f"{mesh.stem}: depth images {size_bytes / 1e6:.1f} MB, {views}² views of {resolution}² texels\n")
        print("| place | way | frame, ms | × dpci | passes, ms | × dpci | PSNR, dB | FLIP | × dpci |")
        print("|---|---|---|---|---|---|---|---|---|")
        for place, metres in PLACES.items():
            objects = _MANY if place == "crowd" else _ALONE

            def opened(way: Way, inner: ExitStack, scale: int = 1, objects: str = objects) -> HeadlessRenderer:
                scene = scene_with(folder, mesh, up, objects, way.render)
                pixels = size[0] * scale, size[1] * scale
                return inner.enter_context(HeadlessRenderer(scene, library, pixels, way.representation))

            with ExitStack() as inner:
                drawn = {name: opened(way, inner) for name, way in chosen.items()}
                cameras = cameras_at(metres, WARM + frames)
                times = time_ways(drawn, {name: way.passes for name, way in chosen.items()}, cameras)
                truth = opened(Way(Representation.MESH, ()), inner, SUPERSAMPLING)
                print_place(place, drawn, times, cameras[:: max(frames // 2, 1)], truth)


def print_place(
    place: str,
    drawn: Mapping[str, HeadlessRenderer],
    times: Mapping[str, Times],
    cameras: Sequence[Camera],
    truth: HeadlessRenderer,
) -> None:
    """Print the rows of one place."""
    true = supersampled(truth, cameras)
    base = times["dpci"]
    errors: dict[str, list[float]] = {name: [] for name in drawn}
    signal: dict[str, list[float]] = {name: [] for name in drawn}
    for camera, expected in zip(cameras, true, strict=True):
        where = picture(drawn["mesh-lod"], camera)[1]
        shown = {name: picture(headless, camera) for name, headless in drawn.items()}
        for name, (pixels, covered) in shown.items():
            errors[name].append(mean_flip(expected, pixels, where | covered))
            signal[name].append(psnr(expected, pixels, where | covered))
    for name in drawn:
        own, error = times[name], statistics.mean(errors[name])
        print(
            f"| {place} | `{name}` | {statistics.median(own.frame):.1f} | {ratio(own.frame, base.frame):.2f} "
            f"| {statistics.median(own.passes):.1f} | {ratio(own.passes, base.passes):.2f} "
            f"| {statistics.mean(signal[name]):.1f} | {error:.4f} | {error / statistics.mean(errors['dpci']):.2f} |",
            flush=True,
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each mesh."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--up", choices=("y", "z"), default="y")
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--views", type=int, default=12, help="along either side of the octahedral map")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480), help="of the pictures, pixels")
    args = parser.parse_args(arguments)
    kernels.load()
    for mesh in args.meshes:
        measure(mesh.resolve(), args.up, tuple(args.size), args.frames, args.views)


if __name__ == "__main__":
    main(sys.argv[1:])
