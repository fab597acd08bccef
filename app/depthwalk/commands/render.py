"""Declare `depthwalk render`, which draws a scene, or the frames of a camera path, to pictures or a video."""

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
    NoBackground,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
    check_camera_source,
    open_scene,
    parse_camera,
    parse_resolution,
    refuse_reuse,
    representation,
)
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError


@guarded
def main(
    scene: SceneArgument,
    out: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="OUT",
            help="PNG, JPEG, EXR or MP4 file; {frame:4} in its name numbers the files of a path; - is stdout.",
        ),
    ],
    path: PathOption = None,
    frames: Frames = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
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
    options = parse_camera(camera_position, camera_target, camera_view_angle)
    check_camera_source(path, options)
    if frames is not None and path is None:
        raise InputError("--frames: needs --path")
    from depthwalk.commands.output import Output, check_output, draw_frames, open_headless, path_cameras, smooth
    from depthwalk.commands.reports import input_files
    from depthwalk.scene.path import load_path

    loaded = open_scene(scene, asset_root, settings)
    walk = load_path(path) if path else None
    cameras = path_cameras(walk, frames) if walk else None
    output = Output(out, no_background)
    if output.suffix != ".exr":  # its distances are those in the middles of pixels
        smooth(loaded, size)
    check_output(output, len(cameras or [None]), walk is not None, input_files(loaded, path))
    with open_headless(loaded, size, representation(representation_name)) as headless:
        if cameras is None:
            cameras = [options.apply(loaded.camera or headless.frame_all())]
        draw_frames(headless, cameras, output, walk.fps if walk else 1.0)
