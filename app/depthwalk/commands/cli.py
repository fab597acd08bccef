"""The command line: what each command takes. The work is in `commands`, imported when its command runs, so that
`depthwalk --help` waits for no graphics library, and `depthwalk check` for no window's and no GL context."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk import limits
from depthwalk.commands.console import BAD_INPUT, OneLineGroup, guarded
from depthwalk.commands.measures import bench, compare, quality
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    AssetRoots,
    Axis,
    CameraAngle,
    CameraPosition,
    CameraTarget,
    Frames,
    Fullscreen,
    Height,
    Layers,
    Method,
    NoBackground,
    Parts,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
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
    representation,
)
from depthwalk.errors import InputError

if TYPE_CHECKING:
    from depthwalk.scene.scene import Scene

app = typer.Typer(
    name="depthwalk",
    cls=OneLineGroup,
    help="Walk through scenes too heavy to draw, by depth images warped on the GPU.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # errors are one plain line, not a box that breaks paths
    pretty_exceptions_enable=False,
)


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
    fullscreen: Fullscreen = False,
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
    scene: Annotated[
        Path | None, typer.Argument(metavar="SCENE", help="Scene file, or a mesh; the garden, if absent.")
    ] = None,
    path: PathOption = None,
    fullscreen: Fullscreen = False,
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

    first = scene or walk.garden()

    def read(file: Path) -> "Scene":
        return open_scene(file, asset_root, settings if file == first else None)

    shown = walk.Walk(
        read(first),
        load_path(path) if path else None,
        size,
        representation(representation_name),
        camera,
        fullscreen,
        read,
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
        typer.Option("-o", "--output", metavar="OUT", help="PNG, JPEG, EXR or MP4; may hold {frame:4}; - is stdout."),
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
    check_camera_source(path, camera)
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
        typer.Option(
            metavar="N",
            min=limits.MIN_DPCI_RESOLUTION,
            max=limits.MAX_DPCI_RESOLUTION,
            help="Side of an image, texels.",
        ),
    ] = 512,
    layers: Layers = None,
    method: Annotated[
        Method, typer.Option(help="How surfaces are sampled: by rays, or by six views warped on the GPU.")
    ] = Method.RAYCAST,
    parts: Parts = None,
    axis: Axis = None,
    up: Annotated[UpAxis, typer.Option(help="The files' upward axis.")] = UpAxis.Y,
    height: Height = None,
    texture: Texture = None,
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
    most_parts, upright = parse_parts(parts) or 1, parse_axis(axis) or "y"
    try:
        params = ModelParams(
            resolution=dpci_resolution,
            layers=deep,
            method=method.value,
            parts=most_parts,
            axis=upright,
        )
    except InputError as error:
        raise InputError(f"--{error}") from None
    failures = work.bake_meshes(specs, params, files, jobs, force)
    if verify:
        from depthwalk.commands import compare

        compare.verify(specs, params, files)
    if failures:
        raise typer.Exit(BAD_INPUT)


for measuring in compare, quality, bench:
    app.command()(measuring)


@app.command()
@guarded
def check(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE", help="Scene files, path files, meshes.")],
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Validate scene files, with what they name, path files and meshes; render nothing."""
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
