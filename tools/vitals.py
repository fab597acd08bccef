"""Measure in two minutes what matters to users: `python -m tools.vitals` prints a row for docs/vitals.md.

First picture: the whole process of `depthwalk render scenes/garden.yaml`, with an empty cache (cold) and with the one
that it left (warm). Walk: the median frame of `depthwalk bench` along stretches of a path, 30 frames per second. Share:
the part of the pixels showing objects that depth images drew, over views along the paths. With `--against DIR`,
measurements alternate with another checkout, so that a ratio holds on a machine whose speed changes. That checkout may
be older: of both, only the command line and the shipped scenes are used.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

ROOT = Path(__file__).resolve().parents[1]
SIZE = 1024, 768
VIEWS = 5  # along a path, at which the share of depth images is taken
STARTS = 3  # along a path, from which a stretch is walked


@dataclass(frozen=True, kw_only=True)
class Walk:
    """Name a scene and a camera path through it.

    Attributes
    ----------
    name
        Name of the walk in the printed row.
    scene, path
        The scene file and the path file.
    """

    name: str
    scene: Path
    path: Path


def walks(extra: Path | None) -> list[Walk]:
    """Return the shipped walks, and the one through the plaza if the folder `extra` has it; None for no folder."""
    found = [
        Walk(name=name, scene=ROOT / f"scenes/{name}.yaml", path=ROOT / f"scenes/paths/{name}.yaml")
        for name in ("garden", "room")
    ]
    if extra is not None and (extra / "plaza.yaml").is_file():
        found.append(Walk(name="plaza", scene=extra / "plaza.yaml", path=extra / "stroll.yaml"))
    return found


def run(checkout: Path, cache: Path, *arguments: str) -> float:
    """Run a command of `depthwalk` in a separate process, and time it.

    Parameters
    ----------
    checkout
        Folder of the checkout whose program is run.
    cache
        Folder of the cache that the program uses.
    *arguments
        The command and its options.

    Returns
    -------
    float
        Seconds from start to end of the process.

    Raises
    ------
    CalledProcessError
        If the command fails.
    """
    environment = os.environ | {"PYTHONPATH": str(checkout / "app"), "XDG_CACHE_HOME": str(cache)}
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-m", "depthwalk", *arguments], env=environment, check=True, capture_output=True)
    return time.perf_counter() - begin


def first_picture(checkout: Path, folder: Path) -> tuple[float, float]:
    """Time the rendering of one picture of the garden, with an empty cache and with a full one.

    Parameters
    ----------
    checkout
        Folder of the checkout that is measured.
    folder
        Folder for the picture and a new cache.

    Returns
    -------
    tuple[float, float]
        Seconds with the empty cache, and the shortest of three times with the full one.
    """
    arguments = (
        "render",
        str(checkout / "scenes/garden.yaml"),
        "-o",
        str(folder / "garden.png"),
        "--resolution",
        "320,240",
    )
    cache = folder / f"cold-{time.time_ns()}"
    return run(checkout, cache, *arguments), min(run(checkout, cache, *arguments) for _ in range(3))


def stretches(walk: Walk, frames: int, folder: Path) -> Path:
    """Write a path file of stretches of a walk, so that few frames sample all of it at the walk's own speed.

    Parameters
    ----------
    walk
        The walk.
    frames
        Number of frames of all `STARTS` stretches together, 30 a second.
    folder
        Folder to write to.

    Returns
    -------
    Path
        The path file.
    """
    from depthwalk.scene.path import CameraPath, load_path, path_text

    path = load_path(walk.path)
    starts = np.linspace(0, path.frames()[-1], STARTS, endpoint=False)
    cameras = [path.sample(float(start + k / 30)) for start in starts for k in range(frames // STARTS)]
    file = folder / f"{walk.name}.yaml"
    views = np.array([[*camera.position, *camera.target] for camera in cameras])
    fovs = np.array([camera.fov for camera in cameras])
    steps = CameraPath(times=np.arange(len(cameras)) / 30, views=views, fovs=fovs, fps=30.0, interpolation="step")
    file.write_text(path_text(steps), encoding="utf-8")
    return file


def walking(checkout: Path, cache: Path, walk: Walk, frames: int, folder: Path) -> float:
    """Return the median time of a frame along stretches of a walk.

    Parameters
    ----------
    checkout
        Folder of the checkout that is measured.
    cache
        Folder of the cache that the program uses.
    walk
        The walk.
    frames
        Number of frames.
    folder
        Folder for the path file and the report.

    Returns
    -------
    float
        Milliseconds.
    """
    report, path = folder / "bench.json", stretches(walk, frames, folder)
    size = ",".join(map(str, SIZE))
    own = walk.scene.is_relative_to(ROOT)  # the other checkout may know other keys and assets
    scene = checkout / walk.scene.relative_to(ROOT) if own else walk.scene
    run(checkout, cache, "bench", str(scene), "--path", str(path), "--resolution", size, "--json", str(report))
    return float(json.loads(report.read_text())["runs"][0]["frame_ms"]["p50"])


def share(walk: Walk) -> float:
    """Return the part of the objects' pixels that depth images drew, 0 to 1, over `VIEWS` views along `walk`."""
    from depthwalk.assets.library import SceneLibrary
    from depthwalk.render.headless import HeadlessRenderer
    from depthwalk.render.pixel_shares import KINDS
    from depthwalk.render.view.view import View
    from depthwalk.scene.loader import load_scene
    from depthwalk.scene.path import load_path

    scene, path = load_scene(walk.scene), load_path(walk.path)
    size = SIZE[0] // 2, SIZE[1] // 2
    pixels = np.zeros(len(KINDS), np.int64)
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        for moment in np.linspace(0, path.frames()[-1], VIEWS):
            headless.draw(View(path.sample(float(moment)), size))
            pixels += headless.pixel_counts()
    return 1 - float(pixels[KINDS.index("mesh")]) / max(int(pixels.sum()), 1)


def main(
    against: Annotated[Path | None, typer.Option(help="Another checkout, measured in turn with this one")] = None,
    rounds: Annotated[int, typer.Option(help="How often each path is walked; the median counts", min=1)] = 3,
    frames: Annotated[int, typer.Option(help="Number of frames of each walk", min=2)] = 36,
) -> None:
    """Print first picture, walking time and share of depth images as a row for docs/vitals.md."""
    extra = Path(os.environ.get("DEPTHWALK_TEST_SCENES", ROOT.parent / "shared" / "scenes"))
    checkouts = [ROOT] + ([against.resolve()] if against else [])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first = {checkout: first_picture(checkout, folder) for checkout in checkouts}
        cells = [date.today().isoformat(), *(f"{seconds:.1f} s" for seconds in first[ROOT])]
        if against:
            cells[1] += f" ({first[ROOT][0] / first[checkouts[1]][0]:.2f} ×)"
            cells[2] += f" ({first[ROOT][1] / first[checkouts[1]][1]:.2f} ×)"
        for walk in walks(extra):
            times: dict[Path, list[float]] = {checkout: [] for checkout in checkouts}
            for number in range(rounds + 1):  # the first one fills the caches
                for checkout in checkouts:
                    cache = folder / f"cache-{checkouts.index(checkout)}"
                    time_of_frame = walking(checkout, cache, walk, frames if number else STARTS, folder)
                    if number:
                        times[checkout].append(time_of_frame)
            cell = f"{walk.name} {statistics.median(times[ROOT]):.1f} ms"
            if against:
                ratios = [mine / other for mine, other in zip(*times.values(), strict=True)]
                cell += f" ({statistics.median(ratios):.3f} ×)"
            cells.append(f"{cell}, {share(walk):.1%} images")
        print(" | ".join(cells))


if __name__ == "__main__":
    typer.run(main)
