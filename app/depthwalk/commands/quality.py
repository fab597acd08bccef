"""Declare `depthwalk quality`, which compares anti-aliasing, depth of field and shadows with reference pictures."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.option_values import parse_resolution, refuse_reuse
from depthwalk.commands.options import (
    AssetRoots,
    ClusterOption,
    HtmlReport,
    JsonReport,
    Quiet,
    Resolution,
    Settings,
    Verbose,
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
            metavar="PART,...", help="What to measure: antialiasing, dof, shadows, edges.", show_default="all"
        ),
    ] = None,
    json: JsonReport = None,
    html: HtmlReport = None,
    resolution: Resolution = "512,384",
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cluster: ClusterOption = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure anti-aliasing, depth of field and shadows against reference pictures.

    Takes some minutes: the references are rendered with many samples per pixel. After Ctrl-C, the same command
    continues where it stopped.
    """
    refuse_reuse(settings)
    where = parse_cluster(cluster)
    size = parse_resolution(resolution)
    from depthwalk.commands.examination import check_size, parse_parts, run_quality, shipped_scenes
    from depthwalk.commands.reports import check_report_files, input_files, write_report
    from depthwalk.commands.scene_file import SceneFile
    from depthwalk.quality.overview import to_html, to_json, to_text

    parts = parse_parts(only)
    check_size(size)
    roots, changes = tuple(asset_root or ()), tuple(settings or ())
    files = [SceneFile(path=file, asset_roots=roots, settings=changes) for file in scenes or shipped_scenes()]
    loaded = [file.open() for file in files]
    check_report_files([json, html], [file for scene in loaded for file in input_files(scene, None)], "examined")
    with run_quality(files, loaded, parts, size, where) as overview:
        write_report(json, to_json(overview))
        write_report(html, to_html(overview))
        print(to_text(overview))
