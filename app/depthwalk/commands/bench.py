"""Declare `depthwalk bench`, which measures how long the frames of a scene take, and each of their passes."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    CacheLimit,
    CameraAngle,
    CameraPosition,
    CameraTarget,
    Frames,
    HtmlReport,
    JsonReport,
    PathOption,
    Quiet,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
    check_camera_source,
    open_scene,
    parse_camera,
    parse_resolution,
)
from depthwalk.commands.program import FAILURE, guarded
from depthwalk.limits import MAX_FRAMES


@guarded
def main(
    scene: SceneArgument,
    path: PathOption = None,
    frames: Frames = None,
    warmup: Annotated[
        int, typer.Option(metavar="N", min=0, max=MAX_FRAMES, help="Frames drawn before measuring begins.")
    ] = 5,
    json: JsonReport = None,
    html: HtmlReport = None,
    table: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write what was noted of each frame to this file, as CSV."),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Report of an earlier --json run to compare with; exit with code 1 where frames got slower.",
        ),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="PERCENT", min=0, max=1000, help="What --baseline takes for chance."),
    ] = 5.0,
    representations: Annotated[
        list[str] | None,
        typer.Option(
            "--representation",
            metavar="R,...",
            help="Representations to compare: scene, dpci, mesh, mesh-lod, mesh-clusters, dmesh; of reliefs also "
            "relief, distance, parallax, bump, displacement, relief-texture; of meshes octahedral, billboard; or auto.",
        ),
    ] = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure how long the frames of a scene and their passes take.

    The camera stands still, or follows the camera path of --path. Several representations take turns, frame by frame.
    """
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    check_camera_source(path, camera)
    from depthwalk.bench.baseline import change_lines, changes, check_comparable, read_report
    from depthwalk.bench.page import pictured_frames, to_html
    from depthwalk.bench.report import to_csv, to_json, to_text
    from depthwalk.commands.benchmark import Plan, parse_representations, run_bench
    from depthwalk.commands.reports import check_report_files, input_files, write_report
    from depthwalk.scene.path import load_path

    names = parse_representations(representations)
    before = read_report(baseline) if baseline else None
    plan = Plan(
        scene=open_scene(scene, asset_root, settings),
        path_file=path,
        path=load_path(path) if path else None,
        camera=camera,
        frames=frames,
        warmup=warmup,
        size=size,
        representations=names,
        pictured=pictured_frames if html else None,
    )
    read = [*input_files(plan.scene, path), *([baseline] if baseline and baseline != json else [])]
    check_report_files([json, html, table], read, "measured")
    if baseline and before:
        check_comparable(
            baseline,
            before,
            scene=plan.scene.path,
            path=path,
            resolution=size,
            frames=plan.frame_count,
            representations=names,
        )
    report = run_bench(plan)
    found = changes(before, report, tolerance / 100) if before else []
    changed = change_lines(baseline, before, report, found) if baseline and before else []
    write_report(json, to_json(report))
    write_report(html, to_html(report, changed) if html else "")
    write_report(table, to_csv(report))
    print("\n".join([to_text(report), *(["", *changed] if changed else [])]))
    if any(change.verdict == "slower" for change in found):
        raise typer.Exit(FAILURE)
