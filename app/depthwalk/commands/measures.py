"""The part of the command line that measures: what `compare`, `quality` and `bench` take. See `depthwalk.commands.cli`."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk import limits
from depthwalk.commands.console import guarded
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    Axis,
    CameraAngle,
    CameraPosition,
    CameraTarget,
    Frames,
    Height,
    Layers,
    Method,
    Parts,
    PathOption,
    Quiet,
    Resolution,
    SceneArgument,
    Settings,
    Texture,
    UpAxis,
    Verbose,
    check_camera_source,
    open_scene,
    parse_axis,
    parse_camera,
    parse_layers,
    parse_parts,
    parse_resolution,
    parse_settings,
    refuse_reuse,
)


@guarded
def compare(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="OBJ, PLY, STL, GLB or glTF files; scene files, with all that has `dpci`."),
    ],
    json: Annotated[Path | None, typer.Option(metavar="F", help="Write the report as JSON.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="F", help="Write it as a page with the worst views.")] = None,
    want_psnr: Annotated[
        float | None, typer.Option(metavar="DB", help="Find the cheapest resolution and layers that reach it.")
    ] = None,
    dpci_resolution: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=limits.MIN_DPCI_RESOLUTION,
            max=limits.MAX_DPCI_RESOLUTION,
            help="Side of an image, texels.",
            show_default="512, or as the scene says",
        ),
    ] = None,
    layers: Layers = None,
    method: Annotated[
        Method | None,
        typer.Option(help="How surfaces are sampled.", show_default="raycast, or as the scene says"),
    ] = None,
    parts: Parts = None,
    axis: Axis = None,
    up: Annotated[UpAxis | None, typer.Option(help="The meshes' upward axis.", show_default="y")] = None,
    height: Height = None,
    texture: Texture = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    asset_root: Annotated[
        list[Path] | None,
        typer.Option("--asset-root", metavar="DIR", help="Folder in which the files, and what they name, may lie."),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Render setting: render.lod.bias=1.")
    ] = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure how like its mesh a mesh's depth images look, over a sphere of views; in scenes, every asset's."""
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    overrides = parse_settings(settings)
    from depthwalk.commands import compare as work
    from depthwalk.commands.subjects import Choices, find_subjects

    choices = Choices(
        dpci_resolution,
        parse_layers(layers),
        method.value if method else None,
        parse_parts(parts),
        parse_axis(axis),
        texture,
        up and up.value,
        height,
    )
    subjects = find_subjects(files, asset_root or [], choices)
    plan = work.Plan(subjects, work.parse_render_settings(overrides), size, want_psnr, html is not None)
    work.check_plan(plan, [json, html])
    work.run_compare(plan, json, html)


@guarded
def quality(
    scenes: Annotated[
        list[Path] | None, typer.Argument(metavar="SCENE", help="Scene files; room and garden, if absent.")
    ] = None,
    only: Annotated[
        str | None, typer.Option(metavar="PART,...", help="Of antialiasing, dof, shadows, edges.", show_default="all")
    ] = None,
    json: Annotated[Path | None, typer.Option(metavar="F", help="Write the report as JSON.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="F", help="Write it as a page with pictures.")] = None,
    resolution: Resolution = "512,384",
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure what smooths edges, blurs and casts shadows against pictures that took far longer; some minutes."""
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    from depthwalk.commands import quality as work

    parts = work.parse_parts(only)
    files = scenes or work.shipped_scenes()
    plan = work.Plan([open_scene(file, asset_root, settings) for file in files], parts, size)
    work.check_plan(plan, [json, html])
    work.run_quality(plan, json, html)


@guarded
def bench(
    scene: SceneArgument,
    path: PathOption = None,
    frames: Frames = None,
    warmup: Annotated[
        int, typer.Option(metavar="N", min=0, max=limits.MAX_FRAMES, help="Frames before the measured ones.")
    ] = 5,
    json: Annotated[Path | None, typer.Option(metavar="F", help="Write the report as JSON.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="F", help="Write the report as a page.")] = None,
    representations: Annotated[
        list[str] | None,
        typer.Option("--representation", metavar="R,...", help="What to compare: scene, dpci, mesh, mesh-lod, dmesh."),
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
    """Measure what a scene costs per frame and per pass, standing still or along a camera path."""
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    check_camera_source(path, camera)
    from depthwalk.commands import bench as work
    from depthwalk.scene.path import load_path

    names = work.parse_representations(representations)
    loaded = open_scene(scene, asset_root, settings)
    walk = load_path(path) if path else None
    plan = work.Plan(loaded, path, walk, camera, frames, warmup, size, names)
    work.check_report_files([json, html], plan)
    work.run_bench(plan, json, html)
