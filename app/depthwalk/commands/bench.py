"""Declare `depthwalk bench`, which measures how long the frames of a scene and their passes take."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.option_values import check_camera_source, parse_camera, parse_resolution, warn_if_empty
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    CacheLimit,
    CameraAngle,
    CameraPosition,
    CameraTarget,
    ClusterOption,
    Frames,
    HtmlReport,
    JsonReport,
    PathOption,
    Quiet,
    Resolution,
    Settings,
    Verbose,
    named_files,
)
from depthwalk.commands.program import guarded
from depthwalk.limits import MAX_FRAMES


@guarded
def main(
    scenes: Annotated[
        list[Path],
        typer.Argument(
            metavar="SCENE",
            help="Scene files or meshes. For several, names of reports must hold {scene}, as in {scene}.json.",
            show_default=False,
            callback=named_files,
        ),
    ],
    path: PathOption = None,
    frames: Frames = None,
    warmup: Annotated[
        int, typer.Option(metavar="N", min=0, max=MAX_FRAMES, help="Frames drawn before measuring begins.")
    ] = 5,
    json: JsonReport = None,
    html: HtmlReport = None,
    table: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write the measurements of each frame to this file, as CSV."),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Report of an earlier --json run to compare with; exit with code 1 if frames became slower.",
        ),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(
            metavar="PERCENT",
            min=0,
            max=1000,
            help="Change of the frame time, per cent, that --baseline attributes to chance.",
        ),
    ] = 5.0,
    representations: Annotated[
        list[str] | None,
        typer.Option(
            "--representation",
            metavar="R,...",
            help="Representations to compare: scene, dpci, mesh, mesh-lod, mesh-clusters, dmesh; of reliefs also "
            "relief, distance, parallax, bump, displacement, relief-texture, bar-texture; of meshes octahedral, "
            "billboard; or auto.",
        ),
    ] = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cluster: ClusterOption = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure how long the frames of scenes and their passes take.

    The camera stands still, or follows the camera path of --path. Several representations take turns, frame by frame.
    After Ctrl-C, the same command continues with the scenes that it has not measured.
    """
    where = parse_cluster(cluster)
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    check_camera_source(path, camera)
    from depthwalk.bench.baseline import check_comparable, read_report
    from depthwalk.bench.page import pictured_frames
    from depthwalk.commands.bench_reports import ReportFiles, report_files, write_reports
    from depthwalk.commands.benchmark import Plan, parse_representations, run_benches
    from depthwalk.commands.reports import check_report_files, input_files
    from depthwalk.commands.scene_file import SceneFile
    from depthwalk.scene.path import load_path

    names = parse_representations(representations)
    files = report_files(scenes, ReportFiles(json=json, html=html, table=table, baseline=baseline))
    baselines = [read_report(paths.baseline) if paths.baseline else None for paths in files]
    walk = load_path(path) if path else None
    plans = [
        Plan(
            file=SceneFile(path=scene, asset_roots=tuple(asset_root or ()), settings=tuple(settings or ())),
            path_file=path,
            path=walk,
            camera=camera,
            frames=frames,
            warmup=warmup,
            size=size,
            representations=names,
            pictured=pictured_frames if html else None,
        )
        for scene in scenes
    ]
    inputs = []
    for plan in plans:
        warn_if_empty(scene := plan.file.open())
        inputs.append(input_files(scene, path))
    read = [file for own in inputs for file in own]
    read += [paths.baseline for paths in files if paths.baseline and paths.baseline != paths.json]
    check_report_files([file for paths in files for file in (paths.json, paths.html, paths.table)], read, "measured")
    for plan, paths, before in zip(plans, files, baselines, strict=True):
        if paths.baseline and before:
            check_comparable(
                paths.baseline,
                before,
                scene=plan.file.path,
                path=path,
                resolution=size,
                frames=plan.frame_count,
                representations=names,
            )
    with run_benches(plans, inputs, where) as reports:
        is_slower = [
            write_reports(report, paths, before, tolerance / 100)
            for report, paths, before in zip(reports, files, baselines, strict=True)
        ]
    if any(is_slower):
        raise typer.Exit(FAILURE)
