"""What anti-aliasing brings and costs: `python -m depthwalk.quality.antialiasing SCENE...`, for docs/anti-aliasing.md.

Every kind of `render.aa` against pictures with many samples per pixel, in the pixels that edges run through.
"""

import json as json_format
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from scipy.ndimage import binary_dilation

import depthwalk
from depthwalk.bench.measure import commit
from depthwalk.colour import srgb8_from_linear
from depthwalk.commands.console import guarded
from depthwalk.commands.options import Quiet, Resolution, Verbose, open_scene, parse_resolution
from depthwalk.commands.render import open_headless
from depthwalk.headless import HeadlessRenderer, LinearImage
from depthwalk.limits import MAX_FRAMES
from depthwalk.output import check_folder, write_bytes
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.render.antialiasing import PictureParams
from depthwalk.render.passes.gpaa import GpaaParams
from depthwalk.render.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene

REFERENCE_SAMPLES = 8  # per pixel, along either axis
JUMP = 0.02  # part of the distance by which the next sample is farther where an edge runs
REPRESENTATIONS = {"depth images": Representation.DPCI, "mesh": Representation.MESH}


@dataclass(frozen=True)
class Kind:
    """A way to smooth edges. samples: `render.gpaa.samples`."""

    title: str
    aa: Any
    samples: int = GpaaParams().samples

    def apply(self, settings: Any) -> None:
        """Sets it in a RenderSettings."""
        settings.aa, settings.gpaa.samples = self.aa, self.samples


KINDS = (
    *(Kind(aa, aa) for aa in get_args(PictureParams.model_fields["aa"].annotation)),
    Kind("gpaa-edge, one sample", "gpaa-edge", samples=1),
)


@dataclass(frozen=True)
class Truth:
    """A picture with `REFERENCE_SAMPLES`² samples per pixel. pixels: (H, W, 3) uint8, sRGB; edge: (H, W), the pixels
    that an edge runs through and those around them."""

    pixels: NDArray[np.uint8]
    edge: NDArray[np.bool_]


@dataclass(frozen=True)
class Row:
    """One kind of anti-aliasing in one scene, drawn by one representation.

    psnr, dB, and flip, mean: of the edge pixels against the mesh; own_psnr: against the same representation; ms: median
    time of a frame; ratio: of that to the frame of the first of `KINDS`, median.
    """

    scene: str
    representation: str
    aa: str
    psnr: float
    own_psnr: float
    flip: float
    ms: float
    ratio: float


def truth(image: LinearImage) -> Truth:
    """The reference that a picture of `REFERENCE_SAMPLES` times the width and height holds."""
    samples = REFERENCE_SAMPLES
    height, width = (side // samples for side in image.distance.shape)
    near = 1 / image.distance  # 0 where nothing is
    jumps = np.zeros(near.shape, bool)
    for axis in (0, 1):
        low, high = (np.take(near, range(first, near.shape[axis] - 1 + first), axis) for first in (0, 1))
        jump = np.abs(high - low) > JUMP * np.maximum(low, high)
        jumps[: jump.shape[0], : jump.shape[1]] |= jump
    edge = binary_dilation(jumps.reshape(height, samples, width, samples).any((1, 3)), np.ones((3, 3)))
    colour = np.clip(image.colour[..., :3], 0, 1)  # what is too bright is white, not a glare
    return Truth(srgb8_from_linear(colour.reshape(height, samples, width, samples, 3).mean((1, 3))), edge)


def measure_scene(scene: Scene, size: tuple[int, int], frames: int) -> Iterator[Row]:
    """The rows of a scene, from its camera. size: (width, height), pixels; frames: timed for each kind, by turns.

    Raises InputError, and GpuError without OpenGL.
    """
    truths = {name: _truth(scene, size, representation) for name, representation in REPRESENTATIONS.items()}
    for name, representation in REPRESENTATIONS.items():
        with open_headless(scene, size, representation) as headless:
            view = View(scene.camera or headless.frame_all(), size)
            milliseconds = np.array([[_frame_ms(headless, view, kind) for kind in KINDS] for _ in range(frames)])
            for number, kind in enumerate(KINDS):
                kind.apply(scene.render)
                headless.draw(view)
                picture = headless.pixels()[..., :3]
                mesh, own = truths["mesh"], truths[name]
                yield Row(
                    str(scene.path),
                    name,
                    kind.title,
                    psnr(mesh.pixels, picture, mesh.edge),
                    psnr(own.pixels, picture, own.edge),
                    mean_flip(mesh.pixels, picture, mesh.edge),
                    float(np.median(milliseconds[:, number])),
                    float(np.median(milliseconds[:, number] / milliseconds[:, 0])),
                )


def _truth(scene: Scene, size: tuple[int, int], representation: Representation) -> Truth:
    scene.render.aa = "none"
    fine = size[0] * REFERENCE_SAMPLES, size[1] * REFERENCE_SAMPLES
    with open_headless(scene, fine, representation) as headless:
        camera: Camera = scene.camera or headless.frame_all()
        headless.draw(View(camera, fine))
        return truth(headless.linear_image())


def _frame_ms(headless: HeadlessRenderer, view: View, kind: Kind) -> float:
    """Of a frame after one that makes what the kind needs: of all cores where they draw, else by the clock."""
    clock = time.process_time if headless.device.software else time.perf_counter
    kind.apply(headless.renderer.settings)
    headless.draw(view)
    headless.device.context.finish()
    start = clock()
    headless.draw(view)
    headless.device.context.finish()
    return (clock() - start) * 1e3


def to_markdown(rows: Sequence[Row]) -> str:
    """A table per scene and representation."""
    titles = "`render.aa`", "PSNR, dB", "against its own, dB", "FLIP", "ms", "× `none`"
    head = f"| {' | '.join(titles)} |\n{'|---' * len(titles)}|\n"
    tables: dict[str, str] = {}
    for row in rows:
        values = f"{row.psnr:.1f}", f"{row.own_psnr:.1f}", f"{row.flip:.3f}", f"{row.ms:.0f}", f"{row.ratio:.2f}"
        title = f"{Path(row.scene).stem}, {row.representation}:\n\n{head}"
        tables[title] = tables.get(title, "") + f"| {row.aa} | {' | '.join(values)} |\n"
    return "\n".join(title + lines for title, lines in tables.items())


def to_json(rows: Sequence[Row], size: tuple[int, int]) -> str:
    """The rows for programs."""
    head = {"version": depthwalk.__version__, "commit": commit(), "resolution": size}
    return json_format.dumps({**head, "rows": [asdict(row) for row in rows]}, indent=2) + "\n"


@guarded
def main(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE", help="Scene files.")],
    json: Annotated[Path | None, typer.Option(metavar="F", help="Write the rows as JSON.")] = None,
    resolution: Resolution = "512,384",
    frames: Annotated[int, typer.Option(metavar="N", min=1, max=MAX_FRAMES, help="Frames to time of each kind.")] = 5,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure what each kind of anti-aliasing brings and costs, seen from each scene's camera."""
    size = parse_resolution(resolution)
    if json is not None:
        check_folder(json)
    loaded = [open_scene(path, None, None) for path in scenes]  # complain about the last one before minutes pass
    rows: list[Row] = []
    for scene in loaded:
        total = len(REPRESENTATIONS) * len(KINDS)
        rows += track(measure_scene(scene, size, frames), str(scene.path), total, console=Console(stderr=True))
    if json is not None:
        write_bytes(json, to_json(rows, size).encode())
    print(to_markdown(rows), end="")


if __name__ == "__main__":
    typer.run(main)
