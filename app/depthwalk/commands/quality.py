"""Declare `depthwalk quality`, which compares anti-aliasing, depth of field and shadows with reference pictures."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.options import (
    AssetRoots,
    HtmlReport,
    JsonReport,
    Quiet,
    Resolution,
    Settings,
    Verbose,
    open_scene,
    parse_resolution,
    refuse_reuse,
)
from depthwalk.commands.program import guarded


@guarded
def main(
    scenes: Annotated[
        list[Path] | None, typer.Argument(metavar="SCENE", help="Scene files; the room and the garden by default.")
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="PART,...", help="What to measure, of antialiasing, dof, shadows and edges.", show_default="all"
        ),
    ] = None,
    json: JsonReport = None,
    html: HtmlReport = None,
    resolution: Resolution = "512,384",
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure anti-aliasing, depth of field and shadows against reference pictures.

    Takes some minutes: the references are rendered with many samples per pixel.
    """
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    from depthwalk.commands.examination import check_size, parse_parts, run_quality, shipped_scenes
    from depthwalk.commands.reports import check_report_files, input_files, write_report
    from depthwalk.quality.overview import to_html, to_json, to_text

    parts = parse_parts(only)
    check_size(size)
    loaded = [open_scene(file, asset_root, settings) for file in scenes or shipped_scenes()]
    check_report_files([json, html], [file for scene in loaded for file in input_files(scene, None)], "examined")
    overview = run_quality(loaded, parts, size)
    write_report(json, to_json(overview))
    write_report(html, to_html(overview))
    print(to_text(overview))
