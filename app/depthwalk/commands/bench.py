"""Declare `depthwalk bench`, which measures how long the frames of a scene take, and each of their passes."""

from typing import Annotated

import typer

from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
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
from depthwalk.commands.program import guarded
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
    representations: Annotated[
        list[str] | None,
        typer.Option(
            "--representation",
            metavar="R,...",
            help="Representations to compare: scene, dpci, mesh, mesh-lod, dmesh; of reliefs also relief, distance, "
            "parallax, bump, displacement.",
        ),
    ] = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure how long the frames of a scene and their passes take.

    The camera stands still, or follows the camera path of --path.
    """
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    check_camera_source(path, camera)
    from depthwalk.bench.report import to_html, to_json, to_text
    from depthwalk.commands.benchmark import Plan, parse_representations, run_bench
    from depthwalk.commands.reports import check_report_files, input_files, write_report
    from depthwalk.scene.path import load_path

    names = parse_representations(representations)
    plan = Plan(
        scene=open_scene(scene, asset_root, settings),
        path_file=path,
        path=load_path(path) if path else None,
        camera=camera,
        frames=frames,
        warmup=warmup,
        size=size,
        representations=names,
    )
    check_report_files([json, html], input_files(plan.scene, path), "measured")
    report = run_bench(plan)
    write_report(json, to_json(report))
    write_report(html, to_html(report))
    print(to_text(report))
