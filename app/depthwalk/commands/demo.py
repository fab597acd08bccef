"""Declare `depthwalk demo`, which opens a window on a shipped scene or, without a display, renders its tour."""

import sys
from contextlib import ExitStack, closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk.commands.option_values import open_scene, parse_resolution, representation
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    CacheLimit,
    Frames,
    Fullscreen,
    Quiet,
    RepresentationName,
    RepresentationOption,
    Verbose,
    WindowResolution,
)
from depthwalk.commands.program import guarded, without_garbage_collection
from depthwalk.commands.signals import end_if_interrupted
from depthwalk.commands.view import shipped_file
from depthwalk.errors import InputError

if TYPE_CHECKING:
    from depthwalk.assets.library import SceneLibrary
    from depthwalk.scene.arrays import Representation
    from depthwalk.scene.path import CameraPath
    from depthwalk.scene.scene import Scene

FOLDER = Path("depthwalk-demo")
STILLS = 6  # pictures of the tour besides its video


class DemoScene(StrEnum):
    """Name a shipped scene and the tour through it."""

    GARDEN = "garden"
    NIGHT = "night"
    ROOM = "room"


@guarded
def main(
    name: Annotated[
        DemoScene, typer.Argument(metavar="SCENE", help="Scene to show: garden, night or room.")
    ] = DemoScene.GARDEN,
    resolution: WindowResolution = None,
    fullscreen: Fullscreen = False,
    representation_name: RepresentationOption = RepresentationName.SCENE,
    frames: Frames = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Walk through the garden, or another scene that ships with the program.

    H shows the keys, P plays the tour. Without a display, the tour is rendered to files in ./depthwalk-demo; --frames
    limits their number.
    """
    size = None if resolution is None else parse_resolution(resolution)
    with ExitStack() as closed_at_end:
        with without_garbage_collection():
            from depthwalk.assets.background import BackgroundLibrary
            from depthwalk.scene.path import load_path

            scene = open_scene(shipped_file(f"{name}.yaml"), None, None)
            chosen = representation(representation_name)
            library = closed_at_end.enter_context(closing(BackgroundLibrary(scene.assets)))
            library.prefetch(scene, chosen)  # files are read while the window's libraries are imported
            from depthwalk import walk

            tour = load_path(shipped_file("paths", f"{name}.yaml"))
        options = walk.WalkOptions(path=tour, representation=chosen, before_frame=end_if_interrupted)
        try:
            walk.run(scene, library, options, fullscreen=fullscreen, size=size)
        except walk.NoDisplayError as error:
            print(f"{error}; rendering the tour to {FOLDER.resolve()}", file=sys.stderr)
            render_tour(name, scene, library, tour, frames, size or parse_resolution(DEFAULT_RESOLUTION), chosen)


def render_tour(
    name: DemoScene,
    scene: "Scene",
    library: "SceneLibrary",
    tour: "CameraPath",
    frames: int | None,
    size: tuple[int, int],
    chosen: "Representation | None",
) -> None:
    """Render stills and a video of a tour to `FOLDER`.

    Parameters
    ----------
    name
        Name of the files.
    scene
        The scene to show.
    library
        The scene's assets.
    tour
        The camera path through the scene.
    frames
        Most stills and most frames of the video to render; None renders `STILLS` stills and the whole tour.
    size
        (width, height) of the pictures, pixels.
    chosen
        How to draw every object; None follows the scene.

    Raises
    ------
    InputError
        If the folder cannot be created.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    from depthwalk.bench.measure import sample_path
    from depthwalk.commands.frame_drawing import draw_frames, open_headless, path_cameras
    from depthwalk.commands.output import Output

    try:
        FOLDER.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{FOLDER}: cannot be created: {error.strerror}") from None
    stills, video = Output(str(FOLDER / f"{name}-{{frame:2}}.png")), Output(str(FOLDER / f"{name}.mp4"))
    with open_headless(scene, size, chosen, library) as headless:
        draw_frames(headless, sample_path(tour, STILLS)[: frames or STILLS], stills, tour.fps)
        draw_frames(headless, path_cameras(tour, frames), video, tour.fps)
