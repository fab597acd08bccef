"""The command line: what each command takes. The work is in `commands`, imported when its command runs, so that
`depthwalk --help` waits for no graphics library, and `depthwalk check` for no window's and no GL context."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from depthwalk import limits
from depthwalk.commands.console import BAD_INPUT, guarded
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    Axis,
    CameraAngle,
    CameraPosition,
    CameraTarget,
    Frames,
    Layers,
    NoBackground,
    Parts,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Resolution,
    SceneArgument,
    Settings,
    Verbose,
    open_scene,
    parse_axis,
    parse_camera,
    parse_layers,
    parse_parts,
    parse_resolution,
    parse_settings,
    refuse_reuse,
    representation,
)
from depthwalk.errors import InputError

app = typer.Typer(
    name="depthwalk",
    help="Walk through scenes too heavy to draw, by depth images warped on the GPU.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # errors are one plain line, not a box that breaks paths
    pretty_exceptions_enable=False,
)


class Method(StrEnum):
    """How depth images are made."""

    RAYCAST = "raycast"
    SIX_VIEW = "six-view"


class UpAxis(StrEnum):
    """A mesh file's upward axis."""

    Y = "y"
    Z = "z"


def main() -> None:
    """The program `depthwalk`."""
    app()


@app.callback(invoke_without_command=True)
def _common(version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False) -> None:
    if version:
        import depthwalk

        print(depthwalk.__version__)
        raise typer.Exit


@app.command()
@guarded
def demo(
    resolution: Resolution = DEFAULT_RESOLUTION,
    fullscreen: Annotated[bool, typer.Option("--fullscreen", help="Use the whole screen.")] = False,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    frames: Frames = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """A window on the garden; with no display, its tour is rendered to files in ./depthwalk-demo."""
    size = parse_resolution(resolution)
    from depthwalk.commands import walk
    from depthwalk.scene.path import load_path

    scene = open_scene(walk.garden(), None, None)
    tour = load_path(walk.garden_tour())
    shown = walk.Walk(scene, tour, size, representation(representation_name), fullscreen=fullscreen)
    walk.demo(shown, tour, frames)


@app.command()
@guarded
def view(
    scene: Annotated[Path | None, typer.Argument(metavar="SCENE", help="Scene file; the garden, if absent.")] = None,
    path: PathOption = None,
    fullscreen: Annotated[bool, typer.Option("--fullscreen", help="Use the whole screen.")] = False,
    resolution: Resolution = DEFAULT_RESOLUTION,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """A window to walk through a scene in."""
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    from depthwalk.commands import walk
    from depthwalk.scene.path import load_path

    loaded = open_scene(scene or walk.garden(), asset_root, settings)
    shown = walk.Walk(
        loaded,
        load_path(path) if path else None,
        size,
        representation(representation_name),
        camera,
        fullscreen,
    )
    reason = walk.open_walk(shown)
    if reason is not None:
        typer.echo(f"{reason}; `depthwalk render` needs no display", err=True)
        raise typer.Exit(1)


@app.command()
@guarded
def render(
    scene: SceneArgument,
    out: Annotated[
        str,
        typer.Option("-o", "--output", metavar="OUT", help="PNG, EXR or MP4 file; may hold {frame:4}; - is stdout."),
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
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Render a scene, or the frames of a camera path, to files."""
    refuse_reuse(settings)
    size = parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle)
    _check_camera_source(path, camera.given)
    if frames is not None and path is None:
        raise InputError("--frames: needs --path")
    from depthwalk.commands import render as work
    from depthwalk.scene.path import load_path

    loaded = open_scene(scene, asset_root, settings)
    walk = load_path(path) if path else None
    cameras = work.path_cameras(walk, frames) if walk else None
    output = work.Output(out, no_background)
    work.check_output(output, len(cameras or [None]), walk is not None, work.input_files(loaded, path))
    look = size, representation(representation_name), walk.fps if walk else 1.0
    work.render_frames(loaded, cameras or camera, output, *look)


@app.command()
@guarded
def bake(
    meshes: Annotated[list[Path], typer.Argument(metavar="MESH", help="OBJ, PLY, STL, GLB or glTF files.")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE_OR_DIR", help="Where to; beside the mesh, where absent."),
    ] = None,
    dpci_resolution: Annotated[
        int,
        typer.Option(min=limits.MIN_DPCI_RESOLUTION, max=limits.MAX_DPCI_RESOLUTION, help="Side of an image, texels."),
    ] = 512,
    layers: Layers = None,
    method: Annotated[
        Method, typer.Option(help="How surfaces are sampled: by rays, or by six views warped on the GPU.")
    ] = Method.RAYCAST,
    parts: Parts = None,
    axis: Axis = None,
    up: Annotated[UpAxis, typer.Option(help="The files' upward axis.")] = UpAxis.Y,
    height: Annotated[float | None, typer.Option(metavar="M", help="Height to scale each mesh to, metres.")] = None,
    texture: Annotated[Path | None, typer.Option(metavar="F", help="Texture in place of the files' own.")] = None,
    jobs: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=limits.MAX_JOBS, help="Meshes at a time.", show_default="one per core"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Bake also what is up to date.")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Say how like the mesh the depth images look.")] = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Bake meshes to depth images, NAME.dpci.exr; scenes that name the mesh with the same values use them.

    What is up to date, or in the cache, is not baked again: after Ctrl-C, the same command goes on where it stopped."""
    from depthwalk.bake.parts import ModelParams
    from depthwalk.commands import bake as work

    files = work.output_files(meshes, out)
    specs = [work.mesh_spec(mesh, texture, up.value, height) for mesh in meshes]
    deep = parse_layers(layers) or (1 if method is Method.SIX_VIEW else 3)
    split = parse_parts(parts) or 1, parse_axis(axis) or "y"
    try:
        params = ModelParams(dpci_resolution, deep, method.value, *split)
    except InputError as error:
        raise InputError(f"--{error}") from None
    failures = work.bake_meshes(specs, params, files, jobs, force)
    if verify:
        from depthwalk.commands import compare

        compare.verify(specs, params, files)
    if failures:
        raise typer.Exit(BAD_INPUT)


@app.command()
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
    height: Annotated[float | None, typer.Option(metavar="M", help="Height to scale each mesh to, metres.")] = None,
    texture: Annotated[Path | None, typer.Option(metavar="F", help="Texture in place of the files' own.")] = None,
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


@app.command()
@guarded
def quality(
    scenes: Annotated[
        list[Path] | None, typer.Argument(metavar="SCENE...", help="Scene files; room and garden, if absent.")
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


@app.command()
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
    _check_camera_source(path, camera.given)
    from depthwalk.commands import bench as work
    from depthwalk.scene.path import load_path

    names = work.parse_representations(representations)
    loaded = open_scene(scene, asset_root, settings)
    walk = load_path(path) if path else None
    plan = work.Plan(loaded, path, walk, camera, frames, warmup, size, names)
    work.check_report_files([json, html], plan)
    work.run_bench(plan, json, html)


@app.command()
@guarded
def check(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE", help="Scene and path files.")],
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Validate scene and path files and what they name; render nothing."""
    overrides = parse_settings(settings)
    from depthwalk.commands.check import check_file

    bad = False
    for scene in scenes:
        try:
            print(check_file(scene, asset_root or [], overrides))
        except InputError as error:
            bad = True
            typer.echo(str(error), err=True)
    if bad:
        raise typer.Exit(BAD_INPUT)


@app.command()
@guarded
def info(
    file: Annotated[Path | None, typer.Argument(metavar="FILE", help="Scene, path, baked file or mesh.")] = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Versions, GL renderer and limits; or what a file holds."""
    from depthwalk.commands.info import describe_file, installation, print_rows

    print_rows(describe_file(file) if file else installation())


def _check_camera_source(path: Path | None, camera_given: bool) -> None:
    if path is not None and camera_given:
        raise InputError("--path: already says where the camera is; leave out the --camera options")


if __name__ == "__main__":
    main()
