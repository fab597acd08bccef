"""How near depth of field comes to many frames: `python -m depthwalk.quality.dof SCENE...`, measured for
docs/depth-of-field.md.

A scene is seen by its camera; what is in the middle of the picture is in focus, unless told otherwise.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from depthwalk.commands.console import guarded
from depthwalk.commands.options import AssetRoots, Quiet, Resolution, Settings, Verbose, open_scene, parse_resolution
from depthwalk.headless import HeadlessRenderer
from depthwalk.library import SceneLibrary
from depthwalk.output import check_folder, png_bytes, write_bytes
from depthwalk.quality.metrics import Picture, mean_flip, psnr
from depthwalk.reference.dof import SHARP, ranges
from depthwalk.render.lens import FARTHEST_FOCUS, NEAREST_FOCUS, circle_radius, largest_radius
from depthwalk.render.passes.dof import TILE
from depthwalk.render.view import View
from depthwalk.scene.scene import Scene

TRUTH = 256  # points of the lens
REPEATS = 5  # of what is timed, the median counts
MODES = "none", "paper", "gather", "accumulate"


@dataclass(frozen=True)
class Row:
    """What a mode came to. psnr (dB), flip: against the mean of `TRUTH` frames; changed: by how much at most, of 255,
    pixels differ from the picture without depth of field that are in focus and that nothing before them reaches;
    seconds: of a frame."""

    mode: str
    psnr: float
    flip: float
    changed: int
    seconds: float


def examine(scene: Scene, size: tuple[int, int], focus: float | None) -> tuple[list[Row], dict[str, Picture]]:
    """A row and the picture (H, W, 3) of each of `MODES`. focus: metres, None for what is in the middle.

    Raises InputError, and GpuError without OpenGL.
    """
    lens, pictures, seconds = scene.render.dof, {}, {}
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        view = View(scene.camera or headless.frame_all(), size)
        lens.mode = "none"
        headless.draw(view)
        distance = headless.linear_image().distance
        middle = float(distance[size[1] // 2, size[0] // 2])
        lens.focus_distance = focus or min(max(middle, NEAREST_FOCUS), FARTHEST_FOCUS)
        largest = largest_radius(lens, view)
        still = _still(np.clip(circle_radius(lens, view, distance), -largest, largest))
        samples = lens.samples
        for mode in MODES:
            lens.mode, lens.samples = mode, TRUTH if mode == "accumulate" else samples
            times = []
            for _ in range(1 if mode == "accumulate" else REPEATS):
                start = time.perf_counter()
                headless.draw(view)
                pictures[mode] = np.ascontiguousarray(headless.pixels()[..., :3])
                times.append(time.perf_counter() - start)
            seconds[mode] = median(times)
    return [_row(mode, pictures, still, seconds[mode]) for mode in MODES], pictures


def _still(circles: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Pixels (H, W) that are in focus and that nothing before them reaches; circles: as the shaders have them."""
    return np.asarray((np.abs(circles) < SHARP) & (ranges(circles[::-1], TILE)[0, ::-1] > -SHARP))


def _row(mode: str, pictures: dict[str, Picture], still: NDArray[np.bool_], seconds: float) -> Row:
    truth, shown, everywhere = pictures["accumulate"], pictures[mode], np.ones_like(still)
    changed = np.abs(shown.astype(int) - pictures["none"])[still].max(initial=0)
    return Row(mode, psnr(truth, shown, everywhere), mean_flip(truth, shown, everywhere), int(changed), seconds)


def to_markdown(tables: dict[str, list[Row]]) -> str:
    """One table, its rows by scene."""
    lines = ["| scene | mode | PSNR, dB | FLIP | in focus, off by | frame, ms | of accumulate's |", "|---" * 7 + "|"]
    for name, rows in tables.items():
        for row in rows:
            share = row.seconds / rows[-1].seconds
            cells = name, f"`{row.mode}`", f"{row.psnr:.1f}", f"{row.flip:.4f}", row.changed
            lines.append(f"| {' | '.join(map(str, cells))} | {row.seconds * 1e3:.0f} | 1/{1 / share:.0f} |")
    return "\n".join(lines) + "\n"


@guarded
def main(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE", help="Scene files.")],
    focus: Annotated[
        float | None,
        typer.Option(metavar="M", min=NEAREST_FOCUS, max=FARTHEST_FOCUS, help="Focus; else the picture's middle."),
    ] = None,
    pictures: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for the pictures of all modes.")] = None,
    resolution: Resolution = "640,480",
    asset_roots: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure depth of field against the mean of many frames."""
    size, tables = parse_resolution(resolution), {}
    if pictures is not None:  # what follows takes minutes
        check_folder(pictures / "picture.png")
    for path in scenes:
        tables[path.stem], shown = examine(open_scene(path, asset_roots, settings), size, focus)
        if pictures is not None:
            for mode, picture in shown.items():
                write_bytes(pictures / f"{path.stem}-{mode}.png", png_bytes(picture))
    print(to_markdown(tables), end="")


if __name__ == "__main__":
    typer.run(main)
