"""`depthwalk bench`: what a scene costs, per frame and per pass."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

import depthwalk
from depthwalk.bench.measure import Report, Run, measure, sample_path
from depthwalk.bench.report import to_html, to_json, to_text
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    CameraAngle,
    CameraOptions,
    CameraPosition,
    CameraTarget,
    Frames,
    HtmlReport,
    JsonReport,
    PathOption,
    Quiet,
    RepresentationName,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
    check_camera_source,
    open_scene,
    parse_camera,
    parse_resolution,
    representation,
)
from depthwalk.commands.output import open_headless
from depthwalk.commands.program import guarded
from depthwalk.commands.progress import frame_progress
from depthwalk.commands.reports import check_report_files, input_files, write_report
from depthwalk.errors import InputError
from depthwalk.limits import MAX_FRAMES
from depthwalk.provenance import commit
from depthwalk.scene.path import CameraPath, load_path
from depthwalk.scene.scene import Scene

DEFAULT_FRAMES = 60  # of a camera that stands still


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
            "--representation", metavar="R,...", help="Representations to compare: scene, dpci, mesh, mesh-lod, dmesh."
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


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Say what to measure.

    Attributes
    ----------
    scene
        What is drawn.
    path_file, path
        The camera path and its file, or None for a camera that stands still.
    camera
        Changes to the camera that stands still.
    frames
        Number of measured frames; None takes every frame of the path.
    warmup
        Number of frames drawn before those.
    size
        (width, height) of the pictures, pixels.
    representations
        What to compare, one after the other.
    """

    scene: Scene
    path_file: Path | None
    path: CameraPath | None
    camera: CameraOptions
    frames: int | None
    warmup: int
    size: tuple[int, int]
    representations: Sequence[RepresentationName]


def parse_representations(texts: Sequence[str] | None) -> list[RepresentationName]:
    """Return the names in repeated options and comma-separated lists, each once. Raises InputError."""
    names = [name.strip() for text in texts or ["scene"] for name in text.split(",")]
    unknown = [name for name in names if name not in set(RepresentationName)]
    if unknown:
        raise InputError(f"--representation {unknown[0]}: must be one of {', '.join(RepresentationName)}")
    return [RepresentationName(name) for name in dict.fromkeys(names)]


def run_bench(plan: Plan) -> Report:
    """Draw and time the frames of `plan` in each representation."""
    runs: list[Run] = []
    for name in plan.representations:
        with open_headless(plan.scene, plan.size, representation(name)) as headless:
            headless.renderer.remembers = True
            if plan.path is not None:
                cameras = sample_path(plan.path, plan.frames)
            else:
                still = plan.camera.apply(plan.scene.camera or headless.frame_all())
                cameras = [still] * (plan.frames or DEFAULT_FRAMES)
            with frame_progress(name, len(cameras)) as advance:
                runs.append(measure(headless, name, cameras, plan.warmup, advance))
            renderer, timer = headless.device.renderer, headless.renderer.timers.kind
    return Report(
        version=depthwalk.__version__,
        commit=commit(),
        renderer=renderer,
        timer=timer,
        resolution=plan.size,
        scene=str(plan.scene.path),
        path=None if plan.path_file is None else str(plan.path_file),
        runs=tuple(runs),
    )
