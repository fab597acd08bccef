"""Declare `depthwalk render`, which draws a scene, or the frames of a camera path, to pictures or a video."""

import logging
from contextlib import ExitStack
from typing import Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.option_values import (
    check_camera_source,
    open_scene,
    parse_camera,
    parse_resolution,
    refuse_reuse,
    representation,
    still_representation,
)
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    CacheLimit,
    CameraAngle,
    CameraDirection,
    CameraPosition,
    CameraTarget,
    ClusterOption,
    NoBackground,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    Settings,
    ShownScene,
    Verbose,
)
from depthwalk.commands.program import guarded, without_garbage_collection
from depthwalk.errors import InputError

log = logging.getLogger("depthwalk")


@guarded
def main(
    scene: ShownScene,
    out: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="OUT",
            help="PNG, JPEG, EXR or MP4 file to write; {frame:4} in its name is the frame's number; - is stdout.",
        ),
    ],
    path: PathOption = None,
    frames: Annotated[
        str | None,
        typer.Option("--frames", metavar="N|A-B", help="The first N frames of the path, or frames A to B."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Skip frames that an earlier run has already drawn from the same input; always on with --cluster.",
        ),
    ] = False,
    cluster: ClusterOption = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    camera_direction: CameraDirection = None,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    no_background: NoBackground = False,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Render a scene, or the frames of a camera path, to picture files."""
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    options = parse_camera(camera_position, camera_target, camera_view_angle, camera_direction)
    check_camera_source(path, options)
    where = parse_cluster(cluster)
    for option, given in (("--frames", frames is not None), ("--resume", resume), ("--cluster", where is not None)):
        if given and path is None:
            raise InputError(f"{option}: needs --path")
    with without_garbage_collection():
        from depthwalk.commands.frame_drawing import draw_frames, open_headless, parse_frames, smooth
        from depthwalk.commands.frame_keys import frame_keys
        from depthwalk.commands.output import Output, check_output
        from depthwalk.commands.reports import input_files
        from depthwalk.render.up_axis import stand_upright
        from depthwalk.scene.path import load_path

        loaded = open_scene(scene, asset_root, settings)
        walk = load_path(path) if path else None
        numbers = parse_frames(frames, walk) if walk else range(1)
    output = Output(out, no_background)
    if output.suffix != ".exr":  # its distances belong to the centres of pixels
        smooth(loaded, size)
    check_output(output, numbers, walk is not None, input_files(loaded, path))
    if resume and not output.is_series:
        raise InputError(f"{out}: --resume needs a file for each frame; put {{frame:4}} into the name")
    if where and path:
        from depthwalk.commands.cluster_render import render_on_cluster

        job = scene, path, asset_root or [], settings or [], size, representation_name, output
        if not render_on_cluster(where, loaded, numbers, *job):
            raise typer.Exit(FAILURE)
        return
    cameras = [walk.sample(number / walk.fps) for number in numbers] if walk else []
    drawn_as = (
        representation(representation_name) if walk else still_representation(representation_name, scene, settings)
    )
    keys: list[str] = []
    if output.is_series and walk:
        named = frame_keys(loaded, settings or (), size, str(representation_name), no_background, output.suffix)
        keys = [named.key(camera) for camera in cameras]
    with ExitStack() as stack:
        with without_garbage_collection():
            headless = stack.enter_context(open_headless(loaded, size, drawn_as))
        if turned := stand_upright(loaded, headless.renderer):
            log.warning("%s", turned)
        cameras = cameras or [options.apply(loaded.camera or headless.frame_all(), headless.frame_all)]
        draw_frames(headless, cameras, output, walk.fps if walk else 1.0, keys, numbers[0], resume)
