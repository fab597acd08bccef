"""Measure what each step beyond the paper's method contributes, for docs/ablation.md.

`python -m depthwalk.commands.ablation MESH...` prints a table for each mesh. The rows of the table add one step after
another to the paper's method; the last row is the program's default.
"""

import json as json_format
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

import depthwalk
from depthwalk.assets.asset_files import read_mesh
from depthwalk.bake.file import SUFFIX, read_baked
from depthwalk.bake.params import NOTHING, ModelParams, Refinements
from depthwalk.commands.baking import mesh_spec
from depthwalk.commands.options import DpciResolution, JsonReport, Meshes, Quiet, Up, UpAxis, Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.commands.progress import frame_progress
from depthwalk.commands.reports import check_report_files, write_report
from depthwalk.errors import missing_file
from depthwalk.files import temporary_folder
from depthwalk.limits import DEFAULT_DPCI_RESOLUTION
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


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Describe how meshes are baked and rendered for one row of the table.

    Attributes
    ----------
    title
        The step that this row adds to the row before.
    layers
        Number of layers of depth images.
    refinements
        What the baker does beyond the paper.
    cases, light, tiles
        The render settings `lod.cases`, `light.mode` and `warp.tile_mapping`.
    """

    title: str
    layers: int
    refinements: Refinements
    cases: str
    light: str
    tiles: str

    @property
    def settings(self) -> RenderSettings:
        """Return the render settings of this row."""
        groups = {"lod": {"cases": self.cases}, "light": {"mode": self.light}, "warp": {"tile_mapping": self.tiles}}
        return RenderSettings.model_validate(groups)


@dataclass(frozen=True, kw_only=True)
class Row:
    """Hold the measurements of one setup.

    Attributes
    ----------
    title
        The step that the setup adds.
    means
        Mean of each measure of `SHOWN` over the views, by its key, in the unit that its title names.
    bake_seconds, bytes_disk, bytes_gpu
        The costs: bake time, seconds; size of the file, bytes; GPU memory, bytes.
    """

    title: str
    means: dict[str, float]
    bake_seconds: float
    bytes_disk: int
    bytes_gpu: int


@dataclass(frozen=True)
class Ablation:
    """Hold the table of one mesh.

    Attributes
    ----------
    mesh
        The mesh file as the user gave it.
    triangles
        Number of its triangles.
    rows
        One row for each setup.
    """

    mesh: str
    triangles: int
    rows: tuple[Row, ...]


def setups() -> Iterator[Setup]:
    """Yield the paper's method, then setups that each add one step, up to the program's default."""
    setup = Setup(title="the paper's method", layers=1, refinements=NOTHING, cases="paper", light="warp", tiles="plane")
    yield setup
    yield (
        setup := replace(
            setup, title="discontinuity cut", refinements=replace(setup.refinements, discontinuity_cut=True)
        )
    )
    yield (setup := replace(setup, title=f"{LAYERS} layers", layers=LAYERS))
    yield (setup := replace(setup, title="across layers", refinements=replace(setup.refinements, across_layers=True)))
    yield (
        setup := replace(setup, title="boundary strips", refinements=replace(setup.refinements, boundary_strips=True))
    )
    yield (setup := replace(setup, title="caps in every view", cases="complete"))
    yield (setup := replace(setup, title="owners", refinements=replace(setup.refinements, owners=True)))
    yield (setup := replace(setup, title="box faces", refinements=replace(setup.refinements, box_faces=True)))
    yield (setup := replace(setup, title="light per pixel", light="deferred"))
    yield replace(setup, title="screen tiles", tiles="screen")


def ablate(
    spec: MeshAsset,
    resolution: int,
    size: tuple[int, int],
    chosen: Iterable[Setup],
    pool: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> Ablation:
    """Bake and measure a mesh in each setup, over the views `FEW`.

    Parameters
    ----------
    spec
        The asset whose mesh is baked and measured.
    resolution
        Width and height of its depth images, texels.
    size
        (width, height) of the pictures, pixels.
    chosen
        The setups to measure, in order.
    pool
        Processes that compute FLIP; None computes it in this process.
    advance
        Called after each setup.

    Returns
    -------
    Ablation
        A row for each setup.

    Raises
    ------
    InputError
        If the mesh cannot be baked.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    mesh = read_mesh(spec)
    rows = []
    for setup in chosen:
        with temporary_folder() as folder:
            file = Path(folder) / f"ablated{SUFFIX}"
            params = ModelParams(resolution=resolution, layers=setup.layers, refinements=setup.refinements)
            costs = measured_bake(spec, params, file)
            quality = measure(mesh, read_baked(file), setup.settings, size, FEW, pool)
        row = Row(
            title=setup.title,
            means={shown.key: summarise(shown, quality.views).mean for shown in SHOWN},
            bake_seconds=costs.seconds,
            bytes_disk=costs.bytes_disk,
            bytes_gpu=quality.gpu_bytes,
        )
        rows.append(row)
        advance()
    return Ablation(str(spec.mesh), len(mesh.faces), tuple(rows))


def to_markdown(ablations: Sequence[Ablation]) -> str:
    """Return Markdown text with a table for each of `ablations`."""
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
    """Return `ablations` as JSON text, with `resolution`, the width of their depth images, texels, and the views."""
    head = {"version": depthwalk.__version__, "commit": commit(), "resolution": resolution, "layers": LAYERS}
    views = [{"elevation": view.elevation, "azimuth": view.azimuth} for view in FEW]
    document = head | {"image_size": SIZE, "views": views, "models": [asdict(ablation) for ablation in ablations]}
    return json_format.dumps(document, indent=2) + "\n"


@guarded
def main(
    meshes: Meshes,
    json: JsonReport = None,
    markdown: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the tables to this file, as Markdown.")
    ] = None,
    dpci_resolution: DpciResolution = DEFAULT_DPCI_RESOLUTION,
    up: Up = UpAxis.Y,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure what each step beyond the paper's method contributes to the picture, and what it costs."""
    check_report_files([json, markdown], meshes, "measured")
    for mesh in meshes:  # each takes minutes, so report a missing one before the first is measured
        if not mesh.is_file():
            raise missing_file(mesh)
    ablations = []
    chosen = list(setups())
    with flip_workers() as pool:
        for mesh in meshes:
            spec = mesh_spec(mesh, None, up.value, None)
            with frame_progress(mesh.name, len(chosen)) as advance:
                ablations.append(ablate(spec, dpci_resolution, SIZE, chosen, pool, advance))
    write_report(json, to_json(ablations, dpci_resolution))
    write_report(markdown, to_markdown(ablations))
    print(to_markdown(ablations), end="")


if __name__ == "__main__":
    as_program(main)()
