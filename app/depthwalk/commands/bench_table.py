"""Compare frame times of a scene with those of its polygons at equal quality, for docs/bench.md.

`python -m depthwalk.commands.bench_table SCENE --path P` prints a row for each number of objects. A row takes minutes
and is stored in the JSON file at once, so that an interrupted table continues where it stopped.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

import depthwalk
from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.rows import COLUMNS, Row, make_row, row_from
from depthwalk.bench.table_walk import Walk
from depthwalk.commands.option_values import open_scene, parse_resolution
from depthwalk.commands.options import DEFAULT_RESOLUTION, AssetRoots, Quiet, SceneArgument, Settings, Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.commands.progress import asset_progress
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.gpu.headless_device import headless_device
from depthwalk.quality.measure import flip_workers
from depthwalk.scene.path import load_path

_COUNTS = "1,10,100,1000,10000"
_GPU_COUNTS, _GPU_RESOLUTION = "10000,100000,200000", "1920,1080"
_RATIOS = (
    ("mesh", "scene"),
    ("mesh-lod", "scene"),
    ("mesh-clusters", "scene"),
    ("unoccluded", "scene"),
    ("mesh-lod", "re-warped"),
)


@guarded
def main(
    scene: SceneArgument,
    path: Annotated[Path, typer.Option(metavar="FILE", help="Camera path file.", show_default=False)],
    counts: Annotated[
        str | None,
        typer.Option(
            metavar="N,...",
            help="Numbers of objects; each has its own row.",
            show_default=f"{_COUNTS}; with --gpu {_GPU_COUNTS}",
        ),
    ] = None,
    frames: Annotated[int, typer.Option(metavar="N", min=1, help="Moments of the path at which frames are timed.")] = 8,
    run: Annotated[int, typer.Option(metavar="N", min=1, help="Consecutive frames timed at each moment.")] = 8,
    seconds: Annotated[
        float, typer.Option(metavar="S", min=0, help="Seconds to spend on timing each way to draw, per row.")
    ] = 60,
    resolution: Annotated[
        str | None,
        typer.Option(
            metavar="W,H|WxH",
            help="Width and height of the pictures, pixels.",
            show_default=f"{DEFAULT_RESOLUTION}; with --gpu {_GPU_RESOLUTION}",
        ),
    ] = None,
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Store rows in this file, and reuse those that it already holds."),
    ] = None,
    gpu: Annotated[bool, typer.Option("--gpu", help="Use the defaults for a GPU, and list a time per pass.")] = False,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Compare frame times of meshes, mesh-lod, mesh-clusters and the scene as it is, tuned to the mean FLIP of one."""
    size = parse_resolution(resolution or (_GPU_RESOLUTION if gpu else DEFAULT_RESOLUTION))
    numbers = _parse_counts(counts or (_GPU_COUNTS if gpu else _COUNTS))
    loaded, camera_path = open_scene(scene, asset_root, settings), load_path(path)
    if max(numbers) > (world := len(loaded.objects)):
        raise InputError(
            f"--counts {max(numbers)}: {scene} has {world} objects; add some with --set objects.0.grid.count=[X,Z]"
        )
    walk = Walk.along(camera_path, frames, run, seconds, size)
    head = {
        "version": depthwalk.__version__,
        "renderer": _driver(gpu),
        "resolution": list(size),
        "scene": str(scene),
        "path": str(path),
        "settings": list(settings or ()),
        "frames": frames,
    }
    rows = {} if json_file is None else _stored_rows(json_file, head)
    with asset_progress() as report, flip_workers() as pool:
        library = SceneLibrary(loaded.assets, report, processes=None)
        for count in numbers:
            if count not in rows:
                rows[count] = make_row(walk, loaded, library, count, pool, partial(report, f"{count} objects"))
            if json_file is not None:
                document = head | {"rows": [asdict(rows[number]) for number in sorted(rows)]}
                write_bytes(json_file, (json.dumps(document, indent=2) + "\n").encode())
    print("\n".join(_lines(head, [rows[count] for count in numbers], gpu)))


def _parse_counts(text: str) -> list[int]:
    try:
        counts = [int(part) for part in text.split(",")]
    except ValueError:
        counts = []
    if not counts or min(counts) < 1:
        raise InputError(f"--counts {text}: must be N,…, whole numbers from 1")
    return counts


def _driver(gpu: bool) -> str:
    """Return the GL driver's name. Raises InputError if --gpu is given and OpenGL runs on the CPU."""
    device = headless_device()
    device.context.release()
    if gpu and device.software:
        raise InputError(f"--gpu: OpenGL here is {device.renderer}, which runs on the CPU")
    return device.renderer


def _stored_rows(file: Path, head: dict[str, Any]) -> dict[int, Row]:
    """Return the rows of an earlier table by number of objects; `head` must be the same in both tables.

    Raises
    ------
    InputError
        If the file holds something else, or a table of other measurements.
    """
    check_folder(file)
    if not file.exists():
        return {}
    try:
        document = json.loads(file.read_text("utf-8"))
        rows = {row["objects"]: row_from(row) for row in document["rows"]}
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{file}: not a table of bench_table: {error}") from None
    for key, value in head.items():
        if document.get(key) != value:
            raise InputError(f"{file}: holds a table of another {key}, {document.get(key)!r} instead of {value!r}")
    if any(row.columns.keys() != COLUMNS.keys() for row in rows.values()):
        raise InputError(f"{file}: holds a table of other columns than {', '.join(COLUMNS)}")
    return rows


def _lines(head: dict[str, Any], rows: list[Row], passes: bool) -> Iterator[str]:
    """Yield the lines of the table; with `passes`, also the time of each pass."""
    width, height = head["resolution"]
    yield f"{head['scene']}, {head['path']}, {width} × {height}, {head['renderer']}"
    yield "milliseconds per frame, means (1000 × FLIP, the setting that reaches it)"
    yield (
        "objects".rjust(9)
        + "".join(name.rjust(30) for name in COLUMNS)
        + "".join(f"{slow} / {fast}".rjust(22) for slow, fast in _RATIOS)
    )
    for row in rows:
        cells = [f"{row.objects:,}".rjust(9)]
        for name in COLUMNS:
            column = row.columns[name]
            note = "" if column.flip is None else " (" + f"{1e3 * column.flip:.2f} {column.setting}".strip() + ")"
            cells.append(f"{column.frame_ms:.2f}{note}".rjust(30))
        cells += [f"{row.columns[slow].frame_ms / row.columns[fast].frame_ms:.2f}".rjust(22) for slow, fast in _RATIOS]
        yield "".join(cells)
    for row in rows:
        yield f"{row.objects:,} objects: the reference is {row.reference}"
        if passes:
            for name, column in row.columns.items():
                times = ", ".join(f"{key} {value:.2f}" for key, value in column.passes_ms.items())
                yield f"  {name}: {times}"


if __name__ == "__main__":
    as_program(main)()
