"""Declare `depthwalk render`, which draws a scene, or the frames of a camera path, to pictures or a video."""

import logging
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.option_values import (
    CameraOptions,
    check_camera_source,
    open_files,
    parse_camera,
    parse_resolution,
    refuse_reuse,
    representation,
    still_representation,
    warn_if_empty,
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
    Moment,
    NoBackground,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    Settings,
    SideBySide,
    Sky,
    Texture,
    Verbose,
    named_files,
)
from depthwalk.commands.program import guarded, without_garbage_collection
from depthwalk.errors import InputError

if TYPE_CHECKING:
    from depthwalk.render.headless import HeadlessRenderer
    from depthwalk.scene.arrays import Camera
    from depthwalk.scene.scene import Scene

log = logging.getLogger("depthwalk")

_TURNTABLE_FPS = 30
_LONGEST_TURN = 3600  # seconds
_LATEST = 1_000_000  # seconds


@guarded
def main(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="Scene file, or meshes, which are shown together.",
            show_default=False,
            callback=named_files,
        ),
    ],
    out: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="OUT",
            help="PNG, JPEG, WebP, EXR, MP4 or GIF file to write; {frame:4} in its name is the frame's number; - is "
            "stdout.",
        ),
    ],
    side_by_side: SideBySide = False,
    path: PathOption = None,
    turntable: Annotated[
        float | None,
        typer.Option(
            "--turntable",
            metavar="SECONDS",
            help=f"Go once around the camera's target in this time, at {_TURNTABLE_FPS} frames per second.",
        ),
    ] = None,
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
    time: Moment = 0.0,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    no_background: NoBackground = False,
    texture: Texture = None,
    sky: Sky = None,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Render a scene, or the frames of a camera path, to picture files.

    Several meshes, such as the parts of a machine or the tiles of a scan, keep the places of their files.
    """
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    options = parse_camera(camera_position, camera_target, camera_view_angle, camera_direction)
    check_camera_source(path, options)
    where = parse_cluster(cluster)
    _check_together(path, turntable, frames=frames, resume=resume, on_cluster=where is not None)
    _check_time(time, path)
    with without_garbage_collection():
        from depthwalk.commands.frame_drawing import draw_frames, open_headless, parse_frames, smooth
        from depthwalk.commands.frame_keys import frame_keys
        from depthwalk.commands.output import Output, check_output, check_webp
        from depthwalk.commands.reports import input_files
        from depthwalk.render.up_axis import stand_upright
        from depthwalk.scene.path import load_path

        loaded = open_files(files, asset_root, settings, sky=sky, side_by_side=side_by_side, texture=texture)
        warn_if_empty(loaded)
        walk = load_path(path) if path else None
        turns = max(round(turntable * _TURNTABLE_FPS), 1) if turntable else 0  # frames
        numbers = parse_frames(frames, len(walk.frames()) if walk else turns) if walk or turns else range(1)
    output = Output(out, no_background)
    if output.suffix != ".exr":  # its distances belong to the centres of pixels
        smooth(loaded, size)
    check_output(output, numbers, walk is not None or turns > 0, input_files(loaded, path))
    check_webp(output, size, resumes=resume or where is not None)
    if resume and not output.is_series:
        raise InputError(f"{out}: --resume needs a file for each frame; put {{frame:4}} into the name")
    if where and path:
        from depthwalk.commands.cluster_render import render_on_cluster
        from depthwalk.commands.frame_chunks import RenderJob

        if loaded.beside or texture:
            raise InputError("--cluster: draws a scene file, or one mesh without --texture")
        job = RenderJob(
            scene=loaded.path,
            path=path,
            asset_roots=tuple(asset_root or ()),
            settings=tuple(settings or ()),
            sky=sky,
            size=size,
            representation=representation_name,
            output=output,
        )
        if not render_on_cluster(where, loaded, numbers, job):
            raise typer.Exit(FAILURE)
        return
    if time and loaded.animations is None:
        log.warning("--time: nothing in %s is animated", loaded.title)
    cameras = [walk.sample(number / walk.fps) for number in numbers] if walk else []
    drawn_as = (
        representation(representation_name) if walk else still_representation(representation_name, files, settings)
    )
    keys: list[str] = []
    if output.is_series and walk:
        named = frame_keys(
            loaded, settings or (), size=size, representation=representation_name, output=output, sky=sky
        )
        keys = [named.key(camera) for camera in cameras]
    with ExitStack() as stack:
        with without_garbage_collection():
            headless = stack.enter_context(open_headless(loaded, size, drawn_as))
        for note in stand_upright(loaded, headless.renderer):
            log.warning("%s", note)
        if not walk:
            cameras = _cameras(headless, loaded, options, time, turns)[numbers.start : numbers.stop]
        draw_frames(headless, cameras, output, walk.fps if walk else _TURNTABLE_FPS, keys, numbers[0], resume)


def _cameras(
    headless: "HeadlessRenderer", loaded: "Scene", options: CameraOptions, seconds: float, turns: int
) -> list["Camera"]:
    """Return the camera of a still picture at a moment, or those of the `turns` frames of a turntable."""
    from depthwalk.commands.frame_drawing import turntable_cameras

    frame_all = partial(headless.frame_all, turns=turns > 0)
    camera = replace(options.apply(loaded.camera or frame_all(), frame_all), time=seconds)
    return turntable_cameras(camera, turns, _TURNTABLE_FPS) if turns else [camera]


def _check_together(
    path: Path | None, turntable: float | None, *, frames: str | None, resume: bool, on_cluster: bool
) -> None:
    """Raise InputError if options are given that exclude or need each other."""
    for option, given in ("--resume", resume), ("--cluster", on_cluster):
        if given and path is None:
            raise InputError(f"{option}: needs --path")
    if frames is not None and path is None and turntable is None:
        raise InputError("--frames: needs --path or --turntable")
    _check_turntable(turntable, path)


def _check_time(seconds: float, path: Path | None) -> None:
    """Raise InputError if the scene cannot be shown at this moment, or follows the time of a `path`."""
    if seconds and path is not None:
        raise InputError("--time: animations run along with --path; leave out one of the two")
    if not abs(seconds) <= _LATEST:  # false for NaN, too
        raise InputError(f"--time {seconds:g}: must be a number of seconds up to {_LATEST}")


def _check_turntable(seconds: float | None, path: Path | None) -> None:
    """Raise InputError if a turn of this many seconds is impossible, or the camera follows a `path`."""
    if seconds is None:
        return
    if path is not None:
        raise InputError("--turntable: places the camera; leave out --path")
    if not 0 < seconds <= _LONGEST_TURN:  # false for NaN, too
        raise InputError(f"--turntable {seconds:g}: must be above 0 and at most {_LONGEST_TURN} seconds")
