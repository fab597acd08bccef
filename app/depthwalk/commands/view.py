"""Declare `depthwalk view`, which opens a window to walk through a scene."""

from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.option_values import (
    open_files,
    parse_camera,
    parse_resolution,
    representation,
    show_light_meshes,
)
from depthwalk.commands.options import (
    AssetRoots,
    CacheLimit,
    CameraAngle,
    CameraDirection,
    CameraPosition,
    CameraTarget,
    Fullscreen,
    PathOption,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Settings,
    SideBySide,
    Sky,
    Texture,
    Verbose,
    WindowResolution,
    named_files,
)
from depthwalk.commands.program import guarded, without_garbage_collection
from depthwalk.commands.signals import end_if_interrupted
from depthwalk.errors import InputError
from depthwalk.resources import scene_root

if TYPE_CHECKING:
    from depthwalk.scene.scene import Scene


@guarded
def main(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE",
            help="Scene file, or meshes, which are shown together; the garden by default.",
            show_default=False,
            callback=lambda paths: named_files(paths or []),
        ),
    ] = None,
    side_by_side: SideBySide = False,
    path: PathOption = None,
    fullscreen: Fullscreen = False,
    resolution: WindowResolution = None,
    camera_position: CameraPosition = None,
    camera_target: CameraTarget = None,
    camera_view_angle: CameraAngle = None,
    camera_direction: CameraDirection = None,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    watch: Annotated[bool, typer.Option("--watch", help="Reload the scene when one of its files is saved.")] = False,
    texture: Texture = None,
    sky: Sky = None,
    asset_root: AssetRoots = None,
    settings: Settings = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Open a window to walk through a scene.

    H shows the keys. Other scenes, meshes and camera paths may be dropped on the window.

    Several meshes, such as the parts of a machine or the tiles of a scan, keep the places of their files.
    """
    size = None if resolution is None else parse_resolution(resolution)
    camera = parse_camera(camera_position, camera_target, camera_view_angle, camera_direction)
    first = tuple(files or [shipped_file("garden.yaml")])

    def read(files: Sequence[Path]) -> "Scene":
        if tuple(files) == first:
            scene = open_files(files, asset_root, settings, sky=sky, side_by_side=side_by_side, texture=texture)
            return show_light_meshes(scene, settings)
        scene = open_files(files, asset_root, None, side_by_side=side_by_side and len(files) > 1)
        return show_light_meshes(scene, None)

    with ExitStack() as closed_at_end:
        with without_garbage_collection():
            from depthwalk.assets.background import BackgroundLibrary
            from depthwalk.scene.path import load_path

            loaded, chosen = read(first), representation(representation_name)
            library = closed_at_end.enter_context(closing(BackgroundLibrary(loaded.assets)))
            library.prefetch(loaded, chosen)  # files are read while the window's libraries are imported
            from depthwalk import walk

            tour = load_path(path) if path else None
        options = walk.WalkOptions(
            path=tour,
            representation=chosen,
            first_camera=camera.apply,
            read=read,
            watched=_files_of if watch else None,
            before_frame=end_if_interrupted,
        )
        try:
            walk.run(loaded, library, options, fullscreen=fullscreen, size=size)
        except walk.NoDisplayError as error:
            typer.echo(f"{error}; `depthwalk render` needs no display", err=True)
            raise typer.Exit(FAILURE) from None


def _files_of(scene: "Scene") -> list[Path]:
    """Return the files that a scene uses; of assets that cannot be read, only their own."""
    from depthwalk.commands.reports import input_files, readable_files

    return input_files(scene, None, readable_files)


def shipped_file(*name: str) -> Path:
    """Return a file in the folder of the shipped scenes.

    Parameters
    ----------
    *name
        Path of the file below that folder, one name for each folder and the file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the installation lacks the file.
    """
    file = scene_root().joinpath(*name)
    if not file.is_file():
        raise InputError(f"{file}: no such file; the demo scene is not installed")
    return file
