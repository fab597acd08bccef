"""What each step contributes: `python -m depthwalk.commands.ablation MESH...`, measured for docs/ablation.md.

The rows of the table add one step after another to the paper's method; the last one is what the program does.
"""

import json as json_format
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

import depthwalk
from depthwalk import limits
from depthwalk.assets.batch_bake import read_mesh
from depthwalk.bake.baker import Refinements
from depthwalk.bake.file import SUFFIX, read_baked
from depthwalk.bake.parts import ModelParams
from depthwalk.commands.console import guarded
from depthwalk.commands.options import Quiet, Verbose
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.provenance import commit
from depthwalk.quality.costs import measured_bake
from depthwalk.quality.goals import MEASURES, summarise
from depthwalk.quality.measure import flip_workers, measure
from depthwalk.quality.report import cell
from depthwalk.quality.views import FEW
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import MeshAsset

LAYERS = 3
SIZE = 1024, 768  # of the pictures, pixels
SHOWN = [measure for measure in MEASURES if measure.key in ("psnr", "iou", "flip", "holes")]


@dataclass(frozen=True)
class Setup:
    """One row: the row before and what `title` says. cases, tiles: `render.lod.cases`, `render.warp.tile_mapping`."""

    title: str
    layers: int
    refinements: Refinements
    cases: str
    tiles: str

    @property
    def settings(self) -> RenderSettings:
        return RenderSettings.model_validate({"lod": {"cases": self.cases}, "warp": {"tile_mapping": self.tiles}})


@dataclass(frozen=True)
class Row:
    """What a setup came to. means: of `SHOWN`, by their keys, over the views; and the costs."""

    title: str
    means: dict[str, float]
    bake_seconds: float
    bytes_disk: int
    bytes_gpu: int


@dataclass(frozen=True)
class Ablation:
    """The rows of one mesh. mesh: its file as the user gave it."""

    mesh: str
    triangles: int
    rows: tuple[Row, ...]


def setups() -> Iterator[Setup]:
    """The paper's method, then one step more in each, to what the program does."""
    nothing = Refinements(**dict.fromkeys((field.name for field in fields(Refinements)), False))
    setup = Setup("the paper's method", 1, nothing, "paper", "plane")
    yield setup
    yield (setup := replace(setup, title="cut", refinements=replace(setup.refinements, cut=True)))
    yield (setup := replace(setup, title=f"{LAYERS} layers", layers=LAYERS))
    yield (setup := replace(setup, title="across layers", refinements=replace(setup.refinements, across_layers=True)))
    yield (setup := replace(setup, title="borders", refinements=replace(setup.refinements, borders=True)))
    yield (setup := replace(setup, title="caps in every view", cases="complete"))
    yield (setup := replace(setup, title="owners", refinements=replace(setup.refinements, owners=True)))
    yield (setup := replace(setup, title="flanks", refinements=replace(setup.refinements, box_faces=True)))
    yield replace(setup, title="screen tiles", tiles="screen")


def ablate(
    spec: MeshAsset, resolution: int, size: tuple[int, int], some: Iterable[Setup], pool: Executor | None = None
) -> Ablation:
    """Bakes and measures a mesh in each setup, over the views `FEW`. size: (width, height) of the pictures, pixels.

    Raises InputError, and GpuError without OpenGL.
    """
    mesh = read_mesh(spec)
    rows = []
    for setup in some:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"ablated{SUFFIX}"
            params = ModelParams(resolution=resolution, layers=setup.layers, refinements=setup.refinements)
            costs = measured_bake(spec, params, file)
            quality = measure(mesh, read_baked(file), setup.settings, size, FEW, pool)
        means = {shown.key: summarise(shown, quality.views).mean for shown in SHOWN}
        rows.append(Row(setup.title, means, costs.seconds, costs.bytes_disk, quality.gpu_bytes))
    return Ablation(str(spec.mesh), len(mesh.faces), tuple(rows))


def to_markdown(ablations: Sequence[Ablation]) -> str:
    """A table per mesh."""
    titles = "", *(measure.title for measure in SHOWN), "bake, s", "disk, MB", "GPU, MB"
    head = f"| {' | '.join(titles)} |\n{'|---' * len(titles)}|\n"
    tables = []
    for ablation in ablations:
        lines = ""
        for number, row in enumerate(ablation.rows):
            means = (cell(measure, row.means[measure.key]) for measure in SHOWN)
            costs = row.bake_seconds, row.bytes_disk / 1e6, row.bytes_gpu / 1e6
            cells = ("+ " if number else "") + row.title, *means, *(f"{cost:.1f}" for cost in costs)
            lines += f"| {' | '.join(cells)} |\n"
        tables.append(f"{Path(ablation.mesh).name}, {ablation.triangles} triangles:\n\n{head}{lines}")
    return "\n".join(tables)


def to_json(ablations: Sequence[Ablation], resolution: int) -> str:
    """The rows for programs."""
    head = {"version": depthwalk.__version__, "commit": commit(), "resolution": resolution, "layers": LAYERS}
    views = [{"elevation": view.elevation, "azimuth": view.azimuth} for view in FEW]
    document = head | {"image_size": SIZE, "views": views, "models": [asdict(ablation) for ablation in ablations]}
    return json_format.dumps(document, indent=2) + "\n"


@guarded
def main(
    meshes: Annotated[list[Path], typer.Argument(metavar="MESH", help="OBJ, PLY, STL, GLB or glTF files.")],
    json: Annotated[Path | None, typer.Option(metavar="F", help="Write the rows as JSON.")] = None,
    markdown: Annotated[Path | None, typer.Option(metavar="F", help="Write the tables.")] = None,
    dpci_resolution: Annotated[
        int,
        typer.Option(min=limits.MIN_DPCI_RESOLUTION, max=limits.MAX_DPCI_RESOLUTION, help="Side of an image, texels."),
    ] = 512,
    up: Annotated[str, typer.Option(metavar="y|z", help="The files' upward axis.")] = "y",
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure what each step from mesh to picture contributes."""
    if up not in ("y", "z"):
        raise InputError(f"--up {up}: must be y or z")
    for out in filter(None, (json, markdown)):
        check_folder(out)
    for mesh in meshes:  # each takes minutes: complain about the last one before that
        if not mesh.is_file():
            raise InputError(f"{mesh}: no such file")
    ablations = []
    with flip_workers() as pool:
        for mesh in meshes:
            spec = MeshAsset(
                name=mesh.stem, mesh=mesh, texture=None, up="z" if up == "z" else "y", height=None, dpci=None
            )
            shown = track(list(setups()), mesh.name, console=Console(stderr=True))
            ablations.append(ablate(spec, dpci_resolution, SIZE, shown, pool))
    if json is not None:
        write_bytes(json, to_json(ablations, dpci_resolution).encode())
    if markdown is not None:
        write_bytes(markdown, to_markdown(ablations).encode())
    print(to_markdown(ablations), end="")


if __name__ == "__main__":
    typer.run(main)
